//! The vocabulary as it ships: which parameters each physics has, in which units. Embedded, so that a report can be checked
//! wherever it is written.

use std::sync::LazyLock;

use serde::Deserialize;

use crate::Physics;

const TEXT: &str = include_str!("../../../models/gap-vocabulary.json");

/// The vocabulary.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Vocabulary {
    /// Its version; reports carry it as `tool.vocabulary_version`.
    pub version: String,
    /// One entry per name.
    pub hypotheses: Vec<Hypothesis>,
}

/// One name of the vocabulary.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Hypothesis {
    /// Its name.
    pub physics: Physics,
    /// Equation in plain text.
    pub equation: String,
    /// Its parameters.
    pub parameters: Vec<ParameterSpec>,
    /// What it is easily taken for.
    pub confusable_with: Vec<Physics>,
}

/// A parameter of a physics.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ParameterSpec {
    /// Its name.
    pub name: String,
    /// Its units, apart by `|`: the first for revolute joints, the second for prismatic ones; one for both otherwise.
    pub unit: String,
    /// Least and greatest value that is to be expected of a RAVEN-II.
    pub raven_range: [f64; 2],
}

/// How a joint moves, which decides the units of its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// It turns: rad, N m.
    Revolute,
    /// It slides: m, N.
    Prismatic,
}

/// The vocabulary that ships with this release.
pub fn vocabulary() -> &'static Vocabulary {
    static VOCABULARY: LazyLock<Vocabulary> = LazyLock::new(|| {
        // The text is part of the program and a test reads it.
        serde_json::from_str(TEXT).expect("the shipped vocabulary is readable")
    });
    &VOCABULARY
}

impl Vocabulary {
    /// The entry of a physics; none for plugins.
    pub fn of(&self, physics: &Physics) -> Option<&Hypothesis> {
        self.hypotheses.iter().find(|hypothesis| hypothesis.physics == *physics)
    }
}

impl Hypothesis {
    /// The parameter of a name.
    pub fn parameter(&self, name: &str) -> Option<&ParameterSpec> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }
}

impl ParameterSpec {
    /// The units that the parameter may have.
    pub fn units(&self) -> impl Iterator<Item = &str> {
        self.unit.split('|')
    }

    /// Its unit at a joint that moves like this.
    pub fn unit_for(&self, motion: Motion) -> &str {
        let first = self.units().next().unwrap_or_default();
        match motion {
            Motion::Revolute => first,
            Motion::Prismatic => self.units().nth(1).unwrap_or(first),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_there_once() {
        let names: Vec<Physics> = vocabulary().hypotheses.iter().map(|hypothesis| hypothesis.physics.clone()).collect();
        assert_eq!(names, Physics::ALL);
        let friction = vocabulary().of(&Physics::CoulombFriction).and_then(|entry| entry.parameter("f_c")).expect("f_c");
        assert_eq!((friction.unit_for(Motion::Revolute), friction.unit_for(Motion::Prismatic)), ("N.m", "N"));
    }
}
