//! Links that are otherwise than the robot's file has them.

use crate::common::{Folder, case_of, holds, primary, wanted, written};
use gap_report::{ALONG, Role, Status};
use generator::order::{Kind, Order};

#[test]
fn a_link_that_is_moved_across_its_length_is_told_with_the_way() {
    // Joints about one direction: to each of two links the shift is the same, and it makes neither longer. One was said to be shorter by it.
    let folder = Folder::new("across");
    let effects = vec![wanted("link_geometry", Some(1), &[("d_length", 0.002)])];
    let order = Order { seed: 99_101, label: "across".to_owned(), effects, robot: Kind::Planar, ..Order::default() };
    let (case, _) = written(&folder, &order);
    let report = case.judged(&folder.file("out"));
    let first = primary(&report)[0];
    assert_eq!((report.status, first.physics.to_string().as_str()), (Status::Explained, "link_geometry"), "{}", report.summary);
    holds(first, "d_length", 0.002, 0.1);
    // Along z of link 1, and y of the base the other way.
    let along = first.parameters[0].extra.get(ALONG).and_then(|way| way.as_str());
    let (joint, way) = (first.location.joint[0].as_str(), along.expect("a way"));
    assert!([("joint1", "-y"), ("joint2", "z")].contains(&(joint, way)), "{joint}, {way}");
    let shown = way.replace('-', "\u{2212}");
    let (how, page) = ("is moved by 2.0", std::fs::read_to_string(folder.file("out/report.html")).expect("page"));
    assert!(report.summary.contains(how) && report.summary.contains(&format!("along {shown}")), "{}", report.summary);
    assert!(page.contains(&format!("shift along {shown} (d_length)")));
}

#[test]
fn a_frame_that_is_hardly_off_is_no_sure_link() {
    // A third of the noise: a turn and a shift of the camera's frame predict no worse than a link that is moved, and had a probability of 0.06 for their
    // six numbers.
    let folder = Folder::new("hardly");
    let (case, _) = case_of(&folder, "full", 557_738_847, "8f6e281f9d33");
    let report = case.judged(&folder.file("out"));
    let all = || report.verdicts.iter().filter(|verdict| verdict.effect == 1);
    let named = |physics: &str| all().find(|verdict| verdict.physics.to_string() == physics).expect("named");
    let (link, frame) = (named("link_geometry"), named("frame_misalignment"));
    assert!(link.role == Role::Primary && link.probability < 0.8, "{}", link.probability);
    assert!(frame.probability > 0.2, "{}", frame.probability);
    assert!(link.confusable_with.iter().any(|other| other.physics == frame.physics));
}
