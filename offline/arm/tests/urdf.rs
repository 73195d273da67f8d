//! URDF: the laboratory's file against its recordings, round trips, and what is read how. Another reader's opinion is
//! Pinocchio's: `pinocchio.rs`; what is refused: `urdf_refusals.rs`.
#![allow(missing_docs)]

mod common;

use arm::serial::{JointKind, LinkInertia, SerialArm, Workspace};
use arm::urdf::{self, Drive, Options};
use arm::{Raven2, Side};
use common::urdf_text::{ARM, load, with};
use common::{Random, Table, Worst, data, random_arm, runs, table};
use nalgebra::{Rotation3, Vector3};

/// Roll of the laboratory's mount, as the file prints it.
const MOUNT_RAD: f64 = 5236.0 / 10_000.0;

#[test]
fn the_gap_examples_robot_reads_as_it_is_written() {
    let Some(text) = lab_robot() else { return };
    let loaded = load(&text);
    let arm = &loaded.arm;
    assert_eq!((arm.name(), arm.base_name(), loaded.root.as_str()), ("raven2-like-3dof", "base", "world"));
    assert_eq!(arm.bodies().iter().map(|body| body.joint.name.as_str()).collect::<Vec<_>>(), ["shoulder", "elbow", "insertion"]);
    assert_eq!(loaded.drives.iter().map(|drive| drive.reduction).collect::<Vec<_>>(), [136.207, 89.366, 2158.590]);
    assert_eq!(arm.tools()[0].name, "end_effector");
    assert_eq!(arm.bodies()[2].joint.kind, JointKind::Prismatic);
    assert!(
        (arm.gravity_vector() - Rotation3::from_euler_angles(-MOUNT_RAD, 0.0, 0.0) * Vector3::new(0.0, 0.0, -9.81)).norm() < 1e-14
    );
    println!("{:#?}", loaded.notes);
    // Its round numbers break the triangle inequality: said, and used as they are.
    assert!(loaded.notes.iter().any(|note| note.starts_with("link link1: no body")));
}

fn lab_robot() -> Option<String> {
    let path = data().join("gap-examples/robot.urdf");
    let text = std::fs::read_to_string(&path).ok();
    if text.is_none() {
        println!("skipped: {} is absent", path.display());
    }
    text
}

/// Tip from the columns `PREFIX_1_rad`, ..., mm, and the tip that the table has under another prefix.
fn tips_mm(arm: &SerialArm, ws: &mut Workspace, table: &Table, row: usize, joints: &str, tip: &str) -> Option<[Vector3<f64>; 2]> {
    let read = ["x", "y", "z"].map(|axis| table.optional(row, &format!("{tip}{axis}_mm")));
    let [Some(x), Some(y), Some(z)] = read else { return None };
    let q = ["1_rad", "2_rad", "3_m"].map(|joint| table.number(row, &format!("{joints}_{joint}")));
    Some([arm.tip(ws, &q).translation.vector * 1e3, Vector3::new(x, y, z)])
}

#[test]
fn its_kinematics_gives_the_recorded_tips() {
    let Some(text) = lab_robot() else { return };
    let arm = load(&text).arm;
    let mut ws = Workspace::new(&arm);
    let (mut reported, mut simulated, mut squares, mut sum, mut count) =
        (Worst::default(), Worst::default(), Vector3::zeros(), Vector3::zeros(), 0.0);
    for run in ["a", "b", "c", "d"].iter().flat_map(|example| runs(&data().join("gap-examples").join(example))) {
        let Some(table) = table(&run) else { return };
        let recording = run.file_name().is_some_and(|name| name.to_string_lossy().starts_with("real"));
        for row in 0..table.rows() {
            if let Some([found, told]) = tips_mm(&arm, &mut ws, &table, row, "jpos", "") {
                reported.see((found - told).amax());
            }
            let Some([found, truth]) = tips_mm(&arm, &mut ws, &table, row, "truth_jpos", "truth_") else { continue };
            if !recording {
                simulated.see((found - truth).amax());
                continue;
            }
            squares += (found - truth).component_mul(&(found - truth));
            sum += found - truth;
            count += 1.0;
        }
    }
    let (rms, mean) = ((squares / count).map(f64::sqrt), sum / count);
    println!(
        "reported tips {:e} mm, simulated tips {:e} mm; {count} recorded frames: RMS {rms:?} mm, mean {mean:?} mm",
        reported.0, simulated.0
    );
    assert!(count > 1000.0);
    // Four decimals of a millimetre are printed, seven of rad and m.
    assert!(reported.0 < 2e-4 && simulated.0 < 2e-4);
    // 0.25 mm of the tip, 0.3 mrad times 0.2 m and 0.04 mm of the joints.
    assert!(rms.max() < 0.29 && rms.min() > 0.2 && mean.amax() < 0.02);
}

#[test]
fn saving_and_loading_is_the_identity() {
    let mut worst = Worst::default();
    for seed in 0..60 {
        let mut random = Random::new(seed);
        let arm = random_arm::arm(&mut random, 1 + seed as usize % 7);
        let drives: Vec<Drive> = (0..arm.joint_count()).map(|i| drive(i, &mut random)).collect();
        let options = Options { gravity_in_root_m_s2: Vector3::new(0.0, 0.0, -arm.gravity_vector().norm()), tip: None };
        let back = urdf::load_with(&urdf::save(&arm, &drives), &options).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        assert_eq!(back.drives, drives, "seed {seed}");
        worst.see(difference(&back.arm, &arm));
    }
    for side in Side::ALL {
        for arm in [Raven2::nominal().rigid_body(side), Raven2::nominal().six_axes(side)] {
            let back = load(&urdf::save(&arm, &[]));
            assert_eq!(back.arm.base_name(), "frame_0");
            worst.see(difference(&back.arm, &arm));
        }
    }
    println!("saved and loaded: {:e}", worst.0);
    assert!(worst.0 < 1e-14);
}

fn drive(i: usize, random: &mut Random) -> Drive {
    Drive {
        transmission: Some(format!("drive \"{i}\" & <co>")),
        actuator: Some(format!("motor{i}")),
        reduction: random.within(-200.0, 200.0),
        offset: random.signed(1.0),
        damping: 0.0,
        friction: 0.0,
    }
}

/// Largest difference of any number; names and kinds must be equal.
fn difference(a: &SerialArm, b: &SerialArm) -> f64 {
    let mut worst = Worst::default();
    worst.see((a.gravity_vector() - b.gravity_vector()).amax() / 10.0);
    worst.see((a.tool_pose().to_homogeneous() - b.tool_pose().to_homogeneous()).amax());
    assert_eq!(a.joint_count(), b.joint_count());
    for (a, b) in a.bodies().iter().zip(b.bodies()) {
        assert_eq!((&a.name, &a.joint.name, a.joint.kind, a.joint.limits), (&b.name, &b.joint.name, b.joint.kind, b.joint.limits));
        worst.see((a.placement.to_homogeneous() - b.placement.to_homogeneous()).amax());
        worst.see((a.joint.axis - b.joint.axis).amax());
        worst.see_all(&a.inertia.parameters(), &b.inertia.parameters());
    }
    worst.0
}

#[test]
fn fixed_joints_are_merged_into_the_chain() {
    let fixed = r#"<joint name="plate" type="fixed"><parent link="c"/><child link="d"/><origin xyz="0 0 1" rpy="0 0 1.5"/></joint>
      <link name="d"><inertial><origin xyz="0.5 0 0"/><mass value="3"/>
        <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
      <joint name="end" type="fixed"><parent link="d"/><child link="e"/><origin xyz="0 0.1 0"/></joint><link name="e"/>"#;
    let loaded = load(&with(fixed));
    let last = loaded.arm.link_inertia(2);
    let com = Vector3::new(0.5 * 1.5_f64.cos(), 0.5 * 1.5_f64.sin(), 1.0) * 0.75;
    assert!((last.mass_kg - 4.0).abs() < 1e-15 && (last.com_m - com).norm() < 1e-15);
    assert_eq!(loaded.arm.tools().iter().map(|tool| tool.name.as_str()).collect::<Vec<_>>(), ["e", "c", "d"]);
    let tip = loaded.arm.tool_pose().translation.vector;
    assert!((tip - Vector3::new(-0.1 * 1.5_f64.sin(), 0.1 * 1.5_f64.cos(), 1.0)).norm() < 1e-15);
    assert_eq!(loaded.arm.link_inertia(1), LinkInertia::ZERO);
    assert!(loaded.notes.contains(&"link b: no <inertial>, taken as massless".to_owned()), "{:?}", loaded.notes);
    // A plate between two moving joints goes into the link before it and into the placement after it.
    let between = ARM.replace(r#"<parent link="b"/>"#, r#"<parent link="f"/>"#);
    let loaded = load(&between.replace(
        "{}",
        r#"<link name="f"/><joint name="spacer" type="fixed"><parent link="b"/><child link="f"/><origin xyz="0 0 7"/></joint>"#,
    ));
    assert_eq!(loaded.arm.bodies()[2].placement.translation.vector.z, 7.0);
}

#[test]
fn a_fixed_mount_turns_gravity_and_moves_no_frame() {
    let mounted = with(
        r#"<link name="floor"/><joint name="mount" type="fixed"><parent link="floor"/><child link="base"/>
          <origin xyz="1 2 3" rpy="3.141592653589793 0 0"/></joint>"#,
    );
    let loaded = load(&mounted);
    assert_eq!((loaded.root.as_str(), loaded.arm.base_name()), ("floor", "base"));
    assert!((loaded.arm.gravity_vector() - Vector3::new(0.0, 0.0, 9.81)).norm() < 1e-14);
    assert_eq!(loaded.base_in_root.translation.vector, Vector3::new(1.0, 2.0, 3.0));
    assert_eq!(loaded.arm.bodies()[0].placement, load(&with("")).arm.bodies()[0].placement);
    let options = Options { gravity_in_root_m_s2: Vector3::new(1.0, 0.0, 0.0), tip: None };
    assert_eq!(urdf::load_with(&mounted, &options).expect("an arm").arm.gravity_vector(), Vector3::new(1.0, 0.0, 0.0));
}

#[test]
fn what_is_assumed_is_noted() {
    let loaded = load(&with(""));
    assert_eq!(
        loaded.notes,
        [
            "link b: no <inertial>, taken as massless",
            "joint one: no <transmission>, reduction 1",
            "joint two: no <transmission>, reduction 1",
            "joint three: no <transmission>, reduction 1"
        ]
    );
    let [one, two, three] = [0, 1, 2].map(|i| loaded.arm.bodies()[i].joint.clone());
    assert_eq!((one.limits.lower, one.limits.upper, one.limits.velocity, one.limits.effort), (-1.0, 2.0, 3.0, 4.0));
    assert_eq!((two.limits.lower, two.axis), (f64::NEG_INFINITY, Vector3::x()));
    assert_eq!((three.limits.upper, three.limits.velocity, three.limits.effort), (0.2, f64::INFINITY, f64::INFINITY));
    let unlimited = with("").replace(r#"<limit lower="-1" upper="2" velocity="3" effort="4"/>"#, "");
    assert!(load(&unlimited).notes.contains(&"joint one: no <limit>, its range is unknown".to_owned()));
    let half = with("").replace(r#"lower="-1" upper="2""#, r#"upper="2""#);
    assert_eq!(load(&half).arm.bodies()[0].joint.limits.lower, 0.0);
}

#[test]
fn transmissions_of_every_age_are_read() {
    let new = r#"<transmission name="t1"><type>transmission_interface/SimpleTransmission</type>
      <joint name="one"><hardwareInterface>x</hardwareInterface><offset>0.25</offset></joint>
      <actuator name="m1"><mechanicalReduction> -12.5 </mechanicalReduction></actuator></transmission>"#;
    let old = r#"<transmission type="pr2_mechanism_model/SimpleTransmission" name="t2">
      <actuator name="m2"/><joint name="two"/><mechanicalReduction>7</mechanicalReduction></transmission>"#;
    let bare = r#"<transmission name="t3"><type>SimpleTransmission</type><joint name="three"/></transmission>"#;
    let loaded = load(&with(&format!("{new}{old}{bare}")));
    let [one, two, three] = &loaded.drives[..] else { panic!("three drives") };
    assert_eq!(
        (one.reduction, one.offset, one.transmission.as_deref(), one.actuator.as_deref()),
        (-12.5, 0.25, Some("t1"), Some("m1"))
    );
    assert_eq!((two.reduction, two.actuator.as_deref()), (7.0, Some("m2")));
    assert_eq!((three.reduction, three.actuator.as_deref()), (1.0, None));
    assert_eq!(loaded.notes[1..], ["transmission t3: no mechanicalReduction, 1"]);
    let friction = with("").replace(r#"<child link="a"/>"#, r#"<child link="a"/><dynamics damping="0.5" friction="2"/>"#);
    assert_eq!((load(&friction).drives[0].damping, load(&friction).drives[0].friction), (0.5, 2.0));
}

#[test]
fn a_quaternion_is_the_rotation_that_it_is() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let text = with("").replace(r#"rpy="1 2 3""#, &format!("quat_xyzw=\"{half} 0 0 {half}\""));
    let rotation = load(&text).arm.bodies()[1].placement.rotation;
    assert!((rotation.matrix() - Rotation3::from_euler_angles(std::f64::consts::FRAC_PI_2, 0.0, 0.0).matrix()).amax() < 1e-15);
}
