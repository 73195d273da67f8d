//! What must hold without any folder of vectors.
#![allow(missing_docs)]

use arm::{Arm, JOINTS, Joints, Raven2, Side, Tool, kinematics, published};

/// A spread of joint positions over the command limits: a Kronecker sequence, the same every time.
fn poses() -> impl Iterator<Item = Joints> {
    let steps = [0.618_034, 0.414_214, 0.732_051, 0.236_068, 0.645_751, 0.316_625, 0.605_551];
    let limits = Raven2::nominal().arm(Side::Gold).limits;
    (1..=500).map(move |k| {
        std::array::from_fn(|i| {
            let share: f64 = (f64::from(k) * steps[i]).fract();
            limits.min()[i] + share * (limits.max()[i] - limits.min()[i])
        })
    })
}

fn arms() -> impl Iterator<Item = Arm> {
    Side::ALL.into_iter().flat_map(|side| Tool::ALL.into_iter().map(move |tool| Raven2::nominal().arm_with_tool(side, tool)))
}

fn worst(a: &[f64; JOINTS], b: &[f64; JOINTS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn joints_to_motors_and_back_is_the_identity() {
    for arm in arms() {
        for joints in poses() {
            let back = arm.transmission.joints(&arm.transmission.motors(&joints));
            assert!(worst(&joints, &back) < 1e-12, "{:?} {:?}", arm.side, arm.tool);
        }
    }
}

#[test]
fn motors_to_joints_and_back_is_the_identity() {
    for arm in arms() {
        for joints in poses() {
            let motors = joints.map(|joint| 300.0 * joint - 50.0);
            let back = arm.transmission.motors(&arm.transmission.joints(&motors));
            assert!(worst(&motors, &back) < 1e-9, "{:?} {:?}", arm.side, arm.tool);
        }
    }
}

#[test]
fn tool_motors_follow_the_measured_motor_3() {
    for arm in arms() {
        for joints in poses() {
            let motors = arm.transmission.motors(&joints);
            assert_eq!(arm.transmission.motors_at(&joints, motors[2]), motors);
            let moved = arm.transmission.motors_at(&joints, motors[2] + 1.0);
            let steps: [f64; JOINTS] = std::array::from_fn(|i| moved[i] - motors[i]);
            assert_eq!(steps[..3], [0.0; 3]);
            assert!((steps[3] - steps[4]).abs() < 1e-9 && (steps[3] - steps[6]).abs() < 1e-9);
            assert!((steps[3] + steps[5]).abs() < 1e-9 && steps[3].abs() > 0.3);
        }
    }
}

#[test]
fn green_tip_is_the_mirror_image_of_gold() {
    let (gold, green) = (Raven2::nominal().arm(Side::Gold), Raven2::nominal().arm(Side::Green));
    for joints in poses() {
        let mut mirrored = joints;
        mirrored[3] = -joints[3];
        let a = gold.kinematics.tip_position(&mirrored);
        let b = green.kinematics.tip_position(&joints);
        assert!((b.x - a.x).abs() < 1e-15 && (b.y + a.y).abs() < 1e-15 && (b.z - a.z).abs() < 1e-15, "{a} {b}");
    }
}

#[test]
fn gravity_feed_forward_is_the_same_on_both_arms() {
    let (gold, green) = (Raven2::nominal().arm(Side::Gold), Raven2::nominal().arm(Side::Green));
    for joints in poses() {
        let (a, b) = (gold.gravity.capstan_torque(&joints), green.gravity.capstan_torque(&joints));
        assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-12), "{a:?} {b:?}");
    }
}

#[test]
fn what_holds_a_mass_at_the_tip_does_the_work_that_lifts_it() {
    let plant = Raven2::nominal().plant();
    let gravity = nalgebra::Vector3::from(plant.control.gravity_model.gravity_m_s2);
    for arm in Side::ALL.map(|side| Raven2::nominal().arm(side)) {
        for joints in poses() {
            let torque = arm.gravity.capstan_torque_per_tip_kg(&joints);
            for (joint, torque) in torque.iter().enumerate() {
                let tip = |step: f64| {
                    let mut moved = joints;
                    moved[joint] += step;
                    arm.kinematics.tip_position(&moved)
                };
                let lifted = -gravity.dot(&(tip(1e-6) - tip(-1e-6))) / 2e-6;
                let share = plant.transmission.gear_big / plant.transmission.ratio[joint];
                assert!((torque - share * lifted).abs() < 1e-7, "joint {joint}: {torque} {}", share * lifted);
            }
        }
    }
}

#[test]
fn frames_are_orthonormal_and_right_handed() {
    for arm in Side::ALL.map(|side| Raven2::nominal().arm(side)) {
        for joints in poses() {
            for frame in arm.kinematics.frames(&joints) {
                let r = frame.rotation.matrix();
                assert!((r.transpose() * r - nalgebra::Matrix3::identity()).norm() < 1e-14);
                assert!((r.determinant() - 1.0).abs() < 1e-14);
            }
        }
    }
}

#[test]
fn the_joint_map_is_the_one_read_off_the_real_robot() {
    // data/raven2-uiuc/README.md: degrees of the motors in, degrees (joint 3: m x 57.29578) out.
    let map = [[0.007_342_35, 0.0, 0.0], [-0.001_067_94, 0.008_228_96, 0.0], [-4.862_47e-5, -6.646_81e-5, 4.632_65e-4]];
    let transmission = Raven2::nominal().arm(Side::Gold).transmission;
    for motor in 0..3 {
        let mut motors = [0.0; JOINTS];
        motors[motor] = 1.0_f64.to_radians();
        let joints = transmission.joints(&motors);
        for joint in 0..3 {
            // Five to six digits are printed there.
            assert!((joints[joint].to_degrees() - map[joint][motor]).abs() < 5.1e-9, "joint {joint}, motor {motor}");
        }
    }
}

#[test]
fn published_speeds_are_steps_of_the_encoder() {
    // ravenstate.md, trap 3.
    let gold = Raven2::nominal().arm(Side::Gold);
    let step = gold.encoders.speed(1.0, 0.0);
    assert!((step.to_degrees() - 90.0).abs() < 1e-9);
    let speeds = gold.transmission.published_speeds(&[step; JOINTS]);
    assert!((speeds[0].to_degrees() - 0.661).abs() < 5e-4);
    assert!((speeds[1].to_degrees() - 0.741).abs() < 5e-4);
    assert!((speeds[2] - 0.728e-3).abs() < 5e-7);
    assert_eq!(speeds[3..], [0.0; 4]);
}

#[test]
fn encoder_counts_and_angles_agree_with_their_signs() {
    for arm in Side::ALL.map(|side| Raven2::nominal().arm(side)) {
        for joint in 0..JOINTS {
            let angle = 12.34 * (joint as f64 + 1.0);
            let count = arm.encoders.quantise(angle);
            let raw = arm.encoders.raw_count(joint, count, 1000.0);
            assert_eq!(raw, (arm.encoders.sign(joint) * (count + 1000.0)) as i32);
            let back = arm.encoders.angle(joint, raw, 1000.0);
            assert!(back <= angle && angle - back < arm.encoders.rad_per_count());
        }
    }
    assert_eq!(Raven2::nominal().arm(Side::Gold).encoders.quantise(-1e-9), -1.0);
}

#[test]
fn amplifier_counts_have_the_published_scale_sign_and_limit() {
    // raven2-plant.md, section 5: counts per N m of tau, sign per arm, clip.
    let (gold, green) = (Raven2::nominal().arm(Side::Gold), Raven2::nominal().arm(Side::Green));
    assert!((gold.amplifiers.counts_per_nm()[0] + 3695.8).abs() < 0.05);
    assert!((green.amplifiers.counts_per_nm()[2] - 3695.8).abs() < 0.05);
    // The document prints 27329; its own constants give 27328.4.
    assert!((gold.amplifiers.counts_per_nm()[5] - 27329.0).abs() < 1.0);
    assert_eq!(gold.amplifiers.counts(0, 0.01), -36);
    assert_eq!(gold.amplifiers.counts(0, -0.01), 36);
    assert_eq!(gold.amplifiers.counts(2, 9.0), -2000);
    assert_eq!(gold.amplifiers.counts_unclipped(2, 9.0), -33262.0);
    assert_eq!(green.amplifiers.counts(5, -9.0), -3800);
    for joint in 0..JOINTS {
        assert!((gold.amplifiers.torque(joint, gold.amplifiers.counts_per_nm()[joint]) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn home_is_inside_the_limits_and_the_hard_stops_are_not() {
    let limits = Raven2::nominal().arm(Side::Gold).limits;
    assert!(limits.contains(limits.home()));
    assert!(!limits.contains(limits.homing_stop()));
    assert!(limits.allows(0, limits.homing_stop()[0]), "the shoulder's stop is its lower limit");
    assert!(!limits.allows(2, f64::NAN));
}

#[test]
fn published_units_keep_the_empty_slot_and_the_quirk_of_joint_3() {
    let home = *Raven2::nominal().arm(Side::Gold).limits.home();
    let slots = published::degrees(&home);
    assert_eq!(slots[3], 0.0);
    assert!((slots[0] - 30.0).abs() < 1e-5 && (slots[2] - 22.918_312).abs() < 1e-5 && (slots[7] - 45.0).abs() < 1e-5);
    assert_eq!(published::slots(&[1, 2, 3, 4, 5, 6, 7]), [1, 2, 3, 0, 4, 5, 6, 7]);
    assert_eq!(published::grasp(1.234_56), 1.234);
    assert!((kinematics::jaw_opening(&home).to_degrees() - 90.0).abs() < 1e-8);
    assert_eq!(kinematics::wrist_yaw(&home), 0.0);
}

#[test]
fn published_positions_truncate_toward_zero() {
    let tip = nalgebra::IsometryMatrix3::translation(1.9e-6, -1.9e-6, -0.5e-6);
    assert_eq!(published::position_um(&tip), [1, -1, 0]);
}

#[test]
fn names_of_arms_and_tools_round_trip() {
    assert!(Side::ALL.into_iter().all(|side| Side::from_name(side.name()) == Some(side)));
    assert!(Tool::ALL.into_iter().all(|tool| Tool::from_name(tool.name()) == Some(tool)));
    assert_eq!(Side::from_name("LEFT"), Some(Side::Gold));
    assert_eq!(Side::from_name("both"), None);
}

#[test]
fn the_embedded_plant_is_the_specification_byte_for_byte() {
    let spec = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/spec/raven2-plant.toml");
    let Ok(spec_text) = std::fs::read_to_string(&spec) else {
        println!("skipped: {} is absent", spec.display());
        return;
    };
    assert!(spec_text == include_str!("../../../models/raven2-plant.toml"));
}
