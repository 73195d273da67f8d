//! What a cycle does beside the network, part by part: each many times in a row, with everything in the cache and no other core near.

use crate::path::{OwnLink, SHIPPED};
use crate::table::{Table, quantiles};
use ravenpose::config::ModelSource;
use ravenpose::correction::{ArmModel, Estimator, Model};
use ravenpose::cycle::{Cycle, Limits};
use ravenpose::guard::Guard;
use ravenpose::histogram::{STAGES, exchange};
use ravenpose::model::{Estimate, Loaded, load};
use ravenpose_transport::{Reader, Writer, now_ns};
use ravenpose_wire::{CorrectedPose, FEATURES, RavenState, features};
use std::hint::black_box;

/// In a batch, so that reading the clock does not count.
const IN_A_BATCH: i64 = 50;
const BATCHES: usize = 2_000;

/// Quantiles over batches of one call of `part`, µs.
fn time(mut part: impl FnMut()) -> [f64; 4] {
    let mut batch = || {
        let begun = now_ns();
        for _ in 0..IN_A_BATCH {
            part();
        }
        // ns of a thousand calls: one is below a nanosecond's resolution.
        (now_ns() - begun) * 1000 / IN_A_BATCH
    };
    (0..BATCHES / 10).for_each(|_| {
        batch();
    });
    let mut all: Vec<i64> = (0..BATCHES).map(|_| batch()).collect();
    quantiles(&mut all).map(|us| us / 1000.0)
}

/// A network that answers at once: what is left of a cycle is the cycle's own.
struct Nothing;

impl Estimator for Nothing {
    fn run(&mut self, _: &[f32; FEATURES], error: &mut [f32; 3]) {
        *error = [0.0; 3];
    }
}

/// The table.
pub(crate) fn run() -> Result<Table, String> {
    let Loaded { mut model, card, .. } = load(&ModelSource::new(SHIPPED[0].into())).map_err(|error| error.to_string())?;
    let input = card.golden.first().ok_or_else(|| format!("{}: no golden pair", SHIPPED[0]))?.input;
    let mut state = crate::path::state(1);
    features::insert(&input, 0, &mut state);
    let mut table = Table::new("A cycle's parts beside the network, one arm, in a row, us", &["p50", "p99", "p99.9", "max"]);
    let mut found = [0.0; FEATURES];
    table.row("features: 118 numbers out of a state", &time(|| features::extract(black_box(&state), 0, black_box(&mut found))));
    let bare = Guard::new(None);
    let mut check = |name: &str, guard: &Guard| {
        table.row(
            name,
            &time(|| {
                black_box(guard.check(black_box(&input)));
            }),
        );
    };
    check("guard: finite, and what a robot can be in", &bare);
    check("guard, with the trained domain", &model.guard);
    let mut now = 0;
    table
        .row("memory, load and friction: a state followed and weighed", &time(|| followed(&mut model.estimator, &input, &mut now)));
    table.row("the cycle without a network: admission, guard, slew, flags, seal", &time(a_cycle(&state, model.guard.clone())));
    table.row("publish: a pose handed over to one reader", &publish()?);
    let (mut recorder, _collector) = exchange();
    let mut value = 0;
    let recorded = || {
        for (stage, _) in STAGES {
            value = (value + 997) % 20_000;
            recorder.record(stage, value);
        }
        recorder.exchange();
    };
    table.row(&format!("recording: {} histograms", STAGES.len()), &time(recorded));
    table.row(
        "reading the clock",
        &time(|| {
            black_box(now_ns());
        }),
    );
    Ok(table)
}

fn followed(estimate: &mut Estimate, input: &[f32; FEATURES], now_ns: &mut i64) {
    *now_ns += 1_000_000;
    estimate.follow(black_box(input), *now_ns);
    estimate.weigh(black_box(input), *now_ns);
}

/// A turn of a cycle whose estimator does nothing.
fn a_cycle(state: &RavenState, guard: Guard) -> impl FnMut() + use<> {
    let model = Model {
        estimator: Nothing,
        guard,
        allowed: ravenpose::guard::Allowed::default(),
        id: 1,
        bound: 15_000.0,
        bound95: [1.0; 3],
        bound95_unsettled: [1.0; 3],
        untrained: false,
    };
    let models = [ArmModel::Loaded(Box::new(model)), ArmModel::None];
    let mut cycle = Cycle::new(Limits::default(), models, false, 0);
    let (mut state, mut pose) = (*state, CorrectedPose::new());
    move || {
        let now = state.source_time_ns + 1_000_000;
        let sequence = state.sequence + 1;
        state.enc_vals[0] ^= 1;
        state.source_time_ns = now;
        state.seal(sequence);
        cycle.offer(black_box(&state), now);
        black_box(cycle.step(now, &mut (), &mut pose));
        cycle.finish(now, false, &mut pose);
        black_box(&pose);
    }
}

/// To a reader of this thread, who takes each one; taking it is not in the time.
fn publish() -> Result<[f64; 4], String> {
    let told = |error: ravenpose_transport::TransportError| error.to_string();
    let link = OwnLink::new("stages");
    let writer: Writer<CorrectedPose> = Writer::open(&link.settings).map_err(told)?;
    let reader: Reader<CorrectedPose> = Reader::open(&link.settings, 1).map_err(told)?;
    let mut pose = CorrectedPose::new();
    let mut all = Vec::with_capacity(BATCHES * 10);
    for sequence in 1..=BATCHES as u64 * 10 {
        pose.seal(sequence);
        writer.prepare();
        let begun = now_ns();
        writer.send(&pose).map_err(told)?;
        all.push(now_ns() - begun);
        if reader.latest().map_err(told)?.is_none() {
            return Err("a pose that was handed over did not come".to_owned());
        }
    }
    Ok(quantiles(&mut all))
}
