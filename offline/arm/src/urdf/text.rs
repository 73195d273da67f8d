//! An arm as URDF text.

use std::fmt::Write as _;

use nalgebra::{IsometryMatrix3, Rotation3, Vector3};

use super::Drive;
use super::element::to_rpy;
use crate::serial::{Body, JointKind, JointLimits, SerialArm, Tool};

/// URDF text that [`super::load`] reads as this arm again: root link `world` with gravity along -z, a fixed joint `mount` to
/// the base frame, the bodies, each tool on a fixed joint, and a transmission per drive (none: no transmissions). The
/// amount of gravity is not part of URDF; a link without mass and inertia has no `<inertial>`.
pub fn save(arm: &SerialArm, drives: &[Drive]) -> String {
    let mut out = String::from("<?xml version=\"1.0\"?>\n");
    line(&mut out, &format!("<robot name=\"{}\">", escaped(arm.name())));
    line(&mut out, "  <link name=\"world\"/>");
    let mount = IsometryMatrix3::from_parts(Vector3::zeros().into(), mount(&arm.gravity_vector()));
    fixed(&mut out, "mount", "world", arm.base_name(), &mount);
    line(&mut out, &format!("  <link name=\"{}\"/>", escaped(arm.base_name())));
    let mut parent = arm.base_name();
    for body in arm.bodies() {
        joint(&mut out, body, parent);
        link(&mut out, body);
        parent = &body.name;
    }
    // The link itself may be one of its own tools.
    for tool in arm.tools().iter().filter(|tool| tool.name != parent) {
        frame(&mut out, tool, parent);
    }
    for (drive, body) in drives.iter().zip(arm.bodies()) {
        transmission(&mut out, drive, body);
    }
    out.push_str("</robot>\n");
    out
}

/// A rotation that turns the base so that gravity points along -z of the world.
fn mount(gravity: &Vector3<f64>) -> Rotation3<f64> {
    let down = Vector3::new(0.0, 0.0, -1.0);
    let turned = Rotation3::rotation_between(gravity, &down);
    // Opposite directions have no shortest way round; without gravity none is needed.
    turned.unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}

fn joint(out: &mut String, body: &Body, parent: &str) {
    let joint = &body.joint;
    let kind = match joint.kind {
        JointKind::Revolute => "revolute",
        JointKind::Continuous => "continuous",
        JointKind::Prismatic => "prismatic",
    };
    line(out, &format!("  <joint name=\"{}\" type=\"{kind}\">", escaped(&joint.name)));
    ends(out, parent, &body.name, &body.placement);
    line(out, &format!("    <axis xyz=\"{}\"/>", triple(&joint.axis)));
    if joint.kind != JointKind::Continuous {
        line(out, &format!("    <limit{}/>", limits(&joint.limits)));
    }
    line(out, "  </joint>");
}

/// Attributes of `<limit>`. Other readers insist on velocity and effort; 0 is what exporters write where nothing is known, and
/// what [`super::load`] reads as that. A range that is open at one end ends at the largest number there.
fn limits(limits: &JointLimits) -> String {
    let known = |value: f64| if value.is_finite() { value } else { 0.0 };
    let mut out = format!(" velocity=\"{}\" effort=\"{}\"", known(limits.velocity), known(limits.effort));
    if limits.lower.is_finite() || limits.upper.is_finite() {
        let (lower, upper) = (limits.lower.max(f64::MIN), limits.upper.min(f64::MAX));
        let _ = write!(out, " lower=\"{lower:e}\" upper=\"{upper:e}\"");
    }
    out
}

fn link(out: &mut String, body: &Body) {
    let (inertia, i) = (&body.inertia, &body.inertia.inertia_com_kg_m2);
    if inertia.mass_kg == 0.0 && i.amax() == 0.0 {
        line(out, &format!("  <link name=\"{}\"/>", escaped(&body.name)));
        return;
    }
    line(out, &format!("  <link name=\"{}\">", escaped(&body.name)));
    line(out, &format!("    <inertial><origin xyz=\"{}\"/><mass value=\"{}\"/>", triple(&inertia.com_m), inertia.mass_kg));
    let tensor = [("ixx", i.m11), ("ixy", i.m12), ("ixz", i.m13), ("iyy", i.m22), ("iyz", i.m23), ("izz", i.m33)];
    let tensor = tensor.map(|(name, value)| format!("{name}=\"{value}\"")).join(" ");
    line(out, &format!("      <inertia {tensor}/></inertial>"));
    line(out, "  </link>");
}

fn frame(out: &mut String, tool: &Tool, parent: &str) {
    fixed(out, &format!("{}_mount", tool.name), parent, &tool.name, &tool.pose);
    line(out, &format!("  <link name=\"{}\"/>", escaped(&tool.name)));
}

fn fixed(out: &mut String, name: &str, parent: &str, child: &str, pose: &IsometryMatrix3<f64>) {
    line(out, &format!("  <joint name=\"{}\" type=\"fixed\">", escaped(name)));
    ends(out, parent, child, pose);
    line(out, "  </joint>");
}

fn ends(out: &mut String, parent: &str, child: &str, pose: &IsometryMatrix3<f64>) {
    line(out, &format!("    <parent link=\"{}\"/><child link=\"{}\"/>", escaped(parent), escaped(child)));
    let (xyz, rpy) = (triple(&pose.translation.vector), triple(&to_rpy(&pose.rotation)));
    line(out, &format!("    <origin xyz=\"{xyz}\" rpy=\"{rpy}\"/>"));
}

fn transmission(out: &mut String, drive: &Drive, body: &Body) {
    let Some(name) = &drive.transmission else { return };
    let actuator = drive.actuator.clone().unwrap_or_else(|| format!("{name}_motor"));
    line(out, &format!("  <transmission name=\"{}\">", escaped(name)));
    line(out, "    <type>transmission_interface/SimpleTransmission</type>");
    line(out, &format!("    <joint name=\"{}\"><offset>{}</offset></joint>", escaped(&body.joint.name), drive.offset));
    let reduction = format!("<mechanicalReduction>{}</mechanicalReduction>", drive.reduction);
    line(out, &format!("    <actuator name=\"{}\">{reduction}</actuator>", escaped(&actuator)));
    line(out, "  </transmission>");
}

fn triple(v: &Vector3<f64>) -> String {
    format!("{} {} {}", v.x, v.y, v.z)
}

fn line(out: &mut String, text: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(out, "{text}");
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
