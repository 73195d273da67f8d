//! The URDF that goes with a case: exact geometry, the laboratory's masses.

use crate::arm::{Arm, Motion};
use std::fmt::Write;

fn three(v: &[f64; 3]) -> String {
    v.iter().map(|x| number(*x)).collect::<Vec<_>>().join(" ")
}

/// Eight decimals, trailing zeros dropped.
fn number(x: f64) -> String {
    let text = format!("{x:.8}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// The text of `robot.urdf`.
pub(crate) fn text(model: &Arm) -> String {
    let mut out = String::from("<?xml version=\"1.0\"?>\n");
    let _ =
        writeln!(out, "<!-- Kinematics exact, inertials approximate (what a lab would have). Gravity is along the world's -z. -->");
    let _ = writeln!(out, "<robot name=\"{}\">\n  <link name=\"world\"/>", model.name);
    let mount = three(&model.mount);
    let _ = writeln!(
        out,
        "  <joint name=\"mount\" type=\"fixed\"><parent link=\"world\"/><child link=\"base\"/><origin rpy=\"{mount}\"/></joint>\n  <link name=\"base\"/>"
    );
    let mut parent = "base";
    for (joint, link) in model.joints.iter().zip(&model.links) {
        let (kind, effort, velocity) = if joint.motion == Motion::Turns { ("revolute", 50, "3") } else { ("prismatic", 60, "0.5") };
        let (rpy, xyz, axis) = (three(&joint.rpy), three(&joint.xyz), three(&joint.axis));
        let [lower, upper] = joint.limits.map(number);
        let _ = writeln!(
            out,
            "  <joint name=\"{}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{}\"/><origin xyz=\"{xyz}\" rpy=\"{rpy}\"/><axis xyz=\"{axis}\"/><limit lower=\"{lower}\" upper=\"{upper}\" effort=\"{effort}\" velocity=\"{velocity}\"/></joint>",
            joint.name, link.name
        );
        let i = &link.inertia;
        let [ixx, iyy, izz, ixy, ixz, iyz] = [i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(0, 1)], i[(0, 2)], i[(1, 2)]].map(number);
        let _ = writeln!(
            out,
            "  <link name=\"{}\"><inertial><origin xyz=\"{}\"/><mass value=\"{}\"/><inertia ixx=\"{ixx}\" iyy=\"{iyy}\" izz=\"{izz}\" ixy=\"{ixy}\" ixz=\"{ixz}\" iyz=\"{iyz}\"/></inertial></link>",
            link.name,
            three(&link.centre.into()),
            number(link.mass)
        );
        parent = &link.name;
    }
    let tip = three(&model.tip);
    let _ = writeln!(
        out,
        "  <joint name=\"tip\" type=\"fixed\"><parent link=\"{parent}\"/><child link=\"end_effector\"/><origin xyz=\"{tip}\"/></joint>\n  <link name=\"end_effector\"/>"
    );
    for (j, (joint, drive)) in model.joints.iter().zip(&model.drives).enumerate() {
        let _ = writeln!(
            out,
            "  <transmission name=\"{0}_drive\"><type>transmission_interface/SimpleTransmission</type><joint name=\"{0}\"><hardwareInterface>EffortJointInterface</hardwareInterface></joint><actuator name=\"motor{1}\"><mechanicalReduction>{2}</mechanicalReduction></actuator></transmission>",
            joint.name,
            j + 1,
            number(drive.ratio)
        );
    }
    out.push_str("</robot>\n");
    out
}
