//! Reports are read and written without loss.

use crate::common;

use gap_report::{Pictures, Report, json, write};
use serde_json::Value;

/// Numbers as numbers: 6 and 6.0 are the same in JSON.
fn plain(value: Value) -> Value {
    match value {
        Value::Number(number) => number.as_f64().map_or(Value::Null, Value::from),
        Value::Array(items) => items.into_iter().map(plain).collect(),
        Value::Object(object) => object.into_iter().map(|(key, value)| (key, plain(value))).collect(),
        other => other,
    }
}

#[test]
fn the_examples_of_the_specification_come_back() {
    for text in [common::EXPLAINED, common::NONE] {
        let report: Report = serde_json::from_str(text).expect("a report");
        let written: Value = serde_json::from_str(&json(&report).expect("JSON")).expect("JSON");
        assert_eq!(plain(written), plain(serde_json::from_str(text).expect("JSON")));
    }
}

#[test]
fn made_up_reports_come_back() {
    for (name, report) in common::all() {
        let again: Report = serde_json::from_str(&json(&report).expect("JSON")).expect("a report");
        assert_eq!(again, report, "{name}");
    }
}

#[test]
fn further_keys_are_kept_and_unknown_ones_refused() {
    let with = |key: &str| {
        let mut value: Value = serde_json::from_str(common::EXPLAINED).expect("JSON");
        value["verdicts"][0]["location"][key] = "kept".into();
        serde_json::from_value::<Report>(value)
    };
    let report = with("x_note").expect("a further key");
    assert_eq!(report.verdicts[0].location.extra.get("x_note"), Some(&Value::from("kept")));
    assert!(json(&report).expect("JSON").contains("\"x_note\": \"kept\""));
    let error = with("note").expect_err("an unknown key");
    assert!(error.to_string().contains("unknown key `note`"), "{error}");
    let mut report = common::none();
    report.extra.set("plain", 1);
    assert_eq!(report.extra.get("x_plain"), Some(&Value::from(1)));
}

#[test]
fn both_files_appear_whole_and_nothing_else() {
    let folder = std::env::temp_dir().join(format!("gap-report-{}", std::process::id()));
    let report = common::explained();
    for _ in 0..2 {
        write(&report, &Pictures::default(), &folder.join("deeper")).expect("written");
    }
    let mut names: Vec<_> =
        std::fs::read_dir(folder.join("deeper")).expect("folder").map(|file| file.expect("file").file_name()).collect();
    names.sort();
    assert_eq!(names, ["report.html", "report.json"]);
    let text = std::fs::read_to_string(folder.join("deeper/report.json")).expect("read");
    assert_eq!(serde_json::from_str::<Report>(&text).expect("a report"), report);
    // A number that JSON has no word for: nothing is written, the old report stays.
    let mut broken = report.clone();
    broken.verdicts[0].parameters[0].value = f64::NAN;
    broken.verdicts[0].fit[0].noise_floor = Some(f64::INFINITY);
    let error = write(&broken, &Pictures::default(), &folder.join("deeper")).expect_err("NaN").to_string();
    assert!(error.contains("report.verdicts[0].parameters[0].value") && error.contains("noise_floor"), "{error}");
    assert_eq!(std::fs::read_to_string(folder.join("deeper/report.json")).expect("read"), text);
    // A file where the folder should be.
    let error = write(&report, &Pictures::default(), &folder.join("deeper/report.json")).expect_err("a file").to_string();
    assert!(error.contains("cannot make the folder"), "{error}");
    std::fs::remove_dir_all(&folder).expect("removed");
}
