//! The types of report.json, as `models/gap-report.schema.json` has them. Every object takes further keys that begin with `x_`
//! ([`Extra`]); any other unknown key is refused.

mod artifact;
mod evidence;
mod experiment;
mod extra;
mod fit;
mod inputs;
mod location;
mod parameter;
mod report;
mod verdict;

pub use artifact::{Artifact, Format};
pub use evidence::{Confusable, EffectSize, Evidence, TestData, TestMethod};
pub use experiment::{Experiment, Trajectory, TrajectoryKind};
pub use extra::Extra;
pub use fit::{ABSENT, Fit, FloorMethod, Metric, Score, Space, removed_fraction};
pub use inputs::{Access, Channel, Inputs, Robot, Run, RunKind, RunRole, Simulator, Tool};
pub use location::{Feature, Interval, Location, Regime, Region, RegionKind, Subsystem};
pub use parameter::{ALONG, CiMethod, Identifiable, Parameter, TRUE_UNIT};
pub use report::{
    Calibration, DataQuality, ExcessRms, Level, MODEL_ERROR, Mismatch, Remaining, Report, SCHEMA_VERSION, SealedCase, Status,
    Timing,
};
pub use verdict::{Role, Verdict, ranked};
