//! Weights, links, what turns with the motors, and the direction of gravity.

use arm::serial::{LinkInertia, PARAMETERS};
use nalgebra::{DMatrix, Vector3};

use super::dictionary::Dictionary;
use super::{Bound, Family};
use crate::cell::Channel;

/// The form of a payload whose place is supposed, not asked of the data.
pub(crate) const AT_THE_TIP: &str = "at the tip";
/// The form of an inertia that turns with the motor: it weighs nothing and loads no other joint. Files of robots seldom have it.
pub(crate) const ROTOR: &str = "of the drive";

/// What asks the motors for torque beside friction: bodies, their weight, and what touches them.
pub(crate) const CARRIED: [&str; 4] = ["payload", "link_inertia", "gravity_direction", "external_contact"];

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Family>) {
    if !dictionary.problem.has(TORQUE) {
        return;
    }
    let robot = dictionary.problem.robot;
    let n = robot.joint_count();
    let last = n - 1;
    let tip = robot.arm.tool_pose().translation.vector;
    let mut places = vec![(AT_THE_TIP, last, tip)];
    places.extend(robot.payload_sites.iter().map(|site| ("at a site", site.link, Vector3::from(site.position_m))));
    for (form, link, point) in places {
        all.push(Family::shaped(
            "payload",
            &[],
            form,
            TORQUE,
            &[Bound::Positive],
            &[("link", false), ("c_x", false), ("c_y", false), ("c_z", false)],
            vec![vec![link as f64, point.x, point.y, point.z]],
            move |d, s| vec![point_column(d, s[0] as usize, &Vector3::new(s[1], s[2], s[3]))],
        ));
    }
    let somewhere = Family::shaped(
        "payload",
        &[],
        "on the last link",
        TORQUE,
        &[Bound::Positive],
        &[("link", false), ("c_x", true), ("c_y", true), ("c_z", true)],
        vec![vec![last as f64, tip.x, tip.y, tip.z]],
        move |d, s| vec![point_column(d, s[0] as usize, &Vector3::new(s[1], s[2], s[3]))],
    );
    all.push(somewhere.stepped(&[None, Some(0.04), Some(0.04), Some(0.04)]).penalised(3.0));
    all.extend(anywhere(dictionary, last, &tip));
    // The links of one robot are the same in two recordings of it.
    let altered = if dictionary.problem.from_recording { 200.0 } else { 0.0 };
    for link in 0..n {
        let rotor = Family::fixed("link_inertia", &[link], ROTOR, TORQUE, &[Bound::Free], move |d| {
            vec![d.effort_of(link, d.at_grid(|r, i, _| d.problem.pairs[r].real.drive_acceleration[link][i]), false)]
        });
        // About an upright axis a link's inertia is that of its drive, and its mass a guess.
        all.push(rotor.penalised(0.5 + altered));
        let parameters = robot.arm.link_inertia(link).parameters();
        if parameters.iter().any(|x| *x != 0.0) {
            all.push(
                Family::fixed("link_inertia", &[link], "scaled", TORQUE, &[Bound::Between(-0.95, 20.0)], move |d| {
                    vec![weighted_column(d, link, &parameters)]
                })
                .penalised(1.0 + altered),
            );
        }
        // The first of those that the motion shows is the one that is reported: the mass, where it can be seen.
        let free = independent(dictionary, link, &EVERY);
        let Some(first) = free.first().map(|k| *k as f64) else { continue };
        let mut bounds = vec![Bound::Free; free.len()];
        if free[0] == 0 && parameters[0] > 0.0 {
            bounds[0] = Bound::Between(-parameters[0], MOST_MASS * parameters[0]);
        }
        let family = Family::shaped(
            "link_inertia",
            &[link],
            "free",
            TORQUE,
            &bounds,
            &[("parameter", false)],
            vec![vec![first]],
            move |d, _| free.iter().map(|k| parameter_column(d, link, *k)).collect(),
        );
        all.push(family.penalised(4.0 + altered));
    }
    super::gravity::push(dictionary, all);
}

const TORQUE: Channel = Channel::JointTorque;
/// How much further than the tip a payload may be from the frame of its link, m.
const BEYOND_THE_TIP_M: f64 = 0.25;
/// Share of a parameter's torque that no other one gives, from which it is told apart.
pub(super) const TOLD_APART: f64 = 0.1;
/// Share of the largest torque of a unit of any parameter below which one gives none: what is left is rounding, of right angles in a URDF too
/// (1.57).
const NONE_AT_ALL: f64 = 1e-3;
/// Times its mass that a link may be heavier than its file has it.
const MOST_MASS: f64 = 5.0;
/// Every parameter of a link: mass, first moments, second moments.
const EVERY: [usize; PARAMETERS] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9];

/// Mass and first moment free, as far as the motion shows them; its second moments are those of a point where the two put it.
/// A weight that is out of reach is another link's number, or a force.
fn anywhere(dictionary: &Dictionary, link: usize, tip: &Vector3<f64>) -> Option<Family> {
    let seen = independent(dictionary, link, &EVERY[..4]);
    if !seen.contains(&0) {
        return None;
    }
    let moments: Vec<usize> = (1..4).filter(|k| seen.contains(k)).collect();
    let names = ["mass", "moment_x", "moment_y", "moment_z"];
    let shape: Vec<&'static str> = std::iter::once(0).chain(moments.iter().copied()).map(|k| names[k]).collect();
    // To begin with its second moments are those of a weight at the tip, or none.
    let start: Vec<f64> = std::iter::once(1.0).chain(moments.iter().map(|k| tip[k - 1])).collect();
    let mut bounds = vec![Bound::Within(tip.norm() + BEYOND_THE_TIP_M); shape.len()];
    bounds[0] = Bound::Positive;
    let mut family = Family::secant("payload", &[], "anywhere on the last link", TORQUE, &bounds, &shape, move |d, s| {
        let mut place = Vector3::zeros();
        if s[0] != 0.0 {
            moments.iter().zip(&s[1..]).for_each(|(k, moment)| place[k - 1] = moment / s[0]);
        }
        let mut of_mass = LinkInertia::point(1.0, place).parameters();
        of_mass[1..4].fill(0.0);
        std::iter::once(weighted_column(d, link, &of_mass)).chain(moments.iter().map(|k| parameter_column(d, link, *k))).collect()
    });
    family.grid.push(start);
    Some(family.penalised(3.0))
}

/// The torque of a set of parameters of one link.
fn weighted_column(dictionary: &Dictionary, link: usize, parameters: &[f64; PARAMETERS]) -> super::Column {
    let n = dictionary.joints();
    let torques: Vec<Option<Vec<f64>>> = (0..n)
        .map(|j| {
            // Links beyond a joint load it; the others do not.
            (j <= link).then(|| {
                let regressor = dictionary.regressor();
                let start = j * n * PARAMETERS + link * PARAMETERS;
                regressor.iter().map(|y| y[start..start + PARAMETERS].iter().zip(parameters).map(|(a, b)| a * b).sum()).collect()
            })
        })
        .collect();
    dictionary.effort(&torques, true)
}

fn parameter_column(dictionary: &Dictionary, link: usize, k: usize) -> super::Column {
    let mut parameters = [0.0; PARAMETERS];
    parameters[k] = 1.0;
    weighted_column(dictionary, link, &parameters)
}

fn point_column(dictionary: &Dictionary, link: usize, point: &Vector3<f64>) -> super::Column {
    weighted_column(dictionary, link, &LinkInertia::point(1.0, *point).parameters())
}

/// Parameters of a link, of some of them, that the motion tells apart (pivoted Gram-Schmidt): the first one that shows at all, then
/// the one of which most is left.
fn independent(dictionary: &Dictionary, link: usize, among: &[usize]) -> Vec<usize> {
    let n = dictionary.joints();
    let regressor = dictionary.regressor();
    let rows = regressor.len() * (link + 1);
    let mut a = DMatrix::from_fn(rows, PARAMETERS, |row, k| {
        regressor[row / (link + 1)][(row % (link + 1)) * n * PARAMETERS + link * PARAMETERS + k]
    });
    let first: Vec<f64> = (0..PARAMETERS).map(|k| a.column(k).norm()).collect();
    let least = NONE_AT_ALL * first.iter().copied().fold(0.0, f64::max);
    let mut chosen = Vec::new();
    loop {
        let beside = among.iter().copied().filter(|k| first[*k] > least && !chosen.contains(k));
        let left = beside.map(|k| (k, a.column(k).norm() / first[k]));
        // Of equals the first: the mass.
        let most = |best: (usize, f64), one: (usize, f64)| if one.1 > best.1 { one } else { best };
        let Some((k, _)) = left.filter(|(_, share)| *share >= TOLD_APART).reduce(most) else { break };
        chosen.push(k);
        let unit = a.column(k) / a.column(k).norm();
        for other in 0..PARAMETERS {
            let along = unit.dot(&a.column(other));
            a.column_mut(other).axpy(-along, &unit, 1.0);
        }
    }
    chosen
}
