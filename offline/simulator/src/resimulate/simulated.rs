//! What a simulation gives: columns of a run.

use arm::serial::JointKind;
use recordings::{Column, Recording};

use crate::any_arm::{ArmCycle, Seen};
use crate::model::{Connection, RobotModel};
use crate::plant::Vector;

/// A simulated run: one entry per row in each list; joints beyond the robot's are 0.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Simulated {
    /// Time, s.
    pub time_s: Vec<f64>,
    /// Commanded joints, where there were commands.
    pub joints_d: Vec<Vector>,
    /// Motor angles, rad.
    pub motors: Vec<Vector>,
    /// Motor speeds, rad/s.
    pub speeds: Vec<Vector>,
    /// Commanded motor torque at the shaft, N·m; where a force acts on the joint itself, that.
    pub torque: Vec<Vector>,
    /// Joints as the controller reports them.
    pub joints: Vec<Vector>,
    /// Joint rates as the controller reports them.
    pub rates: Vec<Vector>,
    /// Joints as they are.
    pub true_joints: Vec<Vector>,
    /// Tip as the controller reports it, m, base frame (frame 0).
    pub tip: Vec<[f64; 3]>,
    /// Tip as it is.
    pub true_tip: Vec<[f64; 3]>,
    /// How many joints of each row mean anything.
    pub joint_count: usize,
}

impl Simulated {
    pub(super) fn new(joint_count: usize, rows: usize) -> Self {
        let room = || Vec::with_capacity(rows);
        Self {
            time_s: Vec::with_capacity(rows),
            joints_d: Vec::new(),
            motors: room(),
            speeds: room(),
            torque: room(),
            joints: room(),
            rates: room(),
            true_joints: room(),
            tip: Vec::with_capacity(rows),
            true_tip: Vec::with_capacity(rows),
            joint_count,
        }
    }

    pub(super) fn push(&mut self, time_s: f64, seen: &Seen, torque: &Vector) {
        self.time_s.push(time_s);
        self.motors.push(seen.motors);
        self.speeds.push(seen.speeds);
        self.torque.push(*torque);
        self.joints.push(seen.joints);
        self.rates.push(seen.rates);
        self.true_joints.push(seen.true_joints);
        self.tip.push(seen.tip);
        self.true_tip.push(seen.true_tip);
    }

    pub(super) fn push_cycle(&mut self, time_s: f64, cycle: &ArmCycle) {
        self.time_s.push(time_s);
        self.joints_d.push(cycle.joints_d);
        self.motors.push(cycle.motors);
        self.speeds.push(cycle.speeds);
        self.torque.push(cycle.torque);
        self.joints.push(cycle.joints);
        self.rates.push(cycle.rates);
        self.true_joints.push(cycle.true_joints);
        self.tip.push(cycle.tip);
        self.true_tip.push(cycle.true_tip);
    }

    /// Rows.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Has it no row?
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// As a tidy recording in SI units, with the names of contracts.md.
    pub fn to_recording(&self, name: &str, model: &RobotModel) -> Recording {
        let rows = ArmColumns::new(model, self.joint_count, !self.joints_d.is_empty());
        let mut values: Vec<Vec<f64>> = rows.names().iter().map(|_| Vec::with_capacity(self.len())).collect();
        let mut cells = Vec::new();
        for row in 0..self.len() {
            cells.clear();
            rows.push(&self.row(row), &mut cells);
            values.iter_mut().zip(&cells).for_each(|(column, cell)| column.push(*cell));
        }
        let mut columns = vec![Column::new("t_s", self.time_s.clone())];
        // In metres here: a recording in memory is in SI units.
        columns.extend(rows.names().into_iter().zip(values).map(|(name, values)| match name.strip_suffix("_mm") {
            Some(quantity) => Column::new(format!("{quantity}_m"), values.iter().map(|value| value * 1e-3).collect()),
            None => Column::new(name, values),
        }));
        let metadata = [("robot", model.name()), ("simulated", "true")].map(|(key, value)| (key.to_owned(), value.to_owned()));
        Recording { name: name.to_owned(), metadata: metadata.into(), columns, texts: Vec::new() }
    }

    /// One row.
    pub fn row(&self, row: usize) -> ArmCycle {
        ArmCycle {
            joints_d: self.joints_d.get(row).copied().unwrap_or_default(),
            motors: self.motors[row],
            speeds: self.speeds[row],
            torque: self.torque[row],
            joints: self.joints[row],
            rates: self.rates[row],
            true_joints: self.true_joints[row],
            tip: self.tip[row],
            true_tip: self.true_tip[row],
        }
    }
}

/// Columns of tidy CSV for an arm, after the time: names, and the cells of a cycle in their order.
#[derive(Debug, Clone)]
pub struct ArmColumns {
    kinds: Vec<JointKind>,
    connections: Vec<Connection>,
    commanded: bool,
}

impl ArmColumns {
    /// For the first joints of a robot; with or without commands.
    pub fn new(model: &RobotModel, joints: usize, commanded: bool) -> Self {
        let drives = model.drives();
        let connection = |joint: usize| drives.get(joint).map_or(Connection::Rigid, |drive| drive.connection);
        let kinds: Vec<JointKind> = model.joint_kinds().into_iter().take(joints).collect();
        Self { connections: (0..kinds.len()).map(connection).collect(), kinds, commanded }
    }

    /// Names with units.
    pub fn names(&self) -> Vec<String> {
        let mut out = Vec::new();
        let mut each = |name: &dyn Fn(usize, JointKind) -> Option<String>| {
            out.extend(self.kinds.iter().enumerate().filter_map(|(joint, kind)| name(joint, *kind)));
        };
        let motor = |joint: usize| self.connections[joint] != Connection::Force;
        let rate = |kind: JointKind| if kind.is_prismatic() { "m_s" } else { "rad_s" };
        each(&|j, _| motor(j).then(|| format!("mpos_{}_rad", j + 1)));
        each(&|j, _| motor(j).then(|| format!("mvel_{}_rad_s", j + 1)));
        each(&|j, kind| {
            Some(if motor(j) { format!("tau_{}_nm", j + 1) } else { format!("jtau_{}_{}", j + 1, kind.effort_unit()) })
        });
        each(&|j, kind| Some(format!("jpos_{}_{}", j + 1, kind.position_unit())));
        each(&|j, kind| Some(format!("jvel_{}_{}", j + 1, rate(kind))));
        if self.commanded {
            each(&|j, kind| Some(format!("jpos_d_{}_{}", j + 1, kind.position_unit())));
        }
        each(&|j, kind| Some(format!("truth_jpos_{}_{}", j + 1, kind.position_unit())));
        out.extend(["x_mm", "y_mm", "z_mm", "truth_x_mm", "truth_y_mm", "truth_z_mm"].map(str::to_owned));
        out
    }

    /// Appends the cells of a cycle.
    pub fn push(&self, cycle: &ArmCycle, out: &mut Vec<f64>) {
        let n = self.kinds.len();
        let motors = |values: &Vector, out: &mut Vec<f64>| {
            out.extend((0..n).filter(|joint| self.connections[*joint] != Connection::Force).map(|joint| values[joint]));
        };
        motors(&cycle.motors, out);
        motors(&cycle.speeds, out);
        out.extend(&cycle.torque[..n]);
        out.extend(&cycle.joints[..n]);
        out.extend(&cycle.rates[..n]);
        if self.commanded {
            out.extend(&cycle.joints_d[..n]);
        }
        out.extend(&cycle.true_joints[..n]);
        out.extend(cycle.tip.iter().chain(&cycle.true_tip).map(|metres| metres * 1e3));
    }
}
