//! Numbers of a robot changed by a program: what an identification writes.

use arm::serial::LinkInertia;

use super::robot_model::Kind;
use super::{Connection, ControllerModel, DriveModel, RobotError, RobotModel};
use crate::plant::Passive;

impl RobotModel {
    /// Another drive for a joint. Of a RAVEN-II: reduction, rotor inertia, torque constant, friction, and stiffness and damping
    /// of its cable can change.
    ///
    /// # Errors
    /// [`RobotError::Change`] for numbers that no drive has, or that this robot cannot take.
    pub fn set_drive(&mut self, joint: usize, drive: &DriveModel) -> Result<(), RobotError> {
        self.check_joint(joint)?;
        for field in super::fields::FIELDS {
            if let Some(value) = (field.get)(drive).filter(|value| !field.range.has(*value)) {
                return Err(refuse(format!("{} is {value}, must be {}", field.name, field.range.words())));
            }
        }
        let elastic = drive.connection == Connection::Cable;
        if elastic != (drive.stiffness > 0.0) || (elastic && drive.rotor_inertia_kg_m2 == 0.0) {
            return Err(refuse("a cable needs a stiffness and a rotor inertia above 0, every other connection a stiffness of 0"));
        }
        match &mut self.kind {
            Kind::Raven(robot) => robot.set_drive(self.side, joint, drive),
            Kind::Urdf(robot) => {
                robot.drives[joint] = *drive;
                Ok(())
            }
        }
    }

    /// Another inertia for a link. Whether a body could have it, [`LinkInertia::is_physically_consistent`] tells.
    ///
    /// # Errors
    /// [`RobotError::Change`] for numbers that are not finite, or a link without dynamics.
    pub fn set_link_inertia(&mut self, link: usize, inertia: &LinkInertia) -> Result<(), RobotError> {
        self.check_joint(link)?;
        let finite = inertia.parameters().iter().all(|number| number.is_finite());
        if !finite || inertia.mass_kg < 0.0 || inertia.inertia_com_kg_m2 != inertia.inertia_com_kg_m2.transpose() {
            return Err(refuse("an inertia must be finite and symmetric, its mass 0 or more"));
        }
        match &mut self.kind {
            Kind::Raven(robot) => robot.set_link_inertia(self.side, link, inertia),
            Kind::Urdf(robot) => {
                robot.inertias[link] = Some(*inertia);
                Ok(())
            }
        }
    }

    /// Another coupling of the cables, as [`RobotModel::coupling`] gives it.
    ///
    /// # Errors
    /// [`RobotError::Change`] for a matrix of another form than the robot's.
    pub fn set_coupling(&mut self, coupling: &[Vec<f64>]) -> Result<(), RobotError> {
        let n = self.joint_count();
        let row = |(i, row): (usize, &Vec<f64>)| row.len() == n && row[i] == 1.0 && row.iter().all(|c| c.is_finite());
        if coupling.len() != n || !coupling.iter().enumerate().all(row) {
            return Err(refuse(format!("a coupling has {n} rows of {n} numbers with ones on the diagonal")));
        }
        match &mut self.kind {
            Kind::Raven(robot) => robot.set_coupling(coupling),
            Kind::Urdf(robot) => {
                robot.coupling = coupling.to_vec();
                Ok(())
            }
        }
    }

    /// Another spring and damper from a joint to the ground.
    ///
    /// # Errors
    /// [`RobotError::Change`] for a RAVEN-II, which has none.
    pub fn set_passive(&mut self, joint: usize, passive: Passive) -> Result<(), RobotError> {
        self.check_joint(joint)?;
        let Kind::Urdf(robot) = &mut self.kind else { return Err(refuse("a RAVEN-II has no springs to the ground")) };
        let good = [passive.stiffness, passive.damping].iter().all(|value| value.is_finite() && *value >= 0.0);
        if !good || !passive.rest.is_finite() {
            return Err(refuse("a spring and damper must be 0 or more and finite"));
        }
        robot.passive[joint] = passive;
        Ok(())
    }

    /// Other gains.
    ///
    /// # Errors
    /// [`RobotError::Change`] for a RAVEN-II, whose control software has its own, or another number of joints.
    pub fn set_controller(&mut self, controller: Option<ControllerModel>) -> Result<(), RobotError> {
        let n = self.joint_count();
        let Kind::Urdf(robot) = &mut self.kind else {
            return Err(refuse("the gains of a RAVEN-II are those of its control software ([plant.control])"));
        };
        if controller.as_ref().is_some_and(|controller| controller.joints.len() != n) {
            return Err(refuse(format!("a controller needs gains for {n} joints")));
        }
        robot.controller = controller;
        Ok(())
    }

    fn check_joint(&self, joint: usize) -> Result<(), RobotError> {
        let n = self.joint_count();
        if joint < n { Ok(()) } else { Err(refuse(format!("there is no joint or link {} with dynamics, only {n}", joint + 1))) }
    }
}

pub(super) fn refuse(what: impl Into<String>) -> RobotError {
    RobotError::Change(what.into())
}
