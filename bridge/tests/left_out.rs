//! A controller that cannot connect a reader is told. A program of its own: it takes its own descriptors away.

#[path = "../../tests/common/mod.rs"]
mod common;
#[path = "../../tests/common/descriptors.rs"]
mod descriptors;

use descriptors::limit_descriptors;
use ravenpose_bridge::*;
use ravenpose_transport::{Reader, Settings};
use ravenpose_wire::RavenState;
use std::ffi::CString;
use std::ptr::null_mut;

#[test]
fn a_reader_that_cannot_be_connected_is_told_once_and_the_others_have_the_state() {
    let name = format!("rpleft{}_", std::process::id());
    let prefix = CString::new(name.clone()).expect("no NUL");
    let settings = Settings { prefix: name.clone(), ..Settings::default() };
    let mut publisher: *mut Publisher = null_mut();
    let publish = |publisher: *mut Publisher| {
        // SAFETY: an open publisher and a whole state.
        unsafe { ravenpose_publisher_publish(publisher, &RavenState::new()) }
    };
    // SAFETY: valid pointers.
    let opened = unsafe {
        let options = Options { prefix: prefix.as_ptr(), ..Options::default() };
        ravenpose_publisher_open(&raw const options, &raw mut publisher, null_mut(), 0)
    };
    assert_eq!(opened, 0);
    let first = Reader::<RavenState>::open(&settings, 4).expect("a reader");
    assert_eq!(publish(publisher), 0);
    assert!(first.next().expect("received").is_some());
    let second = Reader::<RavenState>::open(&settings, 4).expect("another reader");
    let before = limit_descriptors(1);
    let told = publish(publisher);
    limit_descriptors(before);
    assert_eq!(told, Code::Send as i32, "the second could not be reached");
    assert!(first.next().expect("received").is_some(), "the first has the state");
    assert!(second.next().map_or(true, |state| state.is_none()));
    assert_eq!(publish(publisher), 0, "told once");
    // SAFETY: opened above.
    unsafe { ravenpose_publisher_close(&raw mut publisher) };
    drop((first, second));
    common::remove_shared_memory(&name);
}
