//! The other messages: where a state comes from, poses, joint states.

use ravenpose_wire::RavenState;

use super::bytes::{Cursor, Header, MessageError, put_f64s, put_string};

/// What a [`RavenState`] has beyond the ROS message. Its message stands directly before the state with the same header, so
/// that a file keeps the whole state and other programs still see RAVEN's own message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StateOrigin {
    /// Header of the state that follows.
    pub header: Header,
    /// [`RavenState::source_id`].
    pub source_id: u64,
    /// [`RavenState::sequence`].
    pub sequence: u64,
    /// [`RavenState::source_time_ns`].
    pub source_time_ns: i64,
    /// [`RavenState::arms`].
    pub arms: u32,
}

impl StateOrigin {
    /// That of a state.
    pub const fn of(state: &RavenState) -> Self {
        Self {
            header: Header { seq: state.hdr_seq, stamp_sec: state.hdr_stamp_sec, stamp_nsec: state.hdr_stamp_nsec },
            source_id: state.source_id,
            sequence: state.sequence,
            source_time_ns: state.source_time_ns,
            arms: state.arms,
        }
    }

    /// Does it belong to this state?
    pub fn fits(&self, state: &RavenState) -> bool {
        self.header == Self::of(state).header
    }

    /// Gives a state what the message could not hold, and seals it.
    pub fn put_into(&self, state: &mut RavenState) {
        state.source_id = self.source_id;
        state.source_time_ns = self.source_time_ns;
        state.arms = self.arms;
        state.seal(self.sequence);
    }

    /// Appends it as bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        self.header.put(out, "");
        out.extend_from_slice(&self.source_id.to_le_bytes());
        out.extend_from_slice(&self.sequence.to_le_bytes());
        out.extend_from_slice(&self.source_time_ns.to_le_bytes());
        out.extend_from_slice(&self.arms.to_le_bytes());
    }

    /// Reads it.
    ///
    /// # Errors
    /// [`MessageError`] where the message is too short or too long, with the byte.
    pub fn decode(bytes: &[u8]) -> Result<Self, MessageError> {
        let mut cursor = Cursor::new(bytes);
        let origin = Self {
            header: Header::take(&mut cursor)?,
            source_id: cursor.u64("source_id")?,
            sequence: cursor.u64("sequence")?,
            source_time_ns: cursor.i64("source_time_ns")?,
            arms: cursor.u32("arms")?,
        };
        cursor.end()?;
        Ok(origin)
    }
}

/// `geometry_msgs/PoseStamped`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseStamped {
    /// Header; its frame name is not kept.
    pub header: Header,
    /// Position, m.
    pub position_m: [f64; 3],
    /// Rotation: w, x, y, z (the message has w last).
    pub quaternion_wxyz: [f64; 4],
}

impl PoseStamped {
    /// Appends it as bytes.
    pub fn encode(&self, frame: &str, out: &mut Vec<u8>) {
        self.header.put(out, frame);
        let [w, x, y, z] = self.quaternion_wxyz;
        for value in self.position_m.into_iter().chain([x, y, z, w]) {
            out.extend_from_slice(&value.to_le_bytes());
        }
    }

    /// Reads it.
    ///
    /// # Errors
    /// [`MessageError`] where the message is too short or too long, with the byte.
    pub fn decode(bytes: &[u8]) -> Result<Self, MessageError> {
        let mut cursor = Cursor::new(bytes);
        let header = Header::take(&mut cursor)?;
        let mut numbers = [0.0; 7];
        for number in &mut numbers {
            *number = cursor.f64("pose")?;
        }
        cursor.end()?;
        let [px, py, pz, x, y, z, w] = numbers;
        Ok(Self { header, position_m: [px, py, pz], quaternion_wxyz: [w, x, y, z] })
    }
}

/// `sensor_msgs/CompressedImage`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CompressedImage {
    /// Header; its frame name is not kept.
    pub header: Header,
    /// A file's content in the format that the message names.
    pub data: Vec<u8>,
}

impl CompressedImage {
    /// Appends it as bytes, as JPEG; `frame` is the camera.
    pub fn encode(&self, frame: &str, out: &mut Vec<u8>) {
        self.header.put(out, frame);
        put_string(out, "jpeg");
        out.extend_from_slice(&(self.data.len() as u32).to_le_bytes());
        out.extend_from_slice(&self.data);
    }

    /// Reads it.
    ///
    /// # Errors
    /// [`MessageError`] where the message is too short or too long, with the byte.
    pub fn decode(bytes: &[u8]) -> Result<Self, MessageError> {
        let mut cursor = Cursor::new(bytes);
        let header = Header::take(&mut cursor)?;
        let _format = cursor.string("format")?;
        // As text: a count and so many bytes.
        let data = cursor.string("data")?.to_vec();
        cursor.end()?;
        Ok(Self { header, data })
    }
}

/// `sensor_msgs/JointState`; an array is empty where nothing is known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JointState {
    /// Header; its frame name is not kept.
    pub header: Header,
    /// Positions, rad or m.
    pub position: Vec<f64>,
    /// Speeds, rad/s or m/s.
    pub velocity: Vec<f64>,
    /// Torques or forces, N·m or N.
    pub effort: Vec<f64>,
}

impl JointState {
    /// Appends it as bytes, with names of the joints.
    pub fn encode(&self, names: &[&str], out: &mut Vec<u8>) {
        self.header.put(out, "");
        out.extend_from_slice(&(names.len() as u32).to_le_bytes());
        for name in names {
            put_string(out, name);
        }
        for values in [&self.position, &self.velocity, &self.effort] {
            put_f64s(out, values);
        }
    }

    /// Reads it; the names are stepped over.
    ///
    /// # Errors
    /// [`MessageError`] where the message is too short or too long, with the byte.
    pub fn decode(bytes: &[u8]) -> Result<Self, MessageError> {
        let mut cursor = Cursor::new(bytes);
        let header = Header::take(&mut cursor)?;
        for _ in 0..cursor.u32("name")? {
            let _name = cursor.string("name")?;
        }
        let (position, velocity, effort) = (cursor.f64s("position")?, cursor.f64s("velocity")?, cursor.f64s("effort")?);
        cursor.end()?;
        Ok(Self { header, position, velocity, effort })
    }
}

/// Appends a pair as `diagnostic_msgs/KeyValue`.
pub(crate) fn encode_pair(key: &str, value: &str, out: &mut Vec<u8>) {
    put_string(out, key);
    put_string(out, value);
}

/// Reads `diagnostic_msgs/KeyValue`.
pub(crate) fn decode_pair(bytes: &[u8]) -> Result<(String, String), MessageError> {
    let mut cursor = Cursor::new(bytes);
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    let pair = (text(cursor.string("key")?), text(cursor.string("value")?));
    cursor.end()?;
    Ok(pair)
}
