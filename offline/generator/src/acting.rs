//! Effects as the plant meets them: names turned into numbers once, before the first step.

use crate::arm::Arm;
use crate::effect::Effect;
use crate::friction::Brake;
use nalgebra::{Rotation3, Vector3};

/// What an effect does to the plant.
#[derive(Clone, Debug)]
pub enum Act {
    /// More friction; at the link instead of the motor; growing with load; varying with position (amplitude, period, phase,
    /// mean).
    Brake { at_link: bool, brake: Brake, load: f64, wave: [f64; 4] },
    /// Dry friction of the drive fades with heat: share lost, seconds, torque in N m (motor) that heats one second per second.
    Fade { share: f64, time: f64, reference: f64 },
    /// Series compliance, rad/(N m) or m/N.
    Compliance(f64),
    /// Full width of play, rad or m.
    Play(f64),
    /// Bouc-Wen: elastic share, yield deflection, exponent, shape.
    Hysteresis { a: f64, yields: f64, n: f64, g: f64 },
    /// Compliance that comes late: rad/(N m) or m/N, and seconds.
    Creep { compliance: f64, time: f64 },
    /// Stiffness growing with the square of deflection, N m/rad^3 or N/m^3.
    Cubic(f64),
    /// Each of two cables goes slack beyond this deflection, rad or m.
    Slack(f64),
    /// Position of joint `from` times `gain` is added.
    Coupling { from: usize, gain: f64 },
    /// Ratio error about a homing position.
    Ratio { gain: f64, home: f64 },
    /// Constant offset, rad or m.
    Offset(f64),
    /// Eccentric pulley: amplitude, period, phase.
    Eccentric([f64; 3]),
    /// Position that drifts with heat: final size, seconds, reference torque as in `Fade`.
    Drift { size: f64, time: f64, reference: f64 },
    /// Point mass in kg at a point of the last link.
    Payload(f64, Vector3<f64>),
    /// Gravity in the base frame instead of the nominal one.
    Gravity(Vector3<f64>),
    /// Change of one link: mass factor, shift of its centre in m, inertia factor.
    Link { mass: f64, shift: Vector3<f64>, inertia: f64 },
    /// Inertia of a joint's drive, factor.
    Rotor(f64),
    /// Twist added to the fixed turn after the link, rad; length added to it, m.
    Geometry { twist: f64, length: f64 },
    /// Torque constant factor.
    MotorScale(f64),
    /// Motor torque lost: joint-side amplitude, order per motor turn, phase.
    Ripple([f64; 3]),
    /// Wall at the tip: inward normal, a point of it, stiffness, exponent.
    Wall { normal: Vector3<f64>, at: Vector3<f64>, stiffness: f64, power: f64 },
    /// Force at the tip, N.
    Push(Vector3<f64>),
    /// Position and velocity gains of the controller, factors.
    Gains(f64, f64),
    /// Encoder counts lost at each of these times, s.
    Missed { counts: f64, times: [f64; 3] },
}

/// Friction that is the same everywhere.
const NO_WAVE: [f64; 4] = [0.0, 1.0, 0.0, 0.0];

/// An effect with its place, its weight at the present time and its memory.
#[derive(Clone, Debug)]
pub struct Acting {
    /// Joint, counted from 0.
    pub joint: usize,
    /// What it does.
    pub act: Act,
    /// The described effect, for its interval.
    pub effect: Effect,
    /// Share that acts now.
    pub weight: f64,
    /// Memory: bristle deflection, creep, heat in seconds.
    pub memory: f64,
}

impl Acting {
    /// None for effects of sensors alone, which leave the plant as it is.
    pub fn new(effect: &Effect, arm: &Arm) -> Option<Self> {
        let v = |name: &str| effect.value(name);
        let brake = |brake: Brake| Act::Brake { at_link: v("at_link") > 0.5, brake, load: v("mu_l"), wave: NO_WAVE };
        let act = match effect.physics.as_str() {
            "coulomb_friction" => brake(Brake { dry: v("f_c"), ..Brake::default() }),
            "viscous_friction" => brake(Brake { viscous: v("b"), ..Brake::default() }),
            "stribeck_friction" => {
                let (dry, excess) = (v("f_c"), v("f_s") - v("f_c"));
                brake(Brake { dry, excess, speed: v("v_s"), power: v("a"), ..Brake::default() })
            }
            "load_dependent_friction" => brake(Brake { dry: v("f_0"), ..Brake::default() }),
            "outside:position_friction" => Act::Brake {
                at_link: false,
                brake: Brake::default(),
                load: 0.0,
                wave: [v("amplitude"), v("period"), v("phase"), (v("amplitude") - v("spare")).max(0.0)],
            },
            "outside:drag" => {
                Act::Brake { at_link: true, brake: Brake { drag: v("drag"), ..Brake::default() }, load: 0.0, wave: NO_WAVE }
            }
            "thermal_drift" if v("drift") == 0.0 => Act::Fade { share: v("kappa_T"), time: v("T"), reference: v("reference") },
            "thermal_drift" => Act::Drift { size: v("drift"), time: v("T"), reference: v("reference") },
            "cable_stretch" => Act::Compliance(1.0 / v("k")),
            "backlash" => Act::Play(v("b")),
            "cable_hysteresis" => Act::Hysteresis { a: v("a"), yields: v("z_m"), n: v("n"), g: v("g") },
            "cable_creep" => Act::Creep { compliance: v("J_k"), time: v("T_k") },
            "outside:cubic_stiffness" => Act::Cubic(v("cubic")),
            "outside:cable_slack" => Act::Slack(v("pretension")),
            "joint_coupling" => Act::Coupling { from: v("from") as usize - 1, gain: -v("c_ij") },
            "transmission_ratio" => Act::Ratio { gain: v("e"), home: v("home") },
            "joint_offset" => Act::Offset(v("o")),
            "pulley_eccentricity" => Act::Eccentric([v("e_over_r"), v("period"), v("phi")]),
            "payload" => Act::Payload(v("m_p"), Vector3::new(v("c_x"), v("c_y"), v("c_z"))),
            "gravity_direction" => Act::Gravity(Rotation3::new(Vector3::new(v("a"), v("b"), 0.0)) * arm.gravity()),
            "link_inertia" if v("rotor_factor") > 0.0 => Act::Rotor(v("rotor_factor")),
            "link_inertia" => Act::Link {
                mass: v("mass_factor"),
                shift: Vector3::new(v("shift_x"), v("shift_y"), v("shift_z")),
                inertia: v("inertia_factor"),
            },
            "link_geometry" => Act::Geometry { twist: v("d_alpha"), length: v("d_length") },
            "motor_torque_scale" => Act::MotorScale(v("kappa")),
            "torque_ripple" => Act::Ripple([v("amp"), v("order"), v("phase")]),
            "external_contact" if v("k") > 0.0 => Act::Wall {
                normal: Vector3::new(v("n_x"), v("n_y"), v("n_z")),
                at: Vector3::new(v("x_0x"), v("x_0y"), v("x_0z")),
                stiffness: v("k"),
                power: v("p"),
            },
            "external_contact" => Act::Push(Vector3::new(v("n_x"), v("n_y"), v("n_z")) * v("f_max")),
            "outside:gain_change" => Act::Gains(v("kp_factor"), v("kd_factor")),
            "outside:missed_counts" => Act::Missed { counts: v("counts").round(), times: [v("t_1"), v("t_2"), v("t_3")] },
            _ => return None,
        };
        Some(Self { joint: effect.index(), act, effect: effect.clone(), weight: 1.0, memory: 0.0 })
    }

    /// True if the effect changes masses, geometry or gravity.
    pub fn is_rigid(&self) -> bool {
        matches!(self.act, Act::Payload(..) | Act::Gravity(_) | Act::Link { .. } | Act::Geometry { .. })
    }
}
