//! URDF that is no serial arm, is wrong or is damaged: refused in one line that names the place and the remedy.
#![allow(missing_docs)]

mod common;

use arm::serial::Workspace;
use arm::urdf::{self, Options, UrdfError};
use common::urdf_text::{ARM, load, with};
use common::{Random, random_arm};

/// The one line with which a text is refused.
fn refused(text: &str) -> String {
    let message = urdf::load(text).expect_err("to be refused").to_string();
    println!("{message}");
    assert!(!message.contains('\n') && message.starts_with("URDF"), "{message}");
    message
}

#[test]
fn transmissions_that_couple_joints_are_refused_by_name() {
    let one = |kind: &str, inside: &str| with(&format!("<transmission name=\"t\"><type>{kind}</type>{inside}</transmission>"));
    let simple = "transmission_interface/SimpleTransmission";
    let differential =
        refused(&one("transmission_interface/DifferentialTransmission", r#"<joint name="one"/><joint name="two"/>"#));
    assert!(
        differential.contains("line 13, transmission t: it is transmission_interface/DifferentialTransmission"),
        "{differential}"
    );
    assert!(refused(&one(simple, r#"<joint name="one"/><joint name="two"/>"#)).contains("2 joints and 0 actuators"));
    assert!(refused(&one(simple, r#"<joint name="nine"/>"#)).contains("there is no joint `nine`"));
    assert!(refused(&one("", r#"<joint name="one"/>"#)).contains("transmission t: it is of no type"));
    let zero = one(simple, r#"<joint name="one"/><actuator name="m"><mechanicalReduction>0</mechanicalReduction></actuator>"#);
    assert!(refused(&zero).contains("mechanicalReduction is 0"));
    let word = zero.replace(">0<", ">fast<");
    assert!(refused(&word).contains("its text of <mechanicalReduction> is `fast`, expected a finite number"));
    let two = format!("{0}{0}", r#"<transmission name="t"><type>SimpleTransmission</type><joint name="one"/></transmission>"#);
    assert!(refused(&with(&two)).contains("joint `one` already has transmission `t`"));
}

#[test]
fn a_branch_is_refused_unless_the_tip_is_named() {
    let hand = r#"<link name="f1"/><link name="f2"/>
      <joint name="finger1" type="revolute"><parent link="c"/><child link="f1"/><origin xyz="0 0 1"/></joint>
      <joint name="finger2" type="revolute"><parent link="c"/><child link="f2"/><mimic joint="finger1"/></joint>"#;
    let text = with(hand);
    assert!(refused(&text).contains("joint finger2: mimic joints cannot be represented"));
    let text = text.replace(r#"<mimic joint="finger1"/>"#, "");
    let message = refused(&text);
    assert!(
        message.contains("branches at link `c` into joints finger1, finger2") && message.contains("known tips: f1, f2"),
        "{message}"
    );
    let named = |text: &str, tip: &str| urdf::load_with(text, &Options { tip: Some(tip.to_owned()), ..Options::default() });
    let finger = named(&with(hand), "f1").expect("a chain of four");
    assert_eq!(finger.arm.joint_count(), 4);
    assert!(finger.notes.contains(&"joint finger2: beside the chain, held at 0".to_owned()), "{:?}", finger.notes);
    let palm = named(&with(hand), "c").expect("a chain of three");
    assert_eq!((palm.arm.joint_count(), palm.arm.tools()[0].name.as_str()), (3, "c"));
    assert!(named(&with(hand), "f2").expect_err("mimic").to_string().contains("mimic"));
    assert!(matches!(named(&text, "hand"), Err(UrdfError::UnknownTip { .. })));
    assert!(matches!(named(&text, "base"), Err(UrdfError::NothingMoves { .. })));
}

#[test]
fn joints_and_trees_that_are_no_serial_arm_are_refused_by_name() {
    for kind in ["floating", "planar", "spherical", "hinge"] {
        let text = with("").replace(r#"name="two" type="continuous""#, &format!("name=\"two\" type=\"{kind}\""));
        assert!(refused(&text).contains(&format!("line 10, joint two: {kind} joints cannot be represented")));
    }
    assert!(refused(&with(r#"<link name="a"/>"#)).contains("line 13: there is a link a already"));
    assert!(refused(&with("").replace(r#"name="two""#, r#"name="one""#)).contains("there is a joint one already"));
    assert!(refused(&with("").replace(r#"child link="c""#, r#"child link="z""#)).contains("joint three: there is no link `z`"));
    assert!(refused(&with("").replace(r#"child link="c""#, r#"child link="b""#)).contains("link `b` already hangs on joint `two`"));
    assert!(refused(&with(r#"<link name="alone"/>"#)).contains("several roots, base, alone"));
    assert!(refused(&with("").replace(r#"parent link="base""#, r#"parent link="c""#)).contains("a loop apart from the root"));
    let ring = with("").replace(r#"parent link="base""#, r#"parent link="c""#).replace(r#"<link name="base"/>"#, "");
    assert!(refused(&ring).contains("every link is some joint's child"));
    assert!(refused("<robot name=\"x\"/>").contains("no link at all"));
    assert!(refused("<robot name=\"x\"><link name=\"a\"/></robot>").contains("no joint between the root `a`"));
    assert!(refused("<sdf/>").contains("the outermost element is <sdf>"));
}

#[test]
fn wrong_numbers_are_refused_with_line_and_element() {
    let changed = |from: &str, to: &str| {
        assert!(ARM.contains(from), "{from}");
        refused(&with("").replacen(from, to, 1))
    };
    assert!(changed(r#"xyz="0 0 0.3""#, r#"xyz="0 0 0.3 junk""#).contains("line 10, joint two: xyz of <origin> is `0 0 0.3 junk`"));
    let in_mm = changed(r#"xyz="0 0 0.3""#, r#"xyz="0 0 300""#);
    assert!(in_mm.contains("line 10, joint two: its origin is 300 m away; lengths of a URDF are in metres"), "{in_mm}");
    assert!(changed(r#"xyz="0 0 0.3""#, r#"xyz="0 nan 0.3""#).contains("expected three finite numbers"));
    assert!(changed(r#"rpy="1 2 3""#, r#"rpy="1 2""#).contains("rpy of <origin>"));
    assert!(changed(r#"rpy="1 2 3""#, r#"rpy="1 2 3" quat_xyzw="0 0 0 1""#).contains("both rpy and quat_xyzw"));
    assert!(changed(r#"rpy="1 2 3""#, r#"quat_xyzw="0 0 0 0""#).contains("quat_xyzw"));
    assert!(changed(r#"<mass value="2"/>"#, r#"<mass value="-2"/>"#).contains("line 3, link a: its mass is negative"));
    assert!(changed(r#"<mass value="2"/>"#, "").contains("link a: <mass> is missing"));
    assert!(changed(r#"iyz="0" "#, "").contains("attribute `iyz` of <inertia> is missing"));
    assert!(changed(r#"<axis xyz="0 0 1"/>"#, r#"<axis xyz="0 0 0"/>"#).contains("its axis is not a direction"));
    assert!(changed(r#"<axis xyz="0 0 1"/>"#, "<axis/>").contains("attribute `xyz` of <axis> is missing"));
    assert!(changed(r#"lower="-1" upper="2""#, r#"lower="3" upper="2""#).contains("lower 3 exceeds upper 2"));
    assert!(changed(r#"velocity="3""#, r#"velocity="-3""#).contains("velocity is negative"));
    for what in ["damping", "friction"] {
        let rubbed = changed(r#"<axis xyz="0 0 1"/>"#, &format!(r#"<axis xyz="0 0 1"/><dynamics {what}="-0.1"/>"#));
        assert!(rubbed.contains(&format!("{what} is negative; correct it")), "{rubbed}");
    }
    assert!(changed(r#"<parent link="a"/>"#, "").contains("joint two: <parent> is missing"));
    assert!(changed(r#" type="continuous""#, "").contains("joint two: attribute `type` of <joint> is missing"));
    assert!(changed(r#"<link name="b"/>"#, "<link/>").contains("line 5, link: attribute `name` of <link> is missing"));
    assert!(changed(r#"<origin xyz="0 0 0.1"/>"#, r#"<origin xyz="0 0 0.1"/><origin/>"#).contains("a second <origin>"));
    assert!(changed("</robot>", "").contains("not well-formed XML"));
}

const REPLACEMENTS: &[u8] = b" <>/\"=01-.eE\x00\xffxyz";

#[test]
fn damaged_text_is_an_error_or_an_arm_and_never_a_panic() {
    let text = urdf::save(&random_arm::arm(&mut Random::new(3), 4), &[]);
    for end in (0..text.len()).filter(|&end| text.is_char_boundary(end)) {
        let _ = urdf::load(&text[..end]).map_err(|error| error.to_string());
    }
    let mut random = Random::new(4);
    let (mut arms, mut errors) = (0, 0);
    for _ in 0..20_000 {
        let mut bytes = text.clone().into_bytes();
        for _ in 0..=random.below(3) {
            let at = random.below(bytes.len());
            bytes[at] = REPLACEMENTS[random.below(REPLACEMENTS.len())];
        }
        match urdf::load(&String::from_utf8_lossy(&bytes)) {
            Ok(loaded) => {
                let (mut ws, q) = (Workspace::new(&loaded.arm), vec![0.1; loaded.arm.joint_count()]);
                let _ = loaded.arm.tip(&mut ws, &q);
                arms += 1;
            }
            Err(error) => {
                assert!(!error.to_string().contains('\n'), "{error}");
                errors += 1;
            }
        }
    }
    println!("20000 damaged texts: {arms} still arms, {errors} refused");
    assert!(arms > 100 && errors > 10_000);
}

#[test]
fn deep_nesting_and_long_chains_end_well() {
    let deep = format!("{}{}", "<x>".repeat(200_000), "</x>".repeat(200_000));
    assert_eq!(load(&with(&deep)).arm.joint_count(), 3);
    let mut links = String::new();
    for i in 0..20_000 {
        let parent = if i == 0 { "c".to_owned() } else { format!("l{}", i - 1) };
        let link =
            format!(r#"<link name="l{i}"/><joint name="j{i}" type="fixed"><parent link="{parent}"/><child link="l{i}"/></joint>"#);
        links.push_str(&link);
    }
    assert_eq!(load(&with(&links)).arm.tools()[0].name, "l19999");
}
