//! Records as messages.

use arm::{JOINTS, Side};

use super::bytes::Header;
use super::definitions::{JOINT_STATE, KEY_VALUE, MessageType, POSE_STAMPED, RAVEN_STATE, STATE_ORIGIN};
use super::messages::{JointState, PoseStamped, StateOrigin};
use super::state::encode_state;
use crate::stream::{Record, Truth};

/// A topic that is written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Topic {
    pub(crate) name: &'static str,
    pub(crate) message: MessageType,
}

const STATE: usize = 0;
const ORIGIN: usize = 1;
const POSE: [usize; 2] = [2, 3];
const JOINT: [usize; 2] = [4, 5];

/// Every topic; a [`Message`] names one by its index.
pub(crate) const TOPICS: [Topic; 6] = [
    Topic { name: "/ravenstate", message: RAVEN_STATE },
    Topic { name: "/ravenstate/origin", message: STATE_ORIGIN },
    Topic { name: "/truth/gold/pose", message: POSE_STAMPED },
    Topic { name: "/truth/green/pose", message: POSE_STAMPED },
    Topic { name: "/truth/gold/joints", message: JOINT_STATE },
    Topic { name: "/truth/green/joints", message: JOINT_STATE },
];

/// Where a bag has its metadata.
pub(crate) const METADATA_TOPIC: Topic = Topic { name: "/ravenpose/metadata", message: KEY_VALUE };

const FRAMES: [&str; 2] = ["gold/frame_0", "green/frame_0"];
const JOINT_NAMES: [&str; JOINTS] = ["shoulder", "elbow", "insertion", "tool_roll", "wrist", "grasp_1", "grasp_2"];

/// The topic of an arm's true pose or joints.
pub(super) fn truth_topic(side: Side, of_joints: bool) -> &'static str {
    TOPICS[if of_joints { JOINT } else { POSE }[side.index()]].name
}

/// A message on its way into a file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Message<'a> {
    /// Index into [`TOPICS`].
    pub(crate) topic: usize,
    /// Counts up per record of a kind.
    pub(crate) sequence: u32,
    /// ns since 1970.
    pub(crate) time_ns: u64,
    pub(crate) bytes: &'a [u8],
}

/// Why a record cannot be kept without loss.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Unfit {
    #[error("a state is torn or of another layout (version, size or guard words)")]
    Torn,
    #[error("a state has something in its reserved word")]
    Reserved,
    #[error("a truth has the time {0} ns, a ROS time is from 1970 to 2106")]
    Time(i64),
}

/// Topic of a camera's images.
pub fn camera_topic(camera: &str) -> String {
    format!("/camera/{camera}/compressed")
}

/// Turns records into messages. Truths are numbered: pose and joints of one truth have one number.
#[derive(Debug, Default)]
pub(crate) struct Emitter {
    truths: u32,
    bytes: Vec<u8>,
}

impl Emitter {
    /// Sends the messages of a record; the outer result says whether the record can be kept at all, and then nothing was sent.
    pub(crate) fn emit<E>(
        &mut self,
        record: &Record,
        mut send: impl FnMut(Message<'_>) -> Result<(), E>,
    ) -> Result<Result<(), E>, Unfit> {
        match record {
            Record::State(state) => {
                state.admit().map_err(|_| Unfit::Torn)?;
                if state.reserved != 0 {
                    return Err(Unfit::Reserved);
                }
                // The origin goes first: whoever reads the state then has all of it.
                let time_ns = record.time_ns() as u64;
                let sequence = state.sequence as u32;
                self.bytes.clear();
                StateOrigin::of(state).encode(&mut self.bytes);
                let sent = send(Message { topic: ORIGIN, sequence, time_ns, bytes: &self.bytes });
                self.bytes.clear();
                encode_state(state, &mut self.bytes);
                Ok(sent.and_then(|()| send(Message { topic: STATE, sequence, time_ns, bytes: &self.bytes })))
            }
            Record::Truth(truth) => {
                let header = self.truth_header(truth)?;
                Ok(self.emit_truth(truth, header, send))
            }
        }
    }

    fn truth_header(&self, truth: &Truth) -> Result<Header, Unfit> {
        let whole = u32::try_from(truth.time_ns.div_euclid(NS_PER_S)).map_err(|_| Unfit::Time(truth.time_ns))?;
        Ok(Header { seq: self.truths, stamp_sec: whole, stamp_nsec: truth.time_ns.rem_euclid(NS_PER_S) as u32 })
    }

    fn emit_truth<E>(
        &mut self,
        truth: &Truth,
        header: Header,
        mut send: impl FnMut(Message<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let side = truth.side.index();
        let (sequence, time_ns) = (self.truths, truth.time_ns as u64);
        self.truths = self.truths.wrapping_add(1);
        let joints_known = !(is_unknown(&truth.joints) && is_unknown(&truth.cable_force_n));
        // A truth of which nothing is known is a pose of NaN: it must stand somewhere.
        if !(joints_known && is_unknown(&truth.position_m) && is_unknown(&truth.quaternion_wxyz)) {
            self.bytes.clear();
            let pose = PoseStamped { header, position_m: truth.position_m, quaternion_wxyz: truth.quaternion_wxyz };
            pose.encode(FRAMES[side], &mut self.bytes);
            send(Message { topic: POSE[side], sequence, time_ns, bytes: &self.bytes })?;
        }
        if joints_known {
            self.bytes.clear();
            let known = |values: &[f64]| if is_unknown(values) { Vec::new() } else { values.to_vec() };
            let joints =
                JointState { header, position: known(&truth.joints), velocity: Vec::new(), effort: known(&truth.cable_force_n) };
            joints.encode(&JOINT_NAMES, &mut self.bytes);
            send(Message { topic: JOINT[side], sequence, time_ns, bytes: &self.bytes })?;
        }
        Ok(())
    }
}

const NS_PER_S: i64 = 1_000_000_000;

/// All as [`Truth::unknown`] has them; compared as bits, so that any other NaN is kept as it is.
fn is_unknown(values: &[f64]) -> bool {
    values.iter().all(|value| value.to_bits() == f64::NAN.to_bits())
}
