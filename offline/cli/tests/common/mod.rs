//! Running the program in a folder of our own, and the shared data where they are.
#![allow(dead_code, reason = "each test uses its part")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The program, with its arguments to be added.
pub(crate) fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_ravenpose"))
}

pub(crate) fn ravenpose(arguments: &[&str]) -> Output {
    program().args(arguments).output().expect("ravenpose runs")
}

/// The same, and it has to succeed.
pub(crate) fn done(arguments: &[&str]) -> Output {
    let output = ravenpose(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", errors(&output));
    output
}

pub(crate) fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

/// What the program says when it goes wrong.
pub(crate) fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// One line on standard error, exit status 2, and these words in it.
pub(crate) fn refused(output: &Output, words: &[&str]) {
    let error = errors(output);
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
    for word in words {
        assert!(error.contains(word), "{word:?} is not in: {error}");
    }
}

/// A place under ../shared; says that the test skips where it is absent.
pub(crate) fn shared(sub: &str) -> Option<PathBuf> {
    let root = std::env::var_os("RAVENPOSE_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let path = root.join(sub);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {} is absent", path.display());
    None
}

/// A robot file: RAVEN-II as published, with one effect, as the lines of its table.
pub(crate) fn with_effect(lines: &str) -> String {
    format!("schema = \"ravenpose-robot/1\"\nname = \"made\"\nbase = \"raven2-nominal\"\n[[effect]]\n{lines}\n")
}

/// A folder of our own, gone at the end.
pub(crate) struct Folder(PathBuf);

impl Folder {
    /// Of its own, also beside another one of this name: tests of one program run at the same time.
    pub(crate) fn new(name: &str) -> Self {
        static MADE: AtomicUsize = AtomicUsize::new(0);
        let number = MADE.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("ravenpose-{name}-{}-{number}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("folder");
        Self(path)
    }

    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        std::fs::write(self.file(name), bytes).expect("file");
        self.file(name)
    }

    /// Simulates one run of so many minutes into `runs`, of a robot file or of RAVEN-II as published.
    pub(crate) fn run(&self, minutes: &str, robot: Option<&Path>, more: &[&str]) -> PathBuf {
        let runs = self.file("runs");
        let mut arguments = vec!["simulate", "--minutes", minutes, "--seed", "3", "--out", text(&runs)];
        arguments.extend(robot.iter().flat_map(|robot| ["--robot", text(robot)]));
        arguments.extend(more);
        done(&arguments);
        runs.join("run_0001.mcap")
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
