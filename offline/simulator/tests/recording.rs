//! The amplifier commands of a real RAVEN-II played into the plant (`data/raven2-uiuc`), beside the origin's own simulator.
#![allow(missing_docs)]

mod common;

use arm::Side;
use common::data;
use recordings::csv;
use simulator::Robot;
use simulator::replay::{MotorRecord, Replay, standing_still_rms};

/// The recording, or a plain word that it is absent.
fn recording() -> Option<MotorRecord> {
    let path = data().join("raven2-uiuc/real_first_two_thirds.csv");
    if !path.exists() {
        println!("skipped: {} is absent", path.display());
        return None;
    }
    Some(MotorRecord::from_recording(&csv::read(&path).expect("recording")).expect("motors"))
}

fn fitted() -> Robot {
    Robot::from_toml(include_str!("../../../models/raven2-uiuc-fit.toml")).expect("robot")
}

/// RMS over windows of one second of the origin's simulator, rad (issue 3).
const ORIGIN_1_S: [f64; 3] = [7.1, 26.8, 10.0];

#[test]
fn nominal_runs_no_further_off_than_half_the_origins_simulator_and_fitted_less_than_standing_still() {
    let Some(record) = recording() else { return };
    let still = standing_still_rms(&record, 1000);
    let nominal = Replay::new(&Robot::nominal(), Side::Gold).expect("plant").rms(&record, 1000);
    let fitted = Replay::new(&fitted(), Side::Gold).expect("plant").rms(&record, 1000);
    println!("1 s windows, rad RMS: origin {ORIGIN_1_S:?}, nominal {nominal:.2?}, fitted {fitted:.2?}, standing still {still:.2?}");
    for motor in 0..3 {
        assert!(nominal[motor] <= ORIGIN_1_S[motor] / 2.0, "motor {}: nominal {}", motor + 1, nominal[motor]);
        assert!(fitted[motor] < still[motor], "motor {}: fitted {}", motor + 1, fitted[motor]);
    }
}

/// The third that the fit did not see: what it leaves there of standing still, and the origin's simulator beside it, each window of it
/// shifted to the measured place at its start.
#[test]
fn on_the_third_that_it_was_not_fitted_to_the_fit_leaves_at_most_half_of_standing_still() {
    let Some(record) = recording() else { return };
    let from = record.len() * 2 / 3 / 1000 * 1000;
    let rest = record.part(from..record.len());
    let simulated = csv::read(&data().join("raven2-uiuc/uiuc_simulator_freerun_first_two_thirds.csv")).expect("simulation");
    let motors = [1, 2, 3].map(|motor| simulated.column(&format!("mpos_{motor}_rad")).expect("motors"));
    let mut squares = [0.0; 3];
    let windows = rest.len() / 1000;
    for begin in (0..windows).map(|window| from + 1000 * window) {
        for row in begin..begin + 1000 {
            for motor in 0..3 {
                let moved = |of: &dyn Fn(usize) -> f64| of(row) - of(begin);
                let off = moved(&|k| motors[motor][k]) - moved(&|k| record.angles[k][motor]);
                squares[motor] += off * off / (1000 * windows) as f64;
            }
        }
    }
    let origin = squares.map(f64::sqrt);
    let still = standing_still_rms(&rest, 1000);
    let found = Replay::new(&fitted(), Side::Gold).expect("plant").rms(&rest, 1000);
    println!("last third, 1 s windows, rad RMS: origin {origin:.2?}, fitted {found:.2?}, standing still {still:.2?}");
    // So few windows may flatter: those that begin elsewhere too.
    for begin in (100..1000).step_by(100) {
        let rest = rest.part(begin..rest.len());
        let found = Replay::new(&fitted(), Side::Gold).expect("plant").rms(&rest, 1000);
        println!("  the same from its row {begin} on: fitted {found:.2?}, standing still {:.2?}", standing_still_rms(&rest, 1000));
    }
    for motor in 0..3 {
        assert!(found[motor] < origin[motor], "motor {}: {}", motor + 1, found[motor]);
        assert!(found[motor] <= 0.5 * still[motor], "motor {}: {} of {}", motor + 1, found[motor], still[motor]);
    }
}

#[test]
fn longer_free_runs_of_the_nominal_plant_stay_closer_than_the_origins_simulator() {
    let Some(record) = recording() else { return };
    let rms = |robot: &Robot, window| Replay::new(robot, Side::Gold).expect("plant").rms(&record, window);
    for window in [5000, 14_000] {
        let (nominal, fitted, still) =
            (rms(&Robot::nominal(), window), rms(&fitted(), window), standing_still_rms(&record, window));
        println!("{} s: nominal {nominal:.1?}, fitted {fitted:.1?}, standing still {still:.1?} rad RMS", window / 1000);
        for motor in 0..3 {
            // The origin's free run over the whole recording (issue 3). The fitted set was fitted over one second at a time and a little
            // over five: over fourteen its motor 1 drifts away, as an open loop under gravity may.
            assert!(window > 5000 || fitted[motor] < 0.5 * still[motor], "motor {}: {}", motor + 1, fitted[motor]);
            let origin = [98.0, 394.0, 129.0][motor];
            assert!(nominal[motor] < origin / 3.0, "motor {}: {}", motor + 1, nominal[motor]);
            assert!(window > 5000 || fitted[motor] < still[motor], "motor {}: {}", motor + 1, fitted[motor]);
        }
    }
}
