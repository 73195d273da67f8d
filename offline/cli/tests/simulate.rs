//! `ravenpose simulate` with arms that are no RAVEN-II, and along the commands of recordings.
#![allow(missing_docs)]

mod common;

use common::{Folder, done, ravenpose, text};
use recordings::{Recording, csv};
use std::path::PathBuf;
use std::process::Output;

const ARM: &str = r#"<robot name="pair">
  <link name="base"/>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="beam"/><axis xyz="0 0 1"/>
    <limit lower="0.1" upper="0.4" effort="100" velocity="0.5"/></joint>
  <link name="beam"><inertial><origin xyz="0.1 0 0"/><mass value="2"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="swing" type="revolute"><parent link="beam"/><child link="rod"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="20" velocity="3"/></joint>
  <link name="rod"><inertial><origin xyz="0.1 0 0"/><mass value="0.5"/>
    <inertia ixx="0.001" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="end" type="fixed"><parent link="rod"/><child link="tip"/><origin xyz="0.25 0 0"/></joint>
  <link name="tip"/>
  <transmission name="t1"><type>transmission_interface/SimpleTransmission</type><joint name="lift"/>
    <actuator name="m1"><mechanicalReduction>500</mechanicalReduction></actuator></transmission>
  <transmission name="t2"><type>transmission_interface/SimpleTransmission</type><joint name="swing"/>
    <actuator name="m2"><mechanicalReduction>50</mechanicalReduction></actuator></transmission>
</robot>
"#;

/// A folder with the arm in it.
struct Bench(Folder);

impl Bench {
    fn new(name: &str) -> Self {
        let folder = Folder::new(name);
        folder.write("arm.urdf", ARM);
        Self(folder)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.file(name)
    }

    fn simulate(&self, robot: &str, out: &str, more: &[&str]) -> Output {
        let (robot, out) = (self.file(robot), self.file(out));
        ravenpose(&[&["simulate", "--robot", text(&robot), "--out", text(&out)], more].concat())
    }

    fn simulated(&self, robot: &str, out: &str, more: &[&str]) {
        let output = self.simulate(robot, out, more);
        assert!(output.status.success(), "{}", common::errors(&output));
    }

    fn refuses(&self, robot: &str, more: &[&str], words: &str) {
        common::refused(&self.simulate(robot, "x", more), &[words]);
    }

    fn run(&self, out: &str) -> Recording {
        csv::read(&self.file(out).join("run_0001.csv")).expect("a run")
    }
}

/// Largest difference of a column of two runs.
fn off(a: &Recording, b: &Recording, column: &str) -> f64 {
    let (a, b) = (a.column(column).expect(column), b.column(column).expect(column));
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn any_arm_gives_tidy_runs_with_its_own_joints_and_units() {
    let folder = Bench::new("any");
    let plan = ["--minutes", "0.1", "--run-minutes", "0.05", "--seed", "2"];
    folder.simulated("arm.urdf", "one", &[&plan[..], &["--threads", "1"]].concat());
    folder.simulated("arm.urdf", "two", &[&plan[..], &["--threads", "2"]].concat());
    for name in ["run_0001.csv", "run_0002.csv", "simulation.txt"] {
        let read = |out: &str| std::fs::read(folder.file(out).join(name)).expect(name);
        assert_eq!(read("one"), read("two"), "{name}");
    }
    let run = folder.run("one");
    assert_eq!(run.rows(), 3000);
    assert_eq!(run.unknown().count(), 0);
    for column in ["mpos_1_rad", "tau_2_nm", "jpos_d_1_m", "jpos_2_rad", "jvel_1_m_s", "truth_jpos_1_m", "x_m", "truth_z_m"] {
        assert!(run.column(column).is_some(), "{column}");
    }
    let (motor, joint) = (run.column("mpos_1_rad").expect("motor"), run.column("jpos_1_m").expect("joint"));
    assert!(motor.iter().zip(joint).all(|(m, q)| (m - 500.0 * q).abs() < 1e-9));
    assert!(off(&run, &folder.run("one"), "tau_1_nm") == 0.0);
    let inside = run.column("jpos_d_1_m").expect("commands").iter().all(|q| (0.1..=0.4).contains(q));
    assert!(inside);
}

#[test]
fn a_corrected_robot_follows_the_commands_of_a_recording() {
    let folder = Bench::new("commands");
    folder.simulated("arm.urdf", "first", &["--minutes", "0.05", "--seed", "4"]);
    let recorded = folder.file("first").join("run_0001.csv");
    folder.simulated("arm.urdf", "again", &["--commands", text(&recorded)]);
    let (first, again) = (folder.run("first"), folder.run("again"));
    assert_eq!(first.time_s(), again.time_s());
    for column in ["mpos_1_rad", "jpos_2_rad", "truth_x_m"] {
        assert!(off(&first, &again, column) < 1e-3 * first.column(column).expect(column)[0].abs(), "{column}");
    }
    let effect = "[[effect]]\nphysics = \"backlash\"\njoint = \"swing\"\nparameters = { b = 0.02 }\n\
                  [[effect]]\nphysics = \"coulomb_friction\"\njoint = \"lift\"\nparameters = { f_c = 5.0 }\n";
    let file = format!("schema = \"ravenpose-robot/1\"\nname = \"worn\"\nbase = \"urdf\"\nurdf = \"arm.urdf\"\n{effect}");
    folder.0.write("worn.toml", file);
    folder.simulated("worn.toml", "worn", &["--commands", text(&recorded), text(&recorded)]);
    assert!(folder.file("worn").join("run_0002.csv").exists());
    let worn = folder.run("worn");
    assert!(off(&first, &worn, "truth_jpos_2_rad") > 5e-3);
    assert!(off(&first, &worn, "tau_1_nm") > 5e-3);
}

#[test]
fn a_raven_follows_commands_as_states() {
    let folder = Folder::new("raven");
    let out = folder.file("first");
    done(&["simulate", "--minutes", "0.02", "--seed", "5", "--out", text(&out)]);
    let (recorded, again) = (out.join("run_0001.mcap"), folder.file("again"));
    done(&["simulate", "--commands", text(&recorded), "--out", text(&again)]);
    let (a, b) = (folder.file("a.csv"), folder.file("b.csv"));
    done(&["convert", text(&recorded), text(&a)]);
    done(&["convert", text(&again.join("run_0001.mcap")), text(&b)]);
    let (a, b) = (csv::read(&a).expect("a"), csv::read(&b).expect("b"));
    assert_eq!(a.rows(), b.rows());
    for (column, most) in [("jpos_d_1_rad", 1e-6), ("jpos_1_rad", 2e-4), ("jpos_3_m", 1e-4), ("truth_x_m", 2e-4)] {
        assert!(off(&a, &b, column) < most, "{column}: {}", off(&a, &b, column));
    }
}

#[test]
fn runs_of_a_session_follow_each_other_whatever_the_threads() {
    let folder = Folder::new("session");
    let made = |name: &str, more: &[&str]| {
        let out = folder.file(name);
        let plan = [
            "simulate",
            "--minutes",
            "0.08",
            "--run-minutes",
            "0.02",
            "--seed",
            "5",
            "--robot",
            "raven2-worn",
            "--format",
            "csv",
            "--out",
            text(&out),
        ];
        done(&[&plan[..], more].concat());
        let read = |file: &str| std::fs::read(out.join(file)).expect(file);
        [read("run_0001.csv"), read("run_0002.csv"), read("run_0003.csv"), read("run_0004.csv"), read("simulation.txt")]
    };
    let cold = made("cold", &[]);
    let one = made("one", &["--runs-per-session", "2", "--homing-seed", "3", "--threads", "1"]);
    let two = made("two", &["--runs-per-session", "2", "--homing-seed", "3", "--threads", "2"]);
    assert!(one == two, "files depend on the threads");
    assert!(String::from_utf8_lossy(&one[4]).contains("runs per session = 2"));
    let homed = made("homed", &["--homing-seed", "3"]);
    // The first and the third run begin a session, the others go on where it stands.
    assert_eq!([0, 1, 2, 3].map(|run| one[run] == homed[run]), [true, false, true, false]);
    assert!(cold[0] != homed[0]);
}

#[test]
fn what_is_for_another_robot_is_refused() {
    let folder = Bench::new("refused");
    let plan = ["--minutes", "0.01", "--seed", "1"];
    let with = |more: &[&'static str]| -> Vec<&'static str> { [&plan[..], more].concat() };
    folder.refuses("arm.urdf", &with(&["--format", "mcap"]), "RAVEN-II only");
    folder.refuses("arm.urdf", &with(&["--arm", "green"]), "has one arm");
    folder.refuses("arm.urdf", &with(&["--motion", "zigzag"]), "is for RAVEN-II");
    folder.refuses("arm.urdf", &with(&["--runs-per-session", "2"]), "is no RAVEN-II, whose runs alone make sessions");
    folder.refuses("arm.urdf", &with(&["--runs-per-session", "0"]), "--runs-per-session 0: a session has at least one run");
    folder.refuses("none.urdf", &plan, "none.urdf: cannot be read");
    folder.0.write("bad.urdf", ARM.replace("upper=\"1\"", "upper=\"one\""));
    folder.refuses("bad.urdf", &plan, "bad.urdf: URDF line 8, joint swing");
    let table = folder.0.write("table.csv", "t_s,mpos_1_rad,mpos_2_rad\n0,1,2\n0.001,1,2\n");
    folder.refuses("arm.urdf", &["--commands", text(&table)], "has no column jpos_d_1_m");
    common::refused(
        &ravenpose(&["simulate", "--commands", text(&table), "--arm", "both", "--out", text(&folder.file("x"))]),
        &["--arm both"],
    );
    assert!(!folder.file("x").exists());
}
