//! One effect: a physics, where it is, and when it acts.

use crate::physics::{Channel, MeasurementDelay, Parameters, Physics, Place, names, place_of};

/// What an effect is bound to; joints and links count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// A joint.
    Joint(usize),
    /// The motor of a joint: friction before the cable, which does not stretch it. Sizes are still those at the joint.
    Motor(usize),
    /// A joint, and the joint that drives it.
    Pair(usize, usize),
    /// A link; one past the last is the tool that is fixed to it.
    Link(usize),
    /// A signal.
    Channel(Channel),
    /// The whole robot.
    Robot,
}

/// One effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// What.
    pub physics: Physics,
    /// Where.
    pub bound: Bound,
    /// Since when, s from the start of the run.
    pub from_s: f64,
    /// Until when, s.
    pub to_s: f64,
    /// Where its size comes from: for readers of the file.
    pub source: Option<String>,
}

/// What joints and links are called; RAVEN-II's joints have names here that its file format shares with contracts.md.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Names {
    pub(super) joints: Vec<String>,
    /// With the tool, where it has a name of its own, in the last place.
    pub(super) links: Vec<String>,
}

/// A joint or link as a file says it: number from 1, or name.
#[derive(Debug, Clone, PartialEq, serde::Deserialize)]
#[serde(untagged)]
pub(super) enum Which {
    Number(usize),
    Name(String),
}

/// Where an effect is, as a file says it.
#[derive(Debug, Clone, Default)]
pub(super) struct Given {
    pub(super) joint: Option<Which>,
    pub(super) motor: Option<Which>,
    pub(super) driven_by: Option<Which>,
    pub(super) link: Option<Which>,
    pub(super) channel: Option<String>,
    pub(super) from_s: Option<f64>,
    pub(super) to_s: Option<f64>,
    pub(super) source: Option<String>,
}

impl Effect {
    /// An effect that acts all the time.
    pub fn new(physics: Physics, bound: Bound) -> Self {
        Self { physics, bound, from_s: f64::NEG_INFINITY, to_s: f64::INFINITY, source: None }
    }

    /// From names and numbers; the error says what is wrong and what would do.
    pub(super) fn given(name: &str, parameters: &Parameters, given: &Given, known: &Names) -> Result<Self, String> {
        let (Some(place), Some(physics)) = (place_of(name), Physics::new(name, parameters)) else {
            return Err(format!("no such physics; the vocabulary has {}", names().join(", ")));
        };
        let physics = physics.map_err(|error| error.to_string())?;
        let bound = match &given.motor {
            Some(_) if given.joint.is_some() => return Err("takes `joint` or `motor`, not both".to_owned()),
            Some(_) if !rubs_before_the_cable(&physics) => return Err("takes no `motor`".to_owned()),
            Some(motor) => Bound::Motor(index("motor", Some(motor), &known.joints)?),
            None => bound(place, given, known)?,
        };
        let (from_s, to_s) = (given.from_s.unwrap_or(f64::NEG_INFINITY), given.to_s.unwrap_or(f64::INFINITY));
        if from_s.is_nan() || to_s.is_nan() || from_s >= to_s {
            return Err("from_s must lie before to_s".to_owned());
        }
        let always = from_s == f64::NEG_INFINITY && to_s == f64::INFINITY;
        if !always && matches!(physics, Physics::MeasurementDelay(_) | Physics::LinkGeometry(_) | Physics::FrameMisalignment(_)) {
            return Err("acts all the time; leave out from_s and to_s".to_owned());
        }
        Ok(Self { physics, bound, from_s, to_s, source: given.source.clone() })
    }
}

/// Friction that may be the motor's.
fn rubs_before_the_cable(physics: &Physics) -> bool {
    matches!(physics, Physics::CoulombFriction(_) | Physics::ViscousFriction(_) | Physics::StribeckFriction(_))
}

fn bound(place: Place, given: &Given, known: &Names) -> Result<Bound, String> {
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
        Place::Joint => Ok(Bound::Joint(index("joint", given.joint.as_ref(), &known.joints)?)),
        Place::Pair => {
            let driven = index("joint", given.joint.as_ref(), &known.joints)?;
            let driver = index("driven_by", given.driven_by.as_ref(), &known.joints)?;
            if driven == driver { Err("`driven_by` must be another joint".to_owned()) } else { Ok(Bound::Pair(driven, driver)) }
        }
        Place::Link => Ok(Bound::Link(index("link", given.link.as_ref(), &known.links)?)),
        Place::Channel => channel(given.channel.as_deref()),
        Place::Robot => Ok(Bound::Robot),
    }
}

/// Place from 0 among the names.
pub(super) fn index(key: &str, given: Option<&Which>, names: &[String]) -> Result<usize, String> {
    let what = || format!("1 to {} or one of {}", names.len(), names.join(", "));
    match given {
        Some(Which::Number(number)) if (1..=names.len()).contains(number) => Ok(number - 1),
        Some(Which::Number(number)) => Err(format!("`{key}` is {number}, must be {}", what())),
        Some(Which::Name(name)) => {
            let found = names.iter().position(|known| known == name);
            found.ok_or_else(|| format!("`{key}` is `{}`, must be {}", name.escape_debug(), what()))
        }
        None => Err(format!("needs `{key}` = {}", what())),
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
