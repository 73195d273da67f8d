//! The hysteretic benchmark of Noël and Schoukens (`data/boucwen-benchmark`): a mass on a hysteretic spring under a force.
#![allow(missing_docs)]

mod common;

use common::{data, table};
use simulator::RobotModel;
use simulator::model::{Bound, Effect};
use simulator::physics::{CableHysteresis, Physics};
use simulator::resimulate::{Hold, OpenLoop, Run, open_loop};

/// `m y'' + c y' + k y + z = u`, `z' = alpha y' - beta (gamma |y'| z + delta y' |z|)`: numbers of the data's README.
const ROBOT: &str = r#"
schema = "ravenpose-robot/1"
name = "bouc-wen"
base = "urdf"
gravity_m_s2 = [0, 0, 0]
urdf_xml = '''
<robot name="bouc-wen">
  <link name="ground"/>
  <joint name="y" type="prismatic"><parent link="ground"/><child link="mass"/><axis xyz="1 0 0"/>
    <limit lower="-0.01" upper="0.01" effort="200" velocity="1"/></joint>
  <link name="mass"><inertial><mass value="2"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>
'''
[drive.y]
connection = "force"
[passive.y]
stiffness = 1e5
damping = 10
"#;

const PERIODS: usize = 4;

/// RMS of simulated less given displacement over the last period but one, m: the force is known after it too.
fn rms(robot: &RobotModel, hold: Hold) -> Option<(f64, f64)> {
    let table = table(&data().join("boucwen-benchmark/multisine.csv"))?;
    let rows = table.rows();
    let wide = |value: f64| std::array::from_fn(|i| if i == 0 { value } else { 0.0 });
    let run = Run {
        name: "multisine".to_owned(),
        time_s: (0..PERIODS * rows).map(|k| k as f64 / 750.0).collect(),
        torque: Some((0..PERIODS * rows).map(|k| wide(table.number(k % rows, "force_N"))).collect()),
        ..Run::default()
    };
    let found = open_loop(robot, &run, OpenLoop { window_s: f64::INFINITY, hold, ..OpenLoop::default() }).expect("simulated");
    let (mut squares, mut sum) = (0.0, 0.0);
    for row in 0..rows {
        let given = table.number(row, "disp_m");
        squares += (found.true_joints[(PERIODS - 2) * rows + row][0] - given).powi(2);
        sum += given * given;
    }
    Some(((squares / rows as f64).sqrt(), (sum / rows as f64).sqrt()))
}

fn hysteretic() -> RobotModel {
    let mut robot = RobotModel::from_toml(ROBOT, None).expect("robot");
    let element = CableHysteresis::of_bouc_wen(5e4, 5e4, 1e3, 0.8, -1.1, 1.0);
    assert!((element.z_m + 1.0 / 300.0).abs() < 1e-15 && (element.g - 11.0 / 3.0).abs() < 1e-12, "{element:?}");
    robot.effects_mut().push(Effect::new(Physics::CableHysteresis(element), Bound::Joint(0)));
    robot
}

#[test]
fn the_true_parameters_give_the_benchmarks_displacement() {
    let Some((with, size)) = rms(&hysteretic(), Hold::Smooth) else { return };
    let (without, _) = rms(&RobotModel::from_toml(ROBOT, None).expect("robot"), Hold::Smooth).expect("data");
    let (line, _) = rms(&hysteretic(), Hold::Line).expect("data");
    println!(
        "displacement {size:.3e} m RMS; off by {with:.2e} m with the hysteresis, {without:.2e} without; force in lines {line:.2e}"
    );
    assert!(with <= 5e-5, "{with}");
    assert!(without > 10.0 * with, "{without}");
}

#[test]
fn a_corrected_file_keeps_the_element() {
    let robot = hysteretic();
    assert_eq!(RobotModel::from_toml(&robot.to_toml(), None).expect("robot"), robot);
}
