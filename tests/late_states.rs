//! States that are always late, or few, are answered as they are: nothing of the link is opened anew for them.

mod common;
#[path = "common/service.rs"]
mod service;

use ravenpose_transport::Writer;
use ravenpose_wire::RavenState;
use service::World;
use std::time::Duration;

#[test]
fn states_that_are_late_or_few_interrupt_nothing() {
    let world = World::new("late");
    let writer = Writer::<RavenState>::open(&world.settings).expect("a writer");
    let _process = world.start(&world.config("allow_untrained = true\nallow_degraded = true\n"), &[]);
    // Two and a half seconds of states that are always too old, then as long of few.
    let mut state = RavenState::new();
    let mut sequence = 0;
    for (count, pause_ms, late_ns) in [(1250, 2, 20_000_000), (8, 300, 0)] {
        for _ in 0..count {
            sequence += 1;
            state.source_time_ns = ravenpose_transport::now_ns() - late_ns;
            state.seal(sequence);
            writer.send(&state).expect("sent");
            std::thread::sleep(Duration::from_millis(pause_ms));
        }
    }
    assert!(!world.log().contains("another reader") && !world.log().contains("anew"), "{}", world.log());
}
