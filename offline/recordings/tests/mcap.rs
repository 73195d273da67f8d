//! MCAP files: nothing is lost, other programs find plain ROS 1, and a damaged file gives what stands before the damage.

mod common;
#[path = "common/records.rs"]
mod records;

use std::collections::BTreeMap;
use std::io::{BufRead, Cursor};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use common::Scratch;
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use ravenpose_wire::RavenState;
use recordings::mcap_file::{McapLog, McapSink, McapSource};
use recordings::ros::{JOINT_STATE, JointState, RAVEN_STATE, StateOrigin, encode_state};
use recordings::stream::{Damage, Place, Record, Sink, Source, StreamError};
use records::{Random, all, assert_prefix, assert_same, drain, write_all};

fn read(bytes: &[u8]) -> Result<McapSource<&[u8]>, StreamError> {
    McapSource::new(Path::new("run.mcap"), bytes, bytes.len() as u64)
}

fn write(path: &Path, metadata: &[(String, String)], records: &[Record]) {
    let mut sink = Box::new(McapSink::create(path, metadata).expect("created"));
    write_all(sink.as_mut(), records);
    sink.finish().expect("finished");
}

/// A small file of several chunks.
fn small(records: &[Record]) -> Vec<u8> {
    let scratch = Scratch::new(&format!("mcap-small-{}", records.len()));
    let path = scratch.path().join("run.mcap");
    let mut log = Box::new(McapLog::create(&path, &pairs()).expect("created"));
    for group in records.chunks(4) {
        write_all(log.as_mut(), group);
        log.flush().expect("flushed");
    }
    log.finish().expect("finished");
    std::fs::read(path).expect("bytes")
}

fn pairs() -> Vec<(String, String)> {
    [("robot", "raven2"), ("sample_hz", "1000")].map(|(key, value)| (key.to_owned(), value.to_owned())).to_vec()
}

#[test]
fn records_and_metadata_come_back_bit_for_bit() {
    let scratch = Scratch::new("mcap-round");
    let path = scratch.path().join("run.mcap");
    let records = Random(11).records(5_000);
    write(&path, &pairs(), &records);
    let source = McapSource::open(&path).expect("opens");
    assert_eq!((source.metadata(), source.format()), (&pairs()[..], "MCAP"));
    assert_same(&all(source), &records);
}

#[test]
fn what_was_read_gives_the_same_file_again() {
    let scratch = Scratch::new("mcap-again");
    let (first, second) = (scratch.path().join("first.mcap"), scratch.path().join("second.mcap"));
    write(&first, &pairs(), &Random(12).records(3_000));
    let source = McapSource::open(&first).expect("opens");
    let metadata = source.metadata().to_vec();
    write(&second, &metadata, &all(source));
    assert!(std::fs::read(first).expect("first") == std::fs::read(second).expect("second"));
}

#[test]
fn others_find_the_published_message_with_its_definition() {
    let scratch = Scratch::new("mcap-official");
    let path = scratch.path().join("run.mcap");
    let mut random = Random(13);
    let mut records: Vec<Record> = (0..20).map(|_| Record::State(Box::new(random.state()))).collect();
    records.push(Record::Truth(random.truth()));
    write(&path, &[], &records);
    let bytes = std::fs::read(&path).expect("bytes");
    let states: Vec<_> = mcap::MessageStream::new(&bytes)
        .expect("official reader")
        .map(|message| message.expect("message"))
        .filter(|message| message.channel.topic == "/ravenstate")
        .collect();
    assert_eq!(states.len(), 20);
    for (message, record) in states.iter().zip(&records) {
        let Record::State(state) = record else { panic!("a state") };
        let schema = message.channel.schema.as_ref().expect("schema");
        assert_eq!(
            (schema.name.as_str(), schema.encoding.as_str(), message.channel.message_encoding.as_str()),
            (RAVEN_STATE.name, "ros1msg", "ros1")
        );
        assert_eq!(&schema.data[..], RAVEN_STATE.definition.as_bytes());
        let mut expected = Vec::new();
        encode_state(state, &mut expected);
        assert_eq!(&message.data[..], expected);
        assert_eq!((message.log_time, message.publish_time), (record.time_ns() as u64, record.time_ns() as u64));
    }
    let summary = mcap::Summary::read(&bytes).expect("summary").expect("there");
    assert!(summary.channels.values().any(|channel| channel.topic.starts_with("/truth/")));
}

#[test]
fn a_truncated_file_yields_what_stands_before_the_cut() {
    let records = Random(14).records(12);
    let bytes = small(&records);
    let mut most = 0;
    for length in 0..bytes.len() {
        let Ok(mut source) = read(&bytes[..length]) else {
            assert!(length < 8, "{length}");
            continue;
        };
        let (found, damage, error) = drain(&mut source);
        assert_prefix(&found, &records);
        assert_eq!(error, None);
        let Some(Damage { place: Place::Byte(byte), .. }) = damage else { panic!("{length}: {damage:?}") };
        assert!(byte <= length as u64);
        // More of the file never gives fewer records.
        assert!(found.len() >= most, "{length}: {} after {most}", found.len());
        most = most.max(found.len());
    }
    assert_eq!(most, records.len());
    assert_same(&all(read(&bytes).expect("whole")), &records);
}

#[test]
fn a_chunk_that_is_cut_gives_its_first_records() {
    let scratch = Scratch::new("mcap-cut");
    let path = scratch.path().join("run.mcap");
    let records = Random(15).records(600);
    write(&path, &[], &records);
    let bytes = std::fs::read(&path).expect("bytes");
    let (found, damage, _) = drain(&mut read(&bytes[..bytes.len() / 2]).expect("opens"));
    assert!(found.len() > 100, "{}", found.len());
    assert_prefix(&found, &records);
    assert!(damage.expect("cut").what.starts_with("the file is cut off within a chunk"));
}

#[test]
fn a_flipped_byte_is_found_wherever_it_is() {
    let records = Random(16).records(6);
    let bytes = small(&records);
    for place in 0..bytes.len() {
        for flip in [0x01, 0x80, 0xff] {
            let mut flipped = bytes.clone();
            flipped[place] ^= flip;
            let Ok(mut source) = read(&flipped) else { continue };
            let (found, damage, error) = drain(&mut source);
            assert!(damage.is_some() || error.is_some(), "byte {place} ^ {flip:#x} was not noticed");
            assert_prefix(&found, &records);
        }
    }
}

#[test]
fn what_is_no_mcap_file_is_refused() {
    for bytes in [&b""[..], b"\x89MCAP", b"\x89MCAP1\r\n", b"#ROSBAG V2.0\n", &[0; 100]] {
        let error = read(bytes).err().expect("refused");
        assert_eq!(error.to_string(), "run.mcap: byte 0: does not begin as an MCAP file does; check the file and its kind");
    }
    assert!(McapSource::open(Path::new("/nowhere/run.mcap")).is_err());
}

fn record(opcode: u8, content: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(content.len() as u64).to_le_bytes(), content].concat()
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

/// Files whose lengths are lies.
fn liars() -> Vec<Vec<u8>> {
    let magic = b"\x89MCAP0\r\n".to_vec();
    let chunk = |uncompressed: u64, compression: &str, records: u64, data: &[u8]| {
        let head = [&[0; 16][..], &uncompressed.to_le_bytes(), &[0; 4], &text(compression), &records.to_le_bytes(), data].concat();
        [magic.clone(), record(6, &head)].concat()
    };
    let huge = 1_u64 << 40;
    let mut files: Vec<Vec<u8>> = (1..=15).map(|opcode| [&magic[..], &[opcode], &huge.to_le_bytes(), &[0; 50]].concat()).collect();
    files.push([&magic[..], &[6], &u64::MAX.to_le_bytes(), &[0; 50]].concat());
    for compression in ["", "zstd", "lz4"] {
        files.push(chunk(huge, compression, 4, &[1, 2, 3, 4]));
        files.push(chunk(60 << 20, compression, 4, &[1, 2, 3, 4]));
        files.push(chunk(4, compression, huge, &[1, 2, 3, 4]));
    }
    // A chunk of zeros, 4 GiB of them.
    let zeros = zstd::bulk::compress(&vec![0; 32 << 20], 1).expect("compressed");
    files.push(chunk(32 << 20, "zstd", zeros.len() as u64, &zeros));
    files.push(chunk(1, "zstd", zeros.len() as u64 * 128, &zeros.repeat(128)));
    files.push(chunk(1, "zstd", zeros.len() as u64 * 128, &zeros.repeat(128))[..100_000].to_vec());
    // Text that goes on for ever.
    files.push([magic.clone(), record(3, &[&[1, 0][..], &u32::MAX.to_le_bytes(), &[0; 9]].concat())].concat());
    files.push([magic.clone(), record(12, &[&text("ravenpose")[..], &u32::MAX.to_le_bytes(), &[0; 9]].concat())].concat());
    files
}

#[test]
fn a_length_that_lies_costs_no_memory() {
    const ROLE: &str = "RAVENPOSE_TEST_LIARS";
    if std::env::var_os(ROLE).is_some() {
        for file in liars() {
            let (found, damage, error) = drain(&mut read(&file).expect("begins well"));
            assert!(found.is_empty() && damage.is_some() && error.is_none());
        }
        println!("all refused");
        return;
    }
    // A gigabyte of addresses: more than that cannot be asked for.
    let own = std::env::current_exe().expect("this program");
    let output = Command::new("sh")
        .args(["-c", "ulimit -v 1048576; exec \"$0\" --exact a_length_that_lies_costs_no_memory --nocapture --test-threads 1"])
        .arg(own)
        .env(ROLE, "1")
        .output()
        .expect("runs");
    let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("all refused"), "{said}");
}

/// A file of another writer.
fn foreign(options: WriteOptions, fill: impl FnOnce(&mut Writer<Cursor<Vec<u8>>>)) -> Vec<u8> {
    let mut writer = options.create(Cursor::new(Vec::new())).expect("created");
    fill(&mut writer);
    let _summary = writer.finish().expect("finished");
    writer.into_inner().into_inner()
}

fn add(writer: &mut Writer<Cursor<Vec<u8>>>, topic: &str, name: &str, encodings: (&str, &str), text: &str, messages: &[Vec<u8>]) {
    let schema = writer.add_schema(name, encodings.0, text.as_bytes()).expect("schema");
    let channel_id = writer.add_channel(schema, topic, encodings.1, &BTreeMap::new()).expect("channel");
    for (sequence, data) in messages.iter().enumerate() {
        let header = MessageHeader { channel_id, sequence: sequence as u32, log_time: 5_000 + sequence as u64, publish_time: 0 };
        writer.write_to_known_channel(&header, data).expect("message");
    }
}

fn encoded(states: &[RavenState]) -> Vec<Vec<u8>> {
    let encoded = |state| {
        let mut bytes = Vec::new();
        encode_state(state, &mut bytes);
        bytes
    };
    states.iter().map(encoded).collect()
}

const ROS1: (&str, &str) = ("ros1msg", "ros1");

#[test]
fn states_of_other_writers_are_read_from_any_topic_and_counted() {
    let mut random = Random(17);
    let states: Vec<RavenState> = (0..5).map(|_| random.state()).collect();
    let layouts = [
        WriteOptions::new(),
        WriteOptions::new().compression(None),
        WriteOptions::new().use_chunks(false),
        WriteOptions::new()
            .compression(None)
            .calculate_chunk_crcs(false)
            .calculate_data_section_crc(false)
            .emit_summary_records(false),
    ];
    for (options, topic) in layouts.into_iter().zip(["/ravenstate", "/ravenstate_100hz", "raven_state", "/left/state"]) {
        let bytes = foreign(options, |writer| {
            add(writer, "/chatter", "std_msgs/String", ROS1, "string data\n", &[vec![0; 4], vec![0; 4]]);
            add(writer, "/note", "", ("", "json"), "", &[b"{}".to_vec()]);
            add(writer, topic, RAVEN_STATE.name, ROS1, RAVEN_STATE.definition, &encoded(&states));
        });
        let mut source = read(&bytes).expect("opens");
        let (found, damage, error) = drain(&mut source);
        assert_eq!((damage, error), (None, None), "{topic}");
        assert_eq!(found.len(), 5);
        for (index, (record, state)) in found.iter().zip(&states).enumerate() {
            let Record::State(found) = record else { panic!("a state") };
            // What the message does not say: counted from 1, time since the first.
            let since_ns = record.time_ns() - found_first(&states);
            assert_eq!((found.sequence, found.source_id, found.source_time_ns), (index as u64 + 1, 0, since_ns));
            assert_eq!(encoded(&[**found]), encoded(&[*state]));
            assert!(found.admit().is_ok());
        }
        let channels = source.channels();
        let counts: Vec<_> = channels.iter().map(|channel| (channel.topic.as_str(), channel.messages, channel.is_read)).collect();
        assert_eq!(counts, [("/chatter", 2, false), ("/note", 1, false), (topic, 5, true)]);
    }
}

#[test]
fn states_come_from_one_topic_only() {
    let mut random = Random(25);
    let states: Vec<RavenState> = (0..4).map(|_| random.state()).collect();
    let bytes = foreign(WriteOptions::new(), |writer| {
        add(writer, "/ravenstate", RAVEN_STATE.name, ROS1, RAVEN_STATE.definition, &encoded(&states));
        add(writer, "/ravenstate_100hz", RAVEN_STATE.name, ROS1, RAVEN_STATE.definition, &encoded(&states[..2]));
    });
    let mut source = read(&bytes).expect("opens");
    let (found, damage, error) = drain(&mut source);
    assert_eq!((found.len(), damage, error), (4, None, None));
    let channels = source.channels();
    let counts: Vec<_> = channels.iter().map(|channel| (channel.topic.as_str(), channel.messages, channel.is_read)).collect();
    assert_eq!(counts, [("/ravenstate", 4, true), ("/ravenstate_100hz", 2, false)]);
}

fn found_first(states: &[RavenState]) -> i64 {
    StateOrigin::of(&states[0]).header.time_ns()
}

#[test]
fn states_in_another_encoding_are_refused_by_name() {
    for (name, encodings, found) in [
        ("raven_2/msg/RavenState", ("ros2msg", "cdr"), "is encoded as cdr (ROS 2), not as ros1"),
        ("RavenState", ("jsonschema", "json"), "is encoded as json, not as ros1"),
        (RAVEN_STATE.name, ("ros2msg", "ros1"), "is encoded as ros2msg (ROS 2), not as ros1"),
    ] {
        let bytes = foreign(WriteOptions::new(), |writer| add(writer, "/ravenstate", name, encodings, "", &[vec![0; 980]]));
        let (_, _, error) = drain(&mut read(&bytes).expect("opens"));
        let error = error.expect("refused").to_string();
        assert!(error.contains(&format!("topic /ravenstate of type {name} {found}")), "{error}");
    }
}

#[test]
fn a_definition_that_lacks_a_field_is_refused_by_its_name() {
    let definition = RAVEN_STATE.definition.replace("int32[16] dac_val\n", "");
    let bytes =
        foreign(WriteOptions::new(), |writer| add(writer, "/ravenstate", RAVEN_STATE.name, ROS1, &definition, &[vec![0; 916]]));
    let (_, _, error) = drain(&mut read(&bytes).expect("opens"));
    let error = error.expect("refused").to_string();
    assert!(error.contains("the definition of raven_2/raven_state on /ravenstate lacks field dac_val"), "{error}");
}

#[test]
fn a_message_of_the_wrong_size_is_damage_with_its_place() {
    let mut random = Random(18);
    let states: Vec<RavenState> = (0..3).map(|_| random.state()).collect();
    let mut messages = encoded(&states);
    messages[2].pop();
    let bytes = foreign(WriteOptions::new(), |writer| {
        add(writer, "/ravenstate", RAVEN_STATE.name, ROS1, RAVEN_STATE.definition, &messages);
    });
    let (found, damage, error) = drain(&mut read(&bytes).expect("opens"));
    assert_eq!((found.len(), error), (2, None));
    assert_eq!(
        damage.expect("damage").what,
        "message 3 of /ravenstate: the message ends at byte 979, its field jac_f at byte 932 needs 48 bytes"
    );
}

#[test]
fn the_encoders_of_the_lab_are_truth_of_joints_1_to_3() {
    let mut green = RavenState { type_: [0, 22], ..RavenState::new() };
    green.hdr_stamp_sec = 1;
    let joints = JointState { position: vec![0.1, 0.2, 0.3], velocity: vec![9.0; 3], ..JointState::default() };
    let mut message = Vec::new();
    joints.encode(&[], &mut message);
    let bytes = foreign(WriteOptions::new(), |writer| {
        add(writer, "/ravenstate", RAVEN_STATE.name, ROS1, RAVEN_STATE.definition, &encoded(&[green]));
        add(writer, "/ext_jpos", JOINT_STATE.name, ROS1, JOINT_STATE.definition, &[message.clone()]);
        add(writer, "/arm2/measured_js_100hz", JOINT_STATE.name, ROS1, JOINT_STATE.definition, &[message.clone()]);
    });
    let mut source = read(&bytes).expect("opens");
    let (found, damage, error) = drain(&mut source);
    assert_eq!((found.len(), damage, error), (2, None, None));
    let Record::Truth(truth) = &found[1] else { panic!("a truth") };
    // The stamp of the message was never set: the file's time.
    assert_eq!((truth.time_ns, truth.side), (5_000, arm::Side::Green));
    assert_eq!(truth.joints[..3], [0.1, 0.2, 0.3]);
    assert!(truth.joints[3..].iter().chain(&truth.position_m).chain(&truth.cable_force_n).all(|value| value.is_nan()));
    let channels = source.channels();
    assert_eq!(channels.iter().map(|channel| channel.is_read).collect::<Vec<_>>(), [true, true, false]);
}

#[test]
fn a_record_that_would_lose_something_is_refused() {
    let scratch = Scratch::new("mcap-unfit");
    let path = scratch.path().join("run.mcap");
    let mut sink = Box::new(McapSink::create(&path, &[]).expect("created"));
    let mut torn = RavenState::new();
    torn.guard_tail = 1;
    let reserved = RavenState { reserved: 1, ..RavenState::new() };
    let mut early = Random(19).truth();
    early.time_ns = -1;
    for (record, what) in [
        (Record::State(Box::new(torn)), "torn"),
        (Record::State(Box::new(reserved)), "reserved"),
        (Record::Truth(early), "has the time -1 ns"),
    ] {
        let error = sink.write(&record).expect_err("refused").to_string();
        assert!(error.contains(what), "{error}");
    }
    sink.finish().expect("finished");
    assert_same(&all(McapSource::open(&path).expect("opens")), &[]);
}

#[test]
fn a_sink_that_is_dropped_leaves_nothing() {
    let scratch = Scratch::new("mcap-dropped");
    let path = scratch.path().join("run.mcap");
    let mut sink = McapSink::create(&path, &[]).expect("created");
    write_all(&mut sink, &Random(20).records(10));
    assert!(!path.exists());
    drop(sink);
    assert_eq!(std::fs::read_dir(scratch.path()).expect("folder").count(), 0);
    let error = McapSink::create(Path::new("/nowhere/run.mcap"), &[]).err().expect("no folder").to_string();
    assert!(error.contains("/nowhere/run.mcap: cannot be written"), "{error}");
}

#[test]
fn a_log_gets_its_name_at_the_end_and_overwrites_no_earlier_part() {
    let scratch = Scratch::new("mcap-log");
    let path = scratch.path().join("run.mcap");
    let log = Box::new(McapLog::create(&path, &pairs()).expect("created"));
    assert_eq!(log.part(), scratch.path().join("run.mcap.part"));
    assert!(log.part().exists() && !path.exists());
    let error = McapLog::create(&path, &[]).err().expect("occupied").to_string();
    assert!(error.contains("run.mcap.part: is there already"), "{error}");
    log.finish().expect("finished");
    assert!(path.exists() && !scratch.path().join("run.mcap.part").exists());
    assert_eq!(McapSource::open(&path).expect("opens").metadata(), pairs());
}

#[test]
fn a_hole_of_zeros_is_damage_where_it_begins() {
    let scratch = Scratch::new("mcap-hole");
    let mut log = McapLog::create(&scratch.path().join("run.mcap"), &[]).expect("created");
    let records = Random(24).records(5);
    write_all(&mut log, &records);
    log.flush().expect("flushed");
    let mut bytes = std::fs::read(log.part()).expect("bytes");
    let whole = bytes.len() as u64;
    bytes.resize(bytes.len() + 10_000, 0);
    let (found, damage, error) = drain(&mut read(&bytes).expect("opens"));
    assert_same(&found, &records);
    let expected = Damage { place: Place::Byte(whole), what: "a record of kind 0, which there is not".to_owned() };
    assert_eq!((damage, error), (Some(expected), None));
}

const LOG_ROLE: &str = "RAVENPOSE_TEST_LOG";
/// Records before and after the last flush of the log that is killed.
const LOGGED: (usize, usize) = (500, 300);

fn log_until_killed(path: &Path) {
    let records = Random(21).records(LOGGED.0 + LOGGED.1);
    let mut log = McapLog::create(path, &pairs()).expect("created");
    write_all(&mut log, &records[..LOGGED.0]);
    log.flush().expect("flushed");
    write_all(&mut log, &records[LOGGED.0..]);
    println!("ready");
    loop {
        std::thread::sleep(std::time::Duration::from_secs(1));
    }
}

#[test]
fn a_killed_log_keeps_all_that_was_flushed() {
    if let Some(path) = std::env::var_os(LOG_ROLE) {
        log_until_killed(&PathBuf::from(path));
    }
    let scratch = Scratch::new("mcap-killed");
    let path = scratch.path().join("run.mcap");
    let mut child = Command::new(std::env::current_exe().expect("this program"))
        .args(["--exact", "a_killed_log_keeps_all_that_was_flushed", "--nocapture"])
        .env(LOG_ROLE, &path)
        .stdout(Stdio::piped())
        .spawn()
        .expect("runs");
    let said = std::io::BufReader::new(child.stdout.take().expect("stdout"));
    assert!(said.lines().any(|line| line.expect("line").contains("ready")));
    child.kill().expect("killed");
    let _status = child.wait().expect("gone");

    assert!(!path.exists());
    let records = Random(21).records(LOGGED.0 + LOGGED.1);
    let mut source = McapSource::open(&scratch.path().join("run.mcap.part")).expect("opens");
    assert_eq!(source.metadata(), pairs());
    let (found, damage, error) = drain(&mut source);
    assert!(found.len() >= LOGGED.0 && error.is_none());
    assert_same(&found, &records[..found.len()]);
    assert_eq!(damage.expect("cut").what, "the file ends here without an end mark: the recording was cut off");

    // The official reader, from the start.
    let bytes = std::fs::read(scratch.path().join("run.mcap.part")).expect("bytes");
    let options = mcap::read::Options::IgnoreEndMagic.into();
    let messages =
        mcap::MessageStream::new_with_options(&bytes, options).expect("official reader").take_while(Result::is_ok).count();
    assert!(messages >= LOGGED.0);
}

#[test]
fn the_first_records_are_the_same_whatever_follows() {
    let records = Random(22).records(12);
    let bytes = small(&records);
    let mut garbage = bytes[..bytes.len() / 2].to_vec();
    let mut random = Random(23);
    garbage.extend((0..10_000).map(|_| random.next() as u8));
    let (found, damage, error) = drain(&mut read(&garbage).expect("opens"));
    assert!(damage.is_some() || error.is_some());
    assert!(!found.is_empty());
    assert_prefix(&found, &records);
}
