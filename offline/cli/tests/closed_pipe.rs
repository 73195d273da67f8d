//! Output into a pipe that nobody reads any more, as `| head` leaves it.
#![allow(missing_docs)]

mod common;

use common::{Folder, errors, program, text, with_effect};
use std::path::PathBuf;
use std::process::{Output, Stdio};

/// A standard output whose reader has gone already.
fn gone() -> Stdio {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    writer.into()
}

fn unheard(arguments: &[&str]) -> Output {
    let mut command = program();
    command.args(arguments).stdout(gone()).stderr(Stdio::piped());
    command.spawn().and_then(std::process::Child::wait_with_output).expect("ravenpose runs")
}

fn ends(output: &Output, status: i32) {
    assert_eq!((output.status.code(), errors(output).as_str()), (Some(status), ""));
}

/// Half a minute of a robot with a light weight that its model lacks.
fn run(folder: &Folder) -> PathBuf {
    let robot = folder.write("heavy.toml", with_effect("physics = \"payload\"\nparameters = { m_p = 0.2, c_z = -0.45 }"));
    let runs = folder.file("runs");
    ends(&unheard(&["simulate", "--minutes", "0.5", "--seed", "3", "--robot", text(&robot), "--out", text(&runs)]), 0);
    runs.join("run_0001.mcap")
}

#[test]
fn a_reader_that_has_gone_is_no_error_and_the_status_is_the_usual_one() {
    let folder = Folder::new("gone");
    let (run, out) = (run(&folder), folder.file("out"));
    ends(&unheard(&["info", text(&run)]), 0);
    ends(&unheard(&["info", "--json", text(&run)]), 0);
    ends(&unheard(&["gap", "--real", text(&run), "--out", text(&out)]), 1);
    assert!(out.join("report.html").exists() && out.join("corrected.toml").exists());
}

#[test]
fn trouble_has_its_status_where_nobody_hears_of_it() {
    let folder = Folder::new("deaf");
    let absent = folder.file("absent.csv");
    let status = |arguments: &[&str], stdout: Stdio| {
        program().args(arguments).stdout(stdout).stderr(gone()).status().expect("ravenpose runs").code()
    };
    assert_eq!(status(&["info", text(&absent)], gone()), Some(2));
    assert_eq!(status(&["plot", text(&absent), "--out", text(&folder.file("page.html"))], Stdio::null()), Some(2));
}

#[test]
fn output_that_cannot_be_written_is_said() {
    if !std::path::Path::new("/dev/full").exists() {
        println!("skipped: /dev/full absent");
        return;
    }
    let folder = Folder::new("full");
    let run = run(&folder);
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("/dev/full");
    let output = program().args(["info", text(&run)]).stdout(full).stderr(Stdio::piped()).output().expect("ravenpose runs");
    common::refused(&output, &["standard output cannot be written"]);
}
