//! The shipped models' small weights on states of a run: what they were chosen by at start are random numbers.
#![allow(missing_docs)]

mod common;

use common::{Folder, runs};
use ravenpose::config::ModelSource;
use ravenpose::network::{Format, InstructionSet, Plan};
use std::path::PathBuf;
use training::data::{self, Reading};

const SECONDS: f64 = 60.0;

#[test]
fn shipped_models_in_small_weights_stay_within_the_services_limit_on_a_run() {
    let folder = Folder::new("weights");
    let files = runs(&folder, 1, SECONDS, ".mcap");
    for name in ["raven2-worn.onnx", "raven2-worn-orientation.onnx"] {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../models").join(name);
        let mut source = ModelSource::new(path);
        if name.contains("orientation") {
            source.quantity = ravenpose::correction::Quantity::Orientation;
        }
        let loaded = ravenpose::model::load(&source).expect("the service takes it");
        let network = ravenpose::model::network(&source.path).expect("network");
        let reading = Reading { plays: network.plays.clone(), target: source.quantity, ..Reading::default() };
        let set = data::read(&files, &reading, &mut |_, _| {}).expect("run");
        let rows: Vec<&[f32]> = set.trajectories[0].inputs.chunks_exact(set.inputs()).collect();
        assert!(rows.len() as f64 > 25.0 * SECONDS, "{} rows", rows.len());
        for format in [Format::I8, Format::I12, Format::I16] {
            let mut plan = Plan::with(&network, InstructionSet::best(), format);
            let (mut worst, mut squares) = (0.0_f64, 0.0);
            for row in &rows {
                // Friction as usual.
                let mut input = row.to_vec();
                input.resize(network.input_width, 0.0);
                let mut found = [0.0_f32; 3];
                plan.run(&input, &mut found);
                for (found, truth) in found.iter().zip(&network.evaluate_f64(&input)) {
                    let off = (f64::from(*found) - truth).abs() * 1000.0;
                    worst = worst.max(off);
                    squares += off * off;
                }
            }
            let rms = (squares / (3 * rows.len()) as f64).sqrt();
            println!("{name} {format}: worst {worst:.2}, rms {rms:.2} um or 0.001 deg over {} rows", rows.len());
            if format == loaded.model.estimator.plan().format() {
                assert!(worst <= source.weights_deviation, "{name} {format}: {worst} um");
            }
        }
    }
}
