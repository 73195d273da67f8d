//! The Coriolis matrix that belongs to the Christoffel symbols of M, so that `dM/dt - 2C` is skew-symmetric.
//!
//! S. Echeandia, P. M. Wensing, "Numerical Methods to Compute the Coriolis Matrix and Christoffel Symbols for Rigid-Body
//! Systems", 2021, algorithm 1, here with all quantities in base coordinates. Spatial vectors: angular part first.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::stage::Stage;
use super::workspace::Spatial;
use super::{SerialArm, Workspace};

impl SerialArm {
    /// Coriolis matrix C(q, qd), N×N row-major: `C·qd` is [`Self::coriolis_torque`], and `dM/dt = C + Cᵀ`.
    ///
    /// # Panics
    /// If a vector is not N or `c_out` not N·N long, or the workspace is another arm's.
    pub fn coriolis(&self, ws: &mut Workspace, q: &[f64], qd: &[f64], c_out: &mut [f64]) {
        self.check_sizes(ws, &[q.len(), qd.len()]);
        let n = self.stages.len();
        assert_eq!(c_out.len(), n * n, "N N numbers of the Coriolis matrix");
        spread(&self.stages, &mut ws.spatial, q, qd);
        for j in (0..n).rev() {
            let body = ws.spatial[j];
            let late = body.inertia * body.axis_dot + body.quadratic * body.axis;
            let (early, turned) = (body.inertia * body.axis, body.quadratic.tr_mul(&body.axis));
            for (i, ancestor) in ws.spatial[..=j].iter().enumerate() {
                c_out[j * n + i] = ancestor.axis_dot.dot(&early) + ancestor.axis.dot(&turned);
                c_out[i * n + j] = ancestor.axis.dot(&late);
            }
            if j > 0 {
                ws.spatial[j - 1].inertia += body.inertia;
                ws.spatial[j - 1].quadratic += body.quadratic;
            }
        }
    }
}

/// Axis, its rate of change, inertia and velocity factor of every body in base coordinates.
fn spread(stages: &[Stage], bodies: &mut [Spatial], q: &[f64], qd: &[f64]) {
    let (mut rotation, mut position, mut velocity) = (Matrix3::identity(), Vector3::zeros(), Vector6::zeros());
    for ((stage, body), (&q, &rate)) in stages.iter().zip(bodies).zip(q.iter().zip(qd)) {
        let (r, p) = stage.place(q);
        position += rotation * p;
        rotation *= r;
        let z = rotation.column(2).into_owned();
        body.axis = if stage.prismatic { stack(&Vector3::zeros(), &z) } else { stack(&z, &position.cross(&z)) };
        velocity += body.axis * rate;
        let cross = motion_cross(&velocity);
        body.axis_dot = cross * body.axis;
        body.inertia = spatial_inertia(stage, &rotation, &position);
        let momentum = momentum_cross(&(body.inertia * velocity));
        body.quadratic = (momentum - cross.tr_mul(&body.inertia) - body.inertia * cross) * 0.5;
    }
}

fn stack(upper: &Vector3<f64>, lower: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(upper.x, upper.y, upper.z, lower.x, lower.y, lower.z)
}

fn blocks(a: &Matrix3<f64>, b: &Matrix3<f64>, c: &Matrix3<f64>, d: &Matrix3<f64>) -> Matrix6<f64> {
    let mut out = Matrix6::zeros();
    out.fixed_view_mut::<3, 3>(0, 0).copy_from(a);
    out.fixed_view_mut::<3, 3>(0, 3).copy_from(b);
    out.fixed_view_mut::<3, 3>(3, 0).copy_from(c);
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(d);
    out
}

/// `v×`: the cross product with a motion, as a matrix on motions.
fn motion_cross(v: &Vector6<f64>) -> Matrix6<f64> {
    let (w, u) = (Vector3::new(v[0], v[1], v[2]).cross_matrix(), Vector3::new(v[3], v[4], v[5]).cross_matrix());
    blocks(&w, &Matrix3::zeros(), &u, &w)
}

/// The matrix on motions m that gives `m ×* f`.
fn momentum_cross(f: &Vector6<f64>) -> Matrix6<f64> {
    let (n, l) = (-Vector3::new(f[0], f[1], f[2]).cross_matrix(), -Vector3::new(f[3], f[4], f[5]).cross_matrix());
    blocks(&n, &l, &l, &Matrix3::zeros())
}

/// Inertia of one link about the base's origin.
fn spatial_inertia(stage: &Stage, rotation: &Matrix3<f64>, p: &Vector3<f64>) -> Matrix6<f64> {
    let h = rotation * stage.moment;
    let moment = h + p * stage.mass;
    let diagonal = stage.mass * p.norm_squared() + 2.0 * p.dot(&h);
    let cross = p * h.transpose();
    let shift = Matrix3::from_diagonal_element(diagonal) - p * p.transpose() * stage.mass - cross - cross.transpose();
    let inertia = rotation * stage.inertia * rotation.transpose() + shift;
    let skew = moment.cross_matrix();
    blocks(&inertia, &skew, &skew.transpose(), &Matrix3::from_diagonal_element(stage.mass))
}
