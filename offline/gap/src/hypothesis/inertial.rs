//! Weights, links and the direction of gravity.

use arm::serial::{LinkInertia, PARAMETERS, Workspace};
use nalgebra::{DMatrix, Rotation3, Vector3};

use super::dictionary::Dictionary;
use super::{Bound, Candidate};
use crate::nominal::Evaluator;
use crate::problem::Channel;

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Candidate>) {
    let robot = dictionary.problem.robot;
    let n = robot.joint_count();
    let regressor = regressor(dictionary);
    let last = n - 1;
    let tip = robot.arm.tool_pose().translation.vector;
    let weight = |link: usize, point: Vector3<f64>| point_column(dictionary, &regressor, link, &point);
    all.push(
        Candidate::new("payload", &[], "at the tip", Channel::JointTorque)
            .shaped("link", last as f64)
            .shaped("c_x", tip.x)
            .shaped("c_y", tip.y)
            .shaped("c_z", tip.z)
            .with(weight(last, tip), Bound::Positive),
    );
    for site in &robot.payload_sites {
        let [x, y, z] = site.position_m;
        all.push(
            Candidate::new("payload", &[], "at a site", Channel::JointTorque)
                .shaped("link", site.link as f64)
                .shaped("c_x", x)
                .shaped("c_y", y)
                .shaped("c_z", z)
                .with(weight(site.link, Vector3::new(x, y, z)), Bound::Positive),
        );
    }
    // Mass and first moment free; inertia about the origin of a small body follows from them only roughly, and weighs little.
    let mut free = Candidate::new("payload", &[], "anywhere on the last link", Channel::JointTorque).shaped("link", last as f64);
    for k in 0..4 {
        free = free.with(parameter_column(dictionary, &regressor, last, k), if k == 0 { Bound::Positive } else { Bound::Free });
    }
    all.push(free);
    for link in 0..n {
        let own = robot.arm.link_inertia(link).parameters();
        if own.iter().any(|x| *x != 0.0) {
            all.push(
                Candidate::new("link_inertia", &[link], "scaled", Channel::JointTorque)
                    .shaped("mass", own[0])
                    .with(weighted_column(dictionary, &regressor, link, &own), Bound::Between(-0.9, 10.0)),
            );
        }
        let mut free = Candidate::new("link_inertia", &[link], "free", Channel::JointTorque);
        for k in independent(dictionary, &regressor, link) {
            free = free.shaped("parameter", k as f64).with(parameter_column(dictionary, &regressor, link, k), Bound::Free);
        }
        all.push(free);
    }
    push_gravity(dictionary, all);
}

/// The arm's regressor at every grid row, N×10N row-major.
fn regressor(dictionary: &Dictionary) -> Vec<Vec<f64>> {
    let robot = dictionary.problem.robot;
    let n = robot.joint_count();
    let mut ws = Workspace::new(&robot.arm);
    dictionary
        .grid
        .iter()
        .map(|&(r, i, _)| {
            let state = dictionary.problem.pairs[r].real.link(i);
            let mut y = vec![0.0; n * n * PARAMETERS];
            robot.arm.regressor(&mut ws, &state.position, &state.velocity, &state.acceleration, &mut y);
            y
        })
        .collect()
}

/// The torque of a set of parameters of one link.
fn weighted_column(dictionary: &Dictionary, regressor: &[Vec<f64>], link: usize, parameters: &[f64; PARAMETERS]) -> super::Column {
    let n = dictionary.joints();
    let torques: Vec<Option<Vec<f64>>> = (0..n)
        .map(|j| {
            // Links beyond a joint load it; the others do not.
            (j <= link).then(|| {
                let start = j * n * PARAMETERS + link * PARAMETERS;
                regressor.iter().map(|y| y[start..start + PARAMETERS].iter().zip(parameters).map(|(a, b)| a * b).sum()).collect()
            })
        })
        .collect();
    dictionary.effort(&torques, true)
}

fn parameter_column(dictionary: &Dictionary, regressor: &[Vec<f64>], link: usize, k: usize) -> super::Column {
    let mut parameters = [0.0; PARAMETERS];
    parameters[k] = 1.0;
    weighted_column(dictionary, regressor, link, &parameters)
}

fn point_column(dictionary: &Dictionary, regressor: &[Vec<f64>], link: usize, point: &Vector3<f64>) -> super::Column {
    weighted_column(dictionary, regressor, link, &LinkInertia::point(1.0, *point).parameters())
}

/// Parameters of a link that the motion tells apart, most visible first (pivoted Gram-Schmidt).
fn independent(dictionary: &Dictionary, regressor: &[Vec<f64>], link: usize) -> Vec<usize> {
    let n = dictionary.joints();
    let rows = regressor.len() * (link + 1);
    let mut a = DMatrix::from_fn(rows, PARAMETERS, |row, k| {
        regressor[row / (link + 1)][(row % (link + 1)) * n * PARAMETERS + link * PARAMETERS + k]
    });
    let first: Vec<f64> = (0..PARAMETERS).map(|k| a.column(k).norm().max(1e-12)).collect();
    let mut chosen = Vec::new();
    while chosen.len() < 6 {
        let (k, share) = (0..PARAMETERS)
            .filter(|k| !chosen.contains(k))
            .map(|k| (k, a.column(k).norm() / first[k]))
            .max_by(|x, y| x.1.total_cmp(&y.1))
            .expect("ten parameters");
        if share < 0.2 {
            break;
        }
        chosen.push(k);
        let unit = a.column(k) / a.column(k).norm();
        for other in 0..PARAMETERS {
            let along = unit.dot(&a.column(other));
            a.column_mut(other).axpy(-along, &unit, 1.0);
        }
    }
    chosen
}

/// Small turns of gravity about the base's x and y.
fn push_gravity(dictionary: &Dictionary, all: &mut Vec<Candidate>) {
    const TURN: f64 = 1e-4;
    let problem = dictionary.problem;
    let mut candidate = Candidate::new("gravity_direction", &[], "turned", Channel::JointTorque);
    for axis in [Vector3::x(), Vector3::y()] {
        let mut robot = problem.robot.clone();
        robot.arm.set_gravity(Rotation3::from_scaled_axis(axis * TURN) * problem.robot.arm.gravity_vector());
        let mut turned = Evaluator::new(&robot, problem.nominal);
        let torques: Vec<Vec<f64>> = dictionary
            .grid
            .iter()
            .map(|&(r, i, k)| {
                let state = problem.pairs[r].real.link(i);
                turned.link(&state).iter().zip(&problem.loads[r][k].link).map(|(t, l)| (t - l) / TURN).collect()
            })
            .collect();
        let series: Vec<Option<Vec<f64>>> = (0..dictionary.joints()).map(|j| Some(torques.iter().map(|t| t[j]).collect())).collect();
        candidate = candidate.with(dictionary.effort(&series, true), Bound::Between(-0.6, 0.6));
    }
    all.push(candidate);
}
