//! Recipes: the paper's, that of its published code, and the one that does best here.

use crate::data::memory;
use crate::network::{Activation, NormPlace};
use crate::prepare::Preparation;
use ravenpose::memory::Play;
use serde::{Deserialize, Serialize};

/// How the learning rate goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Schedule {
    /// It stays.
    Constant,
    /// It falls to zero along half a cosine, after a twentieth of the steps in which it rises.
    Cosine,
}

/// Everything that training depends on but the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// Name of the preset.
    pub name: String,
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// Activation of the hidden layers.
    pub activation: Activation,
    /// Batch normalisation.
    pub norm: NormPlace,
    /// What the network sees.
    pub preparation: Preparation,
    /// Does it want the memory of the recent motion?
    pub memory: bool,
    /// Rows per step.
    pub batch: usize,
    /// Learning rate of Adam.
    pub rate: f64,
    /// How it goes.
    pub schedule: Schedule,
    /// Passes over the training rows.
    pub epochs: usize,
    /// Weight of the sum of absolute weights in the loss.
    pub l1: f64,
    /// Decoupled weight decay.
    pub decay: f64,
    /// Epochs without a better validation before training stops.
    pub patience: usize,
    /// Everything random.
    pub seed: u64,
}

impl Recipe {
    /// Names of the presets, the best first.
    pub const PRESETS: [&str; 4] = ["default", "one-state", "paper", "paper-code"];

    /// A preset by its name.
    pub fn preset(name: &str) -> Option<Self> {
        match name {
            "paper" => Some(Self::paper()),
            "paper-code" => Some(Self::paper_code()),
            "default" => Some(Self::ours()),
            "one-state" => Some(Self { name: name.to_owned(), memory: false, ..Self::ours() }),
            _ => None,
        }
    }

    /// Peng, Yang, Su, Hannaford 2020. The stated rate of 1e-8 moves a weight by at most 1e-8 per step, so a whole day changes
    /// nothing; Adam's usual 1e-3 stands here, and the epochs that it needs.
    pub fn paper() -> Self {
        Self {
            name: "paper".to_owned(),
            hidden: vec![600, 500, 400],
            activation: Activation::Sigmoid,
            norm: NormPlace::Before,
            preparation: Preparation::Standard,
            memory: false,
            batch: 1024,
            rate: 1e-3,
            schedule: Schedule::Constant,
            epochs: 40,
            l1: 5e-6,
            decay: 0.0,
            patience: 10,
            seed: 0,
        }
    }

    /// What the authors' published script builds.
    pub fn paper_code() -> Self {
        Self {
            name: "paper-code".to_owned(),
            hidden: vec![600, 600, 500, 400],
            activation: Activation::Elu,
            norm: NormPlace::After,
            ..Self::paper()
        }
    }

    /// The memory that it wants.
    pub fn plays(&self) -> Vec<Play> {
        if self.memory { memory::plays() } else { Vec::new() }
    }

    /// The same for tables, whose columns nobody knows: every one of them standardised. The default's network becomes one for
    /// thousands of rows instead of hundreds of thousands.
    #[must_use]
    pub fn for_tables(self) -> Self {
        let ours = self.name == "default" || self.name == "one-state";
        let small = if ours { Self { hidden: vec![48, 48], batch: 64, epochs: 80, decay: 0.1, ..self } } else { self };
        Self { preparation: Preparation::Standard, memory: false, ..small }
    }

    /// The best found here: docs/training.md.
    pub fn ours() -> Self {
        Self {
            name: "default".to_owned(),
            hidden: vec![400, 300],
            activation: Activation::Tanh,
            norm: NormPlace::None,
            preparation: Preparation::Physical,
            memory: true,
            batch: 256,
            rate: 2e-3,
            schedule: Schedule::Cosine,
            epochs: 16,
            l1: 0.0,
            decay: 0.3,
            patience: 16,
            seed: 0,
        }
    }
}
