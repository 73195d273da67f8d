//! Progress bars: on a terminal only, and only for what takes longer than a second.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// One bar, in bytes or in any other unit.
pub(crate) struct Progress {
    begun: Instant,
    bar: Option<ProgressBar>,
    template: &'static str,
    terminal: bool,
}

impl Progress {
    /// Bytes of a file.
    pub(crate) fn bytes() -> Self {
        Self::new("{bar:40} {bytes}/{total_bytes} {bytes_per_sec} {eta} left")
    }

    /// Seconds of simulated time.
    pub(crate) fn seconds() -> Self {
        Self::new("{bar:40} {pos}/{len} s simulated, {eta} left")
    }

    /// Frames of a recording.
    pub(crate) fn frames() -> Self {
        Self::new("{bar:40} {pos}/{len} frames, {eta} left")
    }

    /// Images of a rendering.
    pub(crate) fn images() -> Self {
        Self::new("{bar:40} {pos}/{len} images, {eta} left")
    }

    fn new(template: &'static str) -> Self {
        Self { begun: Instant::now(), bar: None, template, terminal: std::io::stderr().is_terminal() }
    }

    /// So much of so much is done.
    pub(crate) fn at(&mut self, done: u64, total: u64) {
        if !self.terminal || self.begun.elapsed() < PATIENCE {
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            let style = ProgressStyle::with_template(self.template).unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(total).with_style(style)
        });
        bar.set_length(total);
        bar.set_position(done);
    }

    /// Takes the bar away.
    pub(crate) fn end(self) {
        if let Some(bar) = self.bar {
            bar.finish_and_clear();
        }
    }
}
