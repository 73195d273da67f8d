//! The library: every physics of the vocabulary as columns that it adds to the residuals.

mod actuation;
mod dictionary;
mod environment;
mod friction;
mod inertial;
mod kinematic;
mod timing;
mod transmission;

pub use dictionary::{Column, Dictionary};

use crate::problem::Channel;

/// What a coefficient may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// Anything.
    Free,
    /// Not negative: friction takes energy away, a weight pulls down.
    Positive,
    /// Within these.
    Between(f64, f64),
}

/// A hypothesis with fixed shape: a physics bound to its place, linear in what is left to fit.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Name in the vocabulary.
    pub physics: &'static str,
    /// Joints it is tied to; empty: to none.
    pub joints: Vec<usize>,
    /// Which form of it.
    pub form: &'static str,
    /// Channel where it shows most.
    pub channel: Channel,
    /// Numbers that fix its shape, by name.
    pub shape: Vec<(&'static str, f64)>,
    /// One per coefficient.
    pub columns: Vec<Column>,
    /// One per coefficient.
    pub bounds: Vec<Bound>,
    /// Seconds from the start of each run at which it begins; none: always there.
    pub onset_s: Option<f64>,
}

impl Candidate {
    /// One that is always there.
    pub fn new(physics: &'static str, joints: &[usize], form: &'static str, channel: Channel) -> Self {
        Self { physics, joints: joints.to_vec(), form, channel, shape: Vec::new(), columns: Vec::new(), bounds: Vec::new(), onset_s: None }
    }

    /// With one more coefficient.
    #[must_use]
    pub fn with(mut self, column: Column, bound: Bound) -> Self {
        self.columns.push(column);
        self.bounds.push(bound);
        self
    }

    /// With a number of its shape.
    #[must_use]
    pub fn shaped(mut self, name: &'static str, value: f64) -> Self {
        self.shape.push((name, value));
        self
    }

    /// A number of its shape.
    pub fn shape_of(&self, name: &str) -> Option<f64> {
        self.shape.iter().find(|(n, _)| *n == name).map(|(_, v)| *v)
    }

    /// Do the two say the same physics at the same place?
    pub fn same_claim(&self, other: &Self) -> bool {
        self.physics == other.physics && self.joints == other.joints
    }
}

/// Every candidate for a problem.
pub fn library(dictionary: &Dictionary) -> Vec<Candidate> {
    let mut all = Vec::new();
    friction::push(dictionary, &mut all);
    inertial::push(dictionary, &mut all);
    transmission::push(dictionary, &mut all);
    actuation::push(dictionary, &mut all);
    kinematic::push(dictionary, &mut all);
    timing::push(dictionary, &mut all);
    environment::push(dictionary, &mut all);
    all.retain(|candidate| candidate.columns.iter().all(|column| !column.is_empty()));
    all
}
