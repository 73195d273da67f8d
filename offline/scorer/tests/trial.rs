//! Hand-made trials whose figures are known beforehand.

use scorer::score::Score;
use scorer::verify::sha256;
use scorer::{html, markdown, run, trial};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// A folder that goes away with the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("scorer-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        for part in ["sealed", "cases", "reports"] {
            std::fs::create_dir_all(path.join(part)).unwrap();
        }
        Self(path)
    }

    fn seal(&self, id: &str, truth: &Value) {
        std::fs::write(self.0.join("sealed").join(format!("{id}.json")), truth.to_string()).unwrap();
        let mut hashes = serde_json::Map::new();
        for entry in std::fs::read_dir(self.0.join("sealed")).unwrap() {
            let path = entry.unwrap().path();
            let id = path.file_stem().unwrap().to_str().unwrap().to_owned();
            hashes.insert(id, sha256(&std::fs::read(&path).unwrap()).into());
        }
        std::fs::write(self.0.join("manifest.json"), json!({ "cases": hashes }).to_string()).unwrap();
    }

    fn answer(&self, id: &str, report: &Value) {
        std::fs::create_dir_all(self.0.join("reports").join(id)).unwrap();
        std::fs::write(run::report(&self.0, id), report.to_string()).unwrap();
    }

    fn score(&self) -> Score {
        let _ = run::publish(&self.0).unwrap();
        trial::trial(&self.0, false).unwrap()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn truth(id: &str, block: &str, effects: &Value) -> Value {
    json!({"case": id, "block": block, "effects": effects, "noise": 1.0, "robot": "raven", "dry_law": "smooth",
           "joints": ["shoulder", "elbow", "insertion"]})
}

fn coulomb(f_c: f64, severity: f64) -> Value {
    json!({"physics": "coulomb_friction", "joint": 1, "joint_name": "shoulder", "parameters": {"f_c": f_c},
           "severity_wanted": severity, "severity": severity})
}

fn verdict(rank: usize, physics: &str, joint: &[&str], probability: f64, parameters: &Value, others: &[&str]) -> Value {
    let others: Vec<Value> = others.iter().map(|name| json!({"physics": name, "reason": "alike"})).collect();
    json!({"rank": rank, "effect": rank, "role": "primary", "physics": physics, "probability": probability,
           "location": {"joint": joint, "time_intervals": []}, "parameters": parameters,
           "fit": [{"before": 2.0, "noise_floor": 1.0, "removed_fraction": 0.5}, {"before": 9.0, "noise_floor": 1.0, "removed_fraction": 0.95},
                   {"before": 99.0, "noise_floor": null}],
           "confusable_with": others})
}

fn report(status: &str, verdicts: &[Value]) -> Value {
    json!({"status": status, "mismatch": {"detected": !["no_mismatch", "insufficient_data"].contains(&status)}, "verdicts": verdicts,
           "timing": {"total_s": 4.0}, "inputs": {"runs": [{"id": "1", "duration_s": 12.0}]}})
}

fn none() -> Value {
    report("no_mismatch", &[verdict(1, "none", &[], 0.97, &json!([]), &[])])
}

fn f_c(value: f64, low: f64, high: f64) -> Value {
    json!([{"name": "f_c", "value": value, "unit": "N.m", "ci95": [low, high], "identifiable": "yes"}])
}

#[test]
fn single_effects() {
    let folder = Folder::new("single");
    for id in ["right", "set", "wrong", "silent", "missing"] {
        folder.seal(id, &truth(id, "single", &json!([coulomb(2.0, 3.0)])));
    }
    folder.answer("right", &report("explained", &[verdict(1, "coulomb_friction", &["shoulder"], 0.9, &f_c(2.2, 1.9, 2.5), &[])]));
    let other = verdict(1, "viscous_friction", &["shoulder"], 0.6, &json!([]), &["coulomb_friction"]);
    folder.answer("set", &report("explained", &[other]));
    folder.answer("wrong", &report("explained", &[verdict(1, "payload", &[], 0.8, &json!([]), &[])]));
    folder.answer("silent", &none());
    let score = folder.score();

    assert_eq!((score.cases, score.without_report), (5, 1));
    let figures = &score.blocks[0].figures;
    assert_eq!((score.blocks[0].level, figures.cases), (3.0, 5));
    assert_eq!(figures.detected.hits, 3);
    assert_eq!(figures.top.hits, 1);
    assert_eq!(figures.in_set.hits, 2);
    assert_eq!((figures.joint.hits, figures.joint.of), (2, 5));
    assert!((figures.set_size - 5.0 / 4.0).abs() < 1e-12);
    assert!((figures.error_median.value - 0.1).abs() < 1e-12);
    assert_eq!((figures.covered.hits, figures.covered.of), (1, 1));
    // the fit that stands highest above its floor counts
    assert!((figures.removed.value - 0.95).abs() < 1e-12);
    assert_eq!(score.confusion.counts[0][0], 1);
    assert_eq!(score.confusion.counts[0][1], 1);
    assert_eq!(score.confusion.counts[0][9], 1);
    assert_eq!(score.confusion.counts[0][22], 1);
    assert_eq!(score.confusion.elsewhere, 1);
    // calibration: 0.9 right, 0.6 wrong, 0.8 wrong, `none` 0.97 wrong
    assert_eq!(score.calibration.iter().map(|bin| (bin.right.hits, bin.right.of)).collect::<Vec<_>>(), [(0, 1), (0, 1), (1, 2)]);
    let seen = score.targets.iter().find(|target| target.name == "mismatch seen").unwrap();
    assert!(!seen.met && (seen.reached - 0.6).abs() < 1e-12);
}

#[test]
fn nulls_pairs_and_outside() {
    let folder = Folder::new("others");
    for k in 0..4 {
        let id = format!("null{k}");
        folder.seal(&id, &truth(&id, "null", &json!([])));
        folder.answer(
            &id,
            &if k == 0 { report("unmodelled", &[verdict(1, "unmodelled", &[], 0.5, &json!([]), &[])]) } else { none() },
        );
    }
    let payload = json!({"physics": "payload", "parameters": {"m_p": 0.1}, "severity_wanted": 1.0, "severity": 1.1});
    for id in ["both", "more", "same", "second"] {
        folder.seal(id, &truth(id, "pairs", &json!([coulomb(2.0, 1.0), payload])));
    }
    let named = |rank, physics| verdict(rank, physics, &["shoulder"], 0.5, &json!([]), &["payload"]);
    folder.answer("both", &report("explained", &[named(1, "payload"), named(2, "coulomb_friction")]));
    let three = ["payload", "coulomb_friction", "backlash"];
    folder.answer("more", &report("explained", &[1, 2, 3].map(|rank| named(rank, three[rank - 1]))));
    // two sets that hold one effect only: not both
    folder.answer("same", &report("explained", &[named(1, "payload"), named(2, "payload")]));
    folder.answer(
        "second",
        &report("explained", &[verdict(1, "viscous_friction", &[], 0.4, &json!([]), &[]), named(2, "coulomb_friction")]),
    );
    for (id, status, physics) in
        [("o1", "unmodelled", "unmodelled"), ("o2", "explained", "coulomb_friction"), ("o3", "no_mismatch", "none")]
    {
        folder.seal(
            id,
            &truth(
                id,
                "outside",
                &json!([{"physics": "outside:drag", "joint": 2, "joint_name": "elbow", "severity_wanted": 3.0, "severity": 3.0}]),
            ),
        );
        folder.answer(id, &report(status, &[verdict(1, physics, &["elbow"], 0.8, &json!([]), &[])]));
    }
    let score = folder.score();

    assert_eq!((score.nulls[0].alarms.hits, score.nulls[0].alarms.of), (1, 4));
    // 1 of 4, one-sided: p with 4 p^... solved by hand: (1-p)^4 + 4 p (1-p)^3 = 0.05 at 0.7514
    assert!((score.nulls[0].upper95 - 0.7514).abs() < 1e-4, "{}", score.nulls[0].upper95);
    let pairs = &score.pairs[0];
    assert_eq!((pairs.level, pairs.cases, pairs.both.hits, pairs.one.hits), (1.0, 4, 2, 4));
    assert_eq!(pairs.both_in_set.hits, 2);
    // One of the two that have both names has another beside them.
    assert_eq!(pairs.alone.hits, 1);
    let outside = &score.outside[0];
    assert_eq!([outside.refused.hits, outside.wrong_name.hits, outside.missed.hits, outside.wrong_set.hits], [1, 1, 1, 0]);
    assert_eq!(score.confusion.counts[23][23], 1);
}

#[test]
fn a_tool_that_gives_no_report_has_not_said_that_there_is_nothing() {
    let folder = Folder::new("silent");
    for id in ["silent", "answered"] {
        folder.seal(id, &truth(id, "null", &json!([])));
    }
    folder.answer("answered", &none());
    let drag = json!([{"physics": "outside:drag", "joint": 2, "joint_name": "elbow", "severity_wanted": 3.0, "severity": 3.0}]);
    folder.seal("mute", &truth("mute", "outside", &drag));
    folder.seal("few", &truth("few", "null", &json!([])));
    folder.answer("few", &report("insufficient_data", &[]));
    let score = folder.score();
    assert_eq!((score.nulls[0].alarms.hits, score.nulls[0].alarms.of), (1, 3));
    assert_eq!([score.outside[0].wrong_name.hits, score.outside[0].refused.hits, score.outside[0].missed.hits], [1, 0, 1]);
    assert_eq!(score.confusion.counts[22][22], 1, "one said that there is nothing");
}

#[test]
fn coupling_names_two_joints_and_geometry_either_side() {
    let folder = Folder::new("joints");
    let coupling = json!({"physics": "joint_coupling", "joint": 2, "joint_name": "elbow", "parameters": {"c_ij": -0.01}, "severity_wanted": 1.0, "severity": 1.0});
    let geometry = json!({"physics": "link_geometry", "joint": 1, "joint_name": "shoulder", "parameters": {"d_alpha": 0.01}, "severity_wanted": 1.0, "severity": 1.0});
    folder.seal("a", &truth("a", "single", &json!([coupling.clone()])));
    folder.seal("b", &truth("b", "single", &json!([geometry])));
    folder.seal("c", &truth("c", "single", &json!([coulomb(1.0, 1.0)])));
    folder.answer("a", &report("explained", &[verdict(1, "joint_coupling", &["shoulder", "elbow"], 0.9, &json!([]), &[])]));
    folder.answer("b", &report("explained", &[verdict(1, "link_geometry", &["elbow"], 0.9, &json!([]), &[])]));
    // naming every joint is naming none
    folder.answer("c", &report("explained", &[verdict(1, "coulomb_friction", &["shoulder", "elbow"], 0.9, &json!([]), &[])]));
    // The elbow is dragged along by the shoulder, not the reverse.
    let mut dragged = coupling.clone();
    dragged["details"] = json!({"from": 1});
    for (id, said) in [("d", ["elbow", "shoulder"]), ("e", ["shoulder", "elbow"]), ("f", ["elbow", "insertion"])] {
        folder.seal(id, &truth(id, "single", &json!([dragged])));
        folder.answer(id, &report("explained", &[verdict(1, "joint_coupling", &said, 0.9, &json!([]), &[])]));
    }
    let judged = folder.score().judged;
    let found: Vec<_> = judged.iter().map(|case| case.joint).collect();
    assert_eq!(found, [true, true, false, true, false, false].map(Some));
}

#[test]
fn vectors_and_what_is_left_out() {
    let folder = Folder::new("vectors");
    let turned = json!({"w_x": 0.003, "w_y": 0.0, "w_z": 0.004, "t_x": 0.001, "t_y": 0.0, "t_z": 0.0});
    let effect = json!({"physics": "frame_misalignment", "parameters": turned, "severity_wanted": 1.0, "severity": 1.0});
    let scale = json!({"physics": "motor_torque_scale", "joint": 1, "joint_name": "shoulder", "parameters": {"kappa": 0.8}, "severity_wanted": 1.0, "severity": 1.0});
    folder.seal("a", &truth("a", "single", &json!([effect])));
    folder.seal("b", &truth("b", "single", &json!([scale])));
    let say = |name: &str, value: f64| json!({"name": name, "value": value, "ci95": [value - 0.002, value + 0.002], "identifiable": "yes"});
    // off by 0.001 in a turn of 0.005; the shift is not stated, so it is said to be none
    let said = json!([say("w_x", 0.003), say("w_y", 0.001), say("w_z", 0.004)]);
    folder.answer("a", &report("explained", &[verdict(1, "frame_misalignment", &[], 0.9, &said, &[])]));
    folder.answer(
        "b",
        &report("explained", &[verdict(1, "motor_torque_scale", &["shoulder"], 0.9, &json!([say("kappa", 0.82)]), &[])]),
    );
    let judged = folder.score().judged;
    let errors: Vec<(f64, bool)> = judged.iter().flat_map(|case| &case.parameters).map(|p| (p.error, p.covered)).collect();
    let wanted = [(0.2, true), (1.0, false), (0.1, false)];
    assert!(errors.len() == 3 && errors.iter().zip(wanted).all(|(a, b)| (a.0 - b.0).abs() < 1e-9 && a.1 == b.1), "{errors:?}");
}

#[test]
fn stretch_of_time() {
    let folder = Folder::new("time");
    let mut effect = coulomb(2.0, 3.0);
    effect["interval"] = json!([6.0, 120.0]);
    folder.seal("a", &truth("a", "onset", &json!([effect])));
    let mut said = verdict(1, "coulomb_friction", &["shoulder"], 0.9, &f_c(2.0, 1.0, 3.0), &[]);
    said["location"]["time_intervals"] = json!([{"run": "1", "start_s": 7.0, "end_s": 12.0}]);
    folder.answer("a", &report("explained", &[said]));
    // 5 s of 6 s
    let overlap = folder.score().judged[0].overlap.unwrap();
    assert!((overlap - 5.0 / 6.0).abs() < 1e-12, "{overlap}");
}

#[test]
fn stretches_of_time_by_run() {
    let folder = Folder::new("times");
    let mut effect = coulomb(2.0, 3.0);
    effect["intervals"] = json!([[1e6, 1e6], [-1e6, 1e6], [4.0, 1e6]]);
    folder.seal("a", &truth("a", "by_run", &json!([effect])));
    let mut said = verdict(1, "coulomb_friction", &["shoulder"], 0.9, &f_c(2.0, 1.0, 3.0), &[]);
    said["location"]["time_intervals"] =
        json!([{"run": "2", "start_s": 0.0, "end_s": 12.0}, {"run": "3", "start_s": 6.0, "end_s": 12.0}]);
    let mut answer = report("explained", &[said]);
    let run = |id: &str| json!({"id": id, "duration_s": 12.0});
    answer["inputs"]["runs"] = json!([run("1"), run("2"), run("3")]);
    folder.answer("a", &answer);
    // nothing of nothing, all of all, 6 s of 8 s
    let overlap = folder.score().judged[0].overlap.unwrap();
    assert!((overlap - (1.0 + 1.0 + 0.75) / 3.0).abs() < 1e-12, "{overlap}");
}

#[test]
fn severity_out_of_reach_counts_where_it_stands() {
    let folder = Folder::new("reach");
    let mut effect = coulomb(2.0, 30.0);
    effect["severity"] = json!(3.3);
    folder.seal("a", &truth("a", "strong", &json!([effect])));
    assert_eq!(folder.score().judged[0].level, 3.0);
}

fn flip(path: &Path) {
    let mut bytes = std::fs::read(path).unwrap();
    let at = bytes.len() / 2;
    bytes[at] ^= 1;
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn a_flipped_byte_is_seen() {
    let make = |name: &str| {
        let folder = Folder::new(name);
        std::fs::create_dir_all(folder.0.join("cases/a")).unwrap();
        std::fs::write(folder.0.join("cases/a/real_1.csv.gz"), b"recording").unwrap();
        let mut sealed = truth("a", "single", &json!([coulomb(2.0, 3.0)]));
        sealed["files"] = json!({"real_1.csv.gz": sha256(b"recording")});
        folder.seal("a", &sealed);
        folder.answer("a", &none());
        let _ = run::publish(&folder.0).unwrap();
        assert!(trial::trial(&folder.0, false).is_ok());
        folder
    };
    for (name, file, trouble) in [
        ("flip-truth", "sealed/a.json", "changed after publication"),
        ("flip-report", "reports/a/report.json", "changed after publication"),
        ("flip-data", "cases/a/real_1.csv.gz", "not the file that was sealed"),
    ] {
        let folder = make(name);
        flip(&folder.0.join(file));
        let error = trial::trial(&folder.0, false).err().unwrap();
        assert!(error.contains(trouble) && error.contains(file), "{error}");
    }
    // Who lets the tool go on does not publish what was changed.
    let folder = make("flip-and-go-on");
    assert_eq!(run::run(&folder.0, Path::new("/bin/true"), 1), Ok(1));
    flip(&folder.0.join("reports/a/report.json"));
    let error = run::run(&folder.0, Path::new("/bin/true"), 1).err().unwrap();
    assert!(error.contains("changed after publication"), "{error}");
}

#[test]
fn pages_hold_together() {
    let folder = Folder::new("pages");
    folder.seal("a", &truth("a", "single", &json!([coulomb(2.0, 3.0)])));
    folder.answer("a", &report("explained", &[verdict(1, "coulomb_friction", &["shoulder"], 0.9, &f_c(2.2, 1.9, 2.5), &[])]));
    let score = folder.score();
    let page = html::page(&score);
    assert!(page.contains("<svg") && page.contains("coulomb friction") && !page.contains("http") && !page.contains("<script"));
    let text = markdown::markdown(&score);
    for line in text.lines().filter(|line| line.starts_with('|')) {
        assert!(line.ends_with('|'), "{line}");
    }
    assert!(markdown::text(&score).contains("first name right 100 %"));
}
