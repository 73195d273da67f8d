//! Sampling, transmission, motor, control, cable and friction sections of the plant file.

use serde::Deserialize;

use crate::{JOINTS, Side, Tool};

/// `[sampling]` (section 5).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sampling {
    /// Control period, s.
    pub period_s: f64,
    /// Encoder counts per turn of the motor shaft.
    pub encoder_counts_per_rev: u32,
    /// Rounding of the encoder.
    pub encoder_quantiser: String,
    /// Cycles between measurement and use.
    pub measurement_delay_cycles: u32,
    /// Filter of the motor speed.
    pub velocity_filter: String,
    /// What holds the command between cycles.
    pub actuation: String,
    /// The filter that older builds have.
    pub alternative_filter: VelocityFilter,
}

/// Low-pass of the motor speed: `y[k] = Σ b·x + a1·y[k-1] + a2·y[k-2] + a3·y[k-3]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VelocityFilter {
    /// Name.
    pub kind: String,
    /// Feed-forward coefficients.
    pub b: [f64; 4],
    /// Feedback coefficients.
    pub a_feedback: [f64; 3],
}

/// `[transmission]` (section 3).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransmissionTable {
    /// Gear of motors 1 to 3.
    pub gear_big: f64,
    /// Gear of motors 4 to 7.
    pub gear_small: f64,
    /// Capstan radius of motors 1 to 3, m.
    pub capstan_radius_m: f64,
    /// Motor rad per joint rad; joint 3 per m.
    pub ratio: [f64; JOINTS],
    /// Units of `ratio`, in words.
    pub ratio_unit: [String; JOINTS],
    /// Joint 1 on motor 2, rad/rad.
    pub coupling_01: f64,
    /// Joint 1 on motor 3, m/rad.
    pub coupling_02: f64,
    /// Joint 2 on motor 3, m/rad.
    pub coupling_12: f64,
    /// Motor 3 rad per rad that reaches a tool motor.
    pub gb_ratio: f64,
    /// σ.
    pub tool_sign: ToolSign,
    /// κ.
    pub wrist_coupling: WristCoupling,
    /// Signs of the raw counts, gold arm.
    pub encoder_sign_gold: [i32; JOINTS],
    /// Signs of the raw counts, green arm.
    pub encoder_sign_green: [i32; JOINTS],
}

impl TransmissionTable {
    /// Gear of every motor.
    pub fn gears(&self) -> [f64; JOINTS] {
        std::array::from_fn(|i| if i < 3 { self.gear_big } else { self.gear_small })
    }
}

/// σ: the sign with which motor 3 reaches motors 4, 5 and 7; motor 6 takes the opposite.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "named by tool family and arm")]
pub struct ToolSign {
    pub raven_gold: i32,
    pub raven_green: i32,
    pub dv_gold: i32,
    pub dv_green: i32,
    pub square: i32,
}

impl ToolSign {
    /// σ of a tool on an arm.
    pub fn sigma(&self, side: Side, tool: Tool) -> f64 {
        f64::from(match (tool, side) {
            (Tool::Square, _) => self.square,
            (Tool::Raven, Side::Gold) => self.raven_gold,
            (Tool::Raven, Side::Green) => self.raven_green,
            (_, Side::Gold) => self.dv_gold,
            (_, Side::Green) => self.dv_green,
        })
    }
}

/// κ: joint 5 on the jaws.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "named by tool")]
pub struct WristCoupling {
    pub raven: f64,
    pub square: f64,
    pub dv_large_needle: f64,
    pub dv_micro_forceps: f64,
    pub dv_bipolar: f64,
    pub dv_cardiere: f64,
    pub dv_scissors: f64,
}

impl WristCoupling {
    /// κ of a tool.
    pub fn kappa(&self, tool: Tool) -> f64 {
        match tool {
            Tool::Raven => self.raven,
            Tool::Square => self.square,
            Tool::LargeNeedle => self.dv_large_needle,
            Tool::MicroForceps => self.dv_micro_forceps,
            Tool::Bipolar => self.dv_bipolar,
            Tool::Cardiere => self.dv_cardiere,
            Tool::Scissors => self.dv_scissors,
        }
    }
}

/// `[motor]` (section 5).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Torque constant at the shaft, N·m/A.
    pub torque_constant_nm_a: [f64; JOINTS],
    /// Command counts per ampere.
    pub dac_per_amp: [u32; JOINTS],
    /// Sign of the counts for a positive torque, gold arm.
    pub dac_sign_gold: [i32; JOINTS],
    /// Sign of the counts for a positive torque, green arm.
    pub dac_sign_green: [i32; JOINTS],
    /// Where the counts are clipped.
    pub dac_limit: [u32; JOINTS],
    /// Above this the controller zeroes the command and stops.
    pub dac_trip: u32,
    /// Rounding of the counts.
    pub dac_rounding: String,
    /// Inertia of motors 1 to 3, capstan N·m per motor rad/s².
    pub inertia_capstan: [f64; 3],
    /// Speed clamp of one simulator variant, rad/s; not nominal.
    pub speed_limit_rad_s: f64,
}

/// `[control]` (section 5).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Control {
    /// Proportional gain, capstan N·m per motor rad.
    pub kp: [f64; JOINTS],
    /// Derivative gain of the gold arm, capstan N·m per motor rad/s.
    pub kd_gold: [f64; JOINTS],
    /// Derivative gain of the green arm.
    pub kd_green: [f64; JOINTS],
    /// Integral gain, capstan N·m per motor rad·s.
    pub ki: [f64; JOINTS],
    /// Is gravity fed forward?
    pub gravity_feedforward: bool,
    /// Do the tool motors follow the measured motor 3?
    pub insertion_coupling_uses_measured_motor_3: bool,
    /// The controller's gravity model.
    pub gravity_model: GravityModel,
}

/// `[control.gravity_model]`: point masses in the frames of links 1 to 3.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GravityModel {
    /// Gravity in frame 0, m/s².
    pub gravity_m_s2: [f64; 3],
    /// Masses, kg.
    pub mass_kg: [f64; 3],
    /// Centres of the gold arm, m.
    pub com_gold_m: [[f64; 3]; 3],
    /// Centres of the green arm, m.
    pub com_green_m: [[f64; 3]; 3],
}

/// `[cable]` (section 7).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cable {
    /// Stiffness, N.
    pub ke_n: [f64; 3],
    /// Damping, N·s/m.
    pub be_ns_m: [f64; 3],
    /// The law in words.
    pub law: String,
    /// Radius of the joint pulleys, m; joint 3: 1.
    pub joint_radius_m: [f64; 3],
    /// The reaction on the motor in words.
    pub reaction_on_motor: String,
}

/// `[friction]` (section 7).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Friction {
    /// Coulomb friction of the motors, N·m at the capstan.
    pub motor_coulomb_nm: [f64; 3],
    /// Viscous friction of the motors, capstan N·m per motor rad/s.
    pub motor_viscous_nm_s: [f64; 3],
    /// Coulomb friction of the joints, N·m, N·m, N.
    pub joint_coulomb: [f64; 3],
    /// Viscous friction of the joints.
    pub joint_viscous: [f64; 3],
    /// The smoothing of the sign in words.
    pub sign_smoothing: String,
    /// Its speed at the motors, rad/s.
    pub motor_v_s_rad_s: [f64; 3],
    /// Its speed at the joints, rad/s, rad/s, m/s.
    pub joint_v_s: [f64; 3],
}

/// `[tool_axes]`: motors 4 to 7, all assumed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ToolAxes {
    /// Kind of transmission.
    pub transmission: String,
    /// Inertia, capstan N·m per motor rad/s².
    pub inertia_capstan: [f64; 4],
    /// Coulomb friction, N·m at the capstan.
    pub motor_coulomb_nm: [f64; 4],
    /// Viscous friction, capstan N·m per motor rad/s.
    pub motor_viscous_nm_s: [f64; 4],
}
