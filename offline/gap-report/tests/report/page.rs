//! report.html: well-formed, self-contained, with everything that a reader needs and in the right order.

use crate::common;

use gap_report::{
    BeforeAfter, Channel, HeatMap, HeatRun, Level, Pictures, Quantity, Report, Share, Signature, Spectrum, headlines, html,
};
use roxmltree::{Document, Node, ParsingOptions};

fn parsed(text: &str) -> Document<'_> {
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).unwrap_or_else(|error| panic!("not well-formed: {error}"))
}

fn text_of(node: Node<'_, '_>) -> String {
    node.descendants().filter_map(|node| node.is_text().then(|| node.text()).flatten()).collect::<String>().replace('\u{a0}', " ")
}

fn texts(document: &Document<'_>, element: &str) -> Vec<String> {
    document.descendants().filter(|node| node.tag_name().name() == element).map(text_of).collect()
}

/// Well-formed, nothing from outside, no script, no number that is none, every figure with a text.
fn checked(report: &Report, pictures: &Pictures) -> String {
    let page = html(report, pictures);
    let document = parsed(&page);
    for node in document.descendants().filter(Node::is_element) {
        let name = node.tag_name().name();
        assert!(!["script", "link", "iframe", "img", "image", "use", "object", "base", "form"].contains(&name), "<{name}>");
        for attribute in node.attributes() {
            let (name, value) = (attribute.name(), attribute.value());
            assert!(!["href", "src", "srcset", "action"].contains(&name) && !name.starts_with("on"), "{name}");
            assert!(!value.contains("NaN") && !value.contains("inf"), "{name} = {value:.80}");
        }
        if name == "svg" && node.attribute("class").is_some() {
            assert_eq!(node.attribute("role"), Some("img"));
            assert!(node.attribute("aria-label").is_some_and(|label| !label.is_empty()));
        }
    }
    let style = texts(&document, "style").concat();
    assert!(!style.contains("url(") && !style.contains("@import"));
    assert!(style.contains("prefers-color-scheme:dark") && style.contains("@media print"));
    assert!(!page.replace("http://www.w3.org/1999/xhtml", "").contains("://"), "an address");
    assert_eq!(texts(&document, "h1"), [headlines(report)[0].clone()]);
    assert!(page.len() < 2_000_000, "{}", page.len());
    page
}

fn wave(size: f64) -> Vec<f64> {
    (0..60_000).map(|i| size * (f64::from(i) * 0.013).sin()).collect()
}

/// All kinds of pictures, with values missing here and there.
fn pictures() -> Pictures {
    let values = vec![vec![1.0, f64::NAN, 7.5, 2.0], vec![0.2, 1.1, f64::INFINITY, 1.0]];
    let run = |name: &str| HeatRun { run: name.to_owned(), start_s: 2.0, bin_s: 0.5, values: values.clone() };
    let heat = |channel, runs: &[&str]| HeatMap {
        channel,
        rows: vec!["shoulder".to_owned(), "a_very_long_name_of_a_joint".to_owned()],
        runs: runs.iter().map(|name| run(name)).collect(),
    };
    let t_s: Vec<f64> = (0..60_000).map(|i| f64::from(i) * 1e-3).collect();
    let mut before = wave(2.0);
    before[100] = f64::NAN;
    let picture = |effect| BeforeAfter {
        effect,
        run: "run-04".to_owned(),
        error: Quantity::new("Torque error <elbow>", "N.m"),
        t_s: t_s.clone(),
        before: before.clone(),
        after: wave(0.1),
        noise_floor: Some(0.12),
    };
    let share =
        |regime: &str, share| Share { channel: Channel::JointTorque, joint: "elbow".to_owned(), regime: regime.to_owned(), share };
    Pictures {
        heat: vec![heat(Channel::JointTorque, &["one", "two"]), heat(Channel::EndEffector, &["alone"])],
        shares: vec![share("at reversals", 0.7), share("", 0.3), share("nothing", f64::NAN)],
        signatures: vec![Signature {
            effect: 1,
            feature: Quantity::new("Velocity", "rad/s"),
            error: Quantity::new("Torque error, elbow", "N.m"),
            before: vec![(-0.1, -0.8), (0.1, 0.8), (f64::NAN, 1.0)],
            after: vec![(0.0, 0.1)],
            curve: vec![vec![(-0.1, -0.81), (0.0, -0.81)], vec![(0.0, 0.81), (0.1, 0.81)]],
            band: vec![vec![(0.0, 0.7, 0.9), (0.1, 0.7, f64::NAN)]],
            caption: "It jumps.".to_owned(),
        }],
        before_after: vec![picture(Some(1)), picture(None)],
        spectra: vec![Spectrum {
            effect: None,
            error: Quantity::new("torque error", "N.m"),
            frequency_hz: vec![0.0, 0.1, 1.0, 10.0],
            before: vec![1.0, 1.0, 0.1, 0.0],
            after: vec![f64::NAN; 4],
            noise_floor: vec![],
        }],
    }
}

#[test]
fn every_report_makes_a_page_with_and_without_pictures() {
    for (_, report) in common::all() {
        for pictures in [Pictures::default(), pictures()] {
            checked(&report, &pictures);
        }
    }
}

/// Pictures without content must not stop a report.
#[test]
fn empty_pictures_are_left_out() {
    let empty = Pictures {
        heat: vec![HeatMap { channel: Channel::Timing, rows: vec![], runs: vec![] }],
        shares: vec![],
        signatures: vec![Signature { effect: 1, ..Signature::default() }],
        before_after: vec![BeforeAfter { effect: Some(1), ..BeforeAfter::default() }],
        spectra: vec![Spectrum::default()],
    };
    let page = checked(&common::explained(), &empty);
    assert!(page.contains("no data"));
    let ragged = HeatRun { run: "r".to_owned(), start_s: 0.0, bin_s: 0.0, values: vec![vec![], vec![1.0]] };
    let heat = vec![HeatMap { channel: Channel::Timing, rows: vec!["a".to_owned(), "b".to_owned()], runs: vec![ragged] }];
    checked(&common::explained(), &Pictures { heat, ..Pictures::default() });
}

#[test]
fn the_answer_comes_first_and_failures_before_its_details() {
    let report = common::explained_with_failure();
    let page = checked(&report, &pictures());
    let at = |part: &str| page.find(part).unwrap_or_else(|| panic!("{part}"));
    let order = ["<h1>", "Put right first", "class=\"tiles\"", "Where it is", "A load at the tool", "<details>"];
    let places: Vec<usize> = order.iter().map(|part| at(part)).collect();
    assert!(places.windows(2).all(|pair| pair[0] < pair[1]), "{places:?}");
    assert_eq!(report.quality(Level::Fail).count(), 1);
    assert!(page.contains("from 12.1 to 30.0"));
}

#[test]
fn the_example_says_all_that_matters() {
    let page = checked(&common::explained(), &pictures());
    let document = parsed(&page);
    let all = text_of(document.root_element());
    for part in [
        "12.1 N (11.3 to 12.9)",
        "Camera positions arrive 23.1 ms (21.9 to 24.4) later",
        "99 % of the removable error is gone (95 % interval 96 to 100 %)",
        "Friction that grows with load (26 %)",
        "The experiment that would decide, 45 s",
        "insertion triangle of 40 mm",
        "load varies by 6 %",
        "run-04, run-05",
        "corrected.toml",
        "e67d23e7820c49a8051dac2831f38290f5e72f66c8db5079eeb60d82f14894c0",
        "Velocity, rad/s",
    ] {
        assert!(all.contains(part), "{part}");
    }
    assert_eq!(texts(&document, "summary").len(), 5);
}

#[test]
fn what_is_written_in_a_report_cannot_break_the_page() {
    let mut report = common::explained();
    let nasty = "</p><script>alert('x')</script>&amp;\u{0}\u{1b}";
    report.inputs.robot.name = nasty.to_owned();
    report.verdicts[0].confusable_with[0].reason = nasty.to_owned();
    report.data_quality[1].message = nasty.to_owned();
    report.verdicts[0].location.joint[0] = "<b>elbow</b>".to_owned();
    report.inputs.runs[0].id = nasty.to_owned();
    checked(&report, &pictures());
}
