//! Latency histograms: recorded by the loop without allocation, read and written by the ordinary thread.
//!
//! The loop owns one set; when the ordinary thread has put an empty one into a queue, the loop exchanges the two at the end of a
//! cycle. Nothing is shared, nothing is locked, nothing is freed in the loop.

use hdrhistogram::Histogram;
use heapless::spsc::{Consumer, Producer, Queue};

/// What is measured in every cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Age of the state when it was taken.
    InputAge,
    /// How late the loop woke after the time it wanted.
    Wakeup,
    /// Reading the state and building the features, both arms.
    Features,
    /// Guard and network, both arms.
    Inference,
    /// Handing the pose over.
    Publish,
    /// From taking the state to the pose handed over.
    Total,
    /// From the state's own time to the pose handed over.
    InputToOutput,
}

/// Every stage with its name, in the order of the tables.
pub const STAGES: [(Stage, &str); 7] = [
    (Stage::InputAge, "input_age"),
    (Stage::Wakeup, "wakeup"),
    (Stage::Features, "features"),
    (Stage::Inference, "inference"),
    (Stage::Publish, "publish"),
    (Stage::Total, "total"),
    (Stage::InputToOutput, "input_to_output"),
];

/// Largest recorded value, 10 s; larger ones count as this.
const VALUE_MAX_NS: u64 = 10_000_000_000;

/// One histogram per stage, ns, three significant digits.
#[derive(Debug, Clone)]
pub struct Histograms {
    stages: [Histogram<u64>; STAGES.len()],
}

impl Histograms {
    /// Empty histograms of fixed size (200 kB each).
    ///
    /// # Panics
    /// Never: the bounds are constants that the library accepts.
    pub fn new() -> Self {
        let stages = std::array::from_fn(|_| {
            let mut histogram = Histogram::new_with_bounds(1, VALUE_MAX_NS, 3).unwrap_or_else(|_| unreachable!("constant bounds"));
            // Touches every bucket, so that recording never meets an unmapped page.
            histogram.reset();
            histogram
        });
        Self { stages }
    }

    /// Records a duration; negative ones count as zero.
    pub fn record(&mut self, stage: Stage, value_ns: i64) {
        self.stages[stage as usize].saturating_record(value_ns.max(0) as u64);
    }

    /// The histogram of a stage.
    pub fn stage(&self, stage: Stage) -> &Histogram<u64> {
        &self.stages[stage as usize]
    }

    /// Adds another set.
    pub fn add(&mut self, other: &Self) {
        for (to, from) in self.stages.iter_mut().zip(&other.stages) {
            // Cannot fail: same bounds.
            let _ = to.add(from);
        }
    }

    /// Forgets everything recorded.
    pub fn clear(&mut self) {
        for histogram in &mut self.stages {
            histogram.reset();
        }
    }
}

impl Default for Histograms {
    fn default() -> Self {
        Self::new()
    }
}

type Sets = Queue<Box<Histograms>, 4>;

/// The loop's end.
pub struct Recorder {
    active: Box<Histograms>,
    empty: Consumer<'static, Box<Histograms>>,
    full: Producer<'static, Box<Histograms>>,
}

/// The ordinary thread's end.
pub struct Collector {
    spare: Option<Box<Histograms>>,
    empty: Producer<'static, Box<Histograms>>,
    full: Consumer<'static, Box<Histograms>>,
}

/// A pair of connected ends. The two queues live as long as the process.
pub fn exchange() -> (Recorder, Collector) {
    let (empty_in, empty_out) = Box::leak(Box::new(Sets::new())).split();
    let (full_in, full_out) = Box::leak(Box::new(Sets::new())).split();
    (
        Recorder { active: Box::default(), empty: empty_out, full: full_in },
        Collector { spare: Some(Box::default()), empty: empty_in, full: full_out },
    )
}

impl Recorder {
    /// Records a duration.
    pub fn record(&mut self, stage: Stage, value_ns: i64) {
        self.active.record(stage, value_ns);
    }

    /// Hands the set over if an empty one waits. Call once per cycle, after everything else.
    pub fn exchange(&mut self) {
        if let Some(empty) = self.empty.dequeue() {
            let full = std::mem::replace(&mut self.active, empty);
            // There are two sets and room for more in either queue. Should that ever be untrue, leaking beats freeing here.
            if let Err(full) = self.full.enqueue(full) {
                std::mem::forget(full);
            }
        }
    }

    /// Ends the recording and gives up the set, for the last report.
    pub fn into_active(self) -> Box<Histograms> {
        self.active
    }
}

impl Collector {
    /// Asks for the loop's set and gives `take` the last one that came.
    pub fn collect(&mut self, take: impl FnOnce(&Histograms)) {
        if let Some(mut full) = self.full.dequeue() {
            take(&full);
            full.clear();
            self.spare = Some(full);
        }
        if let Some(spare) = self.spare.take()
            && let Err(spare) = self.empty.enqueue(spare)
        {
            self.spare = Some(spare);
        }
    }
}
