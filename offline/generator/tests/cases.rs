//! Cases as a whole: sizes reached, seeds, envelopes, and that nothing leaks.

use generator::batch;
use generator::case::Case;
use generator::effect::{ALWAYS, NEVER};
use generator::logger::Logging;
use generator::order::{Kind, Order, Wanted};
use generator::{matrix, seal};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn order(label: &str, effects: &[(&str, f64)]) -> Order {
    let effects = effects.iter().map(|(physics, severity)| Wanted {
        physics: (*physics).into(),
        severity: Some(*severity),
        ..Wanted::default()
    });
    Order { seed: 5, label: label.into(), effects: effects.collect(), seconds: 4.0, runs: 2, ..Order::default() }
}

fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("generator-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&path);
    path
}

/// Every file under a folder with its bytes.
fn tree(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                files.insert(path.strip_prefix(root).unwrap().to_owned(), std::fs::read(&path).unwrap());
            }
        }
    }
    files
}

#[test]
fn severity_is_reached() {
    for physics in ["coulomb_friction", "cable_stretch", "payload", "joint_offset", "measurement_delay", "frame_misalignment"] {
        let case = order(physics, &[(physics, 3.0)]).make().unwrap();
        let reached = case.truth.effects[0].severity;
        assert!((reached / 3.0 - 1.0).abs() < 0.12, "{physics}: {reached}");
    }
}

#[test]
fn jobs_change_nothing_and_a_second_call_resumes() {
    let orders: Vec<Order> =
        (0..4).map(|k| order(&format!("jobs {k}"), if k % 2 == 0 { &[] } else { &[("payload", 3.0)] })).collect();
    let (a, b) = (folder("one"), folder("two"));
    batch::make(&orders, &a, 1).unwrap();
    batch::make(&orders, &b, 3).unwrap();
    let made = tree(&a);
    assert_eq!(made.len(), 4 * (5 + 1) + 1);
    assert!(made == tree(&b), "threads changed a file");

    // a case that was lost is made again, the same
    let lost = a.join("cases").join(orders[1].id());
    std::fs::remove_dir_all(&lost).unwrap();
    batch::make(&orders, &a, 2).unwrap();
    assert!(made == tree(&a), "resuming changed a file");

    // A truth that was changed after its hash was published is not published anew.
    let one = std::fs::read_dir(a.join("sealed")).unwrap().next().unwrap().unwrap().path();
    let text = std::fs::read_to_string(&one).unwrap().replacen('5', "6", 1);
    std::fs::write(&one, text).unwrap();
    let error = batch::make(&orders, &a, 1).err().unwrap();
    assert!(error.contains("changed after publication") && error.contains("sealed/"), "{error}");
    for path in [a, b] {
        std::fs::remove_dir_all(path).unwrap();
    }
}

#[test]
fn an_effect_by_run_is_in_the_runs_that_it_is_told_of() {
    let null = order("by run", &[]).make().unwrap();
    let made = |intervals: [[f64; 2]; 2]| {
        let mut order = order("by run", &[("coulomb_friction", 10.0)]);
        order.effects[0].joint = Some(1);
        order.effects[0].intervals = intervals.into();
        order.make().unwrap()
    };
    let differs = |case: &Case, run: usize| {
        let name = format!("real_{}.csv.gz", run + 1);
        case.files[&name] != null.files[&name]
    };
    for run in 0..2 {
        let case = made(std::array::from_fn(|of| if of == run { ALWAYS } else { NEVER }));
        assert!(differs(&case, run) && !differs(&case, 1 - run), "{run}");
        assert!((case.truth.effects[0].severity / 10.0 - 1.0).abs() < 0.12);
    }
    // Of one set the sizes are brought to: as it is in the first run that it is in.
    let [alone, later] = [[NEVER, ALWAYS], [NEVER, [1.0, 3.0]]].map(|intervals| made(intervals).truth.effects[0].clone());
    assert!(later.effect.parameters["f_c"] > 1.1 * alone.effect.parameters["f_c"], "{later:?} {alone:?}");

    let mut order = order("by run", &[("coulomb_friction", 10.0)]);
    order.effects[0].intervals = vec![ALWAYS];
    assert_eq!(order.make().err().as_deref(), Some("1 intervals for 2 runs"));
    (order.runs, order.effects[0].intervals, order.effects[0].by_run) = (1, Vec::new(), true);
    assert_eq!(order.make().err().as_deref(), Some("an effect by run asks for two runs at least"));
}

#[test]
fn drawn_times_by_run_differ_from_run_to_run() {
    let mut kinds = [0; 2];
    for index in 0..12 {
        let mut order = order(&format!("drawn {index}"), &[]);
        order.runs = 3;
        order.effects = vec![Wanted {
            physics: "joint_offset".into(),
            joint: Some(1),
            parameters: BTreeMap::from([("o".to_owned(), 0.01)]),
            by_run: true,
            ..Wanted::default()
        }];
        let effect = order.make().unwrap().truth.effects[0].effect.clone();
        assert!(effect.intervals.len() == 3 && effect.interval.is_none(), "{effect:?}");
        let [first, second, third] = [0, 1, 2].map(|run| effect.intervals[run]);
        assert!(first != second || second != third, "{effect:?}");
        assert!(effect.intervals.iter().any(|of| *of != NEVER), "{effect:?}");
        let whole = effect.intervals.iter().all(|of| [NEVER, ALWAYS].contains(of));
        kinds[usize::from(whole)] += 1;
    }
    assert!(kinds[0] > kinds[1] && kinds[1] > 0, "{kinds:?}");
}

#[test]
fn envelopes_are_canonical_and_a_flipped_byte_shows() {
    let out = folder("seal");
    batch::make(&[order("seal", &[("backlash", 3.0)])], &out, 1).unwrap();
    let manifest: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("manifest.json")).unwrap()).unwrap();
    let (case, hash) = manifest["cases"].as_object().unwrap().iter().next().unwrap();
    let path = out.join("sealed").join(format!("{case}.json"));
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!(&seal::sha256(&bytes), hash.as_str().unwrap());
    let truth: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
    assert_eq!(seal::canonical(&truth).as_bytes(), bytes, "reading and writing again gives the same bytes");
    assert_eq!(truth["salt"].as_str().unwrap().len(), 32);
    for at in [1, bytes.len() / 2, bytes.len() - 2] {
        let mut flipped = bytes.clone();
        flipped[at] ^= 1;
        std::fs::write(&path, &flipped).unwrap();
        assert_ne!(seal::commitments(&out.join("sealed")).unwrap()[case], hash.as_str().unwrap());
    }
    std::fs::remove_dir_all(out).unwrap();
}

#[test]
fn nothing_of_the_truth_leaks() {
    let out = folder("leak");
    let orders = [order("a", &[]), order("b", &[("coulomb_friction", 3.0)]), order("c", &[("external_contact", 3.0)])];
    batch::make(&orders, &out, 1).unwrap();
    let mut shapes = Vec::new();
    for order in &orders {
        let id = order.id();
        assert!(id.len() == 12 && id.bytes().all(|b| b.is_ascii_hexdigit()));
        let mut shape = Vec::new();
        for (name, bytes) in tree(&out.join("cases").join(&id)) {
            let modified = std::fs::metadata(out.join("cases").join(&id).join(&name)).unwrap().modified().unwrap();
            let head = if bytes[..2] == [0x1f, 0x8b] { bytes[..10].to_vec() } else { bytes.clone() };
            let mut text = String::new();
            if bytes[..2] == [0x1f, 0x8b] {
                std::io::Read::read_to_string(&mut flate2::read::GzDecoder::new(&bytes[..]), &mut text).unwrap();
            }
            let lines: Vec<String> = text.lines().take(3).map(str::to_owned).collect();
            shape.push((name, modified, head, lines, text.lines().count()));
        }
        shapes.push(shape);
    }
    // same names, times, gzip heads, columns and lengths; the robot is described alike
    assert!(shapes[0] == shapes[1] && shapes[1] == shapes[2]);
    std::fs::remove_dir_all(out).unwrap();
}

#[test]
fn runs_are_apart_and_the_simulation_has_no_noise() {
    let case = order("apart", &[]).make().unwrap();
    assert_ne!(case.files["sim_1.csv.gz"], case.files["sim_2.csv.gz"]);
    let column = |table: &[Vec<String>], name: &str| -> Vec<f64> {
        let at = table[0].iter().position(|column| column == name).unwrap();
        table[1..].iter().filter_map(|row| row[at].parse().ok()).collect()
    };
    let rough = |values: &[f64]| {
        let second: Vec<f64> = values.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]).collect();
        (second.iter().map(|d| d * d).sum::<f64>() / second.len() as f64 / 6.0).sqrt()
    };
    let [real, sim] = ["real_1.csv.gz", "sim_1.csv.gz"].map(|name| cells(&case.files[name]));
    let noise = rough(&column(&real, "truth_jpos_1_rad"));
    assert!((noise / 0.3e-3 - 1.0).abs() < 0.05, "{noise}");
    assert!(rough(&column(&sim, "truth_jpos_1_rad")) < 2e-6);
    assert_eq!(column(&real, "truth_x_mm").len(), 200);
    assert_eq!(column(&sim, "truth_x_mm").len(), 4000);
    let count = std::f64::consts::TAU / 4000.0;
    for position in column(&real, "mpos_2_rad") {
        let counts = position / count;
        assert!((counts - counts.round()).abs() < 1e-3, "{position} is no whole count");
    }
}

#[test]
fn a_faulty_logger_changes_what_is_logged_and_nothing_else() {
    let faithful = order("logged", &[("backlash", 10.0)]);
    let faulty = Order { logging: Logging::Faulty, ..faithful.clone() };
    let [faithful, faulty] = [faithful, faulty].map(|order| order.make().unwrap());
    assert_eq!(faithful.files["sim_1.csv.gz"], faulty.files["sim_1.csv.gz"]);
    assert_eq!(faithful.files["robot.urdf"], faulty.files["robot.urdf"]);
    assert_eq!(seal::canonical(&faithful.truth.effects), seal::canonical(&faulty.truth.effects));
    let [clean, damaged] = [&faithful, &faulty].map(|case| cells(&case.files["real_1.csv.gz"]));
    let differ = |name: &str| {
        let at = clean[0].iter().position(|column| column == name).unwrap();
        clean.iter().zip(&damaged).filter(|(a, b)| a[at] != b[at]).count()
    };
    assert_eq!(["t_s", "jpos_d_1_rad", "x_mm"].map(differ), [0; 3]);
    for quantity in [["mpos_1_rad", "mpos_2_rad", "mpos_3_rad"], ["tau_1_nm", "tau_2_nm", "tau_3_nm"]] {
        assert!(quantity.map(differ).iter().sum::<usize>() > 0, "{quantity:?}");
    }
    assert!(differ("truth_jpos_3_m") > 0);
    // Where nothing is damaged nothing says so.
    assert!(
        !seal::canonical(&faithful.truth).contains("logging") && seal::canonical(&faulty.truth).contains(r#""logging":"faulty""#)
    );
}

/// A table's cells, its header first.
fn cells(gz: &[u8]) -> Vec<Vec<String>> {
    let mut text = String::new();
    std::io::Read::read_to_string(&mut flate2::read::GzDecoder::new(gz), &mut text).unwrap();
    text.lines().filter(|line| !line.starts_with('#')).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn other_arms_hold_their_course() {
    for k in 0..6 {
        let mut order = order(&format!("variant {k}"), &[]);
        order.robot = Kind::Variant;
        let case = order.make().unwrap();
        let mut text = String::new();
        std::io::Read::read_to_string(&mut flate2::read::GzDecoder::new(&case.files["sim_1.csv.gz"][..]), &mut text).unwrap();
        let head: Vec<&str> = text.lines().find(|line| !line.starts_with('#')).unwrap().split(',').collect();
        for (j, _) in case.truth.joints.iter().enumerate() {
            let at = |start: &str| head.iter().position(|name| name.starts_with(start)).unwrap();
            let (wanted, is) = (at(&format!("jpos_d_{}", j + 1)), at(&format!("truth_jpos_{}", j + 1)));
            for line in text.lines().skip(3) {
                let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap_or(0.0)).collect();
                assert!((cells[wanted] - cells[is]).abs() < 0.06, "case {k} joint {j}: {line}");
            }
        }
    }
}

#[test]
fn sets_have_the_cases_of_the_design() {
    let count = |orders: &[Order], block: &str| orders.iter().filter(|order| order.block == block).count();
    let full = matrix::named("full", 1).unwrap();
    assert_eq!(
        ["single", "null", "pairs", "outside", "poor", "by_run", "faulty"].map(|block| count(&full, block)),
        [990, 352, 240, 60, 154, 88, 88]
    );
    let small = matrix::named("small", 1).unwrap();
    assert_eq!(["single", "null"].map(|block| count(&small, block)), [66, 30]);
    let mut ids: Vec<String> = full.iter().chain(&small).chain(&matrix::named("dev", 1).unwrap()).map(Order::id).collect();
    ids.sort();
    ids.dedup();
    assert_eq!(ids.len(), full.len() + small.len() + matrix::named("dev", 1).unwrap().len(), "two cases of one name");
}
