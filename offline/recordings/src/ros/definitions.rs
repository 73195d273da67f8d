//! The message definitions that this program writes, as text, with the MD5 that ROS computes of them (`tests/ros_codec.rs`
//! computes it again). Types that a definition uses stand behind it, as in a bag's connection record and an MCAP schema.

/// A message type with all that a bag or an MCAP file says about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MessageType {
    /// `package/Type`.
    pub name: &'static str,
    /// MD5 of the definition, as `rosmsg md5` prints it.
    pub md5: &'static str,
    /// The definition and those of the types that it uses.
    pub definition: &'static str,
}

macro_rules! with_header {
    ($($text:literal),+ $(,)?) => {
        concat!(
            $($text),+,
            "================================================================================\n",
            "MSG: std_msgs/Header\n",
            "uint32 seq\n",
            "time stamp\n",
            "string frame_id\n",
        )
    };
}

/// RAVEN's state (ravenstate.md, section 1; uw-biorobotics/raven2, `msg/raven_state.msg`).
pub const RAVEN_STATE: MessageType = MessageType {
    name: "raven_2/raven_state",
    md5: "ce9e7f4969049d8bb365de3c98461a01",
    definition: with_header!(
        "Header hdr\n",
        "int32 runlevel\n",
        "int32 sublevel\n",
        "int32 last_seq\n",
        "int32[2] type\n",
        "int32[6] pos\n",
        "float32[18] ori\n",
        "float32[18] ori_d\n",
        "int32[6] pos_d\n",
        "duration dt\n",
        "int32[16] encVals\n",
        "int32[16] dac_val\n",
        "float32[16] tau\n",
        "float32[16] mpos\n",
        "float32[16] jpos\n",
        "float32[16] mvel\n",
        "float32[16] jvel\n",
        "float32[16] mpos_d\n",
        "float32[16] jpos_d\n",
        "float32[2] grasp_d\n",
        "float32[16] encoffsets\n",
        "float32[12] jac_vel\n",
        "float32[12] jac_f\n",
    ),
};

/// What ravenpose knows of a state beyond [`RAVEN_STATE`]; see [`super::StateOrigin`].
pub const STATE_ORIGIN: MessageType = MessageType {
    name: "ravenpose/StateOrigin",
    md5: "93d84dacab8efbe9ea18608f4e66aca6",
    definition: with_header!(
        "# Stands directly before the raven_2/raven_state with the same header.\n",
        "Header header\n",
        "# Which run of the control process.\n",
        "uint64 source_id\n",
        "# Counts control cycles, from 1.\n",
        "uint64 sequence\n",
        "# CLOCK_MONOTONIC of the control cycle, ns.\n",
        "int64 source_time_ns\n",
        "# Bit 0: gold arm connected, bit 1: green arm connected.\n",
        "uint32 arms\n",
    ),
};

/// A pose, here of a tip in m.
pub const POSE_STAMPED: MessageType = MessageType {
    name: "geometry_msgs/PoseStamped",
    md5: "d3812c3cbc69362b77dc0b19b345f8f5",
    definition: with_header!(
        "std_msgs/Header header\n",
        "geometry_msgs/Pose pose\n",
        "================================================================================\n",
        "MSG: geometry_msgs/Pose\n",
        "geometry_msgs/Point position\n",
        "geometry_msgs/Quaternion orientation\n",
        "================================================================================\n",
        "MSG: geometry_msgs/Point\n",
        "float64 x\n",
        "float64 y\n",
        "float64 z\n",
        "================================================================================\n",
        "MSG: geometry_msgs/Quaternion\n",
        "float64 x\n",
        "float64 y\n",
        "float64 z\n",
        "float64 w\n",
    ),
};

/// Joint positions, rad or m, and what drives them, N·m or N.
pub const JOINT_STATE: MessageType = MessageType {
    name: "sensor_msgs/JointState",
    md5: "3066dcd76a6cfaef579bd0f34173e9fd",
    definition: with_header!(
        "std_msgs/Header header\n",
        "string[] name\n",
        "float64[] position\n",
        "float64[] velocity\n",
        "float64[] effort\n",
    ),
};

/// An image as a file of its format, here the JPEG of a webcam.
pub const COMPRESSED_IMAGE: MessageType = MessageType {
    name: "sensor_msgs/CompressedImage",
    md5: "8f7a12909da2c9d3332d540a0977563f",
    definition: with_header!("std_msgs/Header header\n", "string format\n", "uint8[] data\n"),
};

/// A name and its value; bags have no other place for what MCAP calls metadata.
pub const KEY_VALUE: MessageType = MessageType {
    name: "diagnostic_msgs/KeyValue",
    md5: "cf57fdc6617a881a88c16e768132149c",
    definition: "string key\nstring value\n",
};
