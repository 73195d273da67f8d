//! A controller that could not connect the service is connected later, without being restarted. A program of its own: it takes its own
//! descriptors away.

mod common;
#[path = "common/descriptors.rs"]
mod descriptors;
#[path = "common/service.rs"]
mod service;

use descriptors::limit_descriptors;
use ravenpose_transport::Writer;
use ravenpose_wire::RavenState;
use service::{CONFIG, World};
use std::time::Duration;

#[test]
fn a_service_that_a_controller_could_not_connect_opens_another_reader() {
    let world = World::new("unreached");
    let writer = Writer::<RavenState>::open(&world.settings).expect("a writer");
    let _process = world.start(&world.config(CONFIG), &[]);
    let poses = world.poses();
    let mut state = RavenState::new();
    let mut sequence = 0;
    let mut send = || {
        sequence += 1;
        state.source_time_ns = ravenpose_transport::now_ns();
        state.seal(sequence);
        let sent = writer.send(&state);
        std::thread::sleep(Duration::from_millis(1));
        sent
    };
    let before = limit_descriptors(1);
    let _ = send();
    limit_descriptors(before);
    assert_eq!(writer.take_left_out(), 1, "the service could not be connected");
    let mut answered = false;
    world.until("poses of these states", || {
        send().expect("sent");
        answered |= poses.latest().expect("received").is_some_and(|pose| pose.sequence > 0);
        answered
    });
    // What happened is said a second later.
    world.until("words for it", || world.log().contains("do not arrive") && world.log().contains("another reader is opened"));
}
