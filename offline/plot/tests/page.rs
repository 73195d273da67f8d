//! The page of a recording: well-formed, self-contained, small, and with figures that are right.
#![allow(missing_docs)]

use plot::figure::{Axis, Colour, Figure, Mark, Panel, svg, svg_document};
use plot::page::{Block, Page};
use plot::statistics::Statistics;
use plot::{Options, PlotError, overview, overview_svg};
use recordings::{Column, Recording};
use roxmltree::{Document, ParsingOptions};

fn recording(name: &str, columns: Vec<(&str, Vec<f64>)>) -> Recording {
    let columns = columns.into_iter().map(|(name, values)| Column::new(name, values)).collect();
    Recording { name: name.to_owned(), columns, ..Recording::default() }
}

fn parsed(text: &str) -> Document<'_> {
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).unwrap_or_else(|error| panic!("not well-formed: {error}"))
}

/// All text of the elements with a name.
fn texts(document: &Document<'_>, element: &str) -> Vec<String> {
    let of = |node: roxmltree::Node<'_, '_>| {
        node.descendants().filter_map(|node| node.is_text().then(|| node.text()).flatten()).collect()
    };
    document.descendants().filter(|node| node.tag_name().name() == element).map(of).collect()
}

fn page_of(recording: &Recording) -> String {
    let html = overview(recording, &Options::default()).unwrap_or_else(|error| panic!("{error}"));
    check_page(&html);
    let svg = overview_svg(recording, &Options::default()).expect("SVG");
    check_numbers(&parsed(&svg));
    html
}

/// Well-formed, nothing from outside, no script, every number in the drawings finite.
fn check_page(html: &str) {
    let document = parsed(html);
    for node in document.descendants().filter(roxmltree::Node::is_element) {
        let name = node.tag_name().name();
        assert!(!["script", "link", "iframe", "img", "image", "use", "object"].contains(&name), "<{name}>");
        for attribute in node.attributes() {
            assert!(!["href", "src", "onload", "onclick"].contains(&attribute.name()), "{name} {}", attribute.name());
        }
    }
    let style = texts(&document, "style").concat();
    assert!(!style.contains("url(") && !style.contains("@import"));
    assert!(style.contains("prefers-color-scheme"));
    check_numbers(&document);
}

fn check_numbers(document: &Document<'_>) {
    let drawn = ["d", "x", "y", "width", "height", "viewBox", "transform"];
    for node in document.descendants() {
        for attribute in node.attributes().filter(|attribute| drawn.contains(&attribute.name())) {
            let text = attribute.value();
            assert!(!text.contains("NaN") && !text.contains("inf"), "{} = {}", attribute.name(), &text[..text.len().min(80)]);
        }
    }
}

const ROWS: usize = 4000;

/// A run at 200 Hz with an error of known size: 0.4 mm of hysteresis on x, a constant on y, a wave on z.
fn run() -> Recording {
    let t: Vec<f64> = (0..ROWS).map(|i| i as f64 * 0.005).collect();
    let wave = |amplitude: f64, rate: f64| t.iter().map(|t| amplitude * (rate * t).sin()).collect::<Vec<f64>>();
    let (x, y, z) = (wave(0.02, 1.3), wave(0.03, 0.9), wave(0.01, 2.1));
    let rising = |t: &f64| (1.3 * t).cos().signum();
    let truth = |values: &[f64], error: &dyn Fn(&f64) -> f64| {
        // A camera at 50 Hz: three of four rows without a frame.
        let value = |(i, (value, t)): (usize, (&f64, &f64))| if i % 4 == 0 { value + error(t) } else { f64::NAN };
        values.iter().zip(&t).enumerate().map(value).collect::<Vec<f64>>()
    };
    let (truth_x, truth_y) = (truth(&x, &|t| 2e-4 * rising(t)), truth(&y, &|_| 1e-3));
    let truth_z = truth(&z, &|t| 5e-4 * (3.0 * t).sin());
    recording(
        "somewhere/run <1> & \"two\".csv",
        vec![
            ("t_s", t.clone()),
            ("jpos_d_1_rad", wave(0.5, 1.0)),
            ("jpos_1_rad", wave(0.49, 1.0)),
            ("truth_jpos_1_rad", wave(0.48, 1.0)),
            ("jpos_2_rad", wave(0.3, 1.7)),
            ("jpos_d_3_m", wave(0.05, 0.5)),
            ("jpos_3_m", wave(0.049, 0.5)),
            ("tau_1_nm", wave(0.03, 1.1)),
            ("dac_3_counts", wave(700.0, 0.6)),
            ("mpos_1_rad", wave(40.0, 1.0)),
            ("mvel_1_rad_s", wave(40.0, 1.1)),
            ("x_m", x),
            ("y_m", y),
            ("z_m", z),
            ("truth_x_m", truth_x),
            ("truth_y_m", truth_y),
            ("truth_z_m", truth_z),
            ("sensor_5", wave(3.0, 0.2)),
        ],
    )
}

#[test]
fn captions_and_table_hold_the_figures_of_the_data() {
    let run = run();
    let html = page_of(&run);
    let document = parsed(&html);
    // Independently: sorted sizes, no interpolation needed to the digits shown.
    let error = |axis: &str| -> Vec<f64> {
        let (truth, reported) =
            (run.column(&format!("truth_{axis}_m")).expect("truth"), run.column(&format!("{axis}_m")).expect("x"));
        truth.iter().zip(reported).map(|(t, r)| (t - r) * 1e3).filter(|e| e.is_finite()).collect()
    };
    let (x, y, z) = (error("x"), error("y"), error("z"));
    let mut length: Vec<f64> = x.iter().zip(&y).zip(&z).map(|((x, y), z)| (x * x + y * y + z * z).sqrt()).collect();
    let rms = |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    let rms_3d = rms(&length);
    length.sort_by(f64::total_cmp);
    assert_eq!(length.len(), ROWS / 4);
    let (p95, most) = (0.95 * (length.len() - 1) as f64, length[length.len() - 1]);
    let p95 = length[p95 as usize] + p95.fract() * (length[p95 as usize + 1] - length[p95 as usize]);
    let expected = format!(
        "3D error: RMS {rms_3d:.2} mm, 95 % below {p95:.2} mm, at most {most:.2} mm in 1000 samples. RMS per axis x, y, z: {:.3}, {:.2}, {:.3} mm.",
        rms(&x),
        rms(&y),
        rms(&z)
    );
    let captions = texts(&document, "figcaption");
    assert!(captions.contains(&expected), "no `{expected}` in {captions:#?}");
    // Hysteresis: rising minus falling is twice 0.2 mm; a bin at the turns may hold few samples of both.
    let branch = captions.iter().find(|caption| caption.starts_with("Medians over position. Rising minus falling: 0.400 mm"));
    assert!(branch.is_some(), "{captions:#?}");
    let cells = texts(&document, "td");
    let row = cells.iter().position(|cell| cell == "Tip y").expect("row of y");
    assert_eq!(
        cells[row..row + 10],
        ["Tip y", "true \u{2212} reported", "mm", "1\u{202f}000", "1.00", &cells[row + 5], "1.00", "1.00", "1.00", "1.00"]
    );
    assert!(cells.contains(&"commanded \u{2212} reported".to_owned()), "tracking stands beside the true error");
}

#[test]
fn every_section_is_there_with_units_on_its_axes() {
    let html = page_of(&run());
    let document = parsed(&html);
    let headings = texts(&document, "h2");
    for heading in [
        "Errors",
        "Tip",
        "Joints",
        "Error against load",
        "Error by direction of motion",
        "Error by posture",
        "Distribution of the error",
        "Load against velocity",
        "Motors",
        "Other channels",
        "How to read this",
    ] {
        assert!(headings.contains(&heading.to_owned()), "no {heading} in {headings:?}");
    }
    let labels = texts(&document, "text");
    for label in [
        "Time, s",
        "Position, deg",
        "Position, mm",
        "True \u{2212} reported, mm",
        "Motor torque, mN·m",
        "Amplifier command, counts",
        "Velocity, rad/s",
        "Joint 1, deg",
        "Mean size, mm",
        "commanded",
        "reported",
        "true",
        "rising",
        "falling",
    ] {
        assert!(labels.contains(&label.to_owned()), "no {label}");
    }
    let svg = overview_svg(&run(), &Options::default()).expect("SVG");
    let titles = texts(&parsed(&svg), "text");
    for title in ["Error against load: Joint 1", "Joint 1", "Distribution of the error: Tip"] {
        assert!(titles.contains(&title.to_owned()), "figures alone say what they are: no {title}");
    }
    assert!(html.contains("sensor"), "a channel without a role is drawn under its own name");
    let wide = document.descendants().filter(|node| node.attribute("class") == Some("wide")).count();
    let narrow = document.descendants().filter(|node| node.attribute("class") == Some("narrow")).count();
    assert_eq!((wide, narrow), (1, 1), "the error over time comes in two widths");
}

#[test]
fn what_is_missing_is_said_and_nothing_is_made_up() {
    let mut run = run();
    run.columns.retain(|column| !column.name.starts_with("truth"));
    let html = page_of(&run);
    assert!(html.contains("No true position in this recording."), "{html}");
    assert!(html.contains("Error over time: commanded \u{2212} reported"));
    let drawn = [texts(&parsed(&html), "text"), texts(&parsed(&html), "td"), texts(&parsed(&html), "figcaption")].concat().concat();
    assert!(!drawn.to_lowercase().contains("true \u{2212} reported"), "without a truth there is no such difference");
    run.columns.retain(|column| column.name == "t_s" || column.name.starts_with('m'));
    let html = page_of(&run);
    assert!(html.contains("no error can be shown"));
    let document = parsed(&html);
    assert_eq!(texts(&document, "h2"), ["Load against velocity", "Motors", "How to read this"][1..]);
    // Truth columns without a single value are no truth.
    let t: Vec<f64> = (0..100).map(f64::from).collect();
    let nothing = vec![f64::NAN; 100];
    let lost =
        recording("lost", vec![("t_s", t.clone()), ("jpos_1_rad", t.clone()), ("jpos_d_1_rad", t), ("truth_jpos_1_rad", nothing)]);
    assert!(page_of(&lost).contains("commanded \u{2212} reported"));
}

#[test]
fn strange_columns_break_nothing() {
    let rows = 50;
    let t: Vec<f64> = (0..rows).map(|i| f64::from(i) * 1e-3).collect();
    let of = |value: f64| vec![value; rows as usize];
    let some = |value: f64| (0..rows).map(|i| if i % 7 == 3 { value } else { f64::from(i) }).collect::<Vec<f64>>();
    let columns = [
        "jpos_1_rad",
        "jpos_d_1_rad",
        "truth_jpos_1_rad",
        "jvel_1_rad_s",
        "tau_1_nm",
        "x_m",
        "y_m",
        "z_m",
        "truth_x_m",
        "truth_y_m",
        "truth_z_m",
        "other",
    ];
    let kinds: [Vec<f64>; 9] = [
        of(0.0),
        of(-3.5),
        of(f64::NAN),
        of(f64::INFINITY),
        some(f64::NAN),
        some(f64::INFINITY),
        some(1e300),
        some(-1e-300),
        of(f64::MAX),
    ];
    for kind in &kinds {
        for other in &kinds {
            let values = |i: usize| if i.is_multiple_of(2) { kind.clone() } else { other.clone() };
            let columns = columns.iter().enumerate().map(|(i, name)| (*name, values(i)));
            page_of(&recording("strange", [("t_s", t.clone())].into_iter().chain(columns).collect()));
        }
    }
    for rows in 1..4 {
        let t: Vec<f64> = (0..rows).map(f64::from).collect();
        page_of(&recording(
            "short",
            vec![("t_s", t.clone()), ("x_m", t.clone()), ("y_m", t.clone()), ("z_m", t.clone()), ("truth_x_m", t)],
        ));
    }
    page_of(&recording("odd times", vec![("t_s", vec![f64::NAN, 1.0, 1.0, -1.0]), ("jpos_1_rad", vec![1.0, 2.0, 3.0, 4.0])]));
    page_of(&recording(
        "a table",
        vec![("i", vec![1.0, 2.0, 3.0]), ("q_des_1_rad", vec![1.0, 2.0, 1.0]), ("q_act_1_rad", vec![1.1, 2.1, 1.2])],
    ));
}

#[test]
fn unusable_recordings_and_ranges_are_refused_in_one_line() {
    let empty = overview(&recording("empty.csv", vec![]), &Options::default()).expect_err("empty");
    assert_eq!(empty.to_string(), "empty.csv: has no rows with numbers; record at least one sample");
    let ragged = recording("ragged", vec![("t_s", vec![0.0, 1.0]), ("x_m", vec![0.0])]);
    assert!(matches!(overview(&ragged, &Options::default()), Err(PlotError::Unequal { found: 1, expected: 2, .. })));
    let options = Options { from_s: Some(30.0), ..Options::default() };
    let late = overview(&run(), &options).expect_err("late").to_string();
    assert!(late.ends_with("no row lies in the chosen range; the recording runs from 0 to 19.995"), "{late}");
    let options = Options { from_s: Some(5.0), to_s: Some(10.0), title: Some("Part".to_owned()) };
    let html = overview(&run(), &options).expect("part");
    assert!(html.contains("<dd>5.00 s</dd>") && html.contains("<h1>Part</h1>"));
}

#[test]
fn foreign_text_is_escaped() {
    let mut run = run();
    run.metadata.insert("note".to_owned(), "</p><script>alert(1)</script>\u{0}&'\"".to_owned());
    run.columns.push(Column::new("<b>&\"evil\u{7}_3_mm", vec![0.5; ROWS]));
    let html = page_of(&run);
    let document = parsed(&html);
    assert_eq!(texts(&document, "h1"), ["run <1> & \"two\".csv"]);
    assert!(texts(&document, "p")[0].contains("</p><script>alert(1)</script>"), "as text");
    assert!(texts(&document, "h3").is_empty() && texts(&document, "title").iter().any(|title| title.starts_with("<b>&\"evil")));
}

#[test]
fn a_million_rows_stay_under_two_megabytes() {
    let rows = 1_000_000;
    let t: Vec<f64> = (0..rows).map(|i| i as f64 * 1e-3).collect();
    // The worst case for a compact drawing: every column of pixels spans the whole panel.
    let mut random = 1_u64;
    let mut noise = || {
        let mut next = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (random >> 40) as f64 / f64::from(1 << 24) - 0.5
        };
        (0..rows).map(|_| next()).collect::<Vec<f64>>()
    };
    let mut columns = vec![("t_s".to_owned(), t)];
    for joint in 1..=7 {
        let unit = if joint == 3 { "m" } else { "rad" };
        for name in ["jpos_d", "jpos", "truth_jpos", "jvel"] {
            columns.push((format!("{name}_{joint}_{unit}{}", if name == "jvel" { "_s" } else { "" }), noise()));
        }
        columns.push((format!("tau_{joint}_nm"), noise()));
        columns.push((format!("mpos_{joint}_rad"), noise()));
        columns.push((format!("mvel_{joint}_rad_s"), noise()));
    }
    for name in ["x", "y", "z", "truth_x", "truth_y", "truth_z"] {
        columns.push((format!("{name}_m"), noise()));
    }
    let run = recording("million", columns.iter().map(|(name, values)| (name.as_str(), values.clone())).collect());
    let html = overview(&run, &Options::default()).expect("page");
    println!("a million rows of {} columns: {} bytes", run.columns.len(), html.len());
    assert!(html.len() < 2_000_000, "{} bytes", html.len());
    assert!(overview_svg(&run, &Options::default()).expect("SVG").len() < 2_000_000);
    check_page(&html);
}

#[test]
fn the_same_recording_gives_the_same_bytes() {
    assert_eq!(overview(&run(), &Options::default()), overview(&run(), &Options::default()));
}

#[test]
fn figures_stand_alone_and_say_when_there_is_nothing() {
    let empty = Figure::new("Nothing", Axis::new("Time, s")).panel(Panel::new(Axis::new("Position, mm")).mark(Mark::line(
        "a",
        Colour::BLUE,
        vec![],
    )));
    let text = svg_document(&[empty.clone(), Figure::new("No panel", Axis::new(""))]);
    let document = parsed(&text);
    assert!(texts(&document, "text").contains(&"no data".to_owned()));
    assert_eq!(document.root_element().tag_name().namespace(), Some("http://www.w3.org/2000/svg"));
    assert!(parsed(&svg(&empty)).root_element().attribute("aria-label") == Some("Nothing"));
    let points = vec![(0.0, 0.0), (1.0, 10.0)];
    let line = Figure::new("Line", Axis::new("x"))
        .panel(Panel::new(Axis::new("y").range(0.0, 10.0)).height(100.0).mark(Mark::line("up", Colour::GREEN, points)));
    let text = svg(&line);
    let document = parsed(&text);
    let path =
        document.descendants().find(|node| node.attribute("class") == Some("line s3")).expect("line").attribute("d").expect("path");
    assert!(path.starts_with("M0 100l") && path.ends_with("-100"), "from the lower left to the top: {path}");
    let page = Page { title: "T".to_owned(), subtitle: String::new(), blocks: vec![Block::Figures(vec![line])] };
    check_page(&page.html());
    let statistics = Statistics::of([3.0, -4.0, f64::NAN]);
    assert_eq!((statistics.count, statistics.mean, statistics.max), (2, -0.5, 4.0));
    assert!((statistics.rms - 12.5_f64.sqrt()).abs() < 1e-12 && Statistics::of([]).rms.is_nan());
}

#[test]
fn the_recordings_at_hand_are_drawn() {
    let data = std::env::var_os("RAVENPOSE_DATA")
        .map_or_else(|| std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), std::path::PathBuf::from);
    for (file, parts) in [
        ("raven2-uiuc/real_first_two_thirds.csv", ["3 motors", "no error can be shown", "Amplifier command, counts"]),
        ("raven2-circle/circle_first_two_thirds.csv.gz", ["tip and 7 joints", "No true position", "commanded \u{2212} reported"]),
        ("gap-examples/a/real_1.csv.gz", ["tip and 3 joints", "600 at 50.0 Hz", "true \u{2212} reported"]),
        ("gap-examples/c/sim_1.csv.gz", ["tip and 3 joints", "true \u{2212} reported", "Error by posture"]),
        ("dvrk-payload/psm_traj1_noweight_a.csv", ["7 joints", "Joint load, N", "no error can be shown"]),
        ("dvrk-payload/mtm_joint_cable_test.csv", ["1 joint", "The rows are numbered", "Joint load"]),
        ("dvrk-friction/fourier_psm1_1.csv", ["3 joints", "Load against velocity", "200 Hz"]),
        ("dvrk-optical/traj3_first_two_thirds.csv", ["Other channels", "measured_q", "marker"]),
        ("dvrk-rgbd/train_pick_place.csv", ["6 joints", "true \u{2212} commanded", "Error by posture"]),
        ("tendon-catheter/catheter_a2_0.2Hz.csv", ["Other channels", "motor_current_raw", "tip_angle"]),
        ("vision-rendered/easy/truth.csv", ["Tip", "green", "True positions only"]),
    ] {
        let path = data.join(file);
        if !path.exists() {
            println!("skipped: {} is absent", path.display());
            continue;
        }
        let mut source = recordings::open::open_table(&path).unwrap_or_else(|error| panic!("{error}"));
        let recording = recordings::table::collect(file, source.as_mut()).unwrap_or_else(|error| panic!("{error}"));
        let html = page_of(&recording);
        println!("{file}: {} bytes", html.len());
        for part in parts {
            assert!(html.to_lowercase().contains(&part.to_lowercase()), "{file}: no {part}");
        }
    }
}

#[test]
fn names_stand_at_their_places_and_do_not_touch() {
    let names = (0..40).map(|i| (f64::from(i), format!("run-{i:02}")));
    let cells =
        plot::figure::Cells { x: (0.0, 39.0), y: (0.0, 2.0), columns: 3, values: vec![0.2, 1.0, 4.0, f64::NAN, 2.0, 400.0] };
    let mark = Mark::Cells { cells, ramp: plot::figure::Ramp::Ratio { most: 4.0 }, title: String::new() };
    let rows =
        Axis::new("Joint").names([(0.5, "insertion".to_owned()), (1.5, "a name that is too long".to_owned())]).range(0.0, 2.0);
    let figure = Figure::new("Heat", Axis::new("Runs").names(names).range(0.0, 39.0)).panel(Panel::new(rows).mark(mark));
    let drawn = svg(&figure);
    let document = parsed(&drawn);
    let found = texts(&document, "text");
    assert!(found.contains(&"insertion".to_owned()) && found.contains(&"a name that i…".to_owned()), "{found:?}");
    let runs = found.iter().filter(|text| text.starts_with("run-")).count();
    assert!((3..10).contains(&runs), "{found:?}");
    // Noise and less in the first colour, the end of the scale and more in the last, what is missing in none.
    let class = |name: &str| document.descendants().filter(|node| node.attribute("class") == Some(name)).count();
    assert_eq!((class("h0"), class("h15"), class("h8")), (1, 1, 1));
    assert!(!found.iter().any(|text| text == "400"), "no bar");
    let legend = plot::figure::ratio_legend(12.0);
    assert_eq!(texts(&parsed(&legend), "text"), ["noise", "1", "2", "5", "10", "× noise"]);
    assert!(!plot::figure::ratio_legend(0.5).contains("NaN"));
}
