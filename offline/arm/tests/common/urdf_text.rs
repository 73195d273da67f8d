//! A small arm as URDF text, to be changed by tests.
#![allow(dead_code, missing_docs, reason = "each test file uses its own part")]

use arm::urdf::{self, UrdfArm};

/// A revolute, a continuous and a prismatic joint in a row; `{}` is where tests put more.
pub(crate) const ARM: &str = r#"<robot name="three">
  <link name="base"/>
  <link name="a"><inertial><origin xyz="0 0 0.1"/><mass value="2"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="b"/>
  <link name="c"><inertial><mass value="1"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <joint name="one" type="revolute"><parent link="base"/><child link="a"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="2" velocity="3" effort="4"/></joint>
  <joint name="two" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0 0 0.3" rpy="1 2 3"/></joint>
  <joint name="three" type="prismatic"><parent link="b"/><child link="c"/>
    <axis xyz="0 1 0"/><limit lower="0" upper="0.2" velocity="0" effort="0"/></joint>
  {}
</robot>"#;

pub(crate) fn with(more: &str) -> String {
    ARM.replace("{}", more)
}

pub(crate) fn load(text: &str) -> UrdfArm {
    urdf::load(text).unwrap_or_else(|error| panic!("{error}"))
}
