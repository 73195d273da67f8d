//! Which columns of a recording are looked at: the others need not stay in memory.

use recordings::Recording;
use simulator::model::{Connection, RobotModel};

/// Quantities that are looked at, without the number of their joint.
const QUANTITIES: [&str; 12] = ["t_s", "mpos", "mvel", "jpos", "jpos_d", "jvel", "tau", "jtau", "dac", "q", "q_des", "q_act"];
/// Truths that are looked at.
const TRUTHS: [&str; 4] = ["truth_jpos", "truth_x_m", "truth_y_m", "truth_z_m"];

/// Drops the columns that neither the engine nor the simulator behind it reads: of a RAVEN-II two thirds.
pub fn keep_needed(recording: &mut Recording, model: &RobotModel) {
    let recorded = |name: &str| recording.column(name).is_some_and(|values| values.iter().any(|x| x.is_finite()));
    let counts = !(1..=model.joint_count()).all(|joint| recorded(&format!("tau_{joint}_nm")));
    let forces = model.drives().iter().any(|drive| drive.connection == Connection::Force);
    // What the wrist moves the tip by is taken off it.
    let wrist = model.as_raven().is_some() && recorded("truth_x_m");
    let needed = |name: &str| {
        let (quantity, joint) = quantity(name);
        if wrist && joint.is_some_and(|joint| joint > model.joint_count()) {
            return matches!(quantity, "jpos" | "truth_jpos");
        }
        let wanted = match quantity {
            "dac" => counts,
            "jvel" => forces,
            quantity => QUANTITIES.contains(&quantity) || TRUTHS.contains(&quantity),
        };
        // A RAVEN-II's recording has the joints of the tool as well. Of other robots, joints that the model lacks are a warning.
        wanted && joint.is_none_or(|joint| joint <= model.joint_count() || model.as_raven().is_none())
    };
    let mapped = |name: &str| model.columns.iter().any(|column| column.source == name);
    recording.columns.retain(|column| needed(&column.name) || mapped(&column.name));
    recording.texts.clear();
    // Read row by row, each has room for up to as many again.
    recording.columns.iter_mut().for_each(|column| column.values.shrink_to_fit());
}

/// A name up to the number of the joint, and that number.
fn quantity(name: &str) -> (&str, Option<usize>) {
    let mut start = 0;
    for part in name.split('_') {
        if start > 0
            && let Ok(joint) = part.parse()
        {
            return (&name[..start - 1], Some(joint));
        }
        start += part.len() + 1;
    }
    (name, None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use recordings::Column;

    fn kept(names: &[&str]) -> Vec<String> {
        let columns = names.iter().map(|name| Column::new(*name, vec![0.0])).collect();
        let mut recording = Recording { columns, ..Recording::default() };
        keep_needed(&mut recording, &RobotModel::load("raven2-nominal").expect("it ships"));
        recording.columns.into_iter().map(|column| column.name).collect()
    }

    #[test]
    fn what_nobody_reads_is_dropped() {
        let read =
            ["t_s", "mpos_1_rad", "jpos_d_3_m", "q_des_2", "tau_1_nm", "tau_2_nm", "tau_3_nm", "truth_jpos_1_rad", "truth_x_m"];
        let not = [
            "dac_1_counts",
            "jvel_1_rad_s",
            "truth_qw",
            "truth_cable_1_n",
            "x_m",
            "runlevel",
            "ori_r1c1",
            "mpos_4_rad",
            "jpos_7_rad",
            "tau_5_nm",
            "truth_jpos_5_rad",
        ];
        // With a tip the wrist as well, without one not.
        assert_eq!(kept(&[&read[..], &not[..]].concat()), [&read[..], &["jpos_7_rad", "truth_jpos_5_rad"]].concat());
        let (read, not) = (&read[..8], [&not[..], &["jpos_4_rad"]].concat());
        assert_eq!(kept(&[read, &not].concat()), read);
    }

    #[test]
    fn counts_stay_where_no_torque_says_more() {
        assert_eq!(kept(&["dac_1_counts", "tau_1_nm", "tau_2_nm"]), ["dac_1_counts", "tau_1_nm", "tau_2_nm"]);
    }
}
