//! Numbers of a RAVEN-II changed by a program, kept as `[plant]` of its file has them.

use arm::Side;
use arm::serial::LinkInertia;
use toml::{Table, Value};

use super::change::refuse;
use super::raven_file::{changed, merge};
use super::{DriveModel, Robot, RobotError};

/// A number of a drive and where the plant file has it.
struct Change<'a> {
    before: f64,
    after: f64,
    section: &'static str,
    key: &'static str,
    numbers: &'a [f64],
    /// From the shaft or joint to what the plant file has.
    scale: f64,
}

impl Robot {
    pub(super) fn set_drive(&mut self, side: Side, joint: usize, wanted: &DriveModel) -> Result<(), RobotError> {
        let now = self.drives(side)[joint];
        let plant = self.raven.plant();
        let gear = plant.transmission.gear_big;
        let half_area = 0.5 / (plant.cable.joint_radius_m[joint] * plant.cable.joint_radius_m[joint]);
        let (motor, friction) = (&plant.motor, &plant.friction);
        let change = |before: f64, after: f64, section, key, numbers, scale| Change { before, after, section, key, numbers, scale };
        let constant = now.torque_constant_nm_a.unwrap_or_default();
        let wanted_constant = wanted.torque_constant_nm_a.unwrap_or(constant);
        let places = [
            change(now.reduction, wanted.reduction, "transmission", "ratio", &plant.transmission.ratio[..], 1.0),
            change(now.rotor_inertia_kg_m2, wanted.rotor_inertia_kg_m2, "motor", "inertia_capstan", &motor.inertia_capstan, gear),
            change(constant, wanted_constant, "motor", "torque_constant_nm_a", &motor.torque_constant_nm_a, 1.0),
            change(now.motor_coulomb_nm, wanted.motor_coulomb_nm, "friction", "motor_coulomb_nm", &friction.motor_coulomb_nm, gear),
            change(
                now.motor_viscous_nm_s,
                wanted.motor_viscous_nm_s,
                "friction",
                "motor_viscous_nm_s",
                &friction.motor_viscous_nm_s,
                gear,
            ),
            change(
                now.motor_sign_width_rad_s,
                wanted.motor_sign_width_rad_s,
                "friction",
                "motor_v_s_rad_s",
                &friction.motor_v_s_rad_s,
                1.0,
            ),
            change(now.joint_coulomb, wanted.joint_coulomb, "friction", "joint_coulomb", &friction.joint_coulomb, 1.0),
            change(now.joint_viscous, wanted.joint_viscous, "friction", "joint_viscous", &friction.joint_viscous, 1.0),
            change(now.joint_sign_width, wanted.joint_sign_width, "friction", "joint_v_s", &friction.joint_v_s, 1.0),
            change(now.stiffness, wanted.stiffness, "cable", "ke_n", &plant.cable.ke_n, half_area),
            change(now.damping, wanted.damping, "cable", "be_ns_m", &plant.cable.be_ns_m, half_area),
        ];
        let mut changes = Table::new();
        for change in places.iter().filter(|change| change.before != change.after) {
            let mut numbers = change.numbers.to_vec();
            numbers[joint] = change.after * change.scale;
            let numbers = numbers.into_iter().map(Value::Float).collect();
            merge(&mut changes, table(change.section, Table::from_iter([(change.key.to_owned(), Value::Array(numbers))])));
        }
        if self.cables.is_some() && changes.contains_key("cable") {
            return Err(refuse("this RAVEN-II has pretensioned cables ([cable]); change those"));
        }
        let reached = DriveModel {
            reduction: wanted.reduction,
            rotor_inertia_kg_m2: wanted.rotor_inertia_kg_m2,
            torque_constant_nm_a: Some(wanted_constant),
            motor_coulomb_nm: wanted.motor_coulomb_nm,
            motor_viscous_nm_s: wanted.motor_viscous_nm_s,
            motor_sign_width_rad_s: wanted.motor_sign_width_rad_s,
            joint_coulomb: wanted.joint_coulomb,
            joint_viscous: wanted.joint_viscous,
            joint_sign_width: wanted.joint_sign_width,
            stiffness: wanted.stiffness,
            damping: wanted.damping,
            ..now
        };
        if reached != *wanted {
            return Err(refuse(
                "of a drive of a RAVEN-II only reduction, rotor inertia, torque constant, friction, stiffness and damping can change",
            ));
        }
        self.change(changes)
    }

    pub(super) fn set_link_inertia(&mut self, side: Side, link: usize, inertia: &LinkInertia) -> Result<(), RobotError> {
        let floats = |values: &[f64]| Value::Array(values.iter().copied().map(Value::Float).collect());
        let rows = inertia.inertia_com_kg_m2.row_iter().map(|row| floats(&[row[0], row[1], row[2]])).collect();
        let link_table = Table::from_iter([
            ("mass_kg".to_owned(), Value::Float(inertia.mass_kg)),
            ("com_m".to_owned(), floats(inertia.com_m.as_slice())),
            ("inertia_com_kg_m2".to_owned(), Value::Array(rows)),
        ]);
        let link = table(&format!("link{}", link + 1), link_table);
        self.change(table("dynamics", table(side.name(), link)))
    }

    pub(super) fn set_coupling(&mut self, coupling: &[Vec<f64>]) -> Result<(), RobotError> {
        if coupling[0][1] != 0.0 || coupling[0][2] != 0.0 || coupling[1][2] != 0.0 {
            return Err(refuse("joints of a RAVEN-II are driven by those before them only; use the effect joint_coupling"));
        }
        let entries = [("coupling_01", coupling[1][0]), ("coupling_02", coupling[2][0]), ("coupling_12", coupling[2][1])];
        let entries = entries.map(|(key, value)| (key.to_owned(), Value::Float(value)));
        self.change(table("transmission", Table::from_iter(entries)))
    }

    fn change(&mut self, more: Table) -> Result<(), RobotError> {
        let mut changes = self.changes.clone();
        merge(&mut changes, more);
        let plant = changed(changes)?;
        (self.raven, self.changes) = (plant.raven, plant.changes);
        Ok(())
    }
}

fn table(name: &str, inner: Table) -> Table {
    Table::from_iter([(name.to_owned(), Value::Table(inner))])
}
