//! Full states and truth.

use arm::published::SLOT_OF_JOINT;
use arm::{JOINTS, Raven2, Side};
use ravenpose_wire::RavenState;

use super::channel::Numbers;
use super::standstill::{MOTOR_STILL_RAD_S, StillRows};
use super::timing::Times;
use super::{DamageAt, Description, Runlevels, Saturation, Stream, Topic, TruthCoverage, share};
use crate::fields::{self, DAC_VAL, MESSAGE, Values};
use crate::stream::{Record, Source, StreamError, Truth};

/// Records between two reports of progress.
const REPORT_EVERY: u64 = 1024;

/// Everything that is collected from states.
struct States {
    times: Times,
    rows: u64,
    arms: u32,
    numbers: Vec<Numbers>,
    repeated: u64,
    before: Option<Box<RavenState>>,
    still: [StillRows; 2],
    limits: [u32; JOINTS],
    at_limit: [[u64; JOINTS]; 2],
    runlevels: Runlevels,
}

impl States {
    fn new() -> Self {
        let places = MESSAGE.iter().map(|field| field.count()).sum();
        Self {
            times: Times::default(),
            rows: 0,
            arms: 0,
            numbers: vec![Numbers::default(); places],
            repeated: 0,
            before: None,
            still: Default::default(),
            limits: Raven2::nominal().plant().motor.dac_limit,
            at_limit: Default::default(),
            runlevels: Runlevels::default(),
        }
    }

    fn see(&mut self, state: Box<RavenState>, time_ns: i64) {
        self.rows += 1;
        self.times.see(time_ns);
        self.arms |= if state.connected() == 0 { fields::arms_by_content(&state) } else { state.connected() };
        self.runlevels.see(i64::from(state.runlevel));
        self.see_numbers(&state);
        for side in Side::ALL {
            self.see_arm(&state, side);
        }
        self.repeated += u64::from(self.before.as_ref().is_some_and(|before| same_message(before, &state)));
        self.before = Some(state);
    }

    fn see_numbers(&mut self, state: &RavenState) {
        let mut numbers = self.numbers.iter_mut();
        for field in MESSAGE {
            match (field.get)(state) {
                Values::Int(values) => values.iter().zip(&mut numbers).for_each(|(value, to)| to.see(f64::from(*value))),
                Values::Float(values) => values.iter().zip(&mut numbers).for_each(|(value, to)| to.see(f64::from(*value))),
            }
        }
    }

    fn see_arm(&mut self, state: &RavenState, side: Side) {
        let slots = SLOT_OF_JOINT.map(|slot| 8 * side.index() + slot);
        let still = |slot: &usize| f64::from(state.mvel[*slot]).to_radians().abs() < MOTOR_STILL_RAD_S;
        self.still[side.index()].see(slots.iter().all(still));
        for (joint, slot) in slots.into_iter().enumerate() {
            let is_at_limit = state.dac_val[slot].unsigned_abs() >= self.limits[joint];
            self.at_limit[side.index()][joint] += u64::from(is_at_limit);
        }
    }

    fn sides(&self) -> impl Iterator<Item = Side> {
        Side::ALL.into_iter().filter(|side| self.arms & (1 << side.index()) != 0)
    }

    fn channels(&self) -> Vec<super::Channel> {
        let mut numbers = self.numbers.iter();
        let mut channels = Vec::new();
        for field in MESSAGE {
            for (place, numbers) in (0..field.count()).zip(&mut numbers) {
                let shown = field.side(place).is_none_or(|side| self.sides().any(|other| other == side));
                if shown {
                    channels.push(numbers.channel(field.place_name(place), field.unit(place)));
                }
            }
        }
        channels
    }

    fn saturation(&self) -> Vec<Saturation> {
        let first: usize = MESSAGE.iter().take_while(|field| field.name != DAC_VAL.name).map(|field| field.count()).sum();
        let of_joint = |side: Side, joint: usize| {
            let place = 8 * side.index() + SLOT_OF_JOINT[joint];
            Saturation {
                channel: DAC_VAL.place_name(place),
                limit_counts: self.limits[joint],
                share: share(self.at_limit[side.index()][joint], self.rows),
                at_extreme_share: share(self.numbers[first + place].at_extremes(), self.rows),
            }
        };
        self.sides().flat_map(|side| (0..JOINTS).map(move |joint| of_joint(side, joint))).collect()
    }
}

/// Everything but header and times equal?
fn same_message(a: &RavenState, b: &RavenState) -> bool {
    MESSAGE.iter().all(|field| match ((field.get)(a), (field.get)(b)) {
        (Values::Int(a), Values::Int(b)) => a == b,
        (Values::Float(a), Values::Float(b)) => a == b,
        _ => false,
    })
}

/// Truth of one arm.
#[derive(Default)]
struct Truths {
    times: Times,
    count: u64,
    positions: u64,
    rotations: u64,
    joints: u64,
}

impl Truths {
    fn see(&mut self, truth: &Truth) {
        self.times.see(truth.time_ns);
        self.count += 1;
        self.positions += u64::from(truth.position_m.iter().all(|value| !value.is_nan()));
        self.rotations += u64::from(truth.quaternion_wxyz.iter().all(|value| !value.is_nan()));
        self.joints += u64::from(truth.joints.iter().any(|value| !value.is_nan()));
    }
}

pub(super) fn describe(
    name: &str,
    source: &mut dyn Source,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Description, StreamError> {
    let mut states = States::new();
    let mut truths: [Truths; 2] = Default::default();
    let mut records = 0_u64;
    while let Some(record) = source.next()? {
        let time_ns = record.time_ns();
        match record {
            Record::State(state) => states.see(state, time_ns),
            Record::Truth(truth) => truths[truth.side.index()].see(&truth),
        }
        records += 1;
        if records.is_multiple_of(REPORT_EVERY) {
            let (done, total) = source.progress();
            progress(done, total);
        }
    }
    Ok(result(name, source, &states, &truths))
}

fn result(name: &str, source: &dyn Source, states: &States, truths: &[Truths; 2]) -> Description {
    let mut streams = vec![Stream { name: "states".to_owned(), count: states.rows, timing: states.times.timing() }];
    let mut truth = Vec::new();
    for side in Side::ALL {
        let of_arm = &truths[side.index()];
        if of_arm.count > 0 {
            let timing = of_arm.times.timing();
            streams.push(Stream { name: format!("truth {}", side.name()), count: of_arm.count, timing });
            truth.push(TruthCoverage {
                arm: side.name().to_owned(),
                position_share: share(of_arm.positions, states.rows),
                rotation_share: share(of_arm.rotations, states.rows),
                joints_share: share(of_arm.joints, states.rows),
            });
        }
    }
    let rule = format!("all motors below {MOTOR_STILL_RAD_S} rad/s");
    Description {
        file: name.to_owned(),
        format: source.format().to_owned(),
        bytes: source.progress().1,
        metadata: source.metadata().to_vec(),
        topics: topics(source),
        streams,
        channels: states.channels(),
        repeated_rows: states.repeated,
        standstill: states.sides().map(|side| states.still[side.index()].result(side.name(), &rule)).collect(),
        saturation: states.saturation(),
        runlevels: states.runlevels.shares(states.rows),
        truth,
        findings: Vec::new(),
        damage: source.damage().map(DamageAt::from),
    }
}

fn topics(source: &dyn Source) -> Vec<Topic> {
    let topic = |channel: crate::stream::Channel| Topic {
        name: channel.topic,
        type_name: channel.type_name,
        messages: channel.messages,
        is_read: channel.is_read,
    };
    source.channels().into_iter().map(topic).collect()
}
