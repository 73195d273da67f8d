//! Output into a pipe that nobody reads any more, as `| head` leaves it.
#![allow(missing_docs)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// A folder of our own, gone at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ravenpose-pipe-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("folder");
        Self(path)
    }

    fn file(&self, name: &str) -> String {
        self.0.join(name).to_str().expect("UTF-8").to_owned()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A standard output whose reader has gone already.
fn gone() -> Stdio {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    writer.into()
}

fn unheard(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ravenpose"));
    command.args(arguments).stdout(gone()).stderr(Stdio::piped());
    command.spawn().and_then(std::process::Child::wait_with_output).expect("ravenpose runs")
}

fn ends(output: &Output, status: i32) {
    assert_eq!(output.status.code(), Some(status), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Half a minute of a robot with a light weight that its model lacks.
fn run(folder: &Folder) -> String {
    let robot = folder.file("heavy.toml");
    let text = "schema = \"ravenpose-robot/1\"\nname = \"heavy\"\nbase = \"raven2-nominal\"\n[[effect]]\nphysics = \"payload\"\n\
                parameters = { m_p = 0.2, c_z = -0.45 }\n";
    std::fs::write(&robot, text).expect("robot");
    ends(&unheard(&["simulate", "--minutes", "0.5", "--seed", "3", "--robot", &robot, "--out", &folder.file("runs")]), 0);
    folder.file("runs/run_0001.mcap")
}

#[test]
fn a_reader_that_has_gone_is_no_error_and_the_status_is_the_usual_one() {
    let folder = Folder::new("gone");
    let (run, out) = (run(&folder), folder.file("out"));
    ends(&unheard(&["info", &run]), 0);
    ends(&unheard(&["info", "--json", &run]), 0);
    ends(&unheard(&["gap", "--real", &run, "--out", &out]), 1);
    assert!(Path::new(&out).join("report.html").exists() && Path::new(&out).join("corrected.toml").exists());
}

#[test]
fn trouble_has_its_status_where_nobody_hears_of_it() {
    let folder = Folder::new("deaf");
    let mut command = Command::new(env!("CARGO_BIN_EXE_ravenpose"));
    command.args(["info", &folder.file("absent.csv")]).stdout(gone()).stderr(gone());
    assert_eq!(command.status().expect("ravenpose runs").code(), Some(2));
    command = Command::new(env!("CARGO_BIN_EXE_ravenpose"));
    command.args(["plot", &folder.file("absent.csv"), "--out", &folder.file("page.html")]).stderr(gone());
    assert_eq!(command.status().expect("ravenpose runs").code(), Some(2));
}

#[test]
fn output_that_cannot_be_written_is_said() {
    if !Path::new("/dev/full").exists() {
        println!("skipped: /dev/full absent");
        return;
    }
    let folder = Folder::new("full");
    let run = run(&folder);
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("/dev/full");
    let mut command = Command::new(env!("CARGO_BIN_EXE_ravenpose"));
    let output = command.args(["info", &run]).stdout(full).stderr(Stdio::piped()).output().expect("ravenpose runs");
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("standard output cannot be written"));
}
