//! An independent library as the judge: Pinocchio reads the URDF text of random arms and of RAVEN-II and must agree with every
//! algorithm of `serial`. The comparison itself is `tests/python/pinocchio_compare.py`.
//!
//! `RAVENPOSE_PYTHON` names an interpreter with the package `pin`, `build/venv` of the repository is the default; `make test`
//! makes it. Without the package the test says that it skips.
#![allow(missing_docs)]

mod common;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use arm::serial::Workspace;
use arm::urdf::{self, UrdfArm};
use arm::{Raven2, Side};
use common::random_arm::{self, Motion, motion};
use common::{Random, table, vectors};
use nalgebra::{IsometryMatrix3, Vector3};

const ARMS: u64 = 60;
const STATES: usize = 8;

/// One case: URDF text, and states with our results as text of lines `name number number ...`.
struct Case {
    urdf: String,
    results: String,
}

#[test]
fn pinocchio_agrees_on_random_arms_and_raven2() {
    let Some(python) = interpreter() else { return };
    let mut cases: Vec<Case> = (0..ARMS).map(random_case).collect();
    for side in Side::ALL {
        cases.push(raven_case(side));
        cases.push(six_axes_case(side));
    }
    let folder = Folder::new();
    for (number, case) in cases.iter().enumerate() {
        std::fs::write(folder.0.join(format!("{number:03}.urdf")), &case.urdf).expect("written");
        std::fs::write(folder.0.join(format!("{number:03}.txt")), &case.results).expect("written");
    }
    let output = Command::new(&python).arg(script()).arg(&folder.0).output().expect("python");
    let text = String::from_utf8_lossy(&output.stdout);
    println!("{text}");
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains(&format!("agreed: {} arms", cases.len())), "{text}");
}

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn script() -> PathBuf {
    repository().join("tests/python/pinocchio_compare.py")
}

/// An interpreter that has the package.
fn interpreter() -> Option<PathBuf> {
    let default = repository().join("build/venv/bin/python3");
    let python = std::env::var_os("RAVENPOSE_PYTHON").map_or(default, PathBuf::from);
    let found = Command::new(&python).args(["-c", "import pinocchio"]).output().is_ok_and(|output| output.status.success());
    if !found {
        println!("skipped: {} with the package pin is absent (make test makes one)", python.display());
    }
    found.then_some(python)
}

/// A folder that is gone when the test ends.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Self {
        let path = std::env::temp_dir().join(format!("ravenpose-pinocchio-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a temporary folder");
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// URDF text of a random chain: 2 to 7 moving joints, fixed joints before, between and behind them, plates beside them.
fn random_urdf(random: &mut Random) -> String {
    let mut text = String::from("<robot name=\"random\">\n<link name=\"link0\"/>\n");
    let (moving, mut parent, mut next) = (2 + random.below(6), 0, 1);
    let mut add = |random: &mut Random, parent: usize, kind: &str, heavy: bool| {
        let (pose, axis) = (random_arm::pose(random), random_arm::axis(random).normalize());
        let (roll, pitch, yaw) = pose.rotation.euler_angles();
        let (xyz, link) = (pose.translation.vector, next);
        let inertial = if heavy { inertial(random) } else { String::new() };
        writeln!(
            text,
            "<link name=\"link{link}\">{inertial}</link>\n<joint name=\"joint{link}\" type=\"{kind}\">\
             <parent link=\"link{parent}\"/><child link=\"link{link}\"/><origin xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"/>\
             <axis xyz=\"{} {} {}\"/><limit lower=\"-3\" upper=\"3\" effort=\"100\" velocity=\"10\"/></joint>",
            xyz.x, xyz.y, xyz.z, axis.x, axis.y, axis.z
        )
        .expect("a string");
        next += 1;
        link
    };
    for _ in 0..moving {
        if random.below(3) == 0 {
            let heavy = random.below(2) == 0;
            parent = add(random, parent, "fixed", heavy);
        }
        let kind = ["revolute", "prismatic", "continuous", "revolute"][random.below(4)];
        let heavy = random.below(5) > 0;
        parent = add(random, parent, kind, heavy);
        if random.below(4) == 0 {
            add(random, parent, "fixed", true);
        }
    }
    // The last link has inertia at any rate.
    add(random, parent, "fixed", true);
    text + "</robot>\n"
}

fn inertial(random: &mut Random) -> String {
    let inertia = random_arm::inertia(random);
    let (c, i) = (inertia.com_m, inertia.inertia_com_kg_m2);
    // Given in a frame of its own, so that the rotation of <inertial> is used.
    let turn = nalgebra::Rotation3::new(random.vector(2.0));
    let (roll, pitch, yaw) = turn.euler_angles();
    let i = turn.matrix().transpose() * i * turn.matrix();
    format!(
        "<inertial><origin xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"/><mass value=\"{}\"/>\
         <inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/></inertial>",
        c.x, c.y, c.z, inertia.mass_kg, i.m11, i.m12, i.m13, i.m22, i.m23, i.m33
    )
}

fn random_case(seed: u64) -> Case {
    let mut random = Random::new(seed);
    let urdf = random_urdf(&mut random);
    let loaded = urdf::load(&urdf).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
    let mut results = head(&loaded);
    for _ in 0..STATES {
        let at = motion(&mut random, loaded.arm.joint_count());
        state(&mut results, &loaded, &at, true);
    }
    Case { urdf, results }
}

/// RAVEN-II from the plant file; the gold arm also at the states of `dynamics.csv`, with that file's accelerations.
fn raven_case(side: Side) -> Case {
    let urdf = urdf::save(&Raven2::nominal().rigid_body(side), &[]);
    let loaded = urdf::load(&urdf).expect("RAVEN-II");
    let mut results = head(&loaded);
    let mut random = Random::new(200 + side.index() as u64);
    for _ in 0..STATES {
        state(&mut results, &loaded, &motion(&mut random, 3), true);
    }
    if side == Side::Gold
        && let Some(table) = table(&vectors().join("dynamics.csv"))
    {
        let offset = Raven2::nominal().plant().kinematics.gold.theta_offset_deg;
        for row in 0..table.rows() {
            let read = |names: [&str; 3]| names.map(|name| table.number(row, name));
            let theta = read(["theta_1_rad", "theta_2_rad", "d_3_m"]);
            let q = vec![theta[0] - offset[0].to_radians(), theta[1] - offset[1].to_radians(), theta[2]];
            let at = Motion { q, qd: read(["thetad_1_rad_s", "thetad_2_rad_s", "dd_3_m_s"]).to_vec(), qdd: vec![0.0; 3] };
            state(&mut results, &loaded, &at, false);
            line(&mut results, "tau", &read(["tau_1_nm", "tau_2_nm", "f_3_n"]));
            line(&mut results, "vector_qdd", &read(["thetadd_1_rad_s2", "thetadd_2_rad_s2", "ddd_3_m_s2"]));
        }
    }
    Case { urdf, results }
}

/// Kinematics of all six axes; links 4 to 6 have no inertia, so there are no accelerations.
fn six_axes_case(side: Side) -> Case {
    let urdf = urdf::save(&Raven2::nominal().six_axes(side), &[]);
    let loaded = urdf::load(&urdf).expect("RAVEN-II");
    let mut results = head(&loaded);
    let mut random = Random::new(300 + side.index() as u64);
    (0..STATES).for_each(|_| state(&mut results, &loaded, &motion(&mut random, 6), false));
    Case { urdf, results }
}

fn head(loaded: &UrdfArm) -> String {
    let names: Vec<&str> = loaded.arm.bodies().iter().map(|body| body.joint.name.as_str()).collect();
    let links: Vec<&str> = loaded.arm.bodies().iter().map(|body| body.name.as_str()).collect();
    let tip = loaded.arm.tools().first().map_or(links[links.len() - 1], |tool| tool.name.as_str());
    format!("joints {}\nlinks {}\ntip {tip}\n", names.join(" "), links.join(" "))
}

/// All our results at one state; poses and Jacobian in the root link, as Pinocchio has them.
fn state(out: &mut String, loaded: &UrdfArm, at: &Motion, with_accelerations: bool) {
    let (arm, n) = (&loaded.arm, loaded.arm.joint_count());
    let mut ws = Workspace::new(arm);
    let Motion { q, qd, qdd } = at;
    out.push_str("state\n");
    line(out, "q", q);
    line(out, "qd", qd);
    line(out, "qdd", qdd);
    let tip = loaded.base_in_root * arm.tip(&mut ws, q);
    line(out, "tip_pose", &pose_numbers(&tip));
    let frames: Vec<f64> = ws.frames().iter().flat_map(|frame| pose_numbers(&(loaded.base_in_root * frame))).collect();
    line(out, "link_poses", &frames);
    let mut jacobian = vec![0.0; 6 * n];
    arm.jacobian(&mut ws, q, &Vector3::zeros(), &mut jacobian);
    line(out, "jacobian", &turned(&loaded.base_in_root, &jacobian, n));
    let (mut m, mut bias, mut g, mut c, mut tau) = (vec![0.0; n * n], vec![0.0; n], vec![0.0; n], vec![0.0; n * n], vec![0.0; n]);
    arm.mass_matrix_and_bias(&mut ws, q, qd, &mut m, &mut bias);
    arm.gravity(&mut ws, q, &mut g);
    arm.coriolis(&mut ws, q, qd, &mut c);
    arm.inverse_dynamics(&mut ws, q, qd, qdd, None, &mut tau);
    line(out, "mass_matrix", &m);
    line(out, "bias", &bias);
    line(out, "gravity", &g);
    line(out, "coriolis", &c);
    line(out, "inverse_dynamics", &tau);
    let mut regressor = vec![0.0; n * 10 * n];
    arm.regressor(&mut ws, q, qd, qdd, &mut regressor);
    line(out, "regressor", &regressor);
    let mut parameters = vec![0.0; 10 * n];
    arm.parameters(&mut parameters);
    line(out, "parameters", &parameters);
    line(out, "kinetic_energy", &[arm.kinetic_energy(&mut ws, q, qd)]);
    if with_accelerations {
        // Torques that are not the ones of these accelerations, or the answer would be known.
        let tau: Vec<f64> = tau.iter().map(|tau| 0.5 * tau + 1.0).collect();
        let mut found = vec![0.0; n];
        arm.forward_dynamics(&mut ws, q, qd, &tau, &mut found).expect("positive definite");
        line(out, "tau", &tau);
        line(out, "accelerations", &found);
    }
}

fn pose_numbers(pose: &IsometryMatrix3<f64>) -> Vec<f64> {
    pose.to_homogeneous().transpose().as_slice()[..12].to_vec()
}

/// A Jacobian seen from the root link.
fn turned(base: &IsometryMatrix3<f64>, jacobian: &[f64], n: usize) -> Vec<f64> {
    let mut out = vec![0.0; 6 * n];
    for column in 0..n {
        for half in [0, 3] {
            let part = Vector3::from_fn(|row, _| jacobian[(half + row) * n + column]);
            let part = base.rotation * part;
            (0..3).for_each(|row| out[(half + row) * n + column] = part[row]);
        }
    }
    out
}

fn line(out: &mut String, name: &str, numbers: &[f64]) {
    out.push_str(name);
    for number in numbers {
        write!(out, " {number:e}").expect("a string");
    }
    out.push('\n');
}
