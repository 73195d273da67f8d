//! ROS 1 messages: the definitions have the MD5 that ROS gives them, bytes stand where ravenstate.md says, and whatever else
//! comes is refused with the byte.

#[path = "common/records.rs"]
mod records;

use md5::{Digest, Md5};
use ravenpose_wire::RavenState;
use recordings::ros::{
    COMPRESSED_IMAGE, DefinitionError, Header, JOINT_STATE, JointState, KEY_VALUE, MessageError, MessageType, POSE_STAMPED,
    PoseStamped, RAVEN_STATE, STATE_BYTES, STATE_ORIGIN, StateDecoder, StateOrigin, decode_state, encode_state,
};
use records::Random;

/// MD5 as ROS computes it (wiki.ros.org/ROS/Technical Overview): one line `type name` per field, the type of a message replaced
/// by its MD5. Our definitions have no constants.
fn ros_md5(name: &str, sections: &[(&str, &str)]) -> String {
    let text = |name: &str| sections.iter().find(|(full, _)| *full == name).map(|(_, text)| *text);
    let lines: Vec<String> = text(name)
        .expect("section")
        .lines()
        .map(|line| line.split('#').next().unwrap_or_default().trim())
        .filter(|line| !line.is_empty())
        .map(|line| {
            let (kind, field) = line.split_once(' ').expect("type and name");
            let full = if kind == "Header" { "std_msgs/Header" } else { kind };
            if text(full).is_some() { format!("{} {field}", ros_md5(full, sections)) } else { line.to_owned() }
        })
        .collect();
    Md5::digest(lines.join("\n"))
        .iter()
        .flat_map(|byte| [byte >> 4, byte & 15])
        .map(|digit| char::from_digit(digit.into(), 16).expect("digit"))
        .collect()
}

/// A definition's main type and those that it uses.
fn sections<'a>(name: &'a str, definition: &'a str) -> Vec<(&'a str, &'a str)> {
    let separator = "=".repeat(80);
    let (main, used) = definition.split_once(&separator).unwrap_or((definition, ""));
    let used = used.split("MSG: ").skip(1).map(|text| text.split_once('\n').expect("name"));
    std::iter::once((name, main)).chain(used.map(|(name, text)| (name, text.split('=').next().unwrap_or_default()))).collect()
}

#[test]
fn the_definitions_have_the_md5_that_ros_gives_them() {
    // RAVEN's: ravenstate.md, section 1; the others': ROS's own message files.
    assert_eq!(RAVEN_STATE.md5, "ce9e7f4969049d8bb365de3c98461a01");
    for MessageType { name, md5, definition } in [RAVEN_STATE, STATE_ORIGIN, POSE_STAMPED, JOINT_STATE, COMPRESSED_IMAGE, KEY_VALUE]
    {
        assert_eq!(ros_md5(name, &sections(name, definition)), md5, "{name}");
    }
}

fn encoded(state: &RavenState) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode_state(state, &mut bytes);
    bytes
}

type Place = fn(&mut RavenState) -> &mut f32;

#[test]
fn every_field_stands_at_the_byte_of_the_specification() {
    let state = RavenState {
        hdr_seq: 1,
        hdr_stamp_sec: 2,
        hdr_stamp_nsec: 3,
        runlevel: 4,
        sublevel: 5,
        last_seq: 6,
        type_: [7, 0],
        pos: [8, 0, 0, 0, 0, 0],
        pos_d: [11, 0, 0, 0, 0, 0],
        dt_sec: 12,
        dt_nsec: 13,
        enc_vals: std::array::from_fn(|i| if i == 0 { 14 } else { 0 }),
        dac_val: std::array::from_fn(|i| if i == 0 { 15 } else { 0 }),
        ..RavenState::new()
    };
    let bytes = encoded(&state);
    assert_eq!(bytes.len(), STATE_BYTES);
    let expected = [
        (0, 1),
        (4, 2),
        (8, 3),
        (16, 4),
        (20, 5),
        (24, 6),
        (28, 7),
        (36, 8),
        (204, 11),
        (228, 12),
        (232, 13),
        (236, 14),
        (300, 15),
    ];
    for (offset, value) in expected {
        assert_eq!(bytes[offset..offset + 4], i32::to_le_bytes(value), "byte {offset}");
    }
    assert_eq!(bytes.iter().filter(|byte| **byte != 0).count(), expected.len());
    let floats: [(usize, Place); 13] = [
        (60, |s| &mut s.ori[0]),
        (132, |s| &mut s.ori_d[0]),
        (364, |s| &mut s.tau[0]),
        (428, |s| &mut s.mpos[0]),
        (492, |s| &mut s.jpos[0]),
        (556, |s| &mut s.mvel[0]),
        (620, |s| &mut s.jvel[0]),
        (684, |s| &mut s.mpos_d[0]),
        (748, |s| &mut s.jpos_d[0]),
        (812, |s| &mut s.grasp_d[0]),
        (820, |s| &mut s.encoffsets[0]),
        (884, |s| &mut s.jac_vel[0]),
        (932, |s| &mut s.jac_f[0]),
    ];
    for (offset, place) in floats {
        let mut state = RavenState::new();
        *place(&mut state) = 1.5;
        let bytes = encoded(&state);
        assert_eq!(bytes[offset..offset + 4], 1.5_f32.to_le_bytes(), "byte {offset}");
        assert_eq!(bytes.iter().filter(|byte| **byte != 0).count(), 2);
    }
}

#[test]
fn a_state_comes_back_bit_for_bit() {
    let mut random = Random(1);
    for _ in 0..2_000 {
        let state = random.state();
        let bytes = encoded(&state);
        let mut origin = Vec::new();
        StateOrigin::of(&state).encode(&mut origin);
        let mut back = decode_state(&bytes).expect("own bytes");
        let origin = StateOrigin::decode(&origin).expect("own bytes");
        assert!(origin.fits(&back));
        origin.put_into(&mut back);
        assert_eq!(encoded(&back), bytes);
        assert_eq!(StateOrigin::of(&back), StateOrigin::of(&state));
        assert_eq!(
            (back.version, back.size, back.guard_head, back.guard_tail),
            (state.version, state.size, state.sequence, state.sequence)
        );
    }
}

#[test]
fn a_short_message_is_refused_with_the_byte_and_the_field() {
    let bytes = encoded(&Random(2).state());
    for length in 0..bytes.len() {
        match decode_state(&bytes[..length]) {
            Err(MessageError::Short { end, at, needed, .. }) => assert!(end == length && at <= length && at + needed > length),
            other => panic!("{length}: {other:?}"),
        }
    }
    let error = decode_state(&bytes[..300]).expect_err("cut before dac_val");
    assert_eq!(error.to_string(), "the message ends at byte 300, its field dac_val at byte 300 needs 64 bytes");
}

#[test]
fn trailing_bytes_are_refused_with_the_byte() {
    let mut bytes = encoded(&Random(3).state());
    bytes.extend_from_slice(&[0; 5]);
    assert_eq!(decode_state(&bytes), Err(MessageError::Trailing { at: 980, extra: 5 }));
}

#[test]
fn a_frame_name_shifts_what_follows() {
    let state = Random(4).state();
    let mut bytes = encoded(&state);
    bytes[12] = 5;
    let _ = bytes.splice(16..16, *b"frame");
    let mut back = decode_state(&bytes).expect("with a frame name");
    StateOrigin::of(&state).put_into(&mut back);
    assert_eq!(encoded(&back), encoded(&state));
    bytes[15] = 0xff;
    assert!(matches!(decode_state(&bytes), Err(MessageError::Short { at: 16, .. })));
}

#[test]
fn an_arm_is_connected_where_its_board_or_anything_of_it_is_not_zero() {
    let arms = |change: fn(&mut RavenState)| {
        let mut state = RavenState::new();
        change(&mut state);
        decode_state(&encoded(&state)).expect("own bytes").arms
    };
    assert_eq!(arms(|_| {}), 0);
    assert_eq!(arms(|state| state.runlevel = 3), 0);
    assert_eq!(arms(|state| state.type_[0] = 49), 1);
    assert_eq!(arms(|state| state.type_ = [49, 22]), 3);
    assert_eq!(arms(|state| state.jac_f[6] = f32::NAN), 2);
    assert_eq!(arms(|state| (state.type_[1], state.enc_vals[3]) = (22, 1)), 3);
    assert_eq!(arms(|state| state.tau[0] = -0.0), 0);
}

/// The definition with its lines in another order, and more between them.
fn shuffled() -> (String, Vec<usize>) {
    let (main, header) = RAVEN_STATE.definition.split_once('=').expect("sections");
    let mut order: Vec<usize> = (0..main.lines().count()).collect();
    let mut random = Random(5);
    order.sort_by_cached_key(|_| random.next());
    let lines: Vec<&str> = main.lines().collect();
    let begin = "# another version\nint32 VERSION=3\nstring   note # why\n".to_owned();
    let between = order.iter().map(|index| {
        let line = lines[*index].replacen(' ', "\t ", 1);
        format!("{line}   # a field\ngeometry_msgs/Point[] more_{index}\nchar[10] err_{index}\n")
    });
    let end = format!("={header}{}\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n", "=".repeat(80));
    let text = std::iter::once(begin).chain(between).chain([end]).collect();
    (text, order)
}

#[test]
fn another_order_and_more_fields_are_read_by_the_definition() {
    let state = Random(6).state();
    let bytes = encoded(&state);
    let sizes: Vec<usize> = [16, 4, 4, 4, 8, 24, 72, 72, 24, 8].into_iter().chain([64; 9]).chain([8, 64, 48, 48]).collect();
    let starts: Vec<usize> = sizes.iter().scan(0, |sum, size| Some(std::mem::replace(sum, *sum + size))).collect();
    let (definition, order) = shuffled();
    let mut other = vec![3, 0, 0, 0, b'a', b'b', b'c'];
    for (place, index) in order.iter().enumerate() {
        other.extend_from_slice(&bytes[starts[*index]..starts[*index] + sizes[*index]]);
        let points = place as u32 % 3;
        other.extend_from_slice(&points.to_le_bytes());
        other.resize(other.len() + 24 * points as usize + 10, 7);
    }
    let decoder = StateDecoder::of_definition(&definition).expect("all fields are there");
    let mut back = decoder.decode(&other).expect("readable");
    StateOrigin::of(&state).put_into(&mut back);
    assert_eq!(encoded(&back), bytes);
    for length in 0..other.len() {
        assert!(matches!(decoder.decode(&other[..length]), Err(MessageError::Short { .. })), "{length}");
    }
}

#[test]
fn a_definition_that_lacks_fields_is_refused_by_their_names() {
    // CSLDepend/raven2_sim, msg/raven_state.msg (ravenstate.md, section 1, trap 8).
    let definition = "Header hdr\nint32 runlevel\nint32 sublevel\nint32 last_seq\nint32[2] type\nint32[6] pos\nfloat32[18] ori\n\
        float32[18] ori_d\nint32[6] pos_d\nduration dt\nint32[16] encVals\nfloat32[16] tau\nfloat32[16] mpos\nfloat32[16] jpos\n\
        float32[16] mvel\nfloat32[16] mvel_d\nfloat32[16] jvel\nfloat32[16] mpos_d\nfloat32[16] jpos_d\nfloat32[2] grasp_d\n\
        float32[16] encoffsets\nint32[16] current_cmd\nchar[1024] err_msg\nfloat32[3] sim_mpos\nfloat32[3] sim_mvel\n";
    let error = StateDecoder::of_definition(definition).expect_err("no dac_val");
    assert_eq!(error.to_string(), "lacks field dac_val, jac_vel, jac_f");
    let other = RAVEN_STATE.definition.replace("int32[16] dac_val", "float64[16] dac_val");
    let error = StateDecoder::of_definition(&other).expect_err("dac_val of another type");
    assert_eq!(error.to_string(), "has dac_val as float64[16], not as int32[16]");
    let twice = format!("int32 pos\n{}", RAVEN_STATE.definition);
    assert_eq!(StateDecoder::of_definition(&twice).expect_err("pos twice"), DefinitionError::Twice("pos".into()));
}

#[test]
fn a_definition_that_is_a_trap_is_refused() {
    let with = |more: &str| {
        StateDecoder::of_definition(&RAVEN_STATE.definition.replacen("Header hdr\n", &format!("Header hdr\n{more}"), 1))
    };
    let separator = "=".repeat(80);
    // In itself.
    let own =
        format!("{}{separator}\nMSG: a/A\na/A a\n", RAVEN_STATE.definition).replacen("Header hdr\n", "Header hdr\na/A a\n", 1);
    assert!(matches!(StateDecoder::of_definition(&own), Err(DefinitionError::TooLarge(_))));
    // Ten types, each of ten of the next.
    let begin = RAVEN_STATE.definition.replacen("Header hdr\n", "Header hdr\na/A0 a\n", 1);
    let types = (0..10).map(|depth| {
        let fields: Vec<String> = (0..10).map(|field| format!("a/A{} f{field}", depth + 1)).collect();
        format!("{separator}\nMSG: a/A{depth}\n{}\n", fields.join("\n"))
    });
    let wide: String = std::iter::once(begin).chain(types).chain([format!("{separator}\nMSG: a/A10\nint8 x\n")]).collect();
    assert!(matches!(StateDecoder::of_definition(&wide), Err(DefinitionError::TooLarge(_))));
    assert!(matches!(with("int8[99999999999] x\n"), Err(DefinitionError::TooLarge(_))));
    assert!(matches!(with("int8[999999999999999999999] x\n"), Err(DefinitionError::UnknownType(_))));
    assert!(matches!(with("nowhere/Type x\n"), Err(DefinitionError::UnknownType(_))));
    assert!(matches!(with("int8[ x\n"), Err(DefinitionError::UnknownType(_))));
    assert!(matches!(with("nonsense\n"), Err(DefinitionError::Line { line: 2, .. })));
    assert!(matches!(StateDecoder::of_definition(&" ".repeat(2 << 20)), Err(DefinitionError::TextTooLong(_))));
}

#[test]
fn an_array_of_a_huge_number_of_nothing_ends() {
    let definition = format!("a/Empty[] nothing\nstring[] words\n{}{}\nMSG: a/Empty\n", RAVEN_STATE.definition, "=".repeat(80));
    let decoder = StateDecoder::of_definition(&definition).expect("a type without fields");
    let state = Random(7).state();
    let message = |nothings: u32, words: u32| [&nothings.to_le_bytes()[..], &words.to_le_bytes(), &encoded(&state)].concat();
    let mut back = decoder.decode(&message(u32::MAX, 0)).expect("readable");
    StateOrigin::of(&state).put_into(&mut back);
    assert_eq!(encoded(&back), encoded(&state));
    assert!(matches!(decoder.decode(&message(0, u32::MAX)), Err(MessageError::Short { .. })));
}

#[test]
fn poses_and_joint_states_come_back_and_are_refused_when_cut() {
    let header = Header { seq: 7, stamp_sec: 8, stamp_nsec: 9 };
    let pose = PoseStamped { header, position_m: [1.0, -0.0, 3.0], quaternion_wxyz: [0.1, 0.2, 0.3, 0.4] };
    let mut bytes = Vec::new();
    pose.encode("gold/frame_0", &mut bytes);
    assert_eq!(PoseStamped::decode(&bytes), Ok(pose));
    assert_eq!(bytes[bytes.len() - 8..], 0.1_f64.to_le_bytes(), "w stands last");
    for length in 0..bytes.len() {
        assert!(matches!(PoseStamped::decode(&bytes[..length]), Err(MessageError::Short { .. })));
    }
    let joints = JointState { header, position: vec![1.0, 2.0], velocity: Vec::new(), effort: vec![-3.0] };
    let mut bytes = Vec::new();
    joints.encode(&["shoulder", "elbow"], &mut bytes);
    assert_eq!(JointState::decode(&bytes), Ok(joints));
    for length in 0..bytes.len() {
        assert!(matches!(JointState::decode(&bytes[..length]), Err(MessageError::Short { .. })));
    }
    // Four thousand million names, and as many numbers.
    bytes[16..20].fill(0xff);
    assert!(matches!(JointState::decode(&bytes), Err(MessageError::Short { .. })));
    let huge = [&[0; 20][..], &u32::MAX.to_le_bytes()].concat();
    assert!(matches!(JointState::decode(&huge), Err(MessageError::Short { needed, .. }) if needed == 8 * u32::MAX as usize));
}
