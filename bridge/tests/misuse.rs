//! Wrong use of the C interface gives a code, never undefined behaviour.

#[path = "../../tests/common/mod.rs"]
mod common;

use ravenpose_bridge::*;
use ravenpose_transport::{Reader, Settings};
use ravenpose_wire::{ArmStatus, CorrectedPose, RavenState};
use std::ffi::{CStr, CString, c_char};
use std::ptr::{null, null_mut};

fn options(prefix: &Prefix) -> Options {
    Options { prefix: prefix.0.as_ptr(), ..Options::default() }
}

/// A prefix of its own, whose files are gone when it is dropped.
struct Prefix(CString);

impl Drop for Prefix {
    fn drop(&mut self) {
        common::remove_shared_memory(self.0.to_str().expect("UTF-8"));
    }
}

fn prefix(name: &str) -> Prefix {
    Prefix(CString::new(format!("rpmis{name}{}_", std::process::id())).expect("no NUL"))
}

#[test]
fn null_is_refused_everywhere() {
    let name = prefix("null");
    let mut publisher: *mut Publisher = null_mut();
    let mut reader: *mut PoseReader = null_mut();
    let mut state: *mut RavenState = null_mut();
    let mut pose = CorrectedPose::new();
    let mut um = [0.0; 3];
    // SAFETY: null is what is being tested; everything else is valid.
    unsafe {
        let missing = Code::Null as i32;
        assert_eq!(ravenpose_publisher_open(null(), &raw mut publisher, null_mut(), 0), missing);
        assert_eq!(ravenpose_publisher_open(&options(&name), null_mut(), null_mut(), 0), missing);
        assert_eq!(ravenpose_publisher_loan(null_mut(), &raw mut state), missing);
        assert_eq!(ravenpose_publisher_send(null_mut()), missing);
        assert_eq!(ravenpose_publisher_publish(null_mut(), &RavenState::new()), missing);
        assert_eq!(ravenpose_publisher_readers(null()), 0);
        ravenpose_publisher_close(null_mut());
        ravenpose_publisher_close(&raw mut publisher);
        assert_eq!(ravenpose_pose_reader_open(null(), &raw mut reader, null_mut(), 0), missing);
        assert_eq!(ravenpose_pose_reader_take(null_mut(), &raw mut pose), missing);
        assert_eq!(ravenpose_pose_reader_next(null_mut(), &raw mut pose), missing);
        assert_eq!(ravenpose_pose_reader_wait(null_mut(), 0, &raw mut pose), missing);
        ravenpose_pose_reader_close(null_mut());
        ravenpose_pose_reader_close(&raw mut reader);
        assert_eq!(ravenpose_state_init(null_mut()), missing);
        assert_eq!(ravenpose_position(null(), 0, 0, um.as_mut_ptr()), missing);
        assert_eq!(ravenpose_position(&raw const pose, 0, 0, null_mut()), missing);
        let mut matrix = [0.0; 9];
        assert_eq!(ravenpose_orientation(null(), 0, 0, matrix.as_mut_ptr()), missing);
        assert_eq!(ravenpose_orientation(&raw const pose, 0, 0, null_mut()), missing);
    }
}

#[test]
fn another_version_is_refused_with_both_versions_in_the_message() {
    let name = prefix("version");
    for change in 0..3 {
        let mut wrong = options(&name);
        match change {
            0 => wrong.abi_version += 1,
            1 => wrong.state_size -= 8,
            _ => wrong.pose_size += 8,
        }
        let mut publisher = null_mut();
        let mut message = [1 as c_char; 512];
        // SAFETY: valid pointers, and the buffer has the stated size.
        let text = unsafe {
            assert_eq!(
                ravenpose_publisher_open(&raw const wrong, &raw mut publisher, message.as_mut_ptr(), message.len()),
                Code::Version as i32
            );
            assert!(publisher.is_null());
            CStr::from_ptr(message.as_ptr()).to_str().expect("UTF-8")
        };
        assert!(text.contains("version mismatch") && text.contains("has ABI 1"), "{text}");
        assert!(!text.contains('\n'));
    }
}

#[test]
fn a_short_message_buffer_is_filled_and_terminated() {
    let name = prefix("short");
    let mut wrong = options(&name);
    wrong.abi_version = 99;
    let mut reader = null_mut();
    let mut message = [7 as c_char; 12];
    // SAFETY: valid pointers, and the buffer is stated shorter than it is.
    unsafe { ravenpose_pose_reader_open(&raw const wrong, &raw mut reader, message.as_mut_ptr(), 8) };
    assert_eq!((message[7], message[8]), (0, 7));
}

#[test]
fn a_root_that_depends_on_the_working_directory_is_refused() {
    let name = prefix("relative");
    let wrong = Options { root: c"tmp/relative".as_ptr(), ..options(&name) };
    let mut publisher = null_mut();
    let mut message = [0 as c_char; 200];
    // SAFETY: valid pointers, and the buffer's own length.
    let code = unsafe { ravenpose_publisher_open(&raw const wrong, &raw mut publisher, message.as_mut_ptr(), message.len()) };
    // SAFETY: the call has terminated it.
    let said = unsafe { CStr::from_ptr(message.as_ptr()) }.to_str().expect("text");
    assert_eq!(code, Code::Argument as i32, "{said}");
    assert!(said.contains("\"tmp/relative\" is not absolute"), "{said}");
    assert!(publisher.is_null() && !std::path::Path::new("tmp/relative").exists());
}

#[test]
fn one_publisher_only_and_its_place_is_free_again_after_close() {
    let name = prefix("one");
    let (mut first, mut second) = (null_mut(), null_mut());
    let mut message = [0 as c_char; 512];
    // SAFETY: valid pointers; handles are closed once.
    unsafe {
        assert_eq!(ravenpose_publisher_open(&options(&name), &raw mut first, null_mut(), 0), 0);
        assert_eq!(
            ravenpose_publisher_open(&options(&name), &raw mut second, message.as_mut_ptr(), message.len()),
            Code::Full as i32
        );
        assert!(second.is_null());
        assert!(CStr::from_ptr(message.as_ptr()).to_string_lossy().contains("raven/state"));
        assert_eq!(ravenpose_publisher_send(first), Code::Loan as i32, "send without loan");
        let (mut state, mut again) = (null_mut(), null_mut());
        assert_eq!(ravenpose_publisher_loan(first, &raw mut state), 0);
        assert_eq!(ravenpose_publisher_loan(first, &raw mut again), 0);
        assert_eq!(state, again, "the same place until it is sent");
        assert_eq!((*state).sequence, 1);
        // Closing with a loan out is allowed.
        ravenpose_publisher_close(&raw mut first);
        assert!(first.is_null());
        ravenpose_publisher_close(&raw mut first);
        assert_eq!(ravenpose_publisher_open(&options(&name), &raw mut second, null_mut(), 0), 0);
        ravenpose_publisher_close(&raw mut second);
    }
}

#[test]
fn a_state_on_loan_stays_on_loan_while_others_are_published() {
    let name = prefix("both");
    let settings = Settings { prefix: name.0.to_str().expect("UTF-8").to_owned(), ..Settings::default() };
    let mut publisher = null_mut();
    let mut state = null_mut();
    let mut sequences = Vec::new();
    // SAFETY: valid pointers; `state` was given by `loan` and not sent yet.
    unsafe {
        assert_eq!(ravenpose_publisher_open(&options(&name), &raw mut publisher, null_mut(), 0), 0);
        let reader = Reader::<RavenState>::open(&settings, 4).expect("the service's end");
        assert_eq!(ravenpose_publisher_loan(publisher, &raw mut state), 0);
        (*state).pos[0] = -7;
        for count in 0..1000 {
            let mut other = RavenState::new();
            other.pos[0] = count;
            assert_eq!(ravenpose_publisher_publish(publisher, &raw const other), 0, "{count}");
            let taken = reader.next().expect("received").expect("one waits");
            assert_eq!(taken.pos[0], count);
            sequences.push(taken.sequence);
        }
        let mut again = null_mut();
        assert_eq!(ravenpose_publisher_loan(publisher, &raw mut again), 0);
        assert_eq!((again, (*state).pos[0]), (state, -7));
        assert_eq!(ravenpose_publisher_send(publisher), 0);
        let taken = reader.next().expect("received").expect("one waits");
        assert_eq!(taken.pos[0], -7);
        sequences.push(taken.sequence);
        ravenpose_publisher_close(&raw mut publisher);
    }
    assert_eq!(sequences, (1..=1001).collect::<Vec<_>>());
}

#[test]
fn a_prefix_that_is_no_file_name_is_refused() {
    let name = Prefix(CString::new("../evil").expect("no NUL"));
    let mut publisher = null_mut();
    // SAFETY: valid pointers.
    assert_eq!(unsafe { ravenpose_publisher_open(&options(&name), &raw mut publisher, null_mut(), 0) }, Code::Argument as i32);
}

#[test]
fn the_consumer_rule_gives_raw_unless_everything_is_right() {
    let mut good = CorrectedPose::new();
    good.source_time_ns = 1_000_000_000;
    good.arm[0].status = ArmStatus::Valid as u32;
    good.arm[0].raw_position_um = [1.0, 2.0, 3.0];
    good.arm[0].corrected_position_um = [4.0, 5.0, 6.0];
    good.seal(5);
    let rule = |pose: &CorrectedPose, arm: u32, now: i64| {
        let mut um = [0.0; 3];
        // SAFETY: valid pointers.
        let code = unsafe { ravenpose_position(pose, arm, now, um.as_mut_ptr()) };
        (code, um)
    };
    assert_eq!(rule(&good, 0, 1_004_999_999), (Code::Ok as i32, [4.0, 5.0, 6.0]));
    assert_eq!(rule(&good, 0, 1_005_000_000), (Code::Raw as i32, [1.0, 2.0, 3.0]), "too old");
    assert_eq!(rule(&good, 0, 999_000_000), (Code::Ok as i32, [4.0, 5.0, 6.0]), "a clock read before");
    assert_eq!(rule(&good, 0, 998_999_999), (Code::Raw as i32, [1.0, 2.0, 3.0]), "of another clock");
    assert_eq!(rule(&good, 2, 1_000_000_000).0, Code::Argument as i32);
    let mut fallback = good;
    fallback.arm[0].status = ArmStatus::Fallback as u32;
    assert_eq!(rule(&fallback, 0, 1_000_000_001), (Code::Raw as i32, [1.0, 2.0, 3.0]));
    assert_eq!(rule(&good, 1, 1_000_000_001), (Code::Absent as i32, [0.0; 3]), "no arm, no position");
    let mut torn = good;
    torn.guard_tail = 4;
    assert_eq!(rule(&torn, 0, 1_000_000_001).0, Code::Torn as i32);

    let (own, turned_by_model) =
        ([1.0_f32, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0], [-9.0_f32, 8.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0]);
    let mut turned = good;
    (turned.arm[0].orientation, turned.arm[0].corrected_orientation) = (own, turned_by_model);
    let rule = |pose: &CorrectedPose, arm: u32, now: i64| {
        let mut matrix = [0.5; 9];
        // SAFETY: valid pointers.
        let code = unsafe { ravenpose_orientation(pose, arm, now, matrix.as_mut_ptr()) };
        (code, matrix)
    };
    let (fresh, untouched) = (1_004_999_999, [0.5; 9]);
    assert_eq!(rule(&turned, 0, fresh), (Code::Raw as i32, own), "no model turned it");
    turned.arm[0].orientation_model_id = 9;
    assert_eq!(rule(&turned, 0, fresh), (Code::Ok as i32, turned_by_model));
    assert_eq!(rule(&turned, 0, 1_005_000_000), (Code::Raw as i32, own), "too old");
    assert_eq!(rule(&turned, 2, fresh), (Code::Argument as i32, untouched));
    assert_eq!(rule(&turned, 1, fresh), (Code::Absent as i32, untouched));
    let mut torn = turned;
    torn.guard_tail = 4;
    assert_eq!(rule(&torn, 0, fresh), (Code::Torn as i32, untouched));
    turned.arm[0].status = ArmStatus::Fallback as u32;
    assert_eq!(rule(&turned, 0, fresh), (Code::Raw as i32, own));
}

#[test]
fn every_code_has_a_text() {
    for code in -13..=3 {
        // SAFETY: a static text.
        let text = unsafe { CStr::from_ptr(ravenpose_error_text(code)) }.to_str().expect("UTF-8");
        assert!(!text.is_empty());
        assert_eq!(text == "unknown code", !(-12..=2).contains(&code), "{code}");
    }
}
