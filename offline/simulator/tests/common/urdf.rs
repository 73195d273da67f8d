//! Arms for tests.
#![allow(dead_code, missing_docs, reason = "each test file uses its own part")]

use std::path::PathBuf;

/// Two turning joints and a sliding one, as in the gap examples.
pub(crate) const THREE_JOINTS: &str = r#"<robot name="three">
  <link name="world"/>
  <joint name="mount" type="fixed"><parent link="world"/><child link="base"/><origin rpy="0.5236 0 0"/></joint>
  <link name="base"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="link1"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1.57" effort="50" velocity="3"/></joint>
  <link name="link1"><inertial><origin xyz="0.03 -0.1063 0.1385"/><mass value="1.10"/>
    <inertia ixx="0.004" iyy="0.004" izz="0.012" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="elbow" type="revolute"><parent link="link1"/><child link="link2"/><origin rpy="1.30899694 0 0"/><axis xyz="0 0 1"/>
    <limit lower="0.5" upper="2.3" effort="50" velocity="3"/><dynamics damping="0.02" friction="0.1"/></joint>
  <link name="link2"><inertial><origin xyz="-0.0121 -0.1552 0.2003"/><mass value="1.40"/>
    <inertia ixx="0.004" iyy="0.004" izz="0.008" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="insertion" type="prismatic"><parent link="link2"/><child link="tool"/><origin rpy="0.90757121 0 0"/><axis xyz="0 0 -1"/>
    <limit lower="-0.30" upper="-0.10" effort="60" velocity="0.5"/></joint>
  <link name="tool"><inertial><origin xyz="0 0 0.10"/><mass value="0.407"/>
    <inertia ixx="0.0005" iyy="0.0005" izz="0.0001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="tip" type="fixed"><parent link="tool"/><child link="end_effector"/><origin xyz="0 0 -0.05"/></joint>
  <link name="end_effector"/>
  <transmission name="t1"><type>transmission_interface/SimpleTransmission</type><joint name="shoulder"/>
    <actuator name="m1"><mechanicalReduction>136.207</mechanicalReduction></actuator></transmission>
  <transmission name="t2"><type>transmission_interface/SimpleTransmission</type><joint name="elbow"/>
    <actuator name="m2"><mechanicalReduction>89.366</mechanicalReduction></actuator></transmission>
  <transmission name="t3"><type>transmission_interface/SimpleTransmission</type><joint name="insertion"/>
    <actuator name="m3"><mechanicalReduction>2158.590</mechanicalReduction></actuator></transmission>
</robot>
"#;

/// The URDF of the gap examples, or a plain word that it is absent.
pub(crate) fn gap_urdf() -> Option<PathBuf> {
    let path = super::data().join("gap-examples/robot.urdf");
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {} is absent", path.display());
    None
}
