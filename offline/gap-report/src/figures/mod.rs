//! From the data of [`crate::Pictures`] to figures. Before a correction is vermillion, after it blue, noise grey, everywhere.

mod before_after;
mod heat;
mod signature;
mod spectrum;

use plot::figure::Colour;

use crate::text::{Scale, scale};
use crate::{Channel, Quantity};

pub(crate) use before_after::before_after;
pub(crate) use heat::{grouped, heat_maps, hottest};
pub(crate) use signature::signature;
pub(crate) use spectrum::spectrum;

/// Colour of an error before a correction.
const BEFORE: Colour = Colour::VERMILLION;
/// Colour after it.
const AFTER: Colour = Colour::BLUE;

/// Multiple in which values of a quantity read best, from the greatest of them.
fn scale_of(quantity: &Quantity, values: impl IntoIterator<Item = f64>) -> Scale {
    let greatest = values.into_iter().filter(|value| value.is_finite()).fold(0.0, |most: f64, value| most.max(value.abs()));
    scale(greatest, &quantity.unit)
}

/// A channel as a title.
pub(crate) fn channel_title(channel: Channel) -> &'static str {
    match channel {
        Channel::JointTorque => "Joint torque",
        Channel::Transmission => "Transmission",
        Channel::EndEffector => "Tool position",
        Channel::Timing => "Timing",
        Channel::ClosedLoopOutput => "Whole loop",
        Channel::Command => "Commands",
    }
}

/// `Velocity, mm/s`.
fn title(name: &str, unit: &Scale) -> String {
    if unit.name.is_empty() { name.to_owned() } else { format!("{name}, {}", unit.name) }
}
