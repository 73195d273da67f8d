//! Shared by the tests: short simulated runs and a folder of one's own.
#![allow(dead_code, missing_docs, reason = "each test file uses its own part")]

use std::path::{Path, PathBuf};

use arm::Side;
use recordings::open::{Opened, open};
use recordings::save::{self, StateFormat};
use recordings::stream::Record;
use simulator::Robot;
use simulator::production::{Motion, Plan, Player};
use training::preset::Recipe;

/// A folder of our own, gone at the end.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ravenpose-training-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("folder");
        Self(path)
    }

    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    pub(crate) fn text(&self, name: &str, text: &str) -> PathBuf {
        let file = self.file(name);
        std::fs::write(&file, text).expect("file");
        file
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Runs of so many seconds of the worn robot, one homing.
pub(crate) fn runs(folder: &Folder, count: usize, seconds: f64, ending: &str) -> Vec<PathBuf> {
    runs_of(Robot::worn(), 5, folder, count, seconds, ending)
}

/// The same of any robot; the seed is that of the motion.
pub(crate) fn runs_of(robot: Robot, seed: u64, folder: &Folder, count: usize, seconds: f64, ending: &str) -> Vec<PathBuf> {
    let plan = Plan {
        robot,
        sides: vec![Side::Gold],
        duration_s: seconds * count as f64,
        run_s: seconds,
        seed,
        homing_seed: Some(7),
        runs_per_session: 1,
        motion: Motion::Mixed,
    };
    plan.runs()
        .into_iter()
        .map(|run| {
            let file = folder.file(&format!("run_{}{ending}", run.index));
            let format = StateFormat::of_name(&file).expect("format");
            let mut sink = save::create_states(&file, format, &[]).expect("file");
            Player::new(&plan, run).expect("robot").records(|record| sink.write(record)).expect("records");
            sink.finish().expect("file");
            file
        })
        .collect()
}

/// A recording with its records changed, in their order.
pub(crate) fn changed(folder: &Folder, recording: &Path, name: &str, mut change: impl FnMut(&mut Record)) -> PathBuf {
    rewritten(folder, recording, name, |mut record| {
        change(&mut record);
        Some(record)
    })
}

/// What is made of the records of a recording, those of which something is.
pub(crate) fn rewritten(folder: &Folder, of: &Path, name: &str, mut made: impl FnMut(Record) -> Option<Record>) -> PathBuf {
    let Opened::States(mut source) = open(of).expect("recording") else { panic!("states") };
    let file = folder.file(name);
    let mut sink = save::create_states(&file, StateFormat::Mcap, &[]).expect("file");
    while let Some(record) = source.next().expect("record") {
        if let Some(record) = made(record) {
            sink.write(&record).expect("record");
        }
    }
    sink.finish().expect("file");
    file
}

/// A recipe that takes a second.
pub(crate) fn small(preset: &str) -> Recipe {
    Recipe { hidden: vec![16, 12], epochs: 4, ..Recipe::preset(preset).expect("preset") }
}

pub(crate) fn python() -> Option<PathBuf> {
    std::env::var_os("RAVENPOSE_PYTHON").map(|python| Path::new(&python).to_owned())
}
