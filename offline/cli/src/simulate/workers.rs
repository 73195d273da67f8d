//! Runs on several threads; on any failure nothing is left.

use crate::progress::Progress;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

/// What a run sees of the others.
pub(super) struct Watch {
    cycles: AtomicU64,
    stop: AtomicBool,
}

impl Watch {
    /// Counts a cycle; an error once another run has failed.
    pub(super) fn cycle(&self) -> Result<(), String> {
        let done = self.cycles.fetch_add(1, Ordering::Relaxed);
        if done.is_multiple_of(1024) && self.stop.load(Ordering::Relaxed) { Err("stopped".to_owned()) } else { Ok(()) }
    }
}

/// Makes every file by `tasks` calls of `make`, given the number of each; returns what `make` returned, in order. `total` cycles are 100 %.
pub(super) fn all<T: Send>(
    files: &[PathBuf],
    tasks: usize,
    total: u64,
    threads: Option<usize>,
    make: impl Fn(usize, &Watch) -> Result<T, String> + Sync,
) -> Result<Vec<T>, String> {
    let next = AtomicUsize::new(0);
    let watch = Watch { cycles: AtomicU64::new(0), stop: AtomicBool::new(false) };
    let failure: Mutex<Option<String>> = Mutex::new(None);
    let made: Mutex<Vec<Option<T>>> = Mutex::new((0..tasks).map(|_| None).collect());
    let count = threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from)).clamp(1, tasks.max(1));
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= tasks || watch.stop.load(Ordering::Relaxed) {
                return;
            }
            match make(index, &watch) {
                Ok(found) => lock(&made)[index] = Some(found),
                Err(message) => {
                    watch.stop.store(true, Ordering::Relaxed);
                    lock(&failure).get_or_insert(message);
                }
            }
        }
    };
    let mut progress = Progress::seconds();
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..count).map(|_| scope.spawn(work)).collect();
        while workers.iter().any(|worker| !worker.is_finished()) {
            progress.at(watch.cycles.load(Ordering::Relaxed) / 1000, total / 1000);
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
    });
    progress.end();
    if let Some(message) = lock(&failure).take() {
        for file in files {
            drop(std::fs::remove_file(file));
        }
        return Err(message);
    }
    Ok(std::mem::take(&mut *lock(&made)).into_iter().flatten().collect())
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
