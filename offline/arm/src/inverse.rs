//! Tip pose to joints: all solutions in closed form (raven2-plant.md, section 2, read backwards).
//!
//! The chain has three facts that make it solvable by hand: axes 1 to 3 meet in the remote centre, so the wrist point W lies
//! on axis 3 at distance `s = j3 + d4` of it; axes 4 and 5 meet in W; and the tip P lies `lw` from W along x5, normal to axis 6.
//!
//! 1. z5 is normal to z3, hence to W, hence to P: `z5 · P = 0` gives the yaw up to half a turn. Two candidates of W.
//! 2. `s = |W|` or `-|W|`: the wrist on either side of the centre. Two directions of z3.
//! 3. The angle between axes 1 and 3 gives θ2 up to its sign; then θ1, and j4, j5 from the rotation that is left.
//!
//! Eight solutions at most. Where a step has no unique answer, it says so: [`Degeneracy`].

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Vector3};

use crate::kinematics::{self, Kinematics, Link};
use crate::limits::Limits;
use crate::{JOINTS, Joints};

/// Most solutions that a pose has.
pub const MOST_SOLUTIONS: usize = 8;

/// Below this distance a direction cannot be told: the resolution of the published position, m.
pub const RESOLUTION_M: f64 = 1e-6;

/// What rounding may add to a cosine beyond 1.
const COSINE_SLACK: f64 = 1e-12;

/// Why a pose has no solution.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum InverseError {
    /// Not finite, or not a rotation.
    #[error("inverse kinematics: the pose is not a finite rigid transform; correct the rotation or position")]
    NotAPose,
    /// No posture of the first two axes points at any wrist point of this pose.
    #[error(
        "inverse kinematics: out of reach, the wrist lies {degrees:.3} degrees beyond what shoulder and elbow can point at; \
         move or turn the tip"
    )]
    Unreachable {
        /// Least angle by which the direction of axis 3 is missed, degrees.
        degrees: f64,
    },
    /// Infinitely many solutions.
    #[error("inverse kinematics: {0}; move the tip by a millimetre, or keep the joint that is free where it was")]
    Degenerate(Degeneracy),
    /// The plant file describes another kind of arm.
    #[error(
        "inverse kinematics: axes 1 to 3 and 4 to 5 of this plant file do not meet in a point, or axes 4 to 6 are not at right \
         angles; only such arms have this closed form"
    )]
    OtherGeometry,
}

/// A place where a joint is free: infinitely many joint positions give the same tip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Degeneracy {
    /// The wrist point lies in the remote centre: the direction of axis 3 is free.
    #[error("the wrist lies in the remote centre")]
    WristAtCentre,
    /// The yaw axis passes through the remote centre: the yaw is free.
    #[error("the yaw axis passes through the remote centre")]
    YawAxisThroughCentre,
}

/// How close a posture is to each singularity; every number is 0 there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closeness {
    /// Distance of the wrist point from the remote centre, m.
    pub wrist_to_centre_m: f64,
    /// Distance of the yaw axis from the remote centre, m.
    pub yaw_axis_to_centre_m: f64,
    /// |sin θ2|: 0 where the elbow is folded or stretched and axes 1 to 3 lie in one plane.
    pub elbow_sine: f64,
}

/// One posture that has the wanted tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// Joint positions; angles within half a turn of 0, or a turn on where only that is inside the limits.
    pub joints: Joints,
    /// Per joint: outside its command limits?
    pub outside: [bool; JOINTS],
    /// How close it is to the singularities.
    pub closeness: Closeness,
}

impl Solution {
    /// Are all joints inside their limits?
    pub fn within_limits(&self) -> bool {
        self.outside == [false; JOINTS]
    }

    /// Largest difference to other joint positions, rad or m, angles by the shorter way round.
    pub fn distance(&self, joints: &Joints) -> f64 {
        (0..JOINTS).map(|i| difference(i, self.joints[i], joints[i]).abs()).fold(0.0, f64::max)
    }
}

/// All solutions of a pose, one to eight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solutions {
    found: [Option<Solution>; MOST_SOLUTIONS],
    degeneracy: Option<Degeneracy>,
}

impl Solutions {
    /// The solutions.
    pub fn iter(&self) -> impl Iterator<Item = &Solution> {
        self.found.iter().flatten()
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.iter().count()
    }

    /// The solutions inside all limits.
    pub fn within_limits(&self) -> impl Iterator<Item = &Solution> {
        self.iter().filter(|solution| solution.within_limits())
    }

    /// The solution nearest to joint positions, inside the limits if any is.
    pub fn nearest(&self, joints: &Joints) -> Option<&Solution> {
        let rank = |solution: &&Solution| (!solution.within_limits(), solution.distance(joints));
        self.iter().min_by(|a, b| rank(a).partial_cmp(&rank(b)).unwrap_or(std::cmp::Ordering::Equal))
    }

    /// A branch that is left out because infinitely many postures stand in its place.
    pub fn degeneracy(&self) -> Option<Degeneracy> {
        self.degeneracy
    }
}

impl Kinematics {
    /// All joint positions with this tip pose, in frame 0 of the arm, and this jaw opening, rad.
    ///
    /// # Errors
    /// [`InverseError`]: not a pose, out of reach, a free joint everywhere, or a plant file with another kind of arm.
    pub fn inverse(&self, tip: &IsometryMatrix3<f64>, jaw_opening: f64, limits: &Limits) -> Result<Solutions, InverseError> {
        let rotation = tip.rotation.matrix();
        let orthonormal = (rotation.transpose() * rotation - Matrix3::identity()).amax() < 1e-6 && rotation.determinant() > 0.0;
        let finite = tip.translation.vector.iter().all(|value| value.is_finite()) && jaw_opening.is_finite();
        if !(orthonormal && finite) {
            return Err(InverseError::NotAPose);
        }
        let solver = Solver::new(self.links(), limits).ok_or(InverseError::OtherGeometry)?;
        solver.solve(tip, jaw_opening)
    }
}

/// The chain's constants, with what the closed form takes for granted checked.
struct Solver<'a> {
    links: &'a [Link; kinematics::FRAMES],
    limits: &'a Limits,
}

impl<'a> Solver<'a> {
    fn new(links: &'a [Link; kinematics::FRAMES], limits: &'a Limits) -> Option<Self> {
        let zero = |value: f64| value.abs() < 1e-12;
        let [l1, l2, l3, l4, l5, l6] = links;
        let meet = [l1, l2, l3, l4, l5].iter().all(|link| zero(link.a_m)) && [l1, l2, l5, l6].iter().all(|link| zero(link.d_m));
        let square = zero(l4.alpha_sin) && l4.alpha_cos > 0.0 && zero(l5.alpha_sin - 1.0) && zero(l6.alpha_sin - 1.0);
        let crossed = !zero(l2.alpha_sin) && !zero(l3.alpha_sin);
        (meet && square && crossed).then_some(Self { links, limits })
    }

    fn solve(&self, tip: &IsometryMatrix3<f64>, jaw_opening: f64) -> Result<Solutions, InverseError> {
        let centre_in_tip = tip.rotation.inverse() * tip.translation.vector;
        if centre_in_tip.x.hypot(centre_in_tip.y) < RESOLUTION_M {
            return Err(InverseError::Degenerate(Degeneracy::YawAxisThroughCentre));
        }
        let mut found = Solutions { found: [None; MOST_SOLUTIONS], degeneracy: None };
        let mut missed_by = f64::INFINITY;
        for half in 0..2 {
            let sign = if half == 0 { 1.0 } else { -1.0 };
            let theta_6 = (-sign * centre_in_tip.y).atan2(sign * centre_in_tip.x);
            let wrist = Wrist::new(tip, theta_6, self.links[5].a_m);
            if wrist.distance_m < RESOLUTION_M {
                found.degeneracy = Some(Degeneracy::WristAtCentre);
                continue;
            }
            for side in 0..2 {
                let s = if side == 0 { -wrist.distance_m } else { wrist.distance_m };
                match self.elbow(&(wrist.position / s)) {
                    Ok(elbows) => {
                        for (which, (theta_1, theta_2)) in elbows.into_iter().enumerate() {
                            let slot = half * 4 + side * 2 + which;
                            found.found[slot] = Some(self.posture(theta_1, theta_2, s, &wrist, jaw_opening));
                        }
                    }
                    Err(beyond) => missed_by = missed_by.min(beyond),
                }
            }
        }
        match (found.count(), found.degeneracy) {
            (0, Some(degeneracy)) => Err(InverseError::Degenerate(degeneracy)),
            (0, None) => Err(InverseError::Unreachable { degrees: missed_by.to_degrees() }),
            _ => Ok(found),
        }
    }

    /// Both pairs (θ1, θ2) that point axis 3 along `z3`; or the angle by which that fails.
    fn elbow(&self, z3: &Vector3<f64>) -> Result<[(f64, f64); 2], f64> {
        let [l1, l2, l3, ..] = self.links;
        // Frame 1 before its own turn.
        let u = Vector3::new(z3.x, l1.alpha_cos * z3.y + l1.alpha_sin * z3.z, l1.alpha_cos * z3.z - l1.alpha_sin * z3.y);
        let (folded, reach) = (l2.alpha_cos * l3.alpha_cos, l2.alpha_sin * l3.alpha_sin);
        let cosine = (folded - u.z) / reach;
        if cosine.is_nan() || cosine.abs() > 1.0 + COSINE_SLACK {
            let nearest = folded - reach * cosine.signum();
            return Err((nearest.clamp(-1.0, 1.0).acos() - u.z.clamp(-1.0, 1.0).acos()).abs());
        }
        let cosine = cosine.clamp(-1.0, 1.0);
        let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
        Ok([sine, -sine].map(|sine| {
            // z3 in frame 1 at θ1 = 0.
            let x = l3.alpha_sin * sine;
            let y = -l2.alpha_cos * l3.alpha_sin * cosine - l2.alpha_sin * l3.alpha_cos;
            (u.y.atan2(u.x) - y.atan2(x), sine.atan2(cosine))
        }))
    }

    /// Joint positions of one branch.
    fn posture(&self, theta_1: f64, theta_2: f64, s: f64, wrist: &Wrist, jaw_opening: f64) -> Solution {
        let [l1, l2, l3, l4, l5, l6] = self.links;
        let turn_3 = l1.transform(theta_1, 0.0) * l2.transform(theta_2, 0.0) * l3.transform(l3.theta_offset, 0.0);
        let rest = turn_3.rotation.inverse() * wrist.frame_5;
        let rest = rest.matrix();
        // Rz(θ4) Rx(90°) Rz(θ5): its z column and its last row.
        let theta_4 = rest.m13.atan2(-rest.m23);
        let theta_5 = rest.m31.atan2(rest.m32);
        let yaw = wrap(wrist.theta_6 - l6.theta_offset);
        let mut joints = [
            theta_1 - l1.theta_offset,
            theta_2 - l2.theta_offset,
            s - l4.d_m,
            theta_4 - l4.theta_offset,
            theta_5 - l5.theta_offset,
            jaw_opening / 2.0 - yaw,
            jaw_opening / 2.0 + yaw,
        ];
        for joint in [0, 1, 3, 4] {
            joints[joint] = self.unwound(joint, wrap(joints[joint]));
        }
        let closeness = Closeness {
            wrist_to_centre_m: s.abs(),
            yaw_axis_to_centre_m: (s * theta_5.sin() + l6.a_m).abs(),
            elbow_sine: theta_2.sin().abs(),
        };
        Solution { joints, outside: std::array::from_fn(|joint| !self.limits.allows(joint, joints[joint])), closeness }
    }

    /// The angle, or a turn on where only that is allowed.
    fn unwound(&self, joint: usize, angle: f64) -> f64 {
        let turned = [angle, angle + std::f64::consts::TAU, angle - std::f64::consts::TAU];
        turned.into_iter().find(|&angle| self.limits.allows(joint, angle)).unwrap_or(angle)
    }
}

/// The wrist of one yaw candidate.
struct Wrist {
    theta_6: f64,
    /// In frame 0, m.
    position: Vector3<f64>,
    distance_m: f64,
    /// Rotation of frame 5 in frame 0.
    frame_5: Rotation3<f64>,
}

impl Wrist {
    fn new(tip: &IsometryMatrix3<f64>, theta_6: f64, lw_m: f64) -> Self {
        let (sin, cos) = theta_6.sin_cos();
        // Rows of Rx(90°) Rz(θ6), transposed: frame 5 seen from the tip.
        let back = Matrix3::new(cos, 0.0, sin, -sin, 0.0, cos, 0.0, -1.0, 0.0);
        let frame_5 = tip.rotation * Rotation3::from_matrix_unchecked(back);
        let position = tip.translation.vector - frame_5 * Vector3::x() * lw_m;
        Self { theta_6, position, distance_m: position.norm(), frame_5 }
    }
}

/// An angle within half a turn of 0.
fn wrap(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

/// Difference of two positions of a joint.
fn difference(joint: usize, a: f64, b: f64) -> f64 {
    if joint == 2 { a - b } else { wrap(a - b) }
}
