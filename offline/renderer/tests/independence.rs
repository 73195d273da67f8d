//! A tracker that is tested with its own camera model proves nothing.

#[test]
fn the_renderer_depends_on_nothing_of_this_project_and_the_tracker_not_on_it() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for package in ["renderer", "vision"] {
        let text = std::fs::read_to_string(root.join(package).join("Cargo.toml")).unwrap();
        let mut section = "";
        for line in text.lines() {
            if line.starts_with('[') {
                section = line;
            }
            let is_ours = line.starts_with("ravenpose") || line.contains("path = \"..");
            assert!(!(section == "[dependencies]" && is_ours), "{package}: {line}");
        }
        for file in std::fs::read_dir(root.join(package).join("src")).unwrap() {
            let path = file.unwrap().path();
            if let Ok(text) = std::fs::read_to_string(&path) {
                assert!(!text.contains("#[path") && !text.contains("include!"), "{}", path.display());
            }
        }
    }
}
