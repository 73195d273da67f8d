//! A RAVEN-II's recordings: full states with truth become `raven118-v1` and the tip's error in mm.

use super::memory;
use super::{DataSet, Reading, Trajectory, outputs_of};
use crate::error::{TrainingError, shown};
use arm::{Raven2, Side, published};
use nalgebra::{Quaternion, UnitQuaternion};
use ravenpose::correction::Quantity;
use ravenpose::guard::Guard;
use ravenpose::memory::{Memory, Play, may_follow_recorded};
use ravenpose_wire::{FEATURES, PEDAL_DOWN, RavenState, features};
use recordings::open::{Opened, open};
use recordings::stream::{Record, Truth, is_truth_measured};
use std::path::Path;

/// A truth further from every state than this belongs to none: half a period of the slowest recordings (100 Hz).
const APART_MAX_NS: i64 = 5_000_000;
/// By how much the length of a quaternion may be off 1.
const OF_LENGTH_ONE: f64 = 0.05;
/// No arm of half a metre is off by more: units or frames contradict each other then.
const ERROR_MAX_MM: f64 = 100.0;
/// The same of the orientation.
const ERROR_MAX_DEG: f64 = 60.0;
/// A second memory begins anew after so many seconds, one after the other: what a service knows soon after its start.
const YOUNG_S: [f64; 4] = [1.0, 2.0, 4.0, 8.0];

/// A data set of a RAVEN-II without trajectories.
pub(super) fn empty(target: Quantity, plays: &[Play]) -> DataSet {
    DataSet {
        input_names: (0..FEATURES).map(features::name).chain(memory::names(plays)).collect(),
        output_names: outputs_of(target).map(str::to_owned).to_vec(),
        is_raven: true,
        ..DataSet::default()
    }
}

/// Reads one recording of states.
pub(super) fn read(file: &Path, reading: &Reading, notes: &mut Vec<String>) -> Result<Trajectory, TrainingError> {
    let source = match open(file).map_err(|error| TrainingError::Recording(error.to_string()))? {
        Opened::States(source) => source,
        Opened::Table(_) => {
            return Err(TrainingError::Unfit {
                file: shown(file),
                what: "is a table, not a recording of RAVEN-II states".to_owned(),
                remedy: "name its columns with --inputs and --truth",
            });
        }
    };
    let mut pairing = Pairing::new(file, reading);
    let mut source = source;
    pairing.found.is_measured = is_truth_measured(source.metadata());
    loop {
        match source.next().map_err(|error| TrainingError::Recording(error.to_string()))? {
            Some(Record::State(state)) => pairing.state(state)?,
            Some(Record::Truth(truth)) => pairing.truth(&truth)?,
            None => break,
        }
    }
    if let Some(damage) = source.damage() {
        notes.push(format!("{}: {}: {}: what stands before it is used", shown(file), damage.place, damage.what));
    }
    pairing.finish(notes)
}

/// The state being held until its truth comes.
struct Pairing<'a> {
    file: &'a Path,
    side: Side,
    target: Quantity,
    arm: arm::Arm,
    period_ns: i64,
    state: Option<Box<RavenState>>,
    features: [f32; FEATURES],
    possible: Guard,
    memory: Memory,
    young: Memory,
    /// How often it began anew, and when it does so next.
    young_begun: usize,
    young_since_ns: i64,
    young_until_ns: i64,
    state_ns: i64,
    /// A truth that is too far from the state before it: the next may be near.
    ahead: Option<Truth>,
    start_ns: Option<i64>,
    next_ns: i64,
    /// Has any state had another run level than 0? A file whose states all have 0 does not say: no arm moves in an e-stop.
    says_runlevel: bool,
    /// Truths left out because of the run level.
    left_out: usize,
    /// Truths beside states that no robot can have.
    impossible: usize,
    /// What is wrong with a row that may yet be left out.
    doubt: Option<TrainingError>,
    found: Trajectory,
}

impl<'a> Pairing<'a> {
    fn new(file: &'a Path, reading: &Reading) -> Self {
        let side = reading.arm;
        let name = file.file_name().map_or_else(|| shown(file), |name| name.to_string_lossy().into_owned());
        Self {
            file,
            side,
            target: reading.target,
            arm: Raven2::nominal().arm(side),
            period_ns: (1e9 / reading.truth_hz.max(1e-3)) as i64,
            state: None,
            features: [0.0; FEATURES],
            possible: Guard::new(None),
            memory: Memory::new(&reading.plays),
            young: Memory::new(&reading.plays),
            young_begun: 0,
            young_since_ns: i64::MIN,
            young_until_ns: i64::MIN,
            state_ns: 0,
            ahead: None,
            start_ns: None,
            next_ns: i64::MIN,
            says_runlevel: false,
            left_out: 0,
            impossible: 0,
            doubt: None,
            found: Trajectory { name, ..Trajectory::default() },
        }
    }

    fn state(&mut self, state: Box<RavenState>) -> Result<(), TrainingError> {
        let stamp_ns = i64::from(state.hdr_stamp_sec) * 1_000_000_000 + i64::from(state.hdr_stamp_nsec);
        self.state_ns = stamp_ns;
        if state.runlevel != 0 && !std::mem::replace(&mut self.says_runlevel, true) {
            self.left_out += self.found.rows();
            self.found.keep(|_| false);
            (self.start_ns, self.next_ns, self.doubt) = (None, i64::MIN, None);
        }
        features::extract(&state, self.side.index(), &mut self.features);
        self.found.sketch.add(self.features);
        // As the service does it: what cannot be the robot's is not followed.
        if may_follow_recorded(&self.possible, &self.features) {
            self.follow(stamp_ns);
        }
        self.state = Some(state);
        self.ahead.take().map_or(Ok(()), |truth| self.truth(&truth))
    }

    fn follow(&mut self, stamp_ns: i64) {
        self.memory.follow(&self.features, stamp_ns);
        if stamp_ns >= self.young_until_ns {
            self.young.forget();
            self.young_since_ns = stamp_ns;
            self.young_until_ns = stamp_ns + (YOUNG_S[self.young_begun % YOUNG_S.len()] * 1e9) as i64;
            self.young_begun += 1;
        }
        self.young.follow(&self.features, stamp_ns);
    }

    fn truth(&mut self, truth: &Truth) -> Result<(), TrainingError> {
        if truth.side != self.side || truth.time_ns < self.next_ns {
            return Ok(());
        }
        let early_ns = truth.time_ns.saturating_sub(self.state_ns);
        if early_ns > APART_MAX_NS {
            self.ahead = Some(*truth);
        }
        let Some(state) = self.state.as_deref().filter(|_| early_ns.abs() <= APART_MAX_NS) else { return Ok(()) };
        if self.says_runlevel && state.runlevel != PEDAL_DOWN {
            self.left_out += 1;
            return Ok(());
        }
        let board = state.type_[self.side.index()];
        let inputs = self.features;
        // The service answers no such state. What is no number at all is refused below.
        if inputs.iter().all(|value| value.is_finite()) && !may_follow_recorded(&self.possible, &inputs) {
            self.impossible += 1;
            return Ok(());
        }
        let Some(label) = self.label(state, truth) else { return Ok(()) };
        let start_ns = *self.start_ns.get_or_insert(truth.time_ns);
        let time_s = (truth.time_ns - start_ns) as f64 * 1e-9;
        if let Some(error) = self.judge(&inputs, &label, time_s) {
            if self.says_runlevel {
                return Err(error);
            }
            self.doubt.get_or_insert(error);
        }
        // The next one a period after where this one should have been: rates keep their mean.
        self.next_ns = if self.next_ns == i64::MIN { truth.time_ns } else { self.next_ns };
        self.next_ns = (self.next_ns + self.period_ns).max(truth.time_ns + self.period_ns / 2);
        self.found.board = board;
        self.found.time_s.push(time_s);
        self.found.inputs.extend_from_slice(&inputs);
        let mut places = vec![0.0; self.memory.len()];
        self.memory.places(&inputs, &mut places);
        self.found.inputs.extend_from_slice(&places);
        self.young.places(&inputs, &mut places);
        self.found.young_places.extend_from_slice(&places);
        let age_s = self.state_ns.saturating_sub(self.young_since_ns) as f64 * 1e-9;
        if !self.memory.is_empty() {
            self.found.is_unsettled.push(!self.memory.is_settled());
        }
        self.found.unsettled_s.push(if self.young.is_settled() { f64::NAN } else { age_s });
        self.found.labels.extend(label.map(|part| part as f32));
        Ok(())
    }

    /// What is wrong with a row, if anything.
    fn judge(&self, inputs: &[f32; FEATURES], label: &[f64; 3], time_s: f64) -> Option<TrainingError> {
        if let Some(feature) = inputs.iter().position(|value| !value.is_finite()) {
            let what = format!("{} is not a number {time_s:.3} s after the first truth", features::name(feature));
            return Some(self.unfit(what, "remove the row or record again"));
        }
        let (limit, how, remedy) = match self.target {
            Quantity::Position => (
                ERROR_MAX_MM,
                "mm apart",
                "units or frame of the truth contradict the states; register it to frame 0 of the arm in mm",
            ),
            Quantity::Orientation => (
                ERROR_MAX_DEG,
                "deg turned against each other",
                "the truth's frame, the fixture's axes or the order w, x, y, z contradict the states; pair it with frame and mounting known",
            ),
        };
        (norm(label) > limit).then(|| {
            let what = format!("truth and reported tip are {:.0} {how} {time_s:.3} s after the first truth", norm(label));
            self.unfit(what, remedy)
        })
    }

    /// What is to be learnt; none where the truth does not say.
    fn label(&self, state: &RavenState, truth: &Truth) -> Option<[f64; 3]> {
        match self.target {
            Quantity::Position => self.shift(state, truth),
            Quantity::Orientation => self.turn(state, truth),
        }
    }

    /// From the reported to the true orientation: rotation vector, degrees, frame 0.
    fn turn(&self, state: &RavenState, truth: &Truth) -> Option<[f64; 3]> {
        let [w, x, y, z] = truth.quaternion_wxyz;
        // Four zeros are a tracker's that knows no orientation.
        let (reported, there) = if (Quaternion::new(w, x, y, z).norm() - 1.0).abs() < OF_LENGTH_ONE {
            let row_major = std::array::from_fn(|place| state.ori[9 * self.side.index() + place]);
            let reported = UnitQuaternion::from_rotation_matrix(&published::rotation(&row_major)?);
            // Of a matrix in float32.
            (UnitQuaternion::new_normalize(*reported), UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)))
        } else {
            let (reported, there) = self.by_joints(state, truth)?;
            let turned = |joints| UnitQuaternion::from_rotation_matrix(&self.arm.kinematics.tip(joints).rotation);
            (turned(&reported), turned(&there))
        };
        Some((there * reported.inverse()).scaled_axis().map(f64::to_degrees).into())
    }

    /// Joints as reported, and with joints 1 to 3 as encoders at the joints have them (the lab's 252 columns).
    fn by_joints(&self, state: &RavenState, truth: &Truth) -> Option<(arm::Joints, arm::Joints)> {
        let reported = reported_joints(state, self.side);
        let mut there = reported;
        there[..3].copy_from_slice(&truth.joints[..3]);
        there.iter().all(|part| part.is_finite()).then_some((reported, there))
    }

    /// True minus reported tip, mm, frame 0.
    fn shift(&self, state: &RavenState, truth: &Truth) -> Option<[f64; 3]> {
        let at = 3 * self.side.index();
        let reported_m: [f64; 3] = std::array::from_fn(|axis| f64::from(state.pos[at + axis]) * 1e-6);
        if truth.position_m.iter().all(|part| part.is_finite()) {
            return Some(std::array::from_fn(|axis| (truth.position_m[axis] - reported_m[axis]) * 1e3));
        }
        let (reported, there) = self.by_joints(state, truth)?;
        let (before, after) = (self.arm.kinematics.tip_position(&reported), self.arm.kinematics.tip_position(&there));
        Some(std::array::from_fn(|axis| (after[axis] - before[axis]) * 1e3))
    }

    fn unfit(&self, what: String, remedy: &'static str) -> TrainingError {
        TrainingError::Unfit { file: shown(self.file), what, remedy }
    }

    fn finish(mut self, notes: &mut Vec<String>) -> Result<Trajectory, TrainingError> {
        if let Some(doubt) = self.doubt {
            return Err(doubt);
        }
        let file = shown(self.file);
        if self.left_out > 0 && self.found.rows() == 0 {
            let what = format!("all {} truths lie outside run level {PEDAL_DOWN} (pedal down)", self.left_out);
            return Err(self.unfit(what, "record with the pedal down"));
        }
        if self.left_out > 0 {
            notes.push(format!("{file}: {} truths outside run level {PEDAL_DOWN} (pedal down) are left out", self.left_out));
        } else if !self.says_runlevel {
            notes.push(format!("{file}: does not say its run levels: all its truths are used"));
        }
        if self.impossible > 0 {
            notes.push(format!(
                "{file}: {} truths beside states that no robot can have (input_impossible) are left out",
                self.impossible
            ));
        }
        if self.found.rows() == 0 {
            let tip = if self.target == Quantity::Position { "tip" } else { "orientation of the tip" };
            let looked_for = format!("no true {tip} and no true joints 1 to 3 of the {} arm beside its states", self.side.name());
            return Err(TrainingError::NoTruth { file, looked_for });
        }
        self.found.exact.clone_from(&self.found.labels);
        Ok(self.found)
    }
}

/// Joint positions as published (degrees in every slot, joint 3 included), in rad and m.
fn reported_joints(state: &RavenState, side: Side) -> arm::Joints {
    const SLOTS: [usize; arm::JOINTS] = [0, 1, 2, 4, 5, 6, 7];
    SLOTS.map(|slot| f64::from(state.jpos[8 * side.index() + slot]).to_radians())
}

fn norm(vector: &[f64; 3]) -> f64 {
    vector.iter().map(|part| part * part).sum::<f64>().sqrt()
}
