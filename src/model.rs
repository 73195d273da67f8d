//! From a file to a model that the loop may run: size, hash, import, card, plan, golden pairs. Each step refuses with one line.
//! What runs is an [`Estimate`]: the plan, the memory in front of it and the observer of the load beside it, if the model has them.

use crate::card::{Card, CardError, Golden};
use crate::config::{self, ModelSource, shown_path};
use crate::correction::{Estimator, Model};
use crate::guard::Guard;
use crate::load::{LoadCard, LoadObserver};
use crate::memory::Memory;
use crate::network::{self, Deviation, NotExactEnough, Plan};
use ravenpose_importer::{Expected, ImportError, Network};
use ravenpose_wire::FEATURES;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Largest model file that is read: ten million float32 weights are 40 MB.
const SIZE_MAX: u64 = 128 << 20;
/// Largest `FILE.sha256` that is read; `sha256sum` writes one line.
const HASH_FILE_SIZE_MAX: u64 = 8192;
/// Largest difference to a golden output, relative to max(1, |value|): what float32 sums of this size differ by.
const GOLDEN_TOLERANCE: f64 = 1e-4;
/// Inputs and outputs of every model.
pub const EXPECTED: Expected = Expected { inputs: FEATURES, outputs: 3 };

/// Why a model was refused; one line that begins with the file.
#[derive(Debug, Error)]
pub enum ModelError {
    /// The file cannot be read.
    #[error("{path}: cannot read the model: {cause}; give the path of an ONNX file")]
    Unreadable {
        /// The file.
        path: String,
        /// The reason.
        cause: String,
    },
    /// No hash to compare with.
    #[error(
        "{path}: no usable hash beside the model ({cause}); run `sha256sum {name} > {name}.sha256` in its directory after checking where it comes from"
    )]
    NoHash {
        /// The file.
        path: String,
        /// Its last component.
        name: String,
        /// The reason.
        cause: String,
    },
    /// The file is not the one that the hash was taken of.
    #[error("{path}: SHA-256 is {found}, expected {expected} (from {origin}); the file was changed or damaged, copy it again")]
    Hash {
        /// The file.
        path: String,
        /// As computed.
        found: String,
        /// As stated.
        expected: String,
        /// Where it was stated.
        origin: String,
    },
    /// Not a network that can be run.
    #[error("{path}: {cause}")]
    Import {
        /// The file.
        path: String,
        /// The reason.
        cause: ImportError,
    },
    /// The metadata cannot be used.
    #[error("{path}: {cause}")]
    Card {
        /// The file.
        path: String,
        /// The reason.
        cause: CardError,
    },
    /// Weights of the format asked for are too far off.
    #[error("{path}: {cause} {unit}; choose another format, weights = \"auto\", or raise {key}")]
    Weights {
        /// The file.
        path: String,
        /// Of the network's answers.
        unit: &'static str,
        /// Of the configuration.
        key: &'static str,
        /// How far.
        cause: NotExactEnough,
    },
    /// The network does not give what it gave when it was exported.
    #[error(
        "{path}: golden pair {index}: output {axis} is {found} {unit}, the card says {expected} {unit}; card and network do not belong together, export the model again"
    )]
    Golden {
        /// The file.
        path: String,
        /// Which pair, from 0.
        index: usize,
        /// Which output.
        axis: usize,
        /// Of the network's answers.
        unit: &'static str,
        /// As computed.
        found: f64,
        /// As stated.
        expected: f64,
    },
}

/// A model that the loop may run.
pub struct Loaded {
    /// The plan, and what guards it.
    pub model: Model<Estimate>,
    /// What the file's metadata says.
    pub card: Card,
    /// How far the plan's weights are off, mm or degrees.
    pub deviation: Deviation,
}

impl Loaded {
    /// `weights i16, at most 0.6 um from float64 over 264 inputs, in huge pages`.
    pub fn weights(&self) -> String {
        let (plan, Deviation { worst, inputs, .. }) = (&self.model.estimator.plan, self.deviation);
        format!(
            "weights {}, at most {:.2} {} from float64 over {inputs} inputs{}",
            plan.format(),
            worst * 1000.0,
            self.card.quantity.thousandth(),
            if plan.is_in_huge_pages() { ", in huge pages" } else { "" }
        )
    }
}

/// A network as the loop runs it: its memory of the recent motion, the plan, and what watches the load meanwhile.
#[derive(Clone)]
pub struct Estimate {
    plan: Plan,
    memory: Memory,
    load: Option<LoadObserver>,
    /// The features, behind them where they stand within each play, and the friction if the network is told.
    input: Box<[f32]>,
}

impl Estimate {
    /// A network's plan with a memory that has seen nothing.
    pub fn new(network: &Network, plan: Plan) -> Self {
        let memory = Memory::new(&network.plays);
        Self { plan, input: vec![0.0; FEATURES + memory.len() + network.friction].into(), memory, load: None }
    }

    /// The same with an observer of the load.
    #[must_use]
    pub fn watching(self, load: Option<LoadCard>) -> Self {
        Self { load: load.map(LoadObserver::new), ..self }
    }

    /// Puts the features, where they stand in the memory, and the friction where plan and observer look for them.
    fn see(&mut self, features: &[f32; FEATURES]) {
        let (own, places) = self.input.split_at_mut(FEATURES);
        own.copy_from_slice(features);
        self.memory.places(features, places);
        if let (Some(load), Some(friction)) = (&self.load, places.get_mut(self.memory.len()..)) {
            friction.iter_mut().zip(load.friction_nm()).for_each(|(out, friction_nm)| *out = friction_nm);
        }
    }

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }
}

impl Estimator for Estimate {
    fn remembers(&self) -> bool {
        !self.memory.is_empty()
    }

    fn follow(&mut self, features: &[f32; FEATURES], time_ns: i64) {
        self.memory.follow(features, time_ns);
    }

    fn weigh(&mut self, features: &[f32; FEATURES], time_ns: i64) {
        if self.load.as_ref().is_some_and(|load| load.is_due(time_ns)) {
            self.see(features);
            let seen = FEATURES + self.memory.len();
            if let (Some(load), Some(input)) = (&mut self.load, self.input.get(..seen)) {
                load.follow(input, time_ns);
            }
        }
    }

    /// The memory; what is carried stays in the gripper, whoever moves the arm.
    fn forget(&mut self) {
        self.memory.forget();
    }

    fn load_score(&self) -> Option<f32> {
        self.load.as_ref().map(LoadObserver::score)
    }

    fn friction_score(&self) -> Option<f32> {
        self.load.as_ref().and_then(LoadObserver::friction_score)
    }

    fn has_weighed(&self) -> bool {
        self.load.as_ref().is_none_or(LoadObserver::has_weighed)
    }

    fn is_settled(&self) -> bool {
        let tells_friction = self.input.len() > FEATURES + self.memory.len();
        let knows_friction = self.load.as_ref().is_some_and(LoadObserver::has_weighed);
        self.memory.is_settled() && (knows_friction || !tells_friction)
    }

    fn run(&mut self, features: &[f32; FEATURES], error: &mut [f32; 3]) {
        if self.memory.is_empty() {
            return self.plan.run(features, error);
        }
        self.see(features);
        self.plan.run(&self.input, error);
    }

    fn keep_warm(&mut self) {
        self.plan.keep_warm();
    }
}

/// Reads a model file of bounded size.
///
/// # Errors
/// [`ModelError::Unreadable`].
pub fn read(path: &Path) -> Result<Vec<u8>, ModelError> {
    config::read_regular(path, SIZE_MAX).map_err(|cause| ModelError::Unreadable { path: shown_path(path), cause })
}

/// Imports a network as `ravenpose infer` does: no hash and no card wanted.
///
/// # Errors
/// [`ModelError::Unreadable`] or [`ModelError::Import`].
pub fn network(path: &Path) -> Result<Network, ModelError> {
    import(path, &read(path)?)
}

fn import(path: &Path, bytes: &[u8]) -> Result<Network, ModelError> {
    ravenpose_importer::import(bytes, &EXPECTED).map_err(|cause| ModelError::Import { path: shown_path(path), cause })
}

/// Loads a model as the service does: hash first, then import, card and golden pairs. The file is not needed afterwards.
///
/// # Errors
/// Any [`ModelError`].
pub fn load(source: &ModelSource) -> Result<Loaded, ModelError> {
    let path = shown_path(&source.path);
    let bytes = read(&source.path)?;
    let digest: [u8; 32] = Sha256::digest(&bytes).into();
    check_hash(source, &path, &hex(&digest))?;
    let network = import(&source.path, &bytes)?;
    drop(bytes);
    let unusable = |cause| ModelError::Card { path: path.clone(), cause };
    let card = Card::read(&network.metadata, source.quantity).map_err(unusable)?;
    check_golden(&path, &mut Estimate::new(&network, Plan::new(&network)), &card)?;
    card.check_range().map_err(unusable)?;
    card.check_memory(network.plays.len(), network.friction).map_err(unusable)?;
    // Places of a memory that has seen nothing else are zero, and so is the friction that is usual.
    let seen = |golden: &Golden| [&golden.input[..], &vec![0.0; network.plays.len() + network.friction]].concat();
    let golden: Vec<Vec<f32>> = card.golden.iter().map(seen).collect();
    let choice = network::choose(&network, &golden, source.weights_deviation / 1000.0, source.weights).map_err(|cause| {
        ModelError::Weights { path: path.clone(), unit: source.quantity.unit(), key: source.quantity.deviation_key(), cause }
    })?;
    let per_output = source.quantity.per_output();
    let model = Model {
        estimator: Estimate::new(&network, choice.plan).watching(card.load.clone()),
        guard: Guard::new(card.domain.clone()),
        allowed: card.allowed.clone(),
        id: u64::from_be_bytes(std::array::from_fn(|index| digest[index])),
        bound: card.bound * per_output,
        bound95: card.bound95.map(|value| value * per_output),
        bound95_unsettled: card.bound95_unsettled.map(|value| value * per_output),
        untrained: card.untrained,
    };
    Ok(Loaded { model, card, deviation: choice.deviation })
}

fn hex(digest: &[u8]) -> String {
    use std::fmt::Write;
    digest.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

fn check_hash(source: &ModelSource, path: &str, found: &str) -> Result<(), ModelError> {
    let (expected, origin) = match &source.sha256 {
        Some(hash) => (hash.clone(), "the configuration".to_owned()),
        None => stated_hash(&source.path)?,
    };
    if expected.eq_ignore_ascii_case(found) {
        return Ok(());
    }
    Err(ModelError::Hash { path: path.to_owned(), found: found.to_owned(), expected, origin })
}

/// The hash in `FILE.sha256`, in the form that `sha256sum` writes.
fn stated_hash(model: &Path) -> Result<(String, String), ModelError> {
    let mut beside = model.as_os_str().to_owned();
    beside.push(".sha256");
    let beside = PathBuf::from(beside);
    let shown = shown_path(&beside);
    let no_hash = |cause: String| ModelError::NoHash {
        path: shown_path(model),
        name: shown_path(Path::new(model.file_name().unwrap_or_default())),
        cause: format!("{shown}: {cause}"),
    };
    let bytes = config::read_regular(&beside, HASH_FILE_SIZE_MAX).map_err(no_hash)?;
    let text = String::from_utf8_lossy(&bytes);
    let hash = text.split_ascii_whitespace().next().unwrap_or_default();
    if hash.len() != 64 || !hash.chars().all(|c| c.is_ascii_hexdigit()) {
        return Err(no_hash("does not begin with 64 hexadecimal digits".to_owned()));
    }
    Ok((hash.to_owned(), shown))
}

#[expect(clippy::neg_cmp_op_on_partial_ord, reason = "written so that NaN fails")]
fn check_golden(path: &str, estimate: &mut Estimate, card: &Card) -> Result<(), ModelError> {
    for (index, golden) in card.golden.iter().enumerate() {
        let mut output = [0.0_f32; 3];
        estimate.run(&golden.input, &mut output);
        for (axis, (found, expected)) in output.into_iter().map(f64::from).zip(golden.output).enumerate() {
            // Written so that NaN fails.
            if !((found - expected).abs() <= GOLDEN_TOLERANCE * expected.abs().max(1.0)) {
                return Err(ModelError::Golden { path: path.to_owned(), index, axis, unit: card.quantity.unit(), found, expected });
            }
        }
    }
    Ok(())
}
