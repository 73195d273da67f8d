//! What a correction gains on held-out runs, as bars.

use super::tags::{around, text};
use crate::text::{before_and_after, capital, percent, plain_metric};
use crate::{ABSENT, Fit, Metric, Space};

/// One figure before, after and by noise alone.
pub(super) fn fit(fit: &Fit) -> String {
    let how = format!("{}, {}", plain_metric(fit.metric), plain_space(fit.space));
    let mut out = text("p", "name", &capital(&fit.quantity)) + &text("p", "how", &how);
    let least_is_best = !matches!(fit.metric, Metric::R2 | Metric::LogLikelihoodPerSample);
    let most = [fit.before, fit.after].into_iter().chain(fit.noise_floor).fold(0.0_f64, f64::max);
    let bar = |name: &str, class: &str, value: f64, said: &str| {
        let width = if most > 0.0 { (100.0 * value / most).clamp(0.0, 100.0) } else { 0.0 };
        format!(
            "{}<span class=\"t\" aria-hidden=\"true\"><i class=\"{class}\" style=\"width:{width:.1}%\"></i></span>{}",
            text("span", "l", name),
            text("span", "n", said)
        )
    };
    let ([before, after], noise) = before_and_after(fit);
    let floor = fit.noise_floor.zip(noise).map_or_else(String::new, |(floor, said)| bar("noise alone", "noise", floor, &said));
    let bars = bar("before", "before", fit.before, &before) + &bar("after", "after", fit.after, &after) + &floor;
    out += &around("div", "bars", &bars);
    if let Some(gone) = fit.removed_fraction.filter(|_| least_is_best) {
        let interval = fit.removed_fraction_ci95.map_or_else(String::new, |[low, high]| {
            format!(" (95 % interval {} to {})", percent(low).trim_end_matches(['\u{a0}', '%']), percent(high))
        });
        out += &text("p", "gone", &format!("{} of the removable error is gone{interval}.", percent(gone)));
    }
    if fit.extra.get(ABSENT).is_some() {
        out += &text("p", "gone", "Nothing of it is in these runs.");
    }
    around("div", "fit", &out)
}

/// What is compared, in words.
pub(super) fn plain_space(space: Space) -> &'static str {
    match space {
        Space::EquationError => "on the recorded motion",
        Space::ClosedLoop => "simulation run again",
        Space::RecordedOutput => "recorded simulation, corrected",
    }
}
