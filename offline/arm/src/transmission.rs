//! Motors to joints and back, through gearboxes and coupled cables (raven2-plant.md, section 3).

use crate::plant::TransmissionTable;
use crate::{Joints, Motors, Side, Tool};

/// Cable transmission of one arm with its tool. All maps are linear: they hold for rates as for positions.
#[derive(Debug, Clone, PartialEq)]
pub struct Transmission {
    /// Motor rad per joint rad, joint 3 per m.
    ratio: [f64; crate::JOINTS],
    coupling_01: f64,
    coupling_02: f64,
    coupling_12: f64,
    /// What of motor 3 reaches the tool motors 4, 5, 7 (motor 6: the negative): σ / GB.
    insertion_share: f64,
    /// κ.
    wrist_coupling: f64,
}

impl Transmission {
    pub(crate) fn new(table: &TransmissionTable, side: Side, tool: Tool) -> Self {
        Self {
            ratio: table.ratio,
            coupling_01: table.coupling_01,
            coupling_02: table.coupling_02,
            coupling_12: table.coupling_12,
            insertion_share: table.tool_sign.sigma(side, tool) / table.gb_ratio,
            wrist_coupling: table.wrist_coupling.kappa(tool),
        }
    }

    /// Motor rad per joint rad, joint 3 per m.
    pub fn ratio(&self) -> &[f64; crate::JOINTS] {
        &self.ratio
    }

    /// Motor angles that belong to joint positions; the tool motors follow the motor 3 computed here, as after homing.
    pub fn motors(&self, joints: &Joints) -> Motors {
        let motor_3 = self.base_motors(joints)[2];
        self.motors_at(joints, motor_3)
    }

    /// Motor angles that the controller commands for joint positions: the tool motors follow the **measured** motor 3.
    pub fn motors_at(&self, joints: &Joints, motor_3_measured: f64) -> Motors {
        let [m1, m2, m3] = self.base_motors(joints);
        let [_, _, _, j4, j5, j6, j7] = *joints;
        let [_, _, _, r4, r5, r6, r7] = self.ratio;
        let dragged = self.insertion_share * motor_3_measured;
        let wrist = self.wrist_coupling * j5;
        [m1, m2, m3, r4 * j4 + dragged, r5 * j5 + dragged, r6 * (j6 + wrist) - dragged, r7 * (j7 - wrist) + dragged]
    }

    /// Joint positions that belong to motor angles, as the controller reports them.
    pub fn joints(&self, motors: &Motors) -> Joints {
        let [m1, m2, m3, m4, m5, m6, m7] = *motors;
        let [r1, r2, r3, r4, r5, r6, r7] = self.ratio;
        let j1 = m1 / r1;
        let j2 = m2 / r2 - self.coupling_01 * j1;
        let j3 = m3 / r3 - self.coupling_02 * j1 - self.coupling_12 * j2;
        let dragged = self.insertion_share * m3;
        let j5 = (m5 - dragged) / r5;
        let wrist = self.wrist_coupling * j5;
        [j1, j2, j3, (m4 - dragged) / r4, j5, (m6 + dragged) / r6 - wrist, (m7 - dragged) / r7 + wrist]
    }

    /// Joint speeds as published: motor speed over ratio for joints 1 to 3, without coupling, and 0 for the tool joints
    /// (ravenstate.md, trap 4). The true rates are `joints(motor speeds)`.
    pub fn published_speeds(&self, motor_speeds: &Motors) -> Joints {
        let mut speeds = [0.0; crate::JOINTS];
        for joint in 0..3 {
            speeds[joint] = motor_speeds[joint] / self.ratio[joint];
        }
        speeds
    }

    fn base_motors(&self, joints: &Joints) -> [f64; 3] {
        let [j1, j2, j3, ..] = *joints;
        let [r1, r2, r3, ..] = self.ratio;
        [r1 * j1, r2 * (j2 + self.coupling_01 * j1), r3 * (j3 + self.coupling_02 * j1 + self.coupling_12 * j2)]
    }
}
