//! The plant against first principles.

use generator::arm::{Arm, DryLaw};
use generator::lagrange::Chain;
use generator::plant::{Plant, STEP};
use generator::random::Random;
use generator::robots;
use nalgebra::Vector3;

fn arm() -> Arm {
    robots::raven(&mut Random::new(7, "test")).truth
}

fn postures() -> Vec<([f64; 3], [f64; 3])> {
    let mut random = Random::new(11, "postures");
    let mut draw = |low: f64, high: f64| random.uniform(low, high);
    (0..20)
        .map(|_| ([draw(0.1, 1.4), draw(0.6, 2.2), draw(-0.3, -0.1)], [draw(-2.0, 2.0), draw(-2.0, 2.0), draw(-0.4, 0.4)]))
        .collect()
}

#[test]
fn mass_matrix_is_the_curvature_of_kinetic_energy() {
    let mut chain = Chain::<3>::new(&arm());
    chain.set_load(0.2, Vector3::new(0.02, -0.01, -0.03));
    for (q, _) in postures() {
        let mass = chain.posture(&q, &[0.0; 3]).mass;
        for j in 0..3 {
            for k in 0..3 {
                // T is quadratic in v, so differences of it are exact
                let at = |a: f64, b: f64| {
                    let mut v = [0.0; 3];
                    v[j] += a;
                    v[k] += b;
                    chain.energy(&q, &v).0
                };
                let curvature = at(1.0, 1.0) - at(1.0, 0.0) - at(0.0, 1.0);
                assert!((mass[j][k] - curvature).abs() < 1e-12, "{j}{k}: {} {curvature}", mass[j][k]);
            }
        }
    }
}

#[test]
fn velocity_and_gravity_terms_follow_from_the_energies() {
    let mut chain = Chain::<3>::new(&arm());
    chain.set_load(0.2, Vector3::new(0.02, -0.01, -0.03));
    let h = 1e-6;
    for (q, v) in postures() {
        let posture = chain.posture(&q, &v);
        let mass = |q: &[f64; 3]| chain.posture(q, &[0.0; 3]).mass;
        for j in 0..3 {
            // Lagrange: d/dt (dT/dv_j) - dT/dq_j at zero acceleration
            let (mut ahead, mut behind) = (q, q);
            for l in 0..3 {
                ahead[l] += h * v[l];
                behind[l] -= h * v[l];
            }
            let momentum = |m: [[f64; 3]; 3]| (0..3).map(|k| m[j][k] * v[k]).sum::<f64>();
            let rate = (momentum(mass(&ahead)) - momentum(mass(&behind))) / (2.0 * h);
            let (mut plus, mut minus) = (q, q);
            plus[j] += h;
            minus[j] -= h;
            let (up, down) = (chain.energy(&plus, &v), chain.energy(&minus, &v));
            let coriolis = rate - (up.0 - down.0) / (2.0 * h);
            let gravity = (up.1 - down.1) / (2.0 * h);
            assert!((posture.coriolis[j] - coriolis).abs() < 1e-7, "coriolis {j}: {} {coriolis}", posture.coriolis[j]);
            assert!((posture.gravity[j] - gravity).abs() < 1e-7, "gravity {j}: {} {gravity}", posture.gravity[j]);
        }
    }
}

#[test]
fn without_losses_energy_stays() {
    let mut arm = arm();
    arm.dry_law = DryLaw::Smooth(0.5);
    for drive in &mut arm.drives {
        (drive.dry, drive.viscous, drive.damping) = (0.0, 0.0, 0.0);
    }
    let mut plant = Plant::<3>::new(&arm, &[], [0.7, 1.4, -0.2], [0.5, -0.4, 0.1]);
    for _ in 0..100 {
        plant.step(&[0.0; 3]);
    }
    let before = plant.energy();
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    // the arm falls freely, motors and cables swinging
    for _ in 0..(2.0 / STEP) as usize {
        plant.step(&[0.0; 3]);
        let now = plant.energy();
        (low, high) = (low.min(now), high.max(now));
    }
    let moved = plant.motor[0] - 0.7;
    assert!(moved.abs() > 0.3, "the arm did not fall: {moved}");
    assert!(high - low < 0.01, "energy {before} J wandered within [{low}, {high}]");
}
