//! `ravenpose stats` of a service that runs, and of one that does not.
#![allow(missing_docs)]

mod common;

use common::{Folder, ravenpose, refused, text};
use std::time::{SystemTime, UNIX_EPOCH};

#[test]
fn only_a_service_that_runs_ends_with_status_0_and_gives_histograms() {
    let folder = Folder::new("stats");
    let now_s = SystemTime::now().duration_since(UNIX_EPOCH).expect("a clock").as_secs();
    let written = |at_s: u64, flags: &str| {
        let text = format!(
            r#"{{"version":1,"pid":1,"written_unix_s":{at_s},"uptime_s":9,"arms":[{{"arm":"gold","status":"valid","flags":[{flags}],"model":""}}],"counters":[],"stages":[]}}"#
        );
        std::fs::write(folder.file("stats.json"), text).expect("written");
    };
    let of = |more: &[&str]| {
        let directory = folder.file("");
        ravenpose(&[&["stats", "--runtime-dir", text(&directory)], more].concat())
    };
    for (at_s, flags, status, words) in [
        (now_s, "", 0, "ravenposed running, pid 1"),
        (now_s - 60, "", 1, "NOT RUNNING: last statistics 6"),
        (now_s, "\"stopping\"", 1, "NOT RUNNING: stopped"),
        (now_s + 3600, "", 1, "ahead of this machine's clock"),
    ] {
        written(at_s, flags);
        let output = of(&[]);
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.code() == Some(status) && said.contains(words), "{output:?}");
        if status != 0 {
            refused(&of(&["--hgrm", text(&folder.file("run.hgrm"))]), &["stats.json", "no histograms are written"]);
        }
    }
    written(now_s, "");
    refused(&of(&["--hgrm", text(&folder.file(""))]), &["is a folder"]);
}
