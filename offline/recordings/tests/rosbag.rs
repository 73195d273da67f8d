//! Bags of ROS 1: nothing is lost, whatever the compression; bags of other writers, of a crash, and damaged ones.

mod common;
#[path = "common/records.rs"]
mod records;

use std::io::Write;
use std::path::Path;
use std::process::Command;

use arm::Side;
use common::Scratch;
use ravenpose_wire::RavenState;
use recordings::ros::{JOINT_STATE, JointState, MessageType, RAVEN_STATE, encode_state};
use recordings::rosbag_file::{ChunkCompression, RosbagSink, RosbagSource};
use recordings::stream::{Damage, Place, Record, Sink, Source, StreamError};
use records::{Random, all, assert_prefix, assert_same, drain, same_at_start, write_all};

fn read(bytes: &[u8]) -> Result<RosbagSource<&[u8]>, StreamError> {
    RosbagSource::new(Path::new("run.bag"), bytes, bytes.len() as u64)
}

/// Records, damage, error; an error at the opening is one.
fn outcome(bytes: &[u8]) -> (Vec<Record>, Option<Damage>, Option<StreamError>) {
    match read(bytes) {
        Ok(mut source) => drain(&mut source),
        Err(error) => (Vec::new(), None, Some(error)),
    }
}

fn write(path: &Path, metadata: &[(String, String)], records: &[Record], compression: ChunkCompression) {
    let mut sink = Box::new(RosbagSink::create(path, metadata, compression).expect("created"));
    write_all(sink.as_mut(), records);
    sink.finish().expect("finished");
}

fn written(name: &str, records: &[Record], compression: ChunkCompression) -> Vec<u8> {
    let scratch = Scratch::new(&format!("bag-{name}"));
    let path = scratch.path().join("run.bag");
    write(&path, &pairs(), records, compression);
    std::fs::read(path).expect("bytes")
}

fn pairs() -> Vec<(String, String)> {
    [("robot", "raven2"), ("robot", "again"), ("sample_hz", "1000")].map(|(key, value)| (key.to_owned(), value.to_owned())).to_vec()
}

#[test]
fn records_and_metadata_come_back_bit_for_bit() {
    let scratch = Scratch::new("bag-round");
    let records = Random(31).records(3_000);
    for (name, compression) in [("none.bag", ChunkCompression::None), ("lz4.bag", ChunkCompression::Lz4)] {
        let path = scratch.path().join(name);
        write(&path, &pairs(), &records, compression);
        let source = RosbagSource::open(&path).expect("opens");
        assert_eq!((source.metadata(), source.format()), (&pairs()[..], "rosbag v1"));
        assert_same(&all(source), &records);
    }
}

#[test]
fn what_was_read_gives_the_same_bag_again() {
    let first = written("first", &Random(32).records(2_000), ChunkCompression::Lz4);
    let source = read(&first).expect("opens");
    assert_eq!(source.metadata(), pairs());
    let second = written("second", &all(source), ChunkCompression::Lz4);
    assert!(first == second);
}

#[test]
fn a_bag_without_records_is_whole() {
    let bytes = written("empty", &[], ChunkCompression::None);
    let source = read(&bytes).expect("opens");
    assert_eq!(source.metadata(), pairs());
    assert_same(&all(source), &[]);
}

#[test]
fn a_truncated_bag_yields_what_stands_before_the_cut() {
    let records = Random(33).records(8);
    for compression in [ChunkCompression::None, ChunkCompression::Lz4] {
        let bytes = written("cut", &records, compression);
        let mut most = 0;
        for length in 0..bytes.len() {
            let (found, damage, error) = outcome(&bytes[..length]);
            if length < 13 {
                assert!(error.is_some(), "{length}");
                continue;
            }
            assert_prefix(&found, &records);
            assert_eq!(error, None);
            let Some(Damage { place: Place::Byte(byte), .. }) = damage else { panic!("{length}: {damage:?}") };
            assert!(byte <= length as u64);
            assert!(found.len() >= most, "{length}: {} after {most}", found.len());
            most = most.max(found.len());
        }
        assert_eq!(most, records.len());
    }
}

#[test]
fn a_flipped_byte_spoils_nothing_before_it() {
    let records = Random(34).records(4);
    for compression in [ChunkCompression::None, ChunkCompression::Lz4] {
        let bytes = written("flip", &records, compression);
        for place in 0..bytes.len() {
            // All before this byte is whole: as much of it as a cut there would leave, but for what is compressed together.
            let before = match compression {
                ChunkCompression::None => outcome(&bytes[..place]).0.len().saturating_sub(1),
                ChunkCompression::Lz4 => 0,
            };
            for flip in [0x01, 0x80] {
                let mut flipped = bytes.clone();
                flipped[place] ^= flip;
                let (found, damage, error) = outcome(&flipped);
                assert!(same_at_start(&found, &records) >= before || error.is_some(), "byte {place} ^ {flip:#x}");
                assert!(found.len() <= 2 * records.len(), "byte {place}");
                // The checksum of lz4 finds every flip in what is compressed.
                if compression == ChunkCompression::Lz4 && damage.is_none() && error.is_none() {
                    assert_same(&found, &records);
                }
            }
        }
    }
}

#[test]
fn what_is_no_bag_of_format_2_is_refused() {
    let reason = |bytes: &[u8]| read(bytes).err().expect("refused").to_string();
    assert_eq!(reason(b""), "run.bag: byte 0: does not begin as a bag of ROS 1 does; check the file and its kind");
    assert_eq!(reason(b"\x89MCAP0\r\n and more"), reason(b""));
    assert_eq!(
        reason(b"#ROSBAG V1.2\n and more"),
        "run.bag: byte 0: is a bag of format 1.2, not of 2.0; bring it up to date with `rosbag fix` of ROS 1"
    );
    assert!(RosbagSource::open(Path::new("/nowhere/run.bag")).is_err());
}

/// A record of a bag.
fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let header = connection_data(fields);
    [&(header.len() as u32).to_le_bytes()[..], &header, &(data.len() as u32).to_le_bytes(), data].concat()
}

fn connection_data(fields: &[(&str, &[u8])]) -> Vec<u8> {
    let field = |(name, value): &(&str, &[u8])| {
        let length = (name.len() + 1 + value.len()) as u32;
        [&length.to_le_bytes()[..], name.as_bytes(), b"=", value].concat()
    };
    fields.iter().flat_map(field).collect()
}

/// The start of a bag that was never closed.
fn start() -> Vec<u8> {
    let first = record(&[("op", &[3]), ("index_pos", &[0; 8]), ("conn_count", &[0; 4]), ("chunk_count", &[0; 4])], &[b' '; 4000]);
    [b"#ROSBAG V2.0\n".to_vec(), first].concat()
}

fn connection(id: u32, topic: &str, message: &MessageType) -> Vec<u8> {
    let data = connection_data(&[
        ("callerid", b"/r2_control"),
        ("topic", topic.as_bytes()),
        ("type", message.name.as_bytes()),
        ("md5sum", message.md5.as_bytes()),
        ("message_definition", message.definition.as_bytes()),
    ]);
    record(&[("op", &[7]), ("topic", topic.as_bytes()), ("conn", &id.to_le_bytes())], &data)
}

fn message(id: u32, seconds: u32, data: &[u8]) -> Vec<u8> {
    let time = [seconds.to_le_bytes(), 7_u32.to_le_bytes()].concat();
    record(&[("op", &[2]), ("time", &time), ("conn", &id.to_le_bytes())], data)
}

fn chunk(compression: &str, size: usize, data: &[u8]) -> Vec<u8> {
    record(&[("op", &[5]), ("compression", compression.as_bytes()), ("size", &(size as u32).to_le_bytes())], data)
}

fn encoded(state: &RavenState) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode_state(state, &mut bytes);
    bytes
}

/// The lab's encoders.
fn external() -> Vec<u8> {
    let mut bytes = Vec::new();
    let joints = JointState { position: vec![0.1, 0.2, 0.3], ..JointState::default() };
    joints.encode(&["joint1", "joint2", "joint3"], &mut bytes);
    bytes
}

/// What a chunk of RAVEN's own recording holds: states, another topic, the lab's encoders.
fn recorded(states: &[RavenState]) -> Vec<u8> {
    const CHATTER: MessageType = MessageType { name: "std_msgs/String", md5: "", definition: "string data\n" };
    let external = external();
    let mut records = [connection(0, "/ravenstate", &RAVEN_STATE), connection(1, "/chatter", &CHATTER)].concat();
    for (index, state) in states.iter().enumerate() {
        records.extend(message(0, index as u32, &encoded(state)));
    }
    records.extend([message(1, 3, &[0; 4]), connection(2, "/ext_jpos", &JOINT_STATE), message(2, 4, &external)].concat());
    records
}

#[test]
fn joints_measured_before_the_first_state_are_of_the_arm_that_it_tells() {
    let of = |type_: [i32; 2]| {
        let mut state = RavenState::new();
        state.type_.copy_from_slice(&type_);
        let joints = [connection(0, "/ext_jpos", &JOINT_STATE), message(0, 1, &external()), message(0, 2, &external())].concat();
        let records =
            [joints, connection(1, "/ravenstate", &RAVEN_STATE), message(1, 3, &encoded(&state)), message(0, 4, &external())];
        let (found, ..) = outcome(&[start(), chunk("none", 0, &[]), records.concat()].concat());
        let truths = found.iter().filter_map(|record| match record {
            Record::Truth(truth) => Some((truth.side, truth.time_ns / 1_000_000_000)),
            Record::State(_) => None,
        });
        assert!(matches!(found[2], Record::State(_)), "in the order of the file");
        truths.collect::<Vec<_>>()
    };
    for (types, side) in [([0, 2], Side::Green), ([1, 0], Side::Gold), ([1, 2], Side::Gold)] {
        assert_eq!(of(types), [(side, 1), (side, 2), (side, 4)]);
    }
    // Of a bag without a state nothing says it.
    let joints = [connection(0, "/ext_jpos", &JOINT_STATE), message(0, 1, &external())].concat();
    let (found, ..) = outcome(&[start(), chunk("none", 0, &[]), joints].concat());
    assert!(matches!(&found[..], [Record::Truth(truth)] if truth.side == Side::Gold));
}

fn check_recorded(found: &[Record], states: &[RavenState]) {
    assert_eq!(found.len(), states.len() + 1);
    for (index, (record, state)) in found.iter().zip(states).enumerate() {
        let Record::State(found) = record else { panic!("a state") };
        assert_eq!((found.sequence, encoded(found)), (index as u64 + 1, encoded(state)));
    }
    let Some(Record::Truth(truth)) = found.last() else { panic!("a truth") };
    assert_eq!((truth.time_ns, &truth.joints[..3]), (4_000_000_007, &[0.1, 0.2, 0.3][..]));
}

fn bz2(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
    encoder.write_all(bytes).expect("compressed");
    encoder.finish().expect("compressed")
}

fn lz4(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
    encoder.write_all(bytes).expect("compressed");
    encoder.finish().expect("compressed")
}

fn states(seed: u64) -> Vec<RavenState> {
    let mut random = Random(seed);
    (0..5).map(|_| random.state()).collect()
}

#[test]
fn a_bag_without_an_index_is_read_to_its_end_whatever_its_compression() {
    let states = states(35);
    let records = recorded(&states);
    for (name, data) in [("none", records.clone()), ("bz2", bz2(&records)), ("lz4", lz4(&records))] {
        let bytes = [start(), chunk(name, records.len(), &data)].concat();
        let mut source = read(&bytes).expect("opens");
        let (found, damage, error) = drain(&mut source);
        check_recorded(&found, &states);
        assert_eq!(error, None);
        assert_eq!(damage.expect("no index").what, "the file ends here without an index: the recording was cut off", "{name}");
        let channels = source.channels();
        let counts: Vec<_> = channels.iter().map(|channel| (channel.topic.as_str(), channel.messages, channel.is_read)).collect();
        assert_eq!(counts, [("/ravenstate", 5, true), ("/chatter", 1, false), ("/ext_jpos", 1, true)]);
    }
}

#[test]
fn the_chunk_that_was_open_when_the_recorder_died_is_read() {
    let states = states(36);
    let records = recorded(&states);
    // The recorder writes the sizes when it closes a chunk: before, they are 0 and the records follow.
    for (name, data) in [("none", records.clone()), ("bz2", bz2(&records)), ("lz4", lz4(&records))] {
        let bytes = [start(), chunk(name, 0, &[]), data].concat();
        let (found, damage, error) = outcome(&bytes);
        check_recorded(&found, &states);
        assert!(error.is_none() && damage.is_some(), "{name}");
    }
    // Cut in the fifth state.
    let fifth = encoded(&states[4]);
    let cut = records.windows(fifth.len()).position(|bytes| bytes == fifth).expect("there") + 100;
    let (found, damage, error) = outcome(&[start(), chunk("none", 0, &[]), records[..cut].to_vec()].concat());
    assert!(found.len() == 4 && damage.is_some() && error.is_none(), "{}", found.len());
}

#[test]
fn a_definition_that_lacks_a_field_is_refused_by_its_name() {
    let definition = RAVEN_STATE.definition.replace("float32[16] jpos_d\n", "").leak();
    let other = MessageType { definition, ..RAVEN_STATE };
    let bytes = [start(), connection(0, "/ravenstate", &other)].concat();
    let (_, _, error) = outcome(&bytes);
    let error = error.expect("refused").to_string();
    assert!(error.contains("the definition of raven_2/raven_state on /ravenstate lacks field jpos_d; record with"), "{error}");
}

#[test]
fn damage_in_an_uncompressed_chunk_has_its_byte() {
    let states = states(38);
    let records = recorded(&states);
    let whole = [start(), chunk("none", records.len(), &records)].concat();
    let third = encoded(&states[2]);
    let message_at = whole.windows(third.len()).position(|bytes| bytes == third).expect("there") - message(0, 2, &[]).len();
    let mut spoilt = whole.clone();
    // The length of its header.
    spoilt[message_at + 3] = 0x7f;
    let (found, damage, error) = outcome(&spoilt);
    assert_eq!((found.len(), error), (2, None));
    let expected =
        Damage { place: Place::Byte(message_at as u64), what: "a record in a chunk is longer than the rest of the chunk".into() };
    assert_eq!(damage, Some(expected));
}

/// Bags whose lengths and numbers are lies.
fn liars() -> Vec<Vec<u8>> {
    let huge = u32::MAX.to_le_bytes();
    let with = |more: &[u8]| [&start()[..], more].concat();
    let zeros = bz2(&vec![0; 30 << 20]);
    let mut files = vec![
        with(&huge),
        with(&[&20_u32.to_le_bytes()[..], &[0; 100]].concat()),
        with(&[&1_000_000_u32.to_le_bytes()[..], &[0; 2_000_000]].concat()),
        with(&record(&[("op", &[5, 5])], &[])),
        with(&record(&[("op", &[9])], &[])),
        with(&record(&[], &[])),
        with(&message(3, 1, &[])),
        with(&chunk("zip", 4, &[1, 2, 3, 4])),
        with(&chunk("bz2", 30 << 20, &zeros)),
        with(&chunk("bz2", 1, &zeros)),
        with(&chunk("bz2", 0, &[])[..]),
        with(&[chunk("bz2", 0, &[]), zeros.repeat(20)].concat()),
    ];
    for name in ["none", "bz2", "lz4"] {
        files.push(with(&chunk(name, u32::MAX as usize, &[1, 2, 3, 4])));
        files.push(with(&chunk(name, 60 << 20, &[1, 2, 3, 4])));
        let mut long = chunk(name, 4, &[1, 2, 3, 4]);
        let length_at = long.len() - 8;
        long[length_at..length_at + 4].copy_from_slice(&huge);
        files.push(with(&long));
    }
    files
}

#[test]
fn a_length_that_lies_costs_no_memory() {
    const ROLE: &str = "RAVENPOSE_TEST_LIARS";
    if std::env::var_os(ROLE).is_some() {
        for file in liars() {
            let (found, damage, error) = outcome(&file);
            assert!(found.is_empty() && damage.is_some() && error.is_none());
        }
        println!("all refused");
        return;
    }
    // A gigabyte of addresses: more than that cannot be asked for.
    let output = Command::new("sh")
        .args(["-c", "ulimit -v 1048576; exec \"$0\" --exact a_length_that_lies_costs_no_memory --nocapture --test-threads 1"])
        .arg(std::env::current_exe().expect("this program"))
        .env(ROLE, "1")
        .output()
        .expect("runs");
    let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("all refused"), "{said}");
}

#[test]
fn a_sink_that_is_dropped_leaves_nothing() {
    let scratch = Scratch::new("bag-dropped");
    let path = scratch.path().join("run.bag");
    let mut sink = RosbagSink::create(&path, &[], ChunkCompression::None).expect("created");
    write_all(&mut sink, &Random(37).records(10));
    let mut torn = RavenState::new();
    torn.guard_head = 1;
    let error = sink.write(&Record::State(Box::new(torn))).expect_err("torn").to_string();
    assert!(error.contains("run.bag: a state is torn"), "{error}");
    drop(sink);
    assert_eq!(std::fs::read_dir(scratch.path()).expect("folder").count(), 0);
}
