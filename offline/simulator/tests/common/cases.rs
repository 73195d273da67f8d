//! Every physics of the vocabulary with parameters of no size and of a size that shows, on every place of a robot.
#![allow(dead_code, missing_docs, reason = "each test file uses its own part")]

use simulator::model::Bound;
use simulator::physics::{Channel, Parameters, Physics, Value};

/// A physics that is not there, one that is, and where.
pub(crate) struct Case {
    pub(crate) none: Physics,
    pub(crate) some: Physics,
    pub(crate) bounds: Vec<Bound>,
}

/// What a robot has.
pub(crate) struct Places {
    /// Joints in all.
    pub(crate) joints: usize,
    /// Stiffness of the cables of its first joints; the others have none.
    pub(crate) stiffness: Vec<f64>,
    pub(crate) pairs: Vec<Bound>,
    pub(crate) heavy_links: usize,
    pub(crate) links: usize,
    /// N·m or N that show.
    pub(crate) ripple: f64,
    pub(crate) coulomb: f64,
    /// A plane that the tip passes, m along x.
    pub(crate) contact_x_m: f64,
}

pub(crate) fn physics(name: &str, numbers: &[(&str, f64)]) -> Physics {
    Physics::new(name, &Parameters::of(numbers)).expect("a name of the vocabulary").expect("parameters")
}

fn inertia(values: Vec<f64>) -> Physics {
    let parameters = Parameters([("dpi_B".to_owned(), Value::Vector(values))].into());
    Physics::new("link_inertia", &parameters).expect("name").expect("parameters")
}

fn contact(k: f64, x_0: f64) -> Physics {
    let mut parameters = Parameters::of(&[("k", k), ("x_0", x_0)]);
    parameters.0.insert("n".to_owned(), Value::Vector(vec![1.0, 0.0, 0.0]));
    Physics::new("external_contact", &parameters).expect("name").expect("parameters")
}

pub(crate) fn all(places: &Places) -> Vec<Case> {
    let joints = || (0..places.joints).map(Bound::Joint).collect::<Vec<_>>();
    let cables = || (0..places.stiffness.len()).map(Bound::Joint).collect::<Vec<_>>();
    let case = |name: &str, none: &[(&str, f64)], some: &[(&str, f64)], bounds: Vec<Bound>| Case {
        none: physics(name, none),
        some: physics(name, some),
        bounds,
    };
    let (f, amp) = (places.coulomb, places.ripple);
    let mut cases = vec![
        case("coulomb_friction", &[("f_c", 0.0)], &[("f_c", f)], joints()),
        case("viscous_friction", &[("b", 0.0)], &[("b", 2.0)], joints()),
        case(
            "stribeck_friction",
            &[("f_c", 0.0), ("f_s", 0.0), ("v_s", 0.01)],
            &[("f_c", 0.6 * f), ("f_s", 1.2 * f), ("v_s", 0.01)],
            joints(),
        ),
        case("load_dependent_friction", &[("mu_l", 0.0)], &[("mu_l", 0.3)], cables()),
        case("backlash", &[("b", 0.0)], &[("b", 0.003)], joints()),
        case("cable_stretch", &[("k", 1e15)], &[("k", 800.0)], cables()),
        case("cable_creep", &[("J_k", 0.0), ("T_k", 1.0)], &[("J_k", 1e-3), ("T_k", 1.0)], cables()),
        case("joint_coupling", &[("c_ij", 0.0)], &[("c_ij", 0.02)], places.pairs.clone()),
        case("payload", &[("m_p", 0.0)], &[("m_p", 0.2)], vec![Bound::Robot]),
        case("gravity_direction", &[], &[("b", 0.1)], vec![Bound::Robot]),
        Case {
            none: inertia(vec![0.0; 10]),
            some: inertia(vec![0.1, 0.0, 0.02, 0.0, 1e-3, 0.0, 1e-3, 0.0, 0.0, 1e-3]),
            bounds: (0..places.heavy_links).map(Bound::Link).collect(),
        },
        case("motor_torque_scale", &[], &[("kappa", 0.8), ("d_0", 30.0)], joints()),
        case("torque_ripple", &[("amp", 0.0), ("order", 6.0)], &[("amp", amp), ("order", 6.0)], joints()),
        case("joint_offset", &[("o", 0.0)], &[("o", 0.005)], joints()),
        case("transmission_ratio", &[("e", 0.0)], &[("e", 0.02)], joints()),
        case("pulley_eccentricity", &[("e_over_r", 0.0), ("period", 0.5)], &[("e_over_r", 0.002), ("period", 0.5)], joints()),
        case("link_geometry", &[], &[("d_alpha", 0.01), ("d_length", 0.003)], (0..places.links).map(Bound::Link).collect()),
        case("measurement_delay", &[], &[("d", 0.02)], Channel::NAMES.map(|(_, channel)| Bound::Channel(channel)).to_vec()),
        case("frame_misalignment", &[], &[("w_z", 0.02), ("t_x", 0.004)], vec![Bound::Robot]),
        Case { none: contact(1000.0, 10.0), some: contact(1000.0, places.contact_x_m), bounds: vec![Bound::Robot] },
        case("thermal_drift", &[("kappa_T", 0.0), ("T", 1.0)], &[("kappa_T", 0.5), ("T", 1.0)], joints()),
    ];
    // The element takes the place of the cable: without memory (a = 1) it is that cable.
    cases.extend(places.stiffness.iter().enumerate().map(|(joint, k)| {
        let (none, some) = ([("a", 1.0), ("k", *k), ("z_m", 1e-3)], [("a", 0.5), ("k", *k), ("z_m", 1e-4), ("g", 0.6)]);
        case("cable_hysteresis", &none, &some, vec![Bound::Joint(joint)])
    }));
    cases
}
