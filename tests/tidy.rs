//! House rules that a machine can check: `unsafe` only in modules that say so in their first lines, and no stubs.

use std::path::{Path, PathBuf};

fn sources(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(dir).expect("folder").flatten() {
        let path = entry.path();
        let name = entry.file_name();
        if path.is_dir() {
            if name != "target" && name != "build" && name != ".git" {
                sources(&path, found);
            }
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

fn all() -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    sources(Path::new(env!("CARGO_MANIFEST_DIR")), &mut found);
    assert!(found.len() > 50);
    found
        .into_iter()
        .map(|path| {
            let text = std::fs::read_to_string(&path).expect("UTF-8");
            (path, text)
        })
        .collect()
}

#[test]
fn unsafe_stands_only_in_modules_that_name_it() {
    for (path, text) in all() {
        let is_test = path.components().any(|part| part.as_os_str() == "tests");
        let uses = text.lines().any(|line| {
            let code = line.split("//").next().unwrap_or_default();
            code.contains("unsafe {")
                || code.contains("unsafe fn")
                || code.contains("unsafe impl")
                || code.contains("unsafe extern")
        });
        let introduction: String = text.lines().take_while(|line| line.starts_with("//!")).collect();
        assert!(
            is_test || !uses || introduction.contains("`unsafe`"),
            "{}: uses unsafe and does not say so at its top",
            path.display()
        );
    }
}

/// F25: a wall clock that is set changes no output.
#[test]
fn the_service_and_the_bridge_read_the_wall_clock_only_to_date_their_files() {
    let top = Path::new(env!("CARGO_MANIFEST_DIR"));
    let rooms = ["src", "importer/src", "transport/src", "wire/src", "bridge/src"].map(|room| top.join(room));
    let mut readers: Vec<_> = all()
        .into_iter()
        .filter(|(path, _)| rooms.iter().any(|room| path.starts_with(room)))
        .filter(|(_, text)| {
            ["SystemTime", "CLOCK_REALTIME", "ClockId::Realtime", "gettimeofday"].iter().any(|clock| text.contains(clock))
        })
        .map(|(path, _)| path.strip_prefix(top).expect("of this repository").to_path_buf())
        .collect();
    readers.sort();
    assert_eq!(readers, [Path::new("src/report.rs")]);
}

#[test]
fn there_are_no_stubs_and_no_ignored_tests() {
    let marks =
        [concat!("to", "do!("), concat!("unimple", "mented!("), concat!("#[ig", "nore"), concat!("FIX", "ME"), concat!("XX", "X")];
    for (path, text) in all() {
        for mark in marks {
            assert!(!text.contains(mark), "{}: {mark}", path.display());
        }
    }
}

#[test]
fn every_flag_and_status_is_in_the_document_with_its_bit() {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/flags.md")).expect("docs/flags.md");
    for flag in ravenpose_wire::FLAGS {
        let bit = flag.bit.trailing_zeros();
        let start = format!("| {bit} | `{}` |", flag.name);
        assert!(text.lines().any(|line| line.starts_with(&start)), "docs/flags.md has no row that begins with {start}");
    }
}
