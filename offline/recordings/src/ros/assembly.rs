//! Messages as records.

use std::collections::VecDeque;

use arm::{JOINTS, Side};

use super::bytes::{Header, METADATA_MAX, MessageError};
use super::definitions::{COMPRESSED_IMAGE, JOINT_STATE, KEY_VALUE, MessageType, POSE_STAMPED, RAVEN_STATE, STATE_ORIGIN};
use super::emission::{METADATA_TOPIC, camera_topic, truth_topic};
use super::layout::{DefinitionError, Layout};
use super::messages::{CompressedImage, JointState, PoseStamped, StateOrigin, decode_pair};
use super::state::StateDecoder;
use crate::stream::{Record, Truth};

/// Topic of the lab's encoders at joints 1 to 3 (ravenstate.md, section 3).
const EXTERNAL_JOINTS: &str = "/ext_jpos";
/// Joints that those measure.
const EXTERNAL_COUNT: usize = 3;

/// Measured joints that wait for the first state at most: half a minute at 1 kHz.
const EARLY_MAX: usize = 30_000;
/// What a pair takes up beside its text.
const PAIR_BYTES: usize = 2 * size_of::<String>();

/// What the messages of a channel are to us.
#[derive(Debug, Clone)]
pub(crate) enum Role {
    State(StateDecoder),
    Origin,
    Pose(Side),
    Joints(Side),
    ExternalJoints,
    Metadata,
    /// Of the camera whose topic this is.
    Image(String),
}

impl Role {
    /// That of a channel; none where we have no use for it.
    pub(crate) fn of(topic: &str, type_name: &str, definition: &str) -> Result<Option<Self>, DefinitionError> {
        if type_name == RAVEN_STATE.name {
            return StateDecoder::of_definition(definition).map(|decoder| Some(Self::State(decoder)));
        }
        if type_name == COMPRESSED_IMAGE.name {
            // Another definition of it is somebody else's: no reason to refuse the states.
            let ours = compare(type_name, definition, COMPRESSED_IMAGE.definition).is_ok();
            return Ok(ours.then(|| Self::Image(topic.to_owned())));
        }
        let Some((known, role)) = Self::known(topic, type_name) else { return Ok(None) };
        if definition != known.definition {
            compare(type_name, definition, known.definition)?;
        }
        Ok(Some(role))
    }

    fn known(topic: &str, type_name: &str) -> Option<(MessageType, Self)> {
        if type_name == STATE_ORIGIN.name {
            return Some((STATE_ORIGIN, Self::Origin));
        }
        if type_name == KEY_VALUE.name && topic == METADATA_TOPIC.name {
            return Some((KEY_VALUE, Self::Metadata));
        }
        if type_name == JOINT_STATE.name && topic == EXTERNAL_JOINTS {
            return Some((JOINT_STATE, Self::ExternalJoints));
        }
        [Side::Gold, Side::Green].into_iter().find_map(|side| match type_name {
            name if name == POSE_STAMPED.name && topic == truth_topic(side, false) => Some((POSE_STAMPED, Self::Pose(side))),
            name if name == JOINT_STATE.name && topic == truth_topic(side, true) => Some((JOINT_STATE, Self::Joints(side))),
            _ => None,
        })
    }
}

/// Refuses a definition that has not exactly the fields that are needed.
fn compare(type_name: &str, definition: &str, needed: &str) -> Result<(), DefinitionError> {
    let (found, needed) = (Layout::parse(type_name, definition)?.flat(), Layout::parse(type_name, needed)?.flat());
    for (index, (name, kind)) in needed.iter().enumerate() {
        if found.get(index).is_none_or(|field| (&field.0, &field.1) != (name, kind)) {
            return Err(DefinitionError::Missing(format!("{kind} {name} as field {} of {type_name}", index + 1)));
        }
    }
    match found.get(needed.len()) {
        None => Ok(()),
        Some((name, _)) => Err(DefinitionError::Missing(format!("an end of {type_name} before its field {name}"))),
    }
}

/// Refuses, by name, states in an encoding that is not ROS 1.
pub(crate) fn admit_encoding(topic: &str, type_name: &str, encoding: &str) -> Result<(), String> {
    let is_state =
        type_name.starts_with("raven_2/") || ["/ravenstate", "/ravenstate_100hz", "raven_state", "ravenstate"].contains(&topic);
    if !is_state || encoding == "ros1" || encoding == "ros1msg" {
        return Ok(());
    }
    let of = if encoding == "cdr" || encoding == "ros2msg" { " (ROS 2)" } else { "" };
    Err(format!("topic {topic} of type {type_name} is encoded as {encoding}{of}, not as ros1"))
}

/// Puts records together: a state with its origin, the pose and the joints of one truth.
#[derive(Debug, Default)]
pub(crate) struct Assembler {
    ready: VecDeque<Record>,
    origin: Option<StateOrigin>,
    /// A true pose whose joints may follow, and its number.
    pose: Option<(Truth, u32)>,
    states: u64,
    first_ns: Option<i64>,
    /// Arms of the last state.
    arms: u32,
    /// Joints measured before the first state, which says whose they are.
    early: VecDeque<Truth>,
    metadata: Vec<(String, String)>,
    metadata_bytes: usize,
    /// Topic of the images that are wanted, and those that are ready, with their times in ns.
    camera: Option<String>,
    images: VecDeque<(i64, Vec<u8>)>,
}

impl Assembler {
    /// The next complete record.
    pub(crate) fn next(&mut self) -> Option<Record> {
        self.ready.pop_front()
    }

    /// From here on the images of a camera are kept; without it none are.
    pub(crate) fn want_images(&mut self, camera: &str) {
        self.camera = Some(camera_topic(camera));
    }

    /// The next image of that camera and its time, ns.
    pub(crate) fn next_image(&mut self) -> Option<(i64, Vec<u8>)> {
        self.images.pop_front()
    }

    /// Pairs so far.
    pub(crate) fn metadata(&self) -> &[(String, String)] {
        &self.metadata
    }

    /// Keeps a pair.
    pub(crate) fn take_pair(&mut self, key: String, value: String) -> Result<(), MessageError> {
        self.metadata_bytes += key.len() + value.len() + PAIR_BYTES;
        if self.metadata_bytes > METADATA_MAX {
            return Err(MessageError::TooMuchMetadata);
        }
        self.metadata.push((key, value));
        Ok(())
    }

    /// Nothing follows: what waits is complete.
    pub(crate) fn end(&mut self) {
        self.complete_pose();
        self.give_early();
    }

    fn complete_pose(&mut self) {
        if let Some((truth, _)) = self.pose.take() {
            self.ready.push_back(Record::Truth(truth));
        }
    }

    /// Takes a message; `time_ns` is the one that the file gives it.
    pub(crate) fn take(&mut self, role: &Role, time_ns: u64, bytes: &[u8]) -> Result<(), MessageError> {
        match role {
            Role::State(decoder) => self.take_state(decoder, time_ns, bytes),
            Role::Origin => {
                self.origin = Some(StateOrigin::decode(bytes)?);
                Ok(())
            }
            Role::Pose(side) => {
                let pose = PoseStamped::decode(bytes)?;
                self.complete_pose();
                let known = Truth::unknown(stamp(pose.header, time_ns), *side);
                let truth = Truth { position_m: pose.position_m, quaternion_wxyz: pose.quaternion_wxyz, ..known };
                self.pose = Some((truth, pose.header.seq));
                Ok(())
            }
            Role::Joints(side) => self.take_joints(*side, time_ns, bytes),
            Role::ExternalJoints => self.take_external(time_ns, bytes),
            Role::Image(topic) => {
                if self.camera.as_ref() == Some(topic) {
                    let image = CompressedImage::decode(bytes)?;
                    self.images.push_back((stamp(image.header, time_ns), image.data));
                }
                Ok(())
            }
            Role::Metadata => {
                let (key, value) = decode_pair(bytes)?;
                self.take_pair(key, value)
            }
        }
    }

    fn take_state(&mut self, decoder: &StateDecoder, time_ns: u64, bytes: &[u8]) -> Result<(), MessageError> {
        let mut state = decoder.decode(bytes)?;
        self.states += 1;
        let origin = self.origin.take().filter(|origin| origin.fits(&state));
        // As for all other messages; the origin knows the header as it came.
        let header = stamped(StateOrigin::of(&state).header, time_ns);
        (state.hdr_stamp_sec, state.hdr_stamp_nsec) = (header.stamp_sec, header.stamp_nsec);
        if let Some(origin) = origin {
            origin.put_into(&mut state);
        } else {
            state.seal(self.states);
            let stamp_ns = header.time_ns();
            state.source_time_ns = stamp_ns - *self.first_ns.get_or_insert(stamp_ns);
        }
        self.arms = state.connected();
        self.complete_pose();
        self.give_early();
        self.ready.push_back(Record::State(Box::new(state)));
        Ok(())
    }

    fn take_joints(&mut self, side: Side, time_ns: u64, bytes: &[u8]) -> Result<(), MessageError> {
        let message = JointState::decode(bytes)?;
        let time_ns = stamp(message.header, time_ns);
        let mut truth = match self.pose.take() {
            Some((truth, seq)) if truth.side == side && truth.time_ns == time_ns && seq == message.header.seq => truth,
            other => {
                self.pose = other;
                self.complete_pose();
                Truth::unknown(time_ns, side)
            }
        };
        copy("position", &message.position, &mut truth.joints)?;
        copy("effort", &message.effort, &mut truth.cable_force_n)?;
        self.ready.push_back(Record::Truth(truth));
        Ok(())
    }

    /// The message does not say which arm: it is the connected one, or gold where both are.
    fn take_external(&mut self, time_ns: u64, bytes: &[u8]) -> Result<(), MessageError> {
        let message = JointState::decode(bytes)?;
        let mut truth = Truth::unknown(stamp(message.header, time_ns), self.connected_side());
        let measured = message.position.len().min(EXTERNAL_COUNT);
        copy("position", &message.position[..measured], &mut truth.joints)?;
        self.complete_pose();
        if self.states == 0 && self.early.len() < EARLY_MAX {
            self.early.push_back(truth);
        } else {
            self.give_early();
            self.ready.push_back(Record::Truth(truth));
        }
        Ok(())
    }

    fn connected_side(&self) -> Side {
        if self.arms == 2 { Side::Green } else { Side::Gold }
    }

    fn give_early(&mut self) {
        let side = self.connected_side();
        self.ready.extend(self.early.drain(..).map(|truth| Record::Truth(Truth { side, ..truth })));
    }
}

fn copy(field: &'static str, from: &[f64], to: &mut [f64; JOINTS]) -> Result<(), MessageError> {
    if from.len() > JOINTS {
        return Err(MessageError::TooMany { field, found: from.len(), most: JOINTS });
    }
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
    Ok(())
}

/// A header with a time: its own, or where that was never set the file's.
fn stamped(header: Header, time_ns: u64) -> Header {
    if header.stamp_sec == 0 && header.stamp_nsec == 0 { Header::at(header.seq, time_ns) } else { header }
}

/// Time of a message, ns since 1970.
fn stamp(header: Header, time_ns: u64) -> i64 {
    stamped(header, time_ns).time_ns()
}
