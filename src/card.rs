//! The model card: ONNX metadata that says what a network may be used for. `docs/models.md` describes every property.

use crate::correction::Quantity;
use crate::guard::{Allowed, Domain};
use crate::load::{self, LoadCard};
use ravenpose_wire::{FEATURES, PEDAL_DOWN, features};
use std::collections::BTreeMap;
use thiserror::Error;

/// Properties that depend on what a model corrects.
pub struct Keys {
    /// Longest correction that the model stands for.
    pub bound: &'static str,
    /// 95 % half widths.
    pub bound95: &'static str,
    /// The same while the memory has not settled.
    pub bound95_unsettled: &'static str,
    /// Correction bound of a card that states none.
    default_bound: f64,
}

impl Quantity {
    /// Units that the network must speak: inputs exactly as published, outputs in mm or degrees.
    pub const fn units(self) -> &'static str {
        match self {
            Self::Position => "raven_state as published; position error in mm",
            Self::Orientation => "raven_state as published; orientation error in deg",
        }
    }

    /// What a model corrects by the units on its card; none for others.
    pub fn of_card(metadata: &BTreeMap<String, String>) -> Option<Self> {
        let units = metadata.get("ravenpose.units")?;
        [Self::Position, Self::Orientation].into_iter().find(|quantity| quantity.units() == units)
    }

    /// Where a card states what depends on it.
    pub const fn keys(self) -> Keys {
        match self {
            // The paper reports errors up to 10 mm.
            Self::Position => Keys {
                bound: "ravenpose.correction_bound_mm",
                bound95: "ravenpose.bound95_mm",
                bound95_unsettled: "ravenpose.bound95_unsettled_mm",
                default_bound: 15.0,
            },
            Self::Orientation => Keys {
                bound: "ravenpose.correction_bound_deg",
                bound95: "ravenpose.bound95_deg",
                bound95_unsettled: "ravenpose.bound95_unsettled_deg",
                default_bound: 30.0,
            },
        }
    }
}

/// Why a card was refused; the caller adds the file's name.
#[derive(Debug, Error, PartialEq)]
pub enum CardError {
    /// The property has another value than the service needs.
    #[error("property {key} is {found:?}, expected {expected:?}; export the model again with this ravenpose")]
    Mismatch {
        /// Property name.
        key: &'static str,
        /// As found.
        found: String,
        /// As needed.
        expected: String,
    },
    /// A model of the other quantity.
    #[error(
        "corrects the {found}, not the {expected}; in ravenposed.toml models of the orientation belong in [gold.orientation] and [green.orientation]"
    )]
    OtherQuantity {
        /// What it corrects.
        found: &'static str,
        /// What it was to correct.
        expected: &'static str,
    },
    /// A needed property is absent.
    #[error("property {key} is missing; a trained model states it, see docs/models.md")]
    Missing {
        /// Property name.
        key: &'static str,
    },
    /// The numbers of a property cannot be used.
    #[error("property {key}: {problem}")]
    Numbers {
        /// Property name.
        key: &'static str,
        /// What is wrong.
        problem: String,
    },
}

/// Golden pairs that a card may have: each is evaluated in every format before the service starts.
const GOLDEN_MAX: usize = 1000;

/// One golden pair: an input and the output that the network gave when it was exported.
#[derive(Debug, Clone, PartialEq)]
pub struct Golden {
    /// 118 features; a memory has seen nothing else.
    pub input: [f32; FEATURES],
    /// Error of the position, mm, or of the orientation, degrees.
    pub output: [f64; 3],
}

/// What the metadata says.
#[derive(Debug, Clone)]
pub struct Card {
    /// `ravenpose.trained_on` is absent or starts with "nothing".
    pub untrained: bool,
    /// `ravenpose.trained_on`.
    pub trained_on: String,
    /// Trained domain; `None` only for an untrained model.
    pub domain: Option<Domain>,
    /// States that the model may be used with.
    pub allowed: Allowed,
    /// What the model corrects.
    pub quantity: Quantity,
    /// Longest correction that the model stands for, mm or degrees.
    pub bound: f64,
    /// 95 % half width per axis, mm or degrees; NaN if none is stated.
    pub bound95: [f64; 3],
    /// The same while the model's memory is not settled; NaN if none is stated.
    pub bound95_unsettled: [f64; 3],
    /// What torque says about load; none if the model does not watch it.
    pub load: Option<LoadCard>,
    /// Golden pairs.
    pub golden: Vec<Golden>,
}

impl Card {
    /// Reads the card of a model that is to correct `quantity`. A model without `ravenpose.trained_on` counts as untrained and need not
    /// state a domain.
    ///
    /// # Errors
    /// [`CardError`].
    pub fn read(metadata: &BTreeMap<String, String>, quantity: Quantity) -> Result<Self, CardError> {
        let get = |key: &str| metadata.get(key).map(String::as_str);
        let trained_on = get("ravenpose.trained_on").unwrap_or("").trim().to_owned();
        let untrained = trained_on.is_empty() || trained_on.starts_with("nothing");
        if let Some(found) = Quantity::of_card(metadata).filter(|found| *found != quantity) {
            return Err(CardError::OtherQuantity { found: found.name(), expected: quantity.name() });
        }
        for (key, expected) in [("ravenpose.feature_layout", features::LAYOUT), ("ravenpose.units", quantity.units())] {
            match get(key) {
                Some(found) if found == expected => {}
                None if untrained => {}
                None => return Err(CardError::Missing { key }),
                Some(found) => {
                    return Err(CardError::Mismatch { key, found: shorten(found), expected: expected.to_owned() });
                }
            }
        }
        let domain = domain(metadata, untrained)?;
        let keys = quantity.keys();
        let bound = match get(keys.bound) {
            None => keys.default_bound,
            Some(text) => {
                let key = keys.bound;
                let [bound] = numbers::<1>(key, text)?;
                if bound <= 0.0 {
                    return Err(CardError::Numbers { key, problem: format!("{bound} is not positive") });
                }
                f64::from(bound)
            }
        };
        let half_widths = |key: &'static str| -> Result<[f64; 3], CardError> {
            let Some(text) = get(key) else { return Ok([f64::NAN; 3]) };
            let bounds = numbers::<3>(key, text)?.map(f64::from);
            match bounds.iter().find(|bound| **bound < 0.0) {
                Some(bound) => Err(CardError::Numbers { key, problem: format!("{bound} is not a half width") }),
                None => Ok(bounds),
            }
        };
        let bound95 = half_widths(keys.bound95)?;
        let bound95_unsettled = half_widths(keys.bound95_unsettled)?;
        let allowed = Allowed {
            runlevels: match get("ravenpose.runlevels") {
                Some(text) => integers("ravenpose.runlevels", text)?,
                None if untrained => Vec::new(),
                None => vec![PEDAL_DOWN],
            },
            boards: get("ravenpose.boards").map_or(Ok(Vec::new()), |text| integers("ravenpose.boards", text))?,
        };
        let load = load(metadata)?;
        let golden = golden(get("ravenpose.golden").unwrap_or(""))?;
        if golden.is_empty() && !untrained {
            return Err(CardError::Missing { key: "ravenpose.golden" });
        }
        Ok(Self { untrained, trained_on, domain, allowed, quantity, bound, bound95, bound95_unsettled, load, golden })
    }

    /// The bound of a memory that has not settled belongs to a memory, and is no narrower than that of a settled one; what watches the
    /// load looks at as many places as the memory has, and a network that is told of friction has its range on the card.
    ///
    /// # Errors
    /// [`CardError::Missing`] or [`CardError::Numbers`].
    pub fn check_memory(&self, plays: usize, friction: usize) -> Result<(), CardError> {
        let known = self.load.as_ref().and_then(|load| load.friction).map_or(0, |known| known.len());
        if known != friction {
            return Err(if known == 0 && friction == load::MOTORS {
                CardError::Missing { key: FRICTION[0] }
            } else {
                let problem = format!("{known} numbers, the network takes the friction of {friction} motors");
                CardError::Numbers { key: FRICTION[0], problem }
            });
        }
        let expected = load::expected_len(plays);
        if let Some(row) = self.load.iter().flat_map(|load| &load.expected).find(|row| row.len() != expected) {
            let problem = format!("{} numbers per motor, expected {expected} for {plays} plays", row.len());
            return Err(CardError::Numbers { key: LOAD[0], problem });
        }
        let keys = self.quantity.keys();
        let wrong = |problem: String| Err(CardError::Numbers { key: keys.bound95_unsettled, problem });
        let stated = self.bound95_unsettled.iter().all(|bound| bound.is_finite());
        if self.bound95_unsettled.iter().zip(self.bound95).any(|(unsettled, settled)| *unsettled < settled) {
            return wrong(format!("is narrower than {}", keys.bound95));
        }
        if stated && plays == 0 {
            return wrong("the network has no memory".to_owned());
        }
        Ok(())
    }

    /// `corrects in run levels 3, boards 49; watches the load, up to 0.13 kg`.
    pub fn limits(&self) -> String {
        let list = |numbers: &[i32]| match numbers {
            [] => "any".to_owned(),
            some => some.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
        };
        let load = self
            .load
            .as_ref()
            .map_or("does not watch the load".to_owned(), |load| format!("watches the load, up to {:.2} kg", load.limit_kg));
        format!("corrects in run levels {}, boards {}; {load}", list(&self.allowed.runlevels), list(&self.allowed.boards))
    }

    /// Golden pairs are taken from training, so one outside of the trained range shows that the range is of another feature order
    /// or in other units, which the network's outputs alone cannot show.
    ///
    /// # Errors
    /// [`CardError::Numbers`].
    pub fn check_range(&self) -> Result<(), CardError> {
        let Some(domain) = &self.domain else { return Ok(()) };
        for (index, pair) in self.golden.iter().enumerate() {
            for (feature, value) in pair.input.iter().enumerate() {
                let (min, max) = (domain.min[feature], domain.max[feature]);
                if !(min..=max).contains(value) {
                    let name = features::name(feature);
                    let problem = format!("pair {index}: {name} is {value}, outside its trained range {min} to {max}");
                    return Err(CardError::Numbers { key: "ravenpose.golden", problem });
                }
            }
        }
        Ok(())
    }
}

fn domain(metadata: &BTreeMap<String, String>, untrained: bool) -> Result<Option<Domain>, CardError> {
    const KEYS: [&str; 5] = [
        "ravenpose.feature_min",
        "ravenpose.feature_max",
        "ravenpose.domain_center",
        "ravenpose.domain_weight",
        "ravenpose.domain_limit",
    ];
    if untrained && KEYS.iter().all(|key| !metadata.contains_key(*key)) {
        return Ok(None);
    }
    let get = |key: &'static str| metadata.get(key).map(String::as_str).ok_or(CardError::Missing { key });
    let domain = Domain {
        min: numbers(KEYS[0], get(KEYS[0])?)?,
        max: numbers(KEYS[1], get(KEYS[1])?)?,
        center: numbers(KEYS[2], get(KEYS[2])?)?,
        weight: numbers(KEYS[3], get(KEYS[3])?)?,
        limit: numbers::<1>(KEYS[4], get(KEYS[4])?)?[0],
    };
    if let Some(feature) = (0..FEATURES).find(|&feature| domain.min[feature] > domain.max[feature]) {
        let problem = format!("{} has a minimum above its maximum", features::name(feature));
        return Err(CardError::Numbers { key: KEYS[0], problem });
    }
    if domain.limit <= 0.0 {
        return Err(CardError::Numbers { key: KEYS[4], problem: format!("{} is not a positive distance", domain.limit) });
    }
    Ok(Some(domain))
}

/// Keys of [`LoadCard`], in its order.
const LOAD: [&str; 7] = [
    "ravenpose.load_expected",
    "ravenpose.load_pull",
    "ravenpose.load_noise_nm",
    "ravenpose.load_weight",
    "ravenpose.load_travel_deg",
    "ravenpose.load_information",
    "ravenpose.load_limit_kg",
];

/// Friction that the network knows, least and largest of each motor.
const FRICTION: [&str; 2] = ["ravenpose.friction_min_nm", "ravenpose.friction_max_nm"];

fn friction(metadata: &BTreeMap<String, String>) -> Result<Option<[(f32, f32); load::MOTORS]>, CardError> {
    if FRICTION.iter().all(|key| !metadata.contains_key(*key)) {
        return Ok(None);
    }
    let get = |key: &'static str| -> Result<[f32; load::MOTORS], CardError> {
        numbers(key, metadata.get(key).ok_or(CardError::Missing { key })?)
    };
    let (least, largest) = (get(FRICTION[0])?, get(FRICTION[1])?);
    // The usual friction is where the observer begins.
    match least.iter().zip(largest).find(|(least, largest)| !(**least < 0.0 && *largest > 0.0)) {
        Some((least, largest)) => {
            let problem = format!("{least} to {largest} does not hold the usual friction, 0");
            Err(CardError::Numbers { key: FRICTION[0], problem })
        }
        None => Ok(Some(std::array::from_fn(|motor| (least[motor], largest[motor])))),
    }
}

fn load(metadata: &BTreeMap<String, String>) -> Result<Option<LoadCard>, CardError> {
    if LOAD.iter().chain(&FRICTION).all(|key| !metadata.contains_key(*key)) {
        return Ok(None);
    }
    let get = |key: &'static str| metadata.get(key).map(String::as_str).ok_or(CardError::Missing { key });
    let expected: Vec<f32> = words(LOAD[0], get(LOAD[0])?)?.into_iter().map(|value| value as f32).collect();
    if expected.is_empty() || !expected.len().is_multiple_of(load::MOTORS) {
        let problem = format!("{} numbers, expected as many for each of {} motors", expected.len(), load::MOTORS);
        return Err(CardError::Numbers { key: LOAD[0], problem });
    }
    let width = expected.len() / load::MOTORS;
    let pull: [f32; 4 * load::MOTORS] = numbers(LOAD[1], get(LOAD[1])?)?;
    let card = LoadCard {
        expected: std::array::from_fn(|motor| expected[motor * width..(motor + 1) * width].to_vec()),
        pull: std::array::from_fn(|motor| std::array::from_fn(|term| pull[4 * motor + term])),
        noise_nm: numbers(LOAD[2], get(LOAD[2])?)?,
        weight: numbers(LOAD[3], get(LOAD[3])?)?,
        travel_deg: numbers(LOAD[4], get(LOAD[4])?)?,
        information: numbers(LOAD[5], get(LOAD[5])?)?,
        limit_kg: numbers::<1>(LOAD[6], get(LOAD[6])?)?[0],
        friction: friction(metadata)?,
    };
    // One that pulls nothing would never show anything.
    if card.pull.iter().any(|row| row.iter().all(|term| *term == 0.0)) {
        return Err(CardError::Numbers { key: LOAD[1], problem: "a motor's numbers are all 0".to_owned() });
    }
    let above_0 = [&card.noise_nm[..], &card.weight, &card.travel_deg, &card.information, &[card.limit_kg]];
    for (key, all) in LOAD[2..].iter().zip(above_0) {
        if let Some(value) = all.iter().find(|value| **value <= 0.0) {
            return Err(CardError::Numbers { key, problem: format!("{value} is not above 0") });
        }
    }
    Ok(Some(card))
}

fn golden(text: &str) -> Result<Vec<Golden>, CardError> {
    let lines = || text.lines().filter(|line| !line.trim().is_empty());
    let count = lines().count();
    if count > GOLDEN_MAX {
        let problem = format!("{count} pairs, expected at most {GOLDEN_MAX}; export the model again with this ravenpose");
        return Err(CardError::Numbers { key: "ravenpose.golden", problem });
    }
    lines()
        .map(|line| {
            let row: [f64; FEATURES + 3] = parse("ravenpose.golden", line)?;
            let output = [row[FEATURES], row[FEATURES + 1], row[FEATURES + 2]];
            Ok(Golden { input: std::array::from_fn(|feature| row[feature] as f32), output })
        })
        .collect()
}

/// At least one.
fn integers(key: &'static str, text: &str) -> Result<Vec<i32>, CardError> {
    let integer = |word: &str| {
        let problem = format!("{:?} is not a whole number", shorten(word));
        word.parse().map_err(|_| CardError::Numbers { key, problem })
    };
    let found: Vec<i32> = text.split_ascii_whitespace().map(integer).collect::<Result<_, _>>()?;
    if found.is_empty() {
        Err(CardError::Numbers { key, problem: "no numbers, expected at least one".to_owned() })
    } else {
        Ok(found)
    }
}

fn numbers<const N: usize>(key: &'static str, text: &str) -> Result<[f32; N], CardError> {
    Ok(parse::<N>(key, text)?.map(|value| value as f32))
}

fn parse<const N: usize>(key: &'static str, text: &str) -> Result<[f64; N], CardError> {
    let found = words(key, text)?;
    let count = found.len();
    found.try_into().map_err(|_| CardError::Numbers { key, problem: format!("{count} numbers, expected {N}") })
}

fn words(key: &'static str, text: &str) -> Result<Vec<f64>, CardError> {
    let wrong = |word: &str, what: &str| CardError::Numbers { key, problem: format!("{:?} is not a {what}", shorten(word)) };
    let number = |word: &str| match word.parse::<f64>() {
        Ok(value) if (value as f32).is_finite() => Ok(value),
        Ok(_) => Err(wrong(word, "finite number")),
        Err(_) => Err(wrong(word, "number")),
    };
    text.split_ascii_whitespace().map(number).collect()
}

fn shorten(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).take(60).collect()
}
