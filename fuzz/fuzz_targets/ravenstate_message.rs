//! Any bytes as a message definition and a message.
#![no_main]

use libfuzzer_sys::fuzz_target;
use recordings::ros::{JointState, PoseStamped, STATE_BYTES, StateDecoder, StateOrigin, decode_state, encode_state};

fuzz_target!(|data: &[u8]| {
    let Some((length, rest)) = data.split_first_chunk() else { return };
    let Some((definition, message)) = rest.split_at_checked(usize::from(u16::from_le_bytes(*length))) else { return };
    if definition.is_empty() {
        published(message);
    } else if let Ok(decoder) = StateDecoder::of_definition(&String::from_utf8_lossy(definition)) {
        let _ = decoder.decode(message);
    }
});

/// What is read is written again byte for byte, where no frame name was passed over.
fn published(message: &[u8]) {
    if let Ok(state) = decode_state(message) {
        let mut bytes = Vec::new();
        encode_state(&state, &mut bytes);
        assert_eq!(bytes.len(), STATE_BYTES);
        assert!(bytes[..12] == message[..12] && bytes[16..] == message[message.len() - (STATE_BYTES - 16)..]);
    }
    if let Ok(origin) = StateOrigin::decode(message) {
        let mut bytes = Vec::new();
        origin.encode(&mut bytes);
        assert!(bytes[16..] == message[message.len() - (bytes.len() - 16)..]);
    }
    let _ = PoseStamped::decode(message);
    if let Ok(joints) = JointState::decode(message) {
        assert!(8 * (joints.position.len() + joints.velocity.len() + joints.effort.len()) <= message.len());
    }
}
