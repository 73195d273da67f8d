//! A proof that shares code with what it proves is none.

#[test]
fn neither_generator_nor_scorer_depends_on_this_project() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for package in ["generator", "scorer"] {
        let text = std::fs::read_to_string(root.join(package).join("Cargo.toml")).unwrap();
        let mut section = "";
        for line in text.lines() {
            if line.starts_with('[') {
                section = line;
            }
            let is_ours = line.starts_with("ravenpose") || line.contains("path = \"..");
            assert!(!(section.contains("dependencies") && is_ours), "{package}: {line}");
        }
    }
}
