//! Gravity that points elsewhere, `Exp([a, b, 0])` about the base's x and y.

use arm::serial::{PARAMETERS, SerialArm};
use nalgebra::{Rotation3, Vector3};

use super::dictionary::{Column, Dictionary};
use super::inertial::TOLD_APART;
use super::{Bound, Family};
use crate::cell::Channel;
use crate::series::noise_of;

const TORQUE: Channel = Channel::JointTorque;
/// Furthest turn about an axis, rad.
const MOST: f64 = 0.9;
const FURTHEST: Bound = Bound::Between(-MOST, MOST);
/// Angles less than this are that large: a secant of nothing is a tangent.
const LEAST: f64 = 1e-4;
/// Share of the weights per radian that is none: what no joint feels in the first order has no direction.
const NOT_SEEN: f64 = 1e-3;
/// The form with links that are not what the lab says.
pub(crate) const WITH_OTHER_LINKS: &str = "turned, with other links";
/// The form of a turn in the plane in which all joints turn.
pub(crate) const IN_THE_PLANE: &str = "turned about one axis";
/// The form of a turn out of the plane in which all joints turn besides: by that they bear less of every weight.
pub(crate) const OUT_OF_PLANE: &str = "turned, and out of the plane of the joints";
/// What a lab may be wrong by: a link's mass, as a share of it, and its centre, m.
const MASS: f64 = 0.6;
const CENTRE_M: f64 = 0.06;
/// Mass and first moments: what gravity acts on.
const OF_GRAVITY: usize = 4;

/// A link, and which of its inertia's first four numbers.
type Number = (usize, usize);

/// Turned, and turned with links that are not what the lab says: gravity from another side loads joints by numbers that before it did not, and
/// which no motion of the simulation tells.
pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Family>) {
    let weights = Weights::new(dictionary);
    let tangents = turned(dictionary, &[0.0; 2]);
    let weight = dictionary.difference(dictionary.believed(), &dictionary.loads_of(&weightless(dictionary)), 1.0, true);
    if tangents.iter().all(|tangent| weights.size(tangent) <= NOT_SEEN * weights.size(&weight)) {
        return;
    }
    all.push(Family::secant("gravity_direction", &[], "turned", TORQUE, &[FURTHEST; 2], &["a", "b"], |d, s| turned(d, s).into()));
    if let Some(axis) = only_axis(&tangents, &weights) {
        let name = ["a", "b"][axis];
        let about = move |x: f64| if axis == 0 { [x, 0.0] } else { [0.0, x] };
        all.push(Family::secant("gravity_direction", &[], IN_THE_PLANE, TORQUE, &[FURTHEST], &[name], move |d, s| {
            let angle = no_less(s[0]);
            let [a, b] = about(angle);
            vec![d.difference(&d.loads_of(&tilted(d, a, b)), d.believed(), angle, true)]
        }));
        // Weights along the plane and across it are linear in gravity's two parts there.
        let bounds = [FURTHEST, Bound::Between(0.0, 1.0 - MOST.cos())];
        let family = Family::shaped(
            "gravity_direction",
            &[],
            OUT_OF_PLANE,
            TORQUE,
            &bounds,
            &[(name, false)],
            vec![vec![0.0]],
            move |d, _| {
                let [a, b] = about(LEAST);
                let (turned, none) = (d.loads_of(&tilted(d, a, b)), d.loads_of(&weightless(d)));
                vec![d.difference(&turned, d.believed(), LEAST, true), d.difference(&none, d.believed(), 1.0, true)]
            },
        );
        all.push(family.penalised(1.0));
    }
    let Some(about) = weights.angles(dictionary, &tangents) else { return };
    let numbers = told_apart(dictionary, &weights, &about);
    if numbers.is_empty() {
        return;
    }
    let bounds: Vec<Bound> = [FURTHEST; 2].into_iter().chain(numbers.iter().map(|_| Bound::Between(-1.0, 1.0))).collect();
    let mut family = Family::secant("gravity_direction", &[], WITH_OTHER_LINKS, TORQUE, &bounds, &["a", "b"], move |d, s| {
        let turned = turned(d, s);
        let others = of_numbers(d, s, &numbers, &weights.apart(&turned));
        turned.into_iter().chain(others).collect()
    });
    family.grid = vec![about.to_vec()];
    all.push(family.penalised(2.0));
}

/// The axis about which alone a turn is seen in the first order: joints that are all parallel turn in a plane, and a turn out of it that is as
/// large as may be fits noise.
fn only_axis(tangents: &[Column; 2], weights: &Weights) -> Option<usize> {
    let sizes = tangents.each_ref().map(|column| weights.size(column));
    let largest = usize::from(sizes[1] > sizes[0]);
    (sizes[1 - largest] < TOLD_APART * sizes[largest]).then_some(largest)
}

/// The torque by which links as they are believed load the joints, per unit of each angle: along the shortest way, first a, then b.
fn turned(d: &Dictionary, s: &[f64]) -> [Column; 2] {
    let [a, b] = [s[0], s[1]].map(no_less);
    let (first, both) = (d.loads_of(&tilted(d, a, 0.0)), d.loads_of(&tilted(d, a, b)));
    [d.difference(&first, d.believed(), a, true), d.difference(&both, &first, b, true)]
}

/// An angle of which a secant can be drawn.
fn no_less(angle: f64) -> f64 {
    if angle.abs() < LEAST { LEAST } else { angle }
}

fn tilted(d: &Dictionary, a: f64, b: f64) -> SerialArm {
    let mut arm = d.problem.robot.arm.clone();
    arm.set_gravity(Rotation3::from_scaled_axis(Vector3::new(a, b, 0.0)) * arm.gravity_vector());
    arm
}

/// The arm where nothing weighs anything.
fn weightless(d: &Dictionary) -> SerialArm {
    let mut arm = d.problem.robot.arm.clone();
    arm.set_gravity(Vector3::zeros());
    arm
}

/// What each of these numbers adds to that, if it is as wrong as it may be, but for what two other angles would: of these the lab's links say how
/// large they are.
fn of_numbers(d: &Dictionary, s: &[f64], numbers: &[Number], turned: &impl Fn(Column) -> Column) -> Vec<Column> {
    let n = d.joints();
    let arm = tilted(d, s[0], s[1]);
    let (there, here) = (d.regressor_of(&arm), d.regressor());
    let of_number = |(link, k): &Number| {
        let (at_most, first) = (most(&arm.link_inertia(*link).parameters(), *k), link * PARAMETERS + k);
        let torque = |j: usize| {
            let at = j * n * PARAMETERS + first;
            // Links beyond a joint load it; the others do not.
            (j <= *link).then(|| there.iter().zip(here).map(|(there, here)| at_most * (there[at] - here[at])).collect())
        };
        turned(d.effort(&(0..n).map(torque).collect::<Vec<_>>(), true))
    };
    numbers.iter().map(of_number).collect()
}

/// How wrong a number of a link may be.
fn most(parameters: &[f64; PARAMETERS], k: usize) -> f64 {
    let moment = parameters[1..OF_GRAVITY].iter().map(|x| x * x).sum::<f64>().sqrt();
    if k == 0 { MASS * parameters[0] } else { MASS * moment + CENTRE_M * parameters[0] }
}

/// The numbers that a motion tells apart (pivoted Gram-Schmidt), the one of which most is left first.
fn told_apart(d: &Dictionary, weights: &Weights, about: &[f64; 2]) -> Vec<Number> {
    let turned = turned(d, about);
    let numbers: Vec<Number> = (0..d.joints()).flat_map(|link| (0..OF_GRAVITY).map(move |k| (link, k))).collect();
    let size = |column: &Column| weights.size(column);
    let columns = of_numbers(d, about, &numbers, &weights.apart(&turned));
    let mut left: Vec<(Number, f64, Column)> =
        numbers.into_iter().zip(columns).map(|(number, column)| (number, size(&column), column)).collect();
    let least = TOLD_APART * left.iter().map(|(_, size, _)| *size).fold(0.0, f64::max);
    left.retain(|(_, size, _)| *size > least);
    let mut chosen = Vec::new();
    while let Some(k) = (0..left.len()).max_by(|a, b| size(&left[*a].2).total_cmp(&size(&left[*b].2))) {
        let (number, whole, column) = left.swap_remove(k);
        if size(&column) < TOLD_APART * whole {
            break;
        }
        chosen.push(number);
        for (_, _, other) in &mut left {
            *other = weights.without(other, &column);
        }
    }
    chosen
}

/// What a squared value of each cell is worth: one over its noise's.
struct Weights(Vec<f64>);

impl Weights {
    fn new(d: &Dictionary) -> Self {
        Self(d.problem.cells.iter().map(|cell| 1.0 / noise_of(&cell.residual, |_, _| true).powi(2).max(1e-300)).collect())
    }

    /// About which angles the residuals are turned by.
    fn angles(&self, d: &Dictionary, [one, other]: &[Column; 2]) -> Option<[f64; 2]> {
        let cells = d.problem.cells.iter().enumerate();
        let residual = Column { parts: cells.map(|(k, cell)| (k, cell.residual.iter().map(|x| *x as f32).collect())).collect() };
        let (aa, ab, bb) = (self.dot(one, one), self.dot(one, other), self.dot(other, other));
        let (a, b) = (self.dot(one, &residual), self.dot(other, &residual));
        let both = aa * bb - ab * ab;
        let angles = [(a * bb - b * ab) / both, (b * aa - a * ab) / both];
        angles.iter().all(|x| x.is_finite() && x.abs() > LEAST).then_some(angles)
    }

    fn dot(&self, x: &Column, y: &Column) -> f64 {
        x.products(y).map(|(cell, product)| product * self.0[cell]).sum()
    }

    fn size(&self, column: &Column) -> f64 {
        self.dot(column, column).sqrt()
    }

    /// What of a column is not along another one.
    fn without(&self, column: &Column, other: &Column) -> Column {
        let times = self.dot(other, column) / self.dot(other, other).max(1e-300);
        let scaled = |values: &Vec<f32>| values.iter().map(|x| (-times * f64::from(*x)) as f32).collect();
        column.clone().and(Column { parts: other.parts.iter().map(|(cell, values)| (*cell, scaled(values))).collect() })
    }

    /// What of columns is not along either of these.
    fn apart(&self, [one, other]: &[Column; 2]) -> impl Fn(Column) -> Column {
        let other = self.without(other, one);
        move |column| self.without(&self.without(&column, one), &other)
    }
}
