//! Parameters in sentences: size, unit, interval, and `about` where the data do not say it well.

use super::number::Estimate;
use super::unit::Scale;
use crate::{Identifiable, Parameter};

/// Radians as degrees.
pub(super) fn degrees() -> Scale {
    Scale { name: "°".to_owned(), per_unit: 180.0 / std::f64::consts::PI }
}

/// Plain numbers as per cent.
pub(super) fn per_cent() -> Scale {
    Scale { name: "%".to_owned(), per_unit: 100.0 }
}

/// `about` before what the data do not determine well.
fn hedged(parameter: &Parameter, estimate: &Estimate) -> String {
    let about = if parameter.identifiable == Identifiable::Yes { "" } else { "about " };
    format!("{about}{}", estimate.with_interval())
}

/// Size without its sign; the interval turns with it.
pub(super) fn size(parameter: &Parameter) -> Parameter {
    let [low, high] = parameter.ci95;
    let turned = Parameter { value: -parameter.value, ci95: [-high, -low], ..parameter.clone() };
    if parameter.value < 0.0 { turned } else { parameter.clone() }
}

/// `12.1 N (11.3 to 12.9)`, in the multiple that reads best.
pub(super) fn amount(parameter: &Parameter) -> String {
    hedged(parameter, &Estimate::new(parameter.value, parameter.ci95, parameter.true_unit()))
}

/// The same, in as many decimals as its distance from what would be nothing needs.
pub(super) fn amount_beside(parameter: &Parameter, nothing: f64) -> String {
    hedged(parameter, &Estimate::beside(parameter.value, parameter.ci95, nothing, parameter.true_unit()))
}

/// The same in a given multiple.
pub(super) fn amount_in(parameter: &Parameter, scale: &Scale) -> String {
    hedged(parameter, &Estimate::scaled(parameter.value, parameter.ci95, scale))
}
