//! The hysteretic benchmark of Noël and Schoukens (`data/boucwen-benchmark`) against a straight spring.
#![allow(missing_docs)]

mod common;

use common::{data, outcome, parameter, primary};
use simulator::RobotModel;
use simulator::resimulate::{Hold, OpenLoop, Run, open_loop};

const RUN: &str = "boucwen-benchmark/multisine.csv";
/// Periods that are simulated: the recording is one period of a steady state.
const PERIODS: usize = 4;

#[test]
fn the_hysteresis_is_named_measured_and_simulated() {
    let Some(outcome) = outcome("examples/boucwen.toml", &[RUN], &[]) else { return };
    let report = &outcome.report;
    let found = primary(report, "cable_hysteresis");
    assert_eq!(found.len(), 1);
    // The benchmark's k = alpha = 5e4 N/m, beta = 1e3, gamma = 0.8, delta = -1.1, nu = 1 (docs/simulator.md has the map).
    for (name, truth) in [("a", 0.5), ("k", 1e5), ("z_m", -1.0 / 300.0), ("g", 11.0 / 3.0), ("n", 1.0)] {
        let (value, [low, high]) = parameter(found[0], name);
        println!("{name} {value} ({low} to {high}), truth {truth}");
        assert!(low <= truth && truth <= high, "{name} {value} ({low} to {high}), truth {truth}");
    }
    let corrected = RobotModel::from_toml(outcome.corrected.as_deref().expect("a model"), None).expect("robot");
    let rms = simulated(&corrected);
    println!("simulated displacement off by {rms:.2e} m RMS");
    assert!(rms <= 5e-5, "{rms}");
}

/// RMS of simulated less given displacement over the last period but one, m: the force is known after it too.
fn simulated(robot: &RobotModel) -> f64 {
    let recording = recordings::csv::read(&data().join(RUN)).expect("recording");
    let (force, displacement) = (recording.column("force_N").expect("force"), recording.column("disp_m").expect("displacement"));
    let rows = force.len();
    let wide = |value: f64| std::array::from_fn(|i| if i == 0 { value } else { 0.0 });
    let run = Run {
        name: "multisine".to_owned(),
        time_s: (0..PERIODS * rows).map(|k| k as f64 / 750.0).collect(),
        torque: Some((0..PERIODS * rows).map(|k| wide(force[k % rows])).collect()),
        ..Run::default()
    };
    let found =
        open_loop(robot, &run, OpenLoop { window_s: f64::INFINITY, hold: Hold::Smooth, ..OpenLoop::default() }).expect("simulated");
    let squares: f64 = (0..rows).map(|k| (found.true_joints[(PERIODS - 2) * rows + k][0] - displacement[k]).powi(2)).sum();
    (squares / rows as f64).sqrt()
}
