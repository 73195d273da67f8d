//! ROS 1 messages: definitions, bytes, and how a stream of records stands in a file of messages. [`crate::mcap_file`] and
//! [`crate::rosbag_file`] are two containers of the same messages:
//!
//! | topic | type | content |
//! | --- | --- | --- |
//! | `/ravenstate` | `raven_2/raven_state` | the state as RAVEN publishes it |
//! | `/ravenstate/origin` | `ravenpose/StateOrigin` | before each state, what that message has no field for |
//! | `/truth/gold/pose`, `/truth/green/pose` | `geometry_msgs/PoseStamped` | true pose of the tip, m |
//! | `/truth/gold/joints`, `/truth/green/joints` | `sensor_msgs/JointState` | true joints (rad, joint 3 m), cable force (N) as effort |
//! | `/camera/NAME/compressed` | `sensor_msgs/CompressedImage` | images of a camera, JPEG ([`crate::mcap_file::ImageSource`]) |
//!
//! A bag also has `/ravenpose/metadata` (`diagnostic_msgs/KeyValue`), for which MCAP has records of its own.
//!
//! Read are also: states under another topic of that type (the first one of a file), by the definition in the file; and
//! `/ext_jpos` (`sensor_msgs/JointState`), the lab's encoders on joints 1 to 3 of the arm that is connected, of the gold one where
//! both are. States that no origin stands before are counted from 1 and have the time since the first of them as source time.

mod assembly;
mod bytes;
mod channel;
mod compression;
mod container;
mod definitions;
mod emission;
mod layout;
mod messages;
mod state;

pub use bytes::{Header, MessageError};
pub use definitions::{COMPRESSED_IMAGE, JOINT_STATE, KEY_VALUE, MessageType, POSE_STAMPED, RAVEN_STATE, STATE_ORIGIN};
pub use emission::camera_topic;
pub use layout::DefinitionError;
pub use messages::{CompressedImage, JointState, PoseStamped, StateOrigin};
pub use state::{STATE_BYTES, StateDecoder, decode_state, encode_state};

pub(crate) use assembly::{Assembler, admit_encoding};
pub(crate) use bytes::Cursor;
pub(crate) use channel::{KnownChannel, StateTopic};
pub(crate) use compression::{Compression, Decompressor, salvage};
pub(crate) use container::{CHANNELS_MAX, HELD_MAX, Stop, TEXT_MAX, damage, fill, refused, settle, unreadable};
pub(crate) use emission::{Emitter, METADATA_TOPIC, Message, TOPICS, Topic, Unfit};
pub(crate) use messages::encode_pair;
