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

/// What is fitted before the network, which then learns the rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum First {
    /// Nothing.
    #[default]
    Nothing,
    /// A line on all that the network sees; for tanh without normalisation.
    Linear,
    /// Either, each with a network of its own: what leaves less on validation.
    Either,
}

impl First {
    /// Names of all.
    pub const NAMES: [&str; 3] = ["nothing", "linear", "either"];

    /// One by its name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().position(|known| *known == name).map(|at| [Self::Nothing, Self::Linear, Self::Either][at])
    }

    /// Can a line pass the hidden layers?
    pub fn passes(activation: Activation, norm: NormPlace) -> bool {
        activation == Activation::Tanh && norm == NormPlace::None
    }
}

/// Most hidden layers, and most units of one.
const MOST_LAYERS: usize = 16;
const MOST_UNITS: usize = 8192;

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
    /// What is fitted first.
    #[serde(default)]
    pub first: First,
    /// Does it want the memory of the recent motion?
    pub memory: bool,
    /// Does it want the motors' friction, averaged over minutes?
    #[serde(default)]
    pub friction: bool,
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
    pub const PRESETS: [&str; 5] = ["default", "plays", "one-state", "paper", "paper-code"];

    /// A preset by its name.
    pub fn preset(name: &str) -> Option<Self> {
        match name {
            "paper" => Some(Self::paper()),
            "paper-code" => Some(Self::paper_code()),
            "default" => Some(Self::ours()),
            "plays" => Some(Self { name: name.to_owned(), friction: false, ..Self::ours() }),
            "one-state" => Some(Self { name: name.to_owned(), memory: false, friction: false, ..Self::ours() }),
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
            first: First::Nothing,
            memory: false,
            friction: false,
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

    /// Can it be trained?
    ///
    /// # Errors
    /// What cannot be, in words.
    pub fn check(&self) -> Result<(), String> {
        let finite = |x: f64| x.is_finite() && x >= 0.0;
        let wrong = if self.hidden.is_empty()
            || self.hidden.len() > MOST_LAYERS
            || !self.hidden.iter().all(|w| (1..=MOST_UNITS).contains(w))
        {
            format!("hidden must hold 1 to {MOST_LAYERS} widths of 1 to {MOST_UNITS}")
        } else if self.batch == 0 || self.epochs == 0 || self.patience == 0 {
            "batch, epochs and patience must be 1 or more".to_owned()
        } else if !(finite(self.rate) && self.rate > 0.0 && finite(self.l1) && finite(self.decay)) {
            "rate must be above 0, l1 and decay 0 or more".to_owned()
        } else if self.activation == Activation::Identity {
            "activation must not be identity: layers of it are one".to_owned()
        } else if self.first != First::Nothing && !First::passes(self.activation, self.norm) {
            "a line first wants activation tanh and norm none".to_owned()
        } else if self.friction && !self.memory {
            "friction wants memory: it stands behind the places of that".to_owned()
        } else {
            return Ok(());
        };
        Err(wrong)
    }

    /// The memory that it wants.
    pub fn plays(&self) -> Vec<Play> {
        if self.memory { memory::plays() } else { Vec::new() }
    }

    /// The same for tables, whose columns nobody knows: every one of them standardised. The default's network becomes one for
    /// thousands of rows instead of hundreds of thousands, which may learn what a line leaves.
    #[must_use]
    pub fn for_tables(self) -> Self {
        let ours = ["default", "plays", "one-state"].contains(&self.name.as_str());
        let small = if ours {
            Self { hidden: vec![48, 48], first: First::Either, batch: 64, epochs: 80, decay: 0.1, ..self }
        } else {
            self
        };
        Self { preparation: Preparation::Standard, memory: false, friction: false, ..small }
    }

    /// The best found here: docs/training.md.
    pub fn ours() -> Self {
        Self {
            name: "default".to_owned(),
            hidden: vec![400, 300],
            activation: Activation::Tanh,
            norm: NormPlace::None,
            preparation: Preparation::Physical,
            first: First::Nothing,
            memory: true,
            friction: true,
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
