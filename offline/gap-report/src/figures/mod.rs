//! From the data of [`crate::Pictures`] to figures. Before a correction is vermillion, after it blue, noise grey, everywhere.

mod before_after;
mod heat;
mod signature;
mod spectrum;

use plot::figure::Colour;

use crate::Quantity;
use crate::text::{Scale, scale};

pub(crate) use before_after::before_after;
pub(crate) use heat::{channel_title, heat_map, hottest};
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

/// `Velocity, mm/s`.
fn title(name: &str, unit: &Scale) -> String {
    if unit.name.is_empty() { name.to_owned() } else { format!("{name}, {}", unit.name) }
}
