//! Robot files of any arm: what they say, what they refuse, and that a saved robot is the same robot.
#![allow(missing_docs)]

mod common;

use arm::Side;
use arm::serial::LinkInertia;
use common::urdf::{THREE_JOINTS, gap_urdf};
use nalgebra::{Matrix3, Vector3};
use simulator::model::{Bound, Connection, ControllerModel, ControllerNumbers, ModelError, PayloadSite};
use simulator::physics::{Channel, Parameters, Physics, Value};
use simulator::plant::Passive;
use simulator::{Effect, RobotModel};

fn head() -> String {
    format!("schema = \"ravenpose-robot/1\"\nname = \"mine\"\nbase = \"urdf\"\nurdf_xml = '''\n{THREE_JOINTS}'''\n")
}

fn robot(rest: &str) -> RobotModel {
    RobotModel::from_toml(&format!("{}{rest}", head()), None).unwrap_or_else(|error| panic!("{rest}: {error}"))
}

/// The refusal, and the line of the rest that it names.
fn refused(rest: &str) -> (String, usize) {
    let text = RobotModel::from_toml(&format!("{}{rest}", head()), None).expect_err(rest).to_string();
    assert!(!text.contains('\n'), "{text}");
    let line: usize = text.strip_prefix("line ").and_then(|text| text.split(':').next()).map_or(0, |n| n.parse().expect("line"));
    let before = head().matches('\n').count();
    (text, line.saturating_sub(before))
}

const EVERYTHING: &str = "
[drive.shoulder]
rotor_inertia_kg_m2 = 1.2e-5
stiffness = 7500.0
damping = 12.5
torque_constant_nm_a = 0.06
counts_per_a = 2730
sign = -1
joint_coulomb = 0.3
presliding = 1e-4
[drive.2]
reduction = 89.3656
encoder_counts_per_rev = 4000
[drive.insertion]
connection = \"force\"
[passive.insertion]
stiffness = 10.0
damping = 0.5
rest = -0.2
[coupling]
matrix = [[1, 0, 0], [0.145, 1, 0], [0.008, 0.0081, 1.0]]
[controller]
kp = [0.2, 0.16, 0.1]
kd = [4e-3, 3e-3, 2e-3]
velocity_share = [1, 1, 1]
[inertial.link2]
mass_kg = 1.5
com_m = [0.0, -0.16, 0.2]
inertia_com_kg_m2 = [[0.004, 0, 0], [0, 0.005, 1e-4], [0, 1e-4, 0.008]]
[model_error]
torque = [0.05, 0.06, 0.5]
tip_m = [1e-5, 2e-5, 3e-5]
[homing]
offset_sd = [0.01, 0.01, 0.001]
[integrator]
step_s = 0.0005
[[payload_site]]
link = \"tool\"
position_m = [0.0, 0.0, 0.1]
name = \"wrist\"
[[effect]]
physics = \"backlash\"
joint = \"elbow\"
parameters = { b = 0.0015 }
source = \"a \\\"guess\\\"\"
[[effect]]
physics = \"link_geometry\"
link = \"end_effector\"
parameters = { d_length = 0.002 }
[[effect]]
physics = \"measurement_delay\"
channel = \"end_effector\"
parameters = { d = 0.02 }
[[effect]]
physics = \"external_contact\"
to_s = 5.0
parameters = { k = 500.0, x_0 = 0.1, n = [1, 2, -0.3] }
";

#[test]
fn a_file_says_drives_coupling_gains_inertia_and_effects() {
    let robot = robot(EVERYTHING);
    assert_eq!(robot.joint_names(), ["shoulder", "elbow", "insertion"]);
    assert_eq!(robot.link_names(), ["link1", "link2", "tool", "end_effector"]);
    let drives = robot.drives();
    assert_eq!(drives[0].connection, Connection::Cable);
    assert_eq!((drives[0].reduction, drives[0].stiffness), (136.207, 7500.0));
    assert!((drives[0].torque_per_count_nm() + 0.06 / 2730.0).abs() < 1e-18);
    assert_eq!((drives[1].connection, drives[1].reduction), (Connection::Rigid, 89.3656));
    assert_eq!((drives[2].connection, drives[2].reduction), (Connection::Force, 1.0));
    assert_eq!(robot.motor_from_joint()[1], [0.145 * 89.3656, 89.3656, 0.0]);
    assert_eq!(robot.passive()[2], Passive { stiffness: 10.0, damping: 0.5, rest: -0.2 });
    assert_eq!(robot.arm().link_inertia(1).mass_kg, 1.5);
    assert_eq!(robot.arm().link_inertia(0).mass_kg, 1.10);
    let controller = robot.controller().expect("gains");
    assert_eq!(controller.joints[2], ControllerNumbers { kp: 0.1, kd: 2e-3, velocity_share: 1.0, ..Default::default() });
    assert_eq!(robot.payload_sites[0].link, 2);
    assert_eq!(robot.effects()[0].bound, Bound::Joint(1));
    assert_eq!(robot.effects()[1].bound, Bound::Link(3));
    assert_eq!(robot.effects()[2].bound, Bound::Channel(Channel::EndEffector));
    assert_eq!(robot.effects()[3].to_s, 5.0);
    assert_eq!(robot.model_error, ModelError { torque: vec![0.05, 0.06, 0.5], deflection: vec![], tip_m: vec![1e-5, 2e-5, 3e-5] });
    robot.plant().expect("a plant");
}

#[test]
fn a_saved_robot_is_the_same_robot_and_its_text_too() {
    let shipped = |text: &str| RobotModel::from_toml(text, None).expect("shipped");
    let robots = [
        robot(""),
        robot(EVERYTHING),
        RobotModel::from_urdf(THREE_JOINTS).expect("URDF"),
        RobotModel::from_urdf(&THREE_JOINTS.replace("three", "it's \u{fc}\r\n '''")).expect("URDF"),
        RobotModel::load("raven2-nominal").expect("nominal"),
        RobotModel::load("raven2-worn").expect("worn"),
        shipped(include_str!("../../../models/raven2-uiuc-fit.toml")),
        shipped(&include_str!("../../../models/raven2-plant.toml").replace("la12_deg = 75.0", "la12_deg = 75.5")),
    ];
    for robot in robots {
        let text = robot.to_toml();
        let again = RobotModel::from_toml(&text, None).unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert_eq!(robot, again, "{text}");
        assert_eq!(text, again.to_toml());
    }
}

#[test]
fn every_physics_is_written_as_it_was_read() {
    let mut robot = robot("");
    for (name, bound, numbers) in [
        ("coulomb_friction", Bound::Joint(0), vec![("f_c", 0.1), ("f_c_asym", -0.2)]),
        ("viscous_friction", Bound::Joint(1), vec![("b", 0.3)]),
        ("coulomb_friction", Bound::Motor(1), vec![("f_c", 0.4)]),
        ("stribeck_friction", Bound::Joint(2), vec![("f_c", 0.1), ("f_s", 0.2), ("v_s", 1.0 / 3.0), ("a", 1.5)]),
        ("load_dependent_friction", Bound::Joint(0), vec![("mu_theta", 0.3)]),
        ("backlash", Bound::Joint(0), vec![("b", 1e-3)]),
        ("cable_stretch", Bound::Joint(0), vec![("k", 900.0), ("d", 0.1), ("stiffening", 3.0)]),
        ("cable_hysteresis", Bound::Joint(1), vec![("a", 0.5), ("k", 1e5), ("z_m", -1.0 / 300.0), ("g", 11.0 / 3.0)]),
        ("cable_creep", Bound::Joint(1), vec![("J_k", 1e-4), ("T_k", 7.0)]),
        ("joint_coupling", Bound::Pair(2, 0), vec![("c_ij", 0.01)]),
        ("payload", Bound::Robot, vec![("m_p", 0.25), ("c_z", 0.1)]),
        ("gravity_direction", Bound::Robot, vec![("a", 0.1)]),
        ("motor_torque_scale", Bound::Joint(1), vec![("kappa", 0.9)]),
        ("torque_ripple", Bound::Joint(1), vec![("amp", 0.1), ("order", 6.0), ("phase", 1.0)]),
        ("joint_offset", Bound::Joint(1), vec![("o", -0.01)]),
        ("transmission_ratio", Bound::Joint(2), vec![("e", 0.02)]),
        ("pulley_eccentricity", Bound::Joint(0), vec![("e_over_r", 1e-3), ("period", 0.565)]),
        ("link_geometry", Bound::Link(1), vec![("d_alpha", 0.01)]),
        ("measurement_delay", Bound::Channel(Channel::Motor), vec![("d", 0.003)]),
        ("frame_misalignment", Bound::Robot, vec![("w_x", 0.01), ("t_z", 0.002)]),
        ("thermal_drift", Bound::Joint(2), vec![("kappa_T", 0.2), ("T", 60.0)]),
    ] {
        let physics = Physics::new(name, &Parameters::of(&numbers)).expect("name").expect("parameters");
        let mut effect = Effect::new(physics, bound);
        if name == "payload" {
            effect.from_s = 5.25;
        }
        robot.effects_mut().push(effect);
    }
    let link = Parameters([("dpi_B".to_owned(), Value::Vector((0..10).map(|k| f64::from(k) / 7.0).collect()))].into());
    robot.effects_mut().push(Effect::new(Physics::new("link_inertia", &link).expect("name").expect("ten"), Bound::Link(0)));
    assert_eq!(RobotModel::from_toml(&robot.to_toml(), None).expect("robot"), robot);
}

#[test]
fn a_program_changes_numbers_and_the_file_keeps_them() {
    let inertia = LinkInertia {
        mass_kg: 0.6,
        com_m: Vector3::new(0.01, 1.0 / 3.0, -0.07),
        inertia_com_kg_m2: Matrix3::from_diagonal(&Vector3::new(0.01, 0.02, 0.025)),
    };
    for mut robot in [robot(""), RobotModel::load("raven2-nominal").expect("nominal").with_side(Side::Gold)] {
        let mut drive = robot.drives()[1];
        (drive.connection, drive.stiffness, drive.damping) = (Connection::Cable, 1400.0, 2.5);
        (drive.rotor_inertia_kg_m2, drive.joint_coulomb, drive.motor_viscous_nm_s) = (1.7e-5, 0.7, 1e-4 / 3.0);
        robot.set_drive(1, &drive).expect("drive");
        robot.set_link_inertia(1, &inertia).expect("inertia");
        robot.set_coupling(&[vec![1.0, 0.0, 0.0], vec![0.15, 1.0, 0.0], vec![0.01, 0.02, 1.0]]).expect("coupling");
        robot.payload_sites.push(PayloadSite { link: 2, position_m: [0.0, 0.0, 0.1], name: None });
        let again = RobotModel::from_toml(&robot.to_toml(), None).expect("robot");
        assert_eq!(again, robot);
        let found = again.drives()[1];
        for (found, wanted) in [
            (found.stiffness, 1400.0),
            (found.damping, 2.5),
            (found.rotor_inertia_kg_m2, 1.7e-5),
            (found.joint_coulomb, 0.7),
            (found.motor_viscous_nm_s, 1e-4 / 3.0),
        ] {
            assert!((found / wanted - 1.0).abs() < 1e-14, "{found} {wanted}");
        }
        assert_eq!(again.arm().link_inertia(1), inertia);
        assert_eq!(again.coupling()[2], [0.01, 0.02, 1.0]);
        drive.reduction = 0.0;
        assert!(robot.set_drive(1, &drive).is_err());
    }
    let mut arm = robot("");
    let controller = ControllerModel { period_s: 1e-3, delay_cycles: 1, joints: vec![ControllerNumbers::default(); 3] };
    arm.set_controller(Some(controller.clone())).expect("gains");
    assert_eq!(RobotModel::from_toml(&arm.to_toml(), None).expect("robot").controller(), Some(controller));
}

#[test]
fn a_urdf_is_a_robot_file_without_numbers_of_its_own() {
    let folder = std::env::temp_dir().join(format!("ravenpose-robots-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("arms")).expect("folder");
    std::fs::write(folder.join("arms/three.urdf"), THREE_JOINTS).expect("URDF");
    let head = "schema = \"ravenpose-robot/1\"\nname = \"three\"\nbase = \"urdf\"\n";
    std::fs::write(folder.join("robot.toml"), format!("{head}urdf = \"arms/three.urdf\"\n")).expect("file");
    let path = |name: &str| folder.join(name).to_string_lossy().into_owned();
    let (file, bare) = (RobotModel::load(&path("robot.toml")), RobotModel::load(&path("arms/three.urdf")));
    let file = file.expect("robot file");
    assert_eq!(file, bare.expect("URDF"));
    // Saved elsewhere it needs the URDF no more.
    file.save(&folder.join("moved.toml")).expect("saved");
    std::fs::remove_file(folder.join("arms/three.urdf")).expect("removed");
    assert_eq!(RobotModel::load(&path("moved.toml")).expect("moved"), file);
    let lost = RobotModel::load(&path("robot.toml")).expect_err("lost").to_string();
    assert!(lost.contains("robot.toml: line 4: urdf") && lost.contains("three.urdf: cannot be read"), "{lost}");
    std::fs::remove_dir_all(&folder).expect("cleaned");
}

#[test]
fn what_means_nothing_is_refused_with_line_key_and_remedy() {
    for (rest, line, parts) in [
        ("colour = 1\n", 1, &["unknown field `colour`"][..]),
        ("[drive.elbow]\nreduction = 80\nfriction = 1\n", 3, &["drive.elbow.friction is not known", "joint_coulomb"]),
        ("[drive.elbo]\n", 1, &["drive.elbo:", "`elbo`", "1 to 3 or one of shoulder, elbow, insertion"]),
        ("[drive.4]\n", 1, &["`joint` is 4"]),
        ("[drive.elbow]\nreduction = 0\n", 2, &["drive.elbow.reduction must be a number other than 0"]),
        ("[drive.elbow]\nconnection = \"glue\"\n", 2, &["must be one of the words rigid, cable, force"]),
        ("[drive.elbow]\nstiffness = 10.0\n", 1, &["needs a stiffness and a rotor_inertia_kg_m2 above 0"]),
        ("[drive.elbow]\nconnection = \"rigid\"\nstiffness = 10.0\n", 1, &["leave it out"]),
        ("[passive.elbow]\nspring = 1\n", 2, &["unknown field `spring`", "stiffness"]),
        ("[passive.elbow]\nstiffness = -1\n", 1, &["passive.elbow needs a stiffness"]),
        ("[coupling]\nmatrix = [[1, 0], [0, 1]]\n", 1, &["coupling.matrix must have 3 rows of 3 numbers"]),
        ("[controller]\nkp = [1, 2]\n", 1, &["controller.kp must hold 3"]),
        ("[controller]\nkp = [1, 2, 3]\nkv = [1, 2, 3]\n", 3, &["unknown field `kv`"]),
        ("[inertial.link9]\nmass_kg = 1\ncom_m = [0,0,0]\ninertia_com_kg_m2 = [[1,0,0],[0,1,0],[0,0,1]]\n", 1, &["`link9`"]),
        ("[inertial.link1]\nmass_kg = 1\n", 1, &["missing field `com_m`"]),
        ("[homing]\noffset_sd = [0]\n", 1, &["homing.offset_sd must hold 3 numbers"]),
        ("[plant.cable]\nke_n = [1, 2, 3]\n", 1, &["unknown field `plant`"]),
        ("[[payload_site]]\nlink = \"hand\"\nposition_m = [0, 0, 0]\n", 1, &["payload_site", "`hand`", "end_effector"]),
        ("\n[[effect]]\nphysics = \"dust\"\n", 2, &["effect 1 (dust): no such physics"]),
        ("[[effect]]\nphysics = \"backlash\"\njoint = \"elbo\"\nparameters = { b = 1 }\n", 1, &["`joint` is `elbo`", "elbow"]),
        ("[[effect]]\nphysics = \"backlash\"\nparameters = { b = 1 }\n", 1, &["needs `joint`", "shoulder"]),
        ("[[effect]]\nphysics = \"backlash\"\nmotor = 1\nparameters = { b = 1 }\n", 1, &["takes no `motor`"]),
        ("[[effect]]\nphysics = \"viscous_friction\"\nmotor = 4\nparameters = { b = 1 }\n", 1, &["`motor` is 4"]),
        ("[[effect]]\nphysics = \"viscous_friction\"\njoint = 1\nmotor = 1\nparameters = { b = 1 }\n", 1, &["not both"]),
        ("[model_error]\ntorque = [0.1]\n", 1, &["model_error.torque must hold 3 numbers"]),
        ("[model_error]\nspeed = [0.1]\n", 2, &["unknown field `speed`"]),
        ("[[effect]]\nphysics = \"cable_hysteresis\"\njoint = 1\nparameters = { a = 0.5, k = 1, z_m = 0 }\n", 1, &["other than 0"]),
    ] {
        let (text, found) = refused(rest);
        assert!(parts.iter().all(|part| text.contains(part)), "{rest}: {text}");
        assert_eq!(found, line, "{rest}: {text}");
    }
    let base = |text: &str| RobotModel::from_toml(text, None).expect_err(text).to_string();
    assert!(base("schema = \"ravenpose-robot/1\"\nname = \"x\"\nbase = \"mdh\"\n").contains("`raven2-nominal` or `urdf`"));
    assert!(base("schema = \"ravenpose-robot/1\"\nname = \"x\"\nbase = \"urdf\"\n").contains("urdf or urdf_xml"));
    assert!(base("schema = \"ravenpose-robot/1\"\nname = \"x\"\nbase = \"urdf\"\nurdf = \"a.urdf\"\n").contains("urdf_xml"));
    let broken = base("schema = \"ravenpose-robot/1\"\nname = \"x\"\nbase = \"urdf\"\nurdf_xml = '''\n<robot name=\"r\">\n'''\n");
    assert!(broken.contains("line 4: urdf_xml: URDF"), "{broken}");
    let raven =
        "schema = \"ravenpose-robot/1\"\nname = \"x\"\nbase = \"raven2-nominal\"\n\n[plant.cable]\nbe_ns_m = [1,2,3]\nke = 1\n";
    assert!(base(raven).starts_with("line 7: plant.cable: unknown field `ke`"), "{}", base(raven));
}

#[test]
fn joints_that_move_nothing_and_effects_without_a_place_are_refused_when_a_plant_is_made() {
    let plant = |rest: &str| robot(rest).plant().expect_err(rest).to_string();
    let massless = "[inertial.tool]\nmass_kg = 0\ncom_m = [0,0,0]\ninertia_com_kg_m2 = [[0,0,0],[0,0,0],[0,0,0]]\n";
    assert!(plant(massless).contains("joint 3 moves no mass"), "{}", plant(massless));
    assert!(robot(&format!("{massless}[drive.insertion]\nrotor_inertia_kg_m2 = 1e-5\n")).plant().is_ok());
    let counts = "[[effect]]\nphysics = \"motor_torque_scale\"\njoint = 1\nparameters = { d_0 = 10 }\n";
    assert!(plant(counts).contains("torque_constant_nm_a"));
    let loose = "[drive.3]\nconnection = \"force\"\n[[effect]]\nphysics = \"backlash\"\njoint = 3\nparameters = { b = 1e-3 }\n";
    assert!(plant(loose).contains("no spring to act on"));
}

#[test]
fn the_example_of_the_documentation_is_a_robot() {
    let text = include_str!("../../../docs/simulator.md");
    let section = text.split("## Any other arm").nth(1).expect("section");
    let block = section.lines().skip_while(|line| !line.starts_with("    ")).take_while(|line| line.starts_with("    "));
    let lines: Vec<String> = block
        .map(|line| if line.contains("urdf = ") { format!("urdf_xml = '''\n{THREE_JOINTS}'''") } else { line.to_owned() })
        .collect();
    let robot = RobotModel::from_toml(&lines.join("\n"), None).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(robot.drives()[0].stiffness, 1600.0);
    robot.plant().expect("a plant");
}

#[test]
fn the_arm_of_the_gap_examples_loads() {
    let Some(path) = gap_urdf() else { return };
    let robot = RobotModel::load(&path.to_string_lossy()).expect("URDF");
    assert_eq!(robot.joint_names(), ["shoulder", "elbow", "insertion"]);
    assert_eq!(robot.motor_from_joint()[2], [0.0, 0.0, 2158.590]);
    println!("notes: {:?}", robot.notes());
    robot.plant().expect("a plant");
}
