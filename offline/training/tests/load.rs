//! A load that training has not seen shows in the motors' torque.
#![allow(missing_docs)]

mod common;

use arm::{Raven2, Side};
use common::{Folder, runs_of, small};
use simulator::Robot;
use training::data::{self, Reading, Trajectory};
use training::load;

const PAYLOAD: &str = "[[effect]]\nphysics = \"payload\"\nfrom_s = 60.0\nparameters = { m_p = 0.4, c_z = -0.45 }\n";

#[test]
fn a_mass_picked_up_after_training_is_noticed_and_weighed_and_none_is_not() {
    let folder = Folder::new("load");
    let recipe = small("default");
    let reading = Reading { plays: recipe.plays(), ..Reading::default() };
    let read = |robot: Robot, seed: u64, count: usize| -> Vec<Trajectory> {
        let files = runs_of(robot, seed, &folder, count, 120.0, ".mcap");
        data::read(&files, &reading, &mut |_, _| {}).expect("data").trajectories
    };
    let toml = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/raven2-worn.toml")).expect("robot");
    let loaded = Robot::from_toml(&format!("{toml}\n{PAYLOAD}")).expect("robot");
    let known = read(Robot::worn(), 5, 8);
    let plays = reading.plays.len();
    let card = load::fit(&Raven2::nominal().arm(Side::Gold), plays, &known[..6], &known[6..]).expect("they moved");
    assert!((0.03..0.3).contains(&card.limit_kg), "{}", card.limit_kg);
    for one in read(Robot::worn(), 6, 3) {
        let weighed = load::weigh(&card, plays, [&one], |_| true);
        assert!(!weighed.unseen.contains(&true), "{:?}", weighed.mass_kg.last());
    }
    for one in read(loaded, 6, 3) {
        let weighed = load::weigh(&card, plays, [&one], |_| true);
        let when_s = weighed.unseen.iter().zip(&one.time_s).find(|(unseen, _)| **unseen).map(|(_, time_s)| *time_s);
        let mass_kg = *weighed.mass_kg.last().expect("rows");
        assert!(when_s.is_some_and(|time_s| (60.0..110.0).contains(&time_s)), "{when_s:?}");
        // Forty seconds of motion are a time constant: 0.4 (1 - exp(-60/40)) = 0.31 at the end of the usual run.
        assert!((0.15..0.45).contains(&mass_kg), "{mass_kg}");
    }
}

#[test]
fn a_joint_that_goes_harder_than_in_training_shows_in_its_motor_s_friction() {
    let folder = Folder::new("friction");
    let reading = Reading { plays: small("default").plays(), ..Reading::default() };
    let plays = reading.plays.len();
    let toml = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/raven2-worn.toml")).expect("robot");
    assert!(toml.contains("parameters = { f_c = 3.0 }"));
    let of = |f_c: &str| Robot::from_toml(&toml.replace("f_c = 3.0", &format!("f_c = {f_c}"))).expect("robot");
    let read = |robot: Robot, seed: u64, count: usize| -> Vec<Trajectory> {
        let files = runs_of(robot, seed, &folder, count, 120.0, ".mcap");
        data::read(&files, &reading, &mut |_, _| {}).expect("data").trajectories
    };
    let known = read(of("3.0"), 5, 4);
    let card = load::fit(&Raven2::nominal().arm(Side::Gold), plays, &known[..3], &known[3..]).expect("they moved");
    let ends = |robot: Robot| -> [f32; 3] {
        let mut one = read(robot, 6, 1).remove(0);
        load::append_friction(&card, plays, &mut one);
        *one.inputs.last_chunk().expect("rows")
    };
    let (usual, harder, easier) = (ends(of("3.0")), ends(of("6.0")), ends(of("0.5")));
    println!("{usual:?} {harder:?} {easier:?} N·m");
    // At the capstan, 5.675 mm: what is found is of this size, and the other motors hardly notice.
    let capstan_nm = |newton: f32| newton * 5.675e-3;
    assert!((0.6..1.2).contains(&((harder[2] - usual[2]) / capstan_nm(3.0))), "{usual:?} {harder:?}");
    assert!((0.6..1.2).contains(&((usual[2] - easier[2]) / capstan_nm(2.5))), "{usual:?} {easier:?}");
    assert!((0..2).all(|motor| (harder[motor] - usual[motor]).abs() < 0.01), "{usual:?} {harder:?}");
}

#[test]
fn a_few_seconds_of_motion_are_too_few_and_that_is_said() {
    let folder = Folder::new("few");
    let set = data::read(&runs_of(Robot::worn(), 5, &folder, 3, 5.0, ".mcap"), &Reading::default(), &mut |_, _| {}).expect("data");
    let why = load::fit(&Raven2::nominal().arm(Side::Gold), 0, &set.trajectories, &[]).expect_err("too few");
    assert!(why.contains("at least 200 are needed"), "{why}");
}
