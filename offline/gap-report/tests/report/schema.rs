//! Every report, read and made up, is valid under the schema; the schema refuses what it should (so that it is known to run).

use crate::common;

use gap_report::{Physics, Report, check, json};
use jsonschema::Validator;
use serde_json::Value;

/// No finding.
const NOTHING: [String; 0] = [];

const SCHEMA: &str = include_str!("../../../../models/gap-report.schema.json");

fn validator() -> Validator {
    let schema: Value = serde_json::from_str(SCHEMA).expect("the schema is JSON");
    jsonschema::options().should_validate_formats(true).build(&schema).expect("the schema is a schema")
}

fn violations(validator: &Validator, report: &Value) -> Vec<String> {
    validator.iter_errors(report).map(|error| format!("{}: {error}", error.instance_path)).collect()
}

fn value(report: &Report) -> Value {
    serde_json::from_str(&json(report).expect("JSON")).expect("JSON")
}

#[test]
fn reports_of_every_status_are_valid() {
    let validator = validator();
    let mut statuses = std::collections::BTreeSet::new();
    for (name, report) in common::all() {
        statuses.insert(report.status);
        assert_eq!(violations(&validator, &value(&report)), NOTHING, "{name}");
        assert_eq!(check(&report), NOTHING, "{name}");
    }
    assert_eq!(statuses.len(), 5);
}

#[test]
fn the_schema_refuses_what_it_should() {
    let validator = validator();
    let refused = |name: &str, change: &dyn Fn(&mut Value)| {
        let mut report = value(&common::explained());
        change(&mut report);
        assert!(!violations(&validator, &report).is_empty(), "{name}");
    };
    refused("unknown key", &|report| report["surprise"] = 1.into());
    refused("unknown physics", &|report| report["verdicts"][0]["physics"] = "glue".into());
    refused("null for a number", &|report| report["verdicts"][0]["probability"] = Value::Null);
    refused("no model", &|report| report["corrected_model"] = Value::Null);
    refused("no date", &|report| report["created"] = "yesterday".into());
    refused("path to the root", &|report| report["corrected_model"]["path"] = "/etc/passwd".into());
    refused("no experiment", &|report| report["verdicts"][0]["suggested_experiment"] = Value::Null);
}

#[test]
fn the_names_of_the_types_are_those_of_the_schema() {
    let schema: Value = serde_json::from_str(SCHEMA).expect("JSON");
    let names = |pointer: &str| -> Vec<String> {
        let list = schema.pointer(pointer).and_then(Value::as_array).unwrap_or_else(|| panic!("{pointer}"));
        list.iter().filter_map(Value::as_str).map(str::to_owned).collect()
    };
    let physics: Vec<String> = Physics::ALL.iter().map(|physics| physics.name().into_owned()).collect();
    assert_eq!(names("/$defs/physics/anyOf/0/enum"), physics);
    macro_rules! same {
        ($($type:ident $pointer:literal;)*) => {
            $(assert_eq!(names($pointer), gap_report::$type::ALL.iter().map(|one| one.name()).collect::<Vec<_>>(), $pointer);)*
        };
    }
    same! {
        Access "/properties/inputs/properties/simulator/properties/access/enum";
        Channel "/$defs/channel/enum";
        CiMethod "/$defs/parameter/properties/ci_method/enum";
        Feature "/$defs/regime/properties/feature/enum";
        FloorMethod "/$defs/fit/properties/noise_floor_method/enum";
        Format "/$defs/artifact/properties/format/enum";
        Identifiable "/$defs/parameter/properties/identifiable/enum";
        Level "/properties/data_quality/items/properties/level/enum";
        Metric "/$defs/fit/properties/metric/enum";
        RegionKind "/$defs/region/properties/kind/enum";
        Role "/$defs/verdict/properties/role/enum";
        RunKind "/$defs/run/properties/kind/enum";
        RunRole "/$defs/run/properties/role/enum";
        Space "/$defs/fit/properties/space/enum";
        Status "/properties/status/enum";
        Subsystem "/$defs/subsystem/enum";
        TestData "/$defs/evidence/properties/data/enum";
        TestMethod "/$defs/evidence/properties/method/enum";
        TrajectoryKind "/$defs/experiment/properties/trajectory/properties/kind/enum";
    }
}

/// Every property of the schema is a field: a report that has all of them comes back whole.
#[test]
fn every_property_of_the_schema_survives() {
    let schema: Value = serde_json::from_str(SCHEMA).expect("JSON");
    let full = filled(&schema, &schema, "");
    let report: Report = serde_json::from_value(full.clone()).unwrap_or_else(|error| panic!("{error}: {full:#}"));
    assert!(report.extra.iter().next().is_none(), "{:?}", report.extra);
    assert_eq!(serde_json::to_value(&report).expect("JSON"), full);
}

/// An instance with every property, ignoring the conditions of the schema.
fn filled(root: &Value, schema: &Value, name: &str) -> Value {
    if let Some(reference) = schema["$ref"].as_str() {
        return filled(root, root.pointer(reference.trim_start_matches('#')).expect("a definition"), name);
    }
    if let Some(first) = schema["anyOf"].as_array().and_then(|any| any.first()) {
        return filled(root, first, name);
    }
    if let Some(only) = schema.get("const").or_else(|| schema["enum"].as_array().and_then(|names| names.first())) {
        return only.clone();
    }
    let kind = schema["type"].as_str().or_else(|| schema["type"][0].as_str());
    match kind {
        Some("object") => {
            let properties = schema["properties"].as_object().expect("properties");
            properties.iter().map(|(name, schema)| (name.clone(), filled(root, schema, name))).collect()
        }
        Some("array") => match schema["prefixItems"].as_array() {
            Some(items) => items.iter().map(|item| filled(root, item, name)).collect(),
            None => Value::Array(vec![filled(root, &schema["items"], name)]),
        },
        Some("number") => 0.5.into(),
        Some("integer") => 3.into(),
        Some("boolean") => true.into(),
        Some("string") => format!("some {name}").into(),
        other => panic!("{name}: {other:?}"),
    }
}
