//! The columns of a recording that a simulation starts from.

use arm::Motors;
use recordings::Recording;

use super::{Commands, ResimulateError};
use crate::any_arm::Sensors;
use crate::model::{Connection, RobotModel};
use crate::plant::{JOINTS_MAX, Vector, inverse};

/// Rows on either side of which speeds that were not recorded are differences: one of encoder steps over a millisecond is mostly noise.
const REACH: usize = 5;

/// One number per joint and row; joints beyond the robot's are 0.
type Rows = Vec<Vector>;

/// A recording of an arm, in SI units; what it does not have is none.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Run {
    /// Where it came from, for messages.
    pub name: String,
    /// Time of every row, s, rising.
    pub time_s: Vec<f64>,
    /// Commanded joints, rad and m.
    pub joints_d: Option<Rows>,
    /// Joints that have no column of commands, beside some that have.
    pub uncommanded: [bool; JOINTS_MAX],
    /// Motor angles as encoders show them, rad.
    pub motors: Option<Rows>,
    /// Motor speeds, rad/s.
    pub speeds: Option<Rows>,
    /// Motor torque at the shaft, N·m; where a force acts on the joint itself, that.
    pub torque: Option<Rows>,
    /// Joints as the controller reports them, rad and m.
    pub joints: Option<Rows>,
    /// Joints as measured at the joints; NaN where there was no measurement.
    pub true_joints: Option<Rows>,
}

impl Run {
    /// From a tidy recording of the robot.
    ///
    /// Torque is `tau_J_nm`, else `dac_J_counts` by the drive's constants, else the joint-side `jtau_J` through the coupling.
    /// Motors are `mpos_J_rad`, else the reported joints through the coupling.
    ///
    /// # Errors
    /// [`ResimulateError`] where there is no time or nothing of the robot's joints.
    pub fn from_recording(recording: &Recording, model: &RobotModel) -> Result<Self, ResimulateError> {
        let refuse = |what: String| ResimulateError::Run { recording: recording.name.clone(), what };
        let time_s = recording.time_s().ok_or_else(|| refuse("has no t_s; a run needs the time of its rows".to_owned()))?.to_vec();
        if time_s.len() < 2 {
            return Err(refuse("has fewer than two rows".to_owned()));
        }
        if let Some(row) = time_s.windows(2).position(|pair| pair[1] <= pair[0] || !pair[1].is_finite()) {
            return Err(refuse(format!("its time does not rise after row {}", row + 1)));
        }
        let columns = Columns { recording, model };
        let mut run = Self { name: recording.name.clone(), time_s, ..Self::default() };
        run.joints_d = columns.joints("jpos_d");
        run.uncommanded = std::array::from_fn(|joint| !columns.has("jpos_d", joint));
        run.joints = columns.joints("jpos");
        run.true_joints = columns.joints("truth_jpos");
        run.motors = columns.motors("mpos", "rad").or_else(|| Some(columns.motors_of_joints(run.joints.as_ref()?)));
        run.speeds = columns.motors("mvel", "rad_s");
        run.torque = columns.torque();
        if run.joints_d.is_none() && run.motors.is_none() && run.torque.is_none() && run.true_joints.is_none() {
            let kinds = model.joint_kinds();
            let unit = kinds[0].position_unit();
            return Err(refuse(format!(
                "has no column of this robot's joints, neither jpos_d_1_{unit} nor mpos_1_rad nor tau_1_nm"
            )));
        }
        let signals = [&run.joints_d, &run.motors, &run.speeds, &run.torque, &run.joints];
        let gap =
            signals.into_iter().flatten().find_map(|rows| rows.iter().position(|row| row.iter().any(|value| !value.is_finite())));
        match gap {
            Some(row) => Err(refuse(format!("row {} lacks a command, motor, torque or joint; cut the run there", row + 1))),
            None => Ok(run),
        }
    }

    /// Rows.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// The first row not earlier than a time after the first one, s; as many as there are rows where all are.
    pub(super) fn row_from(&self, from_s: f64) -> usize {
        self.time_s.partition_point(|time_s| time_s - self.time_s[0] < from_s)
    }

    /// Has it no row?
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Median time between two rows, s.
    pub fn period_s(&self) -> f64 {
        let mut steps: Vec<f64> = self.time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied().unwrap_or(1e-3)
    }

    /// Some of its rows.
    #[must_use]
    pub fn part(&self, rows: std::ops::Range<usize>) -> Self {
        let cut = |column: &Option<Rows>| column.as_ref().map(|values| values[rows.clone()].to_vec());
        Self {
            name: self.name.clone(),
            time_s: self.time_s[rows.clone()].to_vec(),
            joints_d: cut(&self.joints_d),
            uncommanded: self.uncommanded,
            motors: cut(&self.motors),
            speeds: cut(&self.speeds),
            torque: cut(&self.torque),
            joints: cut(&self.joints),
            true_joints: cut(&self.true_joints),
        }
    }

    /// Leaves, beside time and commands, what a simulation along the commands begins with: all of a run takes much memory.
    pub fn keep_commands(&mut self) {
        let others = [&mut self.motors, &mut self.speeds, &mut self.torque, &mut self.joints, &mut self.true_joints];
        for rows in others.into_iter().flatten() {
            rows.truncate(1 + REACH);
            rows.shrink_to_fit();
        }
    }

    /// Motors and their speeds at a row; speeds that were not recorded are differences over some rows.
    pub(super) fn state_at(&self, row: usize) -> Option<(Vector, Vector)> {
        let motors = self.motors.as_ref()?;
        let speeds = if let Some(speeds) = &self.speeds {
            speeds[row]
        } else {
            let (before, after) = (row.saturating_sub(REACH), (row + REACH).min(motors.len() - 1));
            let span_s = self.time_s[after] - self.time_s[before];
            std::array::from_fn(|i| if span_s > 0.0 { (motors[after][i] - motors[before][i]) / span_s } else { 0.0 })
        };
        Some((motors[row], speeds))
    }

    /// Motors and speeds in which a RAVEN-II begins the run; tool motors that were not recorded where their commands want them.
    pub fn start_of_raven(&self, model: &RobotModel, commands: &Commands) -> Option<(Motors, Motors)> {
        let (motors, speeds) = self.state_at(0)?;
        let arm = model.as_raven()?.raven.arm(model.side());
        let mut start = arm.transmission.motors(&std::array::from_fn(|i| commands.first()[i]));
        let n = model.joint_count();
        let has_tool = motors[n..].iter().any(|angle| *angle != 0.0);
        let known = if has_tool { start.len() } else { n };
        start[..known].copy_from_slice(&motors[..known]);
        Some((start, std::array::from_fn(|i| speeds[i])))
    }

    pub(super) fn missing(&self, column: &str, why: &'static str) -> ResimulateError {
        ResimulateError::Column { recording: self.name.clone(), column: column.to_owned(), why }
    }
}

struct Columns<'a> {
    recording: &'a Recording,
    model: &'a RobotModel,
}

impl Columns<'_> {
    /// A joint's column for every joint that has dynamics, and for those further ones that the recording has.
    fn joints(&self, quantity: &str) -> Option<Rows> {
        self.rows(|joint| self.name_of(quantity, joint))
    }

    fn has(&self, quantity: &str, joint: usize) -> bool {
        self.name_of(quantity, joint).is_some_and(|name| self.recording.column(&name).is_some())
    }

    fn name_of(&self, quantity: &str, joint: usize) -> Option<String> {
        let kind = self.model.joint_kinds().get(joint).copied()?;
        Some(format!("{quantity}_{}_{}", joint + 1, kind.position_unit()))
    }

    fn motors(&self, quantity: &str, unit: &str) -> Option<Rows> {
        let drives = self.model.drives();
        // A joint that a force acts on has no motor: its own position stands for it.
        self.rows(|joint| {
            let direct = drives.get(joint).is_some_and(|drive| drive.connection == Connection::Force);
            let (quantity, unit) = match (direct, unit) {
                (false, unit) => (quantity, unit),
                (true, "rad") => ("jpos", self.model.joint_kinds()[joint].position_unit()),
                (true, _) => ("jvel", if self.model.joint_kinds()[joint].is_prismatic() { "m_s" } else { "rad_s" }),
            };
            Some(format!("{quantity}_{}_{unit}", joint + 1))
        })
    }

    fn motors_of_joints(&self, joints: &Rows) -> Rows {
        let (sensors, coupling) = (Sensors::new(self.model, 1e-3), self.model.coupling());
        joints.iter().map(|joints| sensors.motors_for(joints, &coupling)).collect()
    }

    fn torque(&self) -> Option<Rows> {
        let drives = self.model.drives();
        let direct = |joint: usize| drives.get(joint).is_some_and(|drive| drive.connection == Connection::Force);
        let jtau = |joint: usize| format!("jtau_{}_{}", joint + 1, self.model.joint_kinds()[joint].effort_unit());
        let shaft = self.rows(|joint| {
            (joint < drives.len()).then(|| if direct(joint) { jtau(joint) } else { format!("tau_{}_nm", joint + 1) })
        });
        shaft.or_else(|| self.torque_of_counts()).or_else(|| self.torque_of_joints())
    }

    fn torque_of_counts(&self) -> Option<Rows> {
        let drives = self.model.drives();
        if drives.iter().any(|drive| drive.torque_per_count_nm() == 0.0) {
            return None;
        }
        let mut rows = self.rows(|joint| (joint < drives.len()).then(|| format!("dac_{}_counts", joint + 1)))?;
        for row in &mut rows {
            row.iter_mut().zip(&drives).for_each(|(value, drive)| *value *= drive.torque_per_count_nm());
        }
        Some(rows)
    }

    fn torque_of_joints(&self) -> Option<Rows> {
        let (drives, n) = (self.model.drives(), self.model.joint_count());
        let kinds = self.model.joint_kinds();
        let joint_side = self.rows(|joint| (joint < n).then(|| format!("jtau_{}_{}", joint + 1, kinds[joint].effort_unit())))?;
        let mut coupling = [[0.0; JOINTS_MAX]; JOINTS_MAX];
        for (row, given) in coupling.iter_mut().zip(self.model.coupling()) {
            row[..n].copy_from_slice(&given);
        }
        let inverse = inverse(&coupling, n)?;
        let of_row = |tau: &Vector| {
            let motor = |i: usize| (0..n).map(|k| inverse[k][i] * tau[k]).sum::<f64>() / drives[i].reduction;
            std::array::from_fn(|i| if i < n { motor(i) } else { 0.0 })
        };
        Some(joint_side.iter().map(of_row).collect())
    }

    /// Rows of columns by joint: all that have dynamics, or nothing.
    fn rows(&self, name: impl Fn(usize) -> Option<String>) -> Option<Rows> {
        let all = self.model.joint_kinds().len().min(JOINTS_MAX);
        let columns: Vec<Option<&[f64]>> = (0..all).map(|joint| self.recording.column(&name(joint)?)).collect();
        let n = self.model.joint_count();
        if columns[..n].iter().any(Option::is_none) {
            return None;
        }
        let row = |row: usize| std::array::from_fn(|joint| columns.get(joint).copied().flatten().map_or(0.0, |values| values[row]));
        Some((0..self.recording.rows()).map(row).collect())
    }
}
