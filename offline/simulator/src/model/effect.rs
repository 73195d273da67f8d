//! One effect: a physics, where it is, and when it acts.

use arm::JOINTS;

use crate::physics::{Channel, MeasurementDelay, Parameters, Physics, Place, names, place_of};

/// What an effect is bound to; joints and links count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// A joint.
    Joint(usize),
    /// A joint, and the joint that drives it.
    Pair(usize, usize),
    /// A link.
    Link(usize),
    /// A signal.
    Channel(Channel),
    /// The whole robot.
    Robot,
}

/// One effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effect {
    /// What.
    pub physics: Physics,
    /// Where.
    pub bound: Bound,
    /// Since when, s from the start of the run.
    pub from_s: f64,
    /// Until when, s.
    pub to_s: f64,
}

/// Where an effect is, as a file says it; numbers from 1.
#[derive(Debug, Clone, Default)]
pub(super) struct Given {
    pub(super) joint: Option<usize>,
    pub(super) driven_by: Option<usize>,
    pub(super) link: Option<usize>,
    pub(super) channel: Option<String>,
    pub(super) from_s: Option<f64>,
    pub(super) to_s: Option<f64>,
}

impl Effect {
    /// An effect that acts all the time.
    pub fn new(physics: Physics, bound: Bound) -> Self {
        Self { physics, bound, from_s: f64::NEG_INFINITY, to_s: f64::INFINITY }
    }

    /// From names and numbers; the error says what is wrong and what would do.
    pub(super) fn given(name: &str, parameters: &Parameters, given: &Given) -> Result<Self, String> {
        let (Some(place), Some(physics)) = (place_of(name), Physics::new(name, parameters)) else {
            return Err(format!("no such physics; the vocabulary has {}", names().join(", ")));
        };
        let physics = physics.map_err(|error| error.to_string())?;
        let bound = bound(place, given)?;
        let (from_s, to_s) = (given.from_s.unwrap_or(f64::NEG_INFINITY), given.to_s.unwrap_or(f64::INFINITY));
        if from_s.is_nan() || to_s.is_nan() || from_s >= to_s {
            return Err("from_s must lie before to_s".to_owned());
        }
        let always = from_s == f64::NEG_INFINITY && to_s == f64::INFINITY;
        if !always && matches!(physics, Physics::MeasurementDelay(_) | Physics::LinkGeometry(_) | Physics::FrameMisalignment(_)) {
            return Err("acts all the time; leave out from_s and to_s".to_owned());
        }
        Ok(Self { physics, bound, from_s, to_s })
    }
}

fn bound(place: Place, given: &Given) -> Result<Bound, String> {
    let unwanted = |key: &str, present: bool| if present { Err(format!("takes no `{key}`")) } else { Ok(()) };
    if place != Place::Pair {
        unwanted("driven_by", given.driven_by.is_some())?;
    }
    if !matches!(place, Place::Joint | Place::Pair) {
        unwanted("joint", given.joint.is_some())?;
    }
    if place != Place::Link {
        unwanted("link", given.link.is_some())?;
    }
    if place != Place::Channel {
        unwanted("channel", given.channel.is_some())?;
    }
    match place {
        Place::Joint => Ok(Bound::Joint(number("joint", given.joint)?)),
        Place::Pair => {
            let (driven, driver) = (number("joint", given.joint)?, number("driven_by", given.driven_by)?);
            if driven == driver { Err("`driven_by` must be another joint".to_owned()) } else { Ok(Bound::Pair(driven, driver)) }
        }
        Place::Link => Ok(Bound::Link(number("link", given.link)?)),
        Place::Channel => channel(given.channel.as_deref()),
        Place::Robot => Ok(Bound::Robot),
    }
}

fn number(key: &str, given: Option<usize>) -> Result<usize, String> {
    match given {
        Some(number @ 1..=JOINTS) => Ok(number - 1),
        Some(number) => Err(format!("`{key}` is {number}, must be 1 to {JOINTS}")),
        None => Err(format!("needs `{key}` = 1 to {JOINTS}")),
    }
}

fn channel(given: Option<&str>) -> Result<Bound, String> {
    let known = Channel::NAMES.map(|(name, _)| name).join(", ");
    let name = given.ok_or_else(|| format!("needs `channel`: {known}"))?;
    let found = Channel::NAMES.iter().find(|(known, _)| *known == name);
    found.map(|(_, channel)| Bound::Channel(*channel)).ok_or_else(|| format!("`channel` is `{name}`, must be one of {known}"))
}

/// Delay of a channel, where the effects have one.
pub(crate) fn delay(effects: &[Effect], channel: Channel) -> Option<MeasurementDelay> {
    effects.iter().find_map(|effect| match (effect.physics, effect.bound) {
        (Physics::MeasurementDelay(delay), Bound::Channel(of)) if of == channel => Some(delay),
        _ => None,
    })
}
