//! The service's tree stays small: nothing offline is reachable from `ravenposed`, every licence is permissive, iceoryx2 is one
//! exact version. The lists are those of `deny.toml`, so that this and `cargo deny` say the same.

use std::collections::BTreeSet;
use std::process::Command;

fn cargo(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO")).args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output().expect("cargo");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Name, version and licence of everything that the service's binary is made of.
fn tree() -> BTreeSet<(String, String, String)> {
    cargo(&["tree", "--locked", "--package", "ravenpose", "--edges", "normal", "--prefix", "none", "--format", "{p}|{l}"])
        .lines()
        .map(|line| {
            let (package, licence) = line.split_once('|').expect("format");
            let mut words = package.split(' ');
            let name = words.next().unwrap_or_default().to_owned();
            (name, words.next().unwrap_or_default().to_owned(), licence.trim_end_matches(" (*)").to_owned())
        })
        .collect()
}

fn deny() -> toml::Table {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/deny.toml")).expect("deny.toml");
    text.parse().expect("TOML")
}

fn strings(value: &toml::Value) -> Vec<String> {
    value
        .as_array()
        .expect("a list")
        .iter()
        .map(|item| item.as_str().or_else(|| item.get("crate").and_then(toml::Value::as_str)).expect("a name").to_owned())
        .collect()
}

#[test]
fn nothing_offline_is_reachable_from_the_service() {
    let banned = strings(&deny()["bans"]["deny"]);
    assert!(banned.len() > 10);
    let tree = tree();
    assert!(tree.iter().any(|(name, ..)| name == "iceoryx2") && tree.iter().any(|(name, ..)| name == "tract-onnx"));
    let found: Vec<_> = tree.iter().filter(|(name, ..)| banned.contains(name)).collect();
    assert!(found.is_empty(), "{found:?}");
    println!("{} packages in the service", tree.len());
    assert!(tree.len() < 200, "the tree grew to {} packages", tree.len());
}

#[test]
fn the_bridge_carries_no_inference_engine_into_the_controller() {
    let tree = cargo(&["tree", "--locked", "--package", "ravenpose-bridge", "--edges", "normal", "--prefix", "none"]);
    for engine in ["tract", "ravenpose ", "nalgebra", "hdrhistogram"] {
        assert!(!tree.lines().any(|line| line.starts_with(engine)), "{engine} is reachable from the bridge");
    }
}

#[test]
fn every_licence_is_permissive() {
    let allowed = strings(&deny()["licenses"]["allow"]);
    for (name, version, licence) in tree() {
        // "A OR B": one is enough. "A AND B": all are needed.
        let fits = licence
            .replace(['(', ')'], "")
            .split(" OR ")
            .flat_map(|choice| choice.split('/'))
            .any(|choice| choice.split(" AND ").all(|part| allowed.iter().any(|good| good == part.trim())));
        assert!(fits, "{name} {version}: {licence}");
    }
}

#[test]
fn all_peers_have_one_exact_iceoryx2() {
    let versions: BTreeSet<_> = tree().into_iter().filter(|(name, ..)| name == "iceoryx2").map(|(_, version, _)| version).collect();
    assert_eq!(versions.into_iter().collect::<Vec<_>>(), [format!("v{}", ravenpose_wire::ICEORYX2_VERSION)]);
}
