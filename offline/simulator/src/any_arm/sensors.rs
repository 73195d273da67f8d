//! What instruments show of a plant: motors, joints, the tip.

use arm::serial::{SerialArm, Workspace};
use arm::{Arm, JOINTS, Joints};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::delay::DelayLine;
use crate::model::{DriveModel, RobotModel, delay};
use crate::physics::{Channel, Physics};
use crate::plant::{JOINTS_MAX, Matrix, State, Vector, inverse};
use crate::simulation::{frame, true_arm};

/// What is seen of a state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seen {
    /// Motor angles, rad.
    pub(crate) motors: Vector,
    /// Motor speeds, rad/s.
    pub(crate) speeds: Vector,
    /// Joints as computed from the motors, rad or m.
    pub(crate) joints: Vector,
    /// Joint rates as computed from the motors.
    pub(crate) rates: Vector,
    /// Joints as instruments at the joints show them.
    pub(crate) true_joints: Vector,
    /// Tip as computed from the motors, m, base frame.
    pub(crate) tip: [f64; 3],
    /// Tip as a tracker shows it.
    pub(crate) true_tip: [f64; 3],
}

/// The way from joints to the tip, as believed and as it is.
#[derive(Debug, Clone)]
enum Chain {
    Serial {
        believed: Box<SerialArm>,
        truth: Box<SerialArm>,
        workspace: Workspace,
    },
    /// With the joints of the tool, which this plant does not have.
    Raven {
        believed: Box<Arm>,
        truth: Box<Arm>,
    },
}

/// The instruments of a robot.
#[derive(Debug, Clone)]
pub(crate) struct Sensors {
    joints: usize,
    drives: Vec<DriveModel>,
    /// What a motor shows less than its angle counted from joint 0.
    zero: Vector,
    joint_offset: Vector,
    coupling_inverse: Matrix,
    chain: Chain,
    /// Joints 4 to 7 of a RAVEN-II.
    tool: Joints,
    stepped: bool,
    measured_from_true: Option<Isometry3<f64>>,
    motor_delay: Option<DelayLine<{ 2 * JOINTS_MAX }>>,
    joint_delay: Option<DelayLine<JOINTS_MAX>>,
    tip_delay: Option<DelayLine<3>>,
}

impl Sensors {
    /// For samples that follow each other by a period, s.
    pub(crate) fn new(model: &RobotModel, period_s: f64) -> Self {
        let (drives, n) = (model.drives(), model.joint_count());
        let mut coupling = [[0.0; JOINTS_MAX]; JOINTS_MAX];
        for (row, given) in coupling.iter_mut().zip(model.coupling()) {
            row[..n].copy_from_slice(&given);
        }
        let mut joint_offset = [0.0; JOINTS_MAX];
        joint_offset.iter_mut().zip(&drives).for_each(|(offset, drive)| *offset = drive.offset);
        let zero = std::array::from_fn(|i| {
            drives.get(i).map_or(0.0, |drive| drive.reduction * (0..n).map(|j| coupling[i][j] * joint_offset[j]).sum::<f64>())
        });
        let chain = match (model.as_raven(), model.as_urdf()) {
            (Some(raven), _) => {
                Chain::Raven { believed: Box::new(raven.raven.arm(model.side())), truth: Box::new(true_arm(raven, model.side())) }
            }
            (_, urdf) => {
                let believed = model.arm();
                let truth = urdf.map_or_else(|| believed.clone(), crate::model::UrdfRobot::true_arm);
                Chain::Serial { workspace: Workspace::new(&believed), believed: Box::new(believed), truth: Box::new(truth) }
            }
        };
        let line = |channel| delay(model.effects(), channel);
        let tool = model.as_raven().map_or([0.0; JOINTS], |raven| raven.raven.plant().limits.home);
        Self {
            joints: n,
            zero,
            joint_offset,
            coupling_inverse: inverse(&coupling, n).unwrap_or(coupling),
            chain,
            tool,
            stepped: false,
            measured_from_true: frame(model.effects()),
            motor_delay: line(Channel::Motor).map(|delay| DelayLine::new(delay, period_s)),
            joint_delay: line(Channel::Transmission).map(|delay| DelayLine::new(delay, period_s)),
            tip_delay: line(Channel::EndEffector).map(|delay| DelayLine::new(delay, period_s)),
            drives,
        }
    }

    /// Angles counted from joint 0, as the plant has them, for angles as encoders show them.
    pub(crate) fn counted_from_zero(&self, motors: &Vector) -> Vector {
        std::array::from_fn(|i| motors[i] + self.zero[i])
    }

    /// Motors as encoders show them, rad, for joints as the controller counts them, rad and m.
    pub(crate) fn motors_for(&self, joints: &Vector, coupling: &[Vec<f64>]) -> Vector {
        std::array::from_fn(|i| {
            let Some(row) = coupling.get(i) else { return 0.0 };
            let sum: f64 = row.iter().zip(joints).zip(&self.joint_offset).map(|((c, q), offset)| c * (q - offset)).sum();
            sum * self.drives[i].reduction
        })
    }

    /// Motor speeds for joint rates.
    pub(crate) fn motor_rates(&self, rates: &Vector, coupling: &[Vec<f64>]) -> Vector {
        std::array::from_fn(|i| {
            let Some(row) = coupling.get(i) else { return 0.0 };
            row.iter().zip(rates).map(|(c, rate)| c * rate).sum::<f64>() * self.drives[i].reduction
        })
    }

    /// The posture of a RAVEN-II's tool, where the joints say one.
    pub(crate) fn use_tool_of(&mut self, joints: &Vector) {
        if joints[self.joints..].iter().any(|position| *position != 0.0) {
            self.tool.copy_from_slice(&joints[..JOINTS]);
        }
    }

    /// Joints for motors as encoders show them; rates alike without the offset.
    pub(crate) fn joints_of(&self, motors: &Vector, offset: bool) -> Vector {
        let n = self.joints;
        std::array::from_fn(|i| {
            if i >= n {
                return 0.0;
            }
            let sum: f64 = (0..n).map(|k| self.coupling_inverse[i][k] * motors[k] / self.drives[k].reduction).sum();
            sum + if offset { self.joint_offset[i] } else { 0.0 }
        })
    }

    /// Does what they show depend on what they saw before?
    pub(crate) fn remember(&self) -> bool {
        self.motor_delay.is_some() || self.joint_delay.is_some() || self.tip_delay.is_some()
    }

    /// Looks at a state; to be called once per period.
    pub(crate) fn see(&mut self, state: &State, time_s: f64) -> Seen {
        let mut motors: Vector = std::array::from_fn(|i| state.motors[i] - self.zero[i]);
        let mut speeds = state.speeds;
        if let Some(line) = &mut self.motor_delay {
            let mut both = [0.0; 2 * JOINTS_MAX];
            both[..JOINTS_MAX].copy_from_slice(&motors);
            both[JOINTS_MAX..].copy_from_slice(&speeds);
            let late = line.pass(both, time_s);
            motors.copy_from_slice(&late[..JOINTS_MAX]);
            speeds.copy_from_slice(&late[JOINTS_MAX..]);
        }
        if self.stepped {
            self.quantise(&mut motors);
        }
        let joints = self.joints_of(&motors, true);
        let rates = self.joints_of(&speeds, false);
        let mut true_joints = state.joints;
        let mut true_tip = self.true_tip(&true_joints);
        if let Some(line) = &mut self.tip_delay {
            true_tip = line.pass(true_tip, time_s);
        }
        if let Some(line) = &mut self.joint_delay {
            true_joints = line.pass(true_joints, time_s);
        }
        Seen { motors, speeds, joints, rates, true_joints, tip: self.tip(&joints), true_tip }
    }

    /// Shows motors in steps of their encoders from now on, where the file says how many they have.
    pub(crate) fn in_steps(mut self) -> Self {
        self.stepped = true;
        self
    }

    fn quantise(&self, motors: &mut Vector) {
        for (motor, drive) in motors.iter_mut().zip(&self.drives) {
            if let Some(counts) = drive.encoder_counts_per_rev {
                let step = std::f64::consts::TAU / counts;
                *motor = (*motor / step).floor() * step;
            }
        }
    }

    /// Tip for joints as the controller counts them, m.
    pub(crate) fn tip(&mut self, joints: &Vector) -> [f64; 3] {
        let n = self.joints;
        match &mut self.chain {
            Chain::Serial { believed, workspace, .. } => believed.tip(workspace, &joints[..n]).translation.vector.into(),
            Chain::Raven { believed, .. } => believed.kinematics.tip_position(&with_tool(joints, &self.tool)).into(),
        }
    }

    fn true_tip(&mut self, joints: &Vector) -> [f64; 3] {
        let n = self.joints;
        let tip: Vector3<f64> = match &mut self.chain {
            Chain::Serial { truth, workspace, .. } => truth.tip(workspace, &joints[..n]).translation.vector,
            Chain::Raven { truth, .. } => truth.kinematics.tip_position(&with_tool(joints, &self.tool)),
        };
        match &self.measured_from_true {
            None => tip.into(),
            Some(frame) => (frame * Point3::from(tip)).coords.into(),
        }
    }
}

fn with_tool(joints: &Vector, tool: &Joints) -> Joints {
    let mut all = *tool;
    all[..arm::RIGID_JOINTS].copy_from_slice(&joints[..arm::RIGID_JOINTS]);
    all
}

/// Does an effect start or end within a run?
pub(crate) fn is_timed(model: &RobotModel) -> bool {
    model.effects().iter().any(|effect| {
        let always = effect.from_s == f64::NEG_INFINITY && effect.to_s == f64::INFINITY;
        !always && !matches!(effect.physics, Physics::LinkGeometry(_))
    })
}
