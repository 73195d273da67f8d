//! Services of our names that are not ours: every party refuses them when it connects, in one line, and ours refuse newcomers of another
//! layout. Nothing is ever read as something else (faults.md, F18 and F33).

mod common;
#[path = "common/service.rs"]
mod service;

use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::prelude::{Config, FileName, Path, SemanticString as _, ServiceName, SignalHandlingMode, ZeroCopySend, ipc};
use iceoryx2::service::builder::publish_subscribe::{Builder, PublishSubscribeOpenError};
use ravenpose_transport::{DEPTH_MAX, Message, Reader, Settings, TransportError, Writer};
use ravenpose_wire::{CorrectedPose, RavenState};
use service::{CONFIG, Process, World};

/// The next layout, of the same size.
#[repr(C)]
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[type_name("RavenState.v2")]
struct NextState(RavenState);

/// Under the name of ours, but longer.
#[repr(C)]
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[type_name("RavenState.v1")]
struct LongState(RavenState, u64);

/// Under the name of ours, but shorter.
#[repr(C)]
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[type_name("RavenState.v1")]
struct ShortState([u64; 128]);

#[repr(C)]
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[type_name("CorrectedPose.v0")]
struct EarlierPose(CorrectedPose);

#[repr(C)]
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[type_name("CorrectedPose.v1")]
struct LongPose(CorrectedPose, u64);

fn node(settings: &Settings) -> Node<ipc::Service> {
    iceoryx2::prelude::set_log_level(iceoryx2::prelude::LogLevel::Fatal);
    let mut config = Config::default();
    config.global.prefix = FileName::new(settings.prefix.as_bytes()).expect("prefix");
    config.global.set_root_path(&Path::new(settings.root.as_bytes()).expect("root"));
    NodeBuilder::new().config(&config).signal_handling_mode(SignalHandlingMode::Disabled).create().expect("a node")
}

/// A service with our settings and other contents.
fn like_ours<T: ZeroCopySend + std::fmt::Debug>(
    node: &Node<ipc::Service>,
    name: &str,
    readers: usize,
) -> Builder<T, (), ipc::Service> {
    node.service_builder(&ServiceName::new(name).expect("a name"))
        .publish_subscribe::<T>()
        .enable_safe_overflow(true)
        .history_size(1)
        .subscriber_max_buffer_size(DEPTH_MAX)
        .subscriber_max_borrowed_samples(2)
        .max_publishers(1)
        .max_subscribers(readers)
        .max_nodes(readers + 8)
}

fn assert_foreign<T: Message>(found: Result<impl Sized, TransportError>, why: &str, what: &str) {
    match found {
        Err(error @ TransportError::Foreign { .. }) => {
            let line = error.to_string();
            let start =
                format!("service {} exists with other contents than {} (PublishSubscribeOpenError({why}))", T::SERVICE, T::TYPE);
            assert!(line.starts_with(&start) && line.ends_with("stop the program that made it, or update it"), "{what}: {line}");
        }
        Err(error) => panic!("{what}: {error}"),
        Ok(_) => panic!("{what}: was opened"),
    }
}

/// Both of our ports, and the service itself, against what somebody else has made under `T`'s name; `why` is iceoryx2's word for it.
fn all_refuse<T: Message>(world: &World, why: &str, what: &str) {
    assert_foreign::<T>(Writer::<T>::open(&world.settings), why, what);
    assert_foreign::<T>(Reader::<T>::open(&world.settings, 1), why, what);
    let log = std::fs::File::create(world.dir.0.join("service.log")).expect("log");
    let mut service = Process(world.service(&world.config(CONFIG)).stderr(log).spawn().expect("the service starts"));
    let status = service.end();
    let words = world.log();
    assert_eq!(status.code(), Some(2), "{what}: {words}");
    let last = words.lines().last().unwrap_or_default();
    assert!(last.contains(T::SERVICE) && last.contains("exists with other contents than"), "{what}: {words}");
}

#[test]
fn a_service_of_our_name_with_other_contents_is_refused_by_every_party() {
    let world = World::new("foreign");
    let other = node(&world.settings);
    // What is wrong below is only what it says: with nothing wrong it would be ours.
    let ours = like_ours::<RavenState>(&other, RavenState::SERVICE, RavenState::MAX_READERS).create().expect("as ours");
    drop(Reader::<RavenState>::open(&world.settings, 1).expect("as ours"));
    drop(ours);
    macro_rules! refused {
        ($ours:ty, $theirs:ty, $readers:expr, $why:expr, $what:expr) => {
            let theirs = like_ours::<$theirs>(&other, <$ours>::SERVICE, $readers).create().expect($what);
            all_refuse::<$ours>(&world, $why, $what);
            drop(theirs);
        };
    }
    let (types, readers) = ("IncompatibleTypes", "DoesNotSupportRequestedAmountOfSubscribers");
    refused!(RavenState, NextState, RavenState::MAX_READERS, types, "states of the next layout");
    refused!(RavenState, LongState, RavenState::MAX_READERS, types, "states that are longer");
    refused!(RavenState, ShortState, RavenState::MAX_READERS, types, "states that are shorter");
    refused!(RavenState, CorrectedPose, RavenState::MAX_READERS, types, "poses where states belong");
    refused!(RavenState, RavenState, 2, readers, "states for fewer readers");
    refused!(CorrectedPose, EarlierPose, CorrectedPose::MAX_READERS, types, "poses of an earlier layout");
    refused!(CorrectedPose, LongPose, CorrectedPose::MAX_READERS, types, "poses that are longer");
    refused!(CorrectedPose, CorrectedPose, 2, readers, "poses for fewer readers");
    let slow = like_ours::<RavenState>(&other, RavenState::SERVICE, RavenState::MAX_READERS).enable_safe_overflow(false);
    let slow = slow.create().expect("states that a slow reader holds up");
    all_refuse::<RavenState>(&world, "IncompatibleOverflowBehavior", "states that a slow reader holds up");
    drop(slow);
    // They are gone, and nothing of the refusals is left in the way.
    let _writer = Writer::<RavenState>::open(&world.settings).expect("ours");
    let _reader = Reader::<CorrectedPose>::open(&world.settings, 1).expect("ours");
}

#[test]
fn newcomers_of_another_layout_are_refused_by_our_services() {
    let world = World::new("newcomer");
    let writer = Writer::<RavenState>::open(&world.settings).expect("ours");
    let reader = Reader::<RavenState>::open(&world.settings, 1).expect("ours");
    let _poses = Reader::<CorrectedPose>::open(&world.settings, 1).expect("ours");
    let other = node(&world.settings);
    macro_rules! refused {
        ($ours:ty, $theirs:ty) => {
            let found = like_ours::<$theirs>(&other, <$ours>::SERVICE, <$ours>::MAX_READERS).open();
            assert_eq!(found.err(), Some(PublishSubscribeOpenError::IncompatibleTypes), stringify!($theirs));
        };
    }
    refused!(RavenState, NextState);
    refused!(RavenState, LongState);
    refused!(RavenState, ShortState);
    refused!(RavenState, CorrectedPose);
    refused!(CorrectedPose, EarlierPose);
    refused!(CorrectedPose, LongPose);
    refused!(CorrectedPose, RavenState);
    // Ours go on.
    let mut state = RavenState::new();
    state.seal(7);
    writer.send(&state).expect("sent");
    assert_eq!(reader.next().expect("received").map(|state| state.sequence), Some(7));
}
