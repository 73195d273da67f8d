//! `ravenpose simulate`, `info`, `convert`, `plot` as a user runs them.
#![allow(missing_docs)]

mod common;

use common::{Folder, done, errors, program, ravenpose, refused, text, with_effect};
use recordings::csv;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Output;

fn simulate(out: &Path, more: &[&str]) -> Output {
    let mut arguments = vec!["simulate", "--minutes", "0.05", "--seed", "7", "--robot", "raven2-worn", "--out", text(out)];
    arguments.extend(more);
    ravenpose(&arguments)
}

#[test]
fn runs_are_the_same_bytes_whatever_the_number_of_threads() {
    let folder = Folder::new("threads");
    let (one, two) = (folder.file("one"), folder.file("two"));
    for (out, threads) in [(&one, "1"), (&two, "3")] {
        let output = simulate(out, &["--run-minutes", "0.0125", "--arm", "both", "--threads", threads]);
        assert!(output.status.success(), "{}", errors(&output));
    }
    let mut names: Vec<_> = std::fs::read_dir(&one).expect("runs").map(|entry| entry.expect("entry").file_name()).collect();
    names.sort();
    assert_eq!(names.len(), 5, "{names:?}");
    for name in names {
        assert_eq!(std::fs::read(one.join(&name)).expect("run"), std::fs::read(two.join(&name)).expect("run"), "{name:?}");
    }
}

#[test]
fn a_simulated_run_has_every_state_and_its_truth_and_converts_to_everything() {
    let folder = Folder::new("formats");
    let out = folder.file("runs");
    assert!(simulate(&out, &[]).status.success());
    let run = out.join("run_0001.mcap");
    let info: serde_json::Value = serde_json::from_slice(&ravenpose(&["info", "--json", text(&run)]).stdout).expect("JSON");
    let shown = info[0].to_string();
    assert!(shown.contains("MCAP") && shown.contains("3000"), "{shown}");
    let table = folder.file("run.csv");
    done(&["convert", text(&run), text(&table)]);
    let lines = std::fs::read_to_string(&table).expect("table");
    let header = lines.lines().find(|line| !line.starts_with('#')).expect("header");
    assert!(header.starts_with("t_s,") && header.contains("mpos_1_rad") && header.contains("truth_x_mm"), "{header}");
    assert_eq!(lines.lines().filter(|line| !line.starts_with('#')).count(), 3001);
    // There and back again through every format that keeps all: the same bytes of MCAP.
    let first = folder.file("first.mcap");
    done(&["convert", text(&run), text(&first)]);
    for ending in ["bag", "parquet"] {
        let (other, back) = (folder.file(&format!("other.{ending}")), folder.file(&format!("back-{ending}.mcap")));
        done(&["convert", text(&run), text(&other)]);
        done(&["convert", text(&other), text(&back)]);
        let (a, b) = (folder.file(&format!("a-{ending}.csv")), folder.file(&format!("b-{ending}.csv")));
        done(&["convert", text(&first), text(&a)]);
        done(&["convert", text(&back), text(&b)]);
        assert_eq!(std::fs::read(&a).expect("a"), std::fs::read(&b).expect("b"), "{ending}");
    }
    for ending in ["rvs", "txt", "252.csv", "csv.gz"] {
        let other = folder.file(&format!("other.{ending}"));
        done(&["convert", text(&run), text(&other)]);
        done(&["info", text(&other)]);
        let again = done(&["convert", text(&other), text(&folder.file("again.csv"))]);
        let said = String::from_utf8_lossy(&again.stdout).contains("columns 4-11 (CRTK joints) are neither state nor truth");
        assert_eq!(said, ending == "252.csv", "{again:?}");
    }
    let page = folder.file("run.html");
    done(&["plot", text(&run), "--out", text(&page)]);
    let page = std::fs::read_to_string(&page).expect("page");
    assert!(page.contains("<svg") && page.len() > 20_000 && !page.contains("<script src"), "{} bytes", page.len());
}

#[test]
fn a_table_becomes_states_of_its_own_arm_at_its_own_times() {
    let folder = Folder::new("own-arm");
    let out = folder.file("runs");
    assert!(simulate(&out, &["--arm", "green"]).status.success());
    let (run, table, back) = (out.join("run_0001.mcap"), folder.file("run.csv"), folder.file("back.mcap"));
    done(&["convert", text(&run), text(&table)]);
    let said = done(&["convert", text(&table), text(&back)]);
    assert!(String::from_utf8_lossy(&said.stdout).contains("3000 states, 3.000 s"), "{said:?}");
    let again = folder.file("again.csv");
    done(&["convert", text(&back), text(&again)]);
    let (first, second) = (csv::read(&table).expect("table"), csv::read(&again).expect("table"));
    for key in ["arm", "start_unix_ns"] {
        assert_eq!(first.metadata.get(key), second.metadata.get(key), "{key}");
    }
    for name in ["x_m", "y_m", "z_m", "truth_x_m", "truth_y_m", "truth_z_m"] {
        let (a, b) = (first.column(name).expect("before"), second.column(name).expect("after"));
        let apart = a.iter().zip(b).filter(|(a, b)| a.is_finite() && b.is_finite()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 2e-6, "{name}: {apart}");
        assert_eq!(a.iter().filter(|x| x.is_finite()).count(), b.iter().filter(|x| x.is_finite()).count(), "{name}");
    }
    // Shown as the other arm it has no truth: that is in the frame of its own.
    let other = folder.file("other.mcap");
    let said = done(&["convert", text(&table), text(&other), "--arm", "gold"]);
    assert!(String::from_utf8_lossy(&said.stdout).contains("where the green arm truly was is left out"), "{said:?}");
    let shown = folder.file("other.csv");
    done(&["convert", text(&other), text(&shown)]);
    assert!(csv::read(&shown).expect("table").column("truth_x_m").is_none());
    refused(
        &ravenpose(&["convert", text(&table), text(&shown), "--arm", "green"]),
        &["a table keeps its columns", "leave --arm out"],
    );
}

#[test]
fn a_slow_run_is_as_long_as_it_is_and_what_is_no_run_does_not_become_states() {
    let folder = Folder::new("no-run");
    // A hundred rows of 10 Hz are ten seconds, whatever the states' own rate.
    let rows: String = (0..100)
        .fold("t_s,mpos_1_rad,mpos_2_rad,mpos_3_rad\n".to_owned(), |text, row| text + &format!("{},{row},1,1\n", row as f64 * 0.1));
    let said = done(&["convert", text(&folder.write("slow.csv", rows)), text(&folder.file("slow.mcap"))]);
    assert!(String::from_utf8_lossy(&said.stdout).contains("100 states, 10.000 s"), "{said:?}");
    let header = "t_s,mpos_1_rad,mpos_2_rad,mpos_3_rad,x_mm,y_mm,z_mm";
    let out = folder.file("out.mcap");
    for (name, rows, word) in [
        ("empty.CSV", "", "no row"),
        ("back.CSV", "0,1,1,1,0,0,0\n0.002,1,1,1,0,0,0\n0.001,1,1,1,0,0,0\n", "does not rise"),
        ("word.CSV", "0,1,1,1,0,0,0\n0.001,2o.5,1,1,0,0,0\n", "2o.5"),
    ] {
        let table = folder.write(name, format!("{header}\n{rows}"));
        refused(&ravenpose(&["convert", text(&table), text(&out)]), &[name, word]);
        assert!(!out.exists());
    }
}

#[test]
fn a_stretch_is_cut_out_of_states_and_tables_alike() {
    let folder = Folder::new("cut");
    let out = folder.file("runs");
    assert!(simulate(&out, &[]).status.success());
    let run = out.join("run_0001.mcap");
    let whole = folder.file("whole.csv");
    done(&["convert", text(&run), text(&whole)]);
    let rows = |path: &Path| -> Vec<String> {
        let lines = std::fs::read_to_string(path).expect("table");
        lines.lines().filter(|line| !line.starts_with('#')).skip(1).map(str::to_owned).collect()
    };
    // The same second out of the states, out of the table, and out of the table as states.
    let cut = ["--from", "1", "--to", "2"];
    let (states, table, back) = (folder.file("states.mcap"), folder.file("table.csv"), folder.file("back.rvs"));
    done(&[&["convert", text(&run), text(&states)], &cut[..]].concat());
    done(&[&["convert", text(&whole), text(&table)], &cut[..]].concat());
    assert_eq!(rows(&table), rows(&whole)[1000..2000]);
    let of_states = folder.file("of_states.csv");
    done(&["convert", text(&states), text(&of_states)]);
    // Each table begins at zero on its own; everything else is the same.
    let but_time =
        |rows: Vec<String>| -> Vec<String> { rows.iter().map(|row| row.split_once(',').expect("columns").1.to_owned()).collect() };
    assert_eq!(but_time(rows(&of_states)), but_time(rows(&table)));
    let said = ravenpose(&[&["convert", text(&whole), text(&back)], &cut[..]].concat());
    assert!(String::from_utf8_lossy(&said.stdout).contains("1000 states, 1.000 s"), "{said:?}");
    // The end alone, and the begin alone.
    done(&["convert", text(&whole), text(&table), "--from", "2.5"]);
    assert_eq!(rows(&table), rows(&whole)[2500..]);
    done(&["convert", text(&whole), text(&table), "--to", "0.25"]);
    assert_eq!(rows(&table), rows(&whole)[..250]);

    let nothing = folder.file("nothing.mcap");
    for (input, cut, why) in [
        (&run, ["--from", "9", "--to", "10"], "none of that time; nothing was written"),
        (&whole, ["--from", "9", "--to", "10"], "no row of that time; nothing was written"),
        (&run, ["--from", "2", "--to", "1"], "--from 2 --to 1: must be seconds"),
        (&run, ["--from", "NaN", "--to", "1"], "must be seconds"),
    ] {
        refused(&ravenpose(&[&["convert", text(input), text(&nothing)], &cut[..]].concat()), &[why]);
        assert!(!nothing.exists());
    }
    let timeless = folder.file("timeless.csv");
    std::fs::write(&timeless, "x_mm\n1\n2\n").expect("table");
    let output = ravenpose(&["convert", text(&timeless), text(&table), "--to", "1"]);
    refused(&output, &["has no column t_s, which --from and --to need"]);
}

#[test]
fn pairs_of_a_simulated_run_are_its_error() {
    let folder = Folder::new("pairs");
    let out = folder.file("runs");
    assert!(simulate(&out, &[]).status.success());
    let table = folder.file("pairs.csv");
    done(&["pair", text(&out.join("run_0001.mcap")), "--same", "--out", text(&table)]);
    let lines = std::fs::read_to_string(&table).expect("pairs");
    let rows: Vec<Vec<f64>> = lines
        .lines()
        .filter(|line| line.starts_with(|first: char| first.is_ascii_digit()))
        .map(|line| line.split(',').map(|cell| cell.parse().expect("number")).collect())
        .collect();
    assert!(rows.len() > 100, "{}", rows.len());
    for row in &rows {
        for axis in 0..3 {
            assert!((row[5 + axis] - row[2 + axis] - row[8 + axis]).abs() < 2e-6, "{row:?}");
        }
    }
    let largest = rows.iter().map(|row| row[8..].iter().map(|label| label * label).sum::<f64>().sqrt()).fold(0.0, f64::max);
    assert!((0.5..15.0).contains(&largest), "{largest} mm");
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.file("pairs.report.json")).expect("report")).expect("JSON");
    assert_eq!(report["pairs"].as_u64(), Some(rows.len() as u64));
    // A run without a true position has no error of zero.
    let (run, alone) = (out.join("run_0001.mcap"), folder.file("alone.rvs"));
    done(&["convert", text(&run), text(&alone)]);
    let pairs = folder.file("alone.csv");
    refused(&ravenpose(&["pair", text(&alone), "--same", "--out", text(&pairs)]), &["alone.rvs", "give it with --truth"]);
    refused(&ravenpose(&["pair", text(&run), "--same", "--out", text(&folder.file("p.csv.gz"))]), &["not a format of pairs"]);
    assert!(!pairs.exists());
    // Nor is a run replaced by its picture.
    refused(&ravenpose(&["plot", text(&run), "--out", text(&run)]), &["both input and output"]);
    refused(&ravenpose(&["plot", text(&run), "--out", text(&folder.file("run.png"))]), &[".html or .svg"]);
    refused(&ravenpose(&["plot", text(&run), "--out", "/dev/null"]), &["is no file"]);
}

#[test]
fn the_clocks_of_a_run_and_its_truth_are_found_by_their_start_times_or_as_told() {
    let folder = Folder::new("clocks");
    let out = folder.file("runs");
    done(&["simulate", "--minutes", "0.4", "--seed", "4", "--out", text(&out)]);
    let table = folder.file("table.csv");
    done(&["convert", text(&out.join("run_0001.mcap")), text(&table)]);
    let table = std::fs::read_to_string(table).expect("table");
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().expect("names").split(',').collect();
    let at = ["t_s", "truth_x_mm", "truth_y_mm", "truth_z_mm"].map(|name| names.iter().position(|own| *own == name).expect(name));
    // 20 frames a second, of a camera that began 9 s after the run; by the two computers' clocks it was 8.8 s.
    let mut frames = String::from("t_s,x_mm,y_mm,z_mm\n");
    for line in lines.clone().step_by(50) {
        let cells: Vec<&str> = line.split(',').collect();
        let t_s: f64 = cells[at[0]].parse().expect("time");
        if t_s >= 9.0 {
            let _ = writeln!(frames, "{:.6},{},{},{}", t_s - 9.0, cells[at[1]], cells[at[2]], cells[at[3]]);
        }
    }
    let states = format!("{}\n{}\n", names.join(","), lines.collect::<Vec<_>>().join("\n"));
    let written = |name: &str, head: &str, rows: &str| {
        let file = folder.file(name);
        std::fs::write(&file, format!("{head}\n{rows}")).expect("table");
        file
    };
    let run = written("run.csv", "# start_unix_ns = 1800000000000000000", &states);
    let bare_run = written("bare.csv", "# robot = raven2", &states);
    let seen = written("truth.csv", "# start_unix_s = 1800000008.800000", &frames);
    let bare = written("bare_truth.csv", "# rig = ours", &frames);
    let pairs = folder.file("pairs.csv");
    let offset_s = |run: &Path, truth: &Path, more: &[&str]| {
        let mut arguments = vec!["pair", text(run), "--truth", text(truth), "--out", text(&pairs)];
        arguments.extend(more);
        let words = String::from_utf8(done(&arguments).stdout).expect("UTF-8");
        let report = std::fs::read(folder.file("pairs.report.json")).expect("report");
        let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
        (report["clock"]["clock"]["offset_s"].as_f64().expect("offset"), words)
    };
    let (found, words) = offset_s(&run, &seen, &[]);
    assert!((found - 9.0).abs() < 0.02 && words.contains("8.800 s of the states, by the start times"), "{found} {words}");
    let (found, words) = offset_s(&bare_run, &bare, &["--offset-s", "12"]);
    assert!((found - 9.0).abs() < 0.02 && words.contains("12.000 s of the states, as told"), "{found} {words}");
    // With nothing known, 9 s are out of reach, and no other offset is taken for it.
    for (run, truth) in [(&bare_run, &seen), (&run, &bare)] {
        refused(&ravenpose(&["pair", text(run), "--truth", text(truth), "--out", text(&pairs)]), &[text(run)]);
    }
    let both = ravenpose(&["pair", text(&run), "--truth", text(&seen), "--out", text(&pairs), "--same", "--offset-s", "1"]);
    assert_eq!(both.status.code(), Some(2));
}

#[test]
fn a_cut_recording_gives_what_stands_before_the_cut_and_says_where() {
    let folder = Folder::new("cut");
    let out = folder.file("runs");
    assert!(simulate(&out, &[]).status.success());
    let whole = std::fs::read(out.join("run_0001.mcap")).expect("run");
    let cut = folder.write("cut.mcap", &whole[..whole.len() * 2 / 3]);
    let saved = folder.file("saved.csv");
    let output = ravenpose(&["convert", text(&cut), text(&saved)]);
    let error = errors(&output);
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.lines().count() == 1 && error.contains("cut.mcap: byte "), "{error}");
    let rows = std::fs::read_to_string(&saved).expect("saved").lines().filter(|line| !line.starts_with('#')).count();
    assert!((100..3000).contains(&rows), "{rows}");
    // So do a picture and pairs of it.
    let (page, pairs) = (folder.file("page.html"), folder.file("pairs.csv"));
    for arguments in [["plot", text(&cut), "--out", text(&page)].as_slice(), &["pair", text(&cut), "--same", "--out", text(&pairs)]]
    {
        let output = ravenpose(arguments);
        let error = errors(&output);
        assert_eq!(output.status.code(), Some(1), "{error}");
        assert!(error.lines().count() == 1 && error.contains("cut.mcap: byte "), "{error}");
    }
    assert!(page.exists() && pairs.exists());
    // And so does a simulation that follows its commands.
    let again = folder.file("again");
    let output = ravenpose(&["simulate", "--commands", text(&cut), "--out", text(&again)]);
    let error = errors(&output);
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.lines().count() == 1 && error.contains("cut.mcap: byte "), "{error}");
    assert!(again.join("run_0001.mcap").exists());
    let both = ravenpose(&["simulate", "--commands", text(&cut), "--motion", "zigzag", "--out", text(&folder.file("z"))]);
    assert!(both.status.code() == Some(2) && errors(&both).contains("--motion"), "{}", errors(&both));
}

#[test]
fn cells_that_cannot_be_kept_are_told_and_the_status_is_1() {
    let folder = Folder::new("words");
    let mut rows: Vec<String> = (0..40).map(|row| format!("{row},{row}.5")).collect();
    rows[20] = "20,2o.5".to_owned();
    let table = folder.write("table.csv", format!("t_s,x_mm\n{}\n", rows.join("\n")));
    let out = folder.file("out.parquet");
    let output = ravenpose(&["convert", text(&table), text(&out)]);
    assert_eq!(output.status.code(), Some(1));
    assert!(errors(&output).contains("table.csv: 1 cells are no numbers") && out.exists(), "{}", errors(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("first in line 22: `2o.5`"));
}

#[test]
fn of_a_recording_of_both_arms_the_one_that_is_named_is_paired() {
    let folder = Folder::new("both");
    let out = folder.file("runs");
    assert!(simulate(&out, &["--arm", "both"]).status.success());
    let (run, pairs) = (out.join("run_0001.mcap"), folder.file("pairs.csv"));
    refused(&ravenpose(&["pair", text(&run), "--same", "--out", text(&pairs)]), &["holds both arms", "--arm green"]);
    let table = folder.file("both.csv");
    done(&["convert", text(&run), text(&table)]);
    refused(&ravenpose(&["pair", text(&table), "--same", "--arm", "gold", "--out", text(&pairs)]), &["is a table of both arms"]);
    // Its states keep both arms.
    refused(&ravenpose(&["convert", text(&run), text(&folder.file("one.bag")), "--arm", "gold"]), &["leave --arm out"]);
    let error_of = |run: &Path, arm: &str| {
        done(&["pair", text(run), "--same", "--arm", arm, "--out", text(&pairs)]);
        let table = csv::read(&pairs).expect("pairs");
        let column = |name: &str| table.column(name).expect("a column")[5];
        (column("x_m"), column("label_x_mm"))
    };
    let (gold, green) = (error_of(&run, "gold"), error_of(&run, "green"));
    assert!(gold != green, "{gold:?} {green:?}");
    for (arm, expected) in [("gold", gold), ("green", green)] {
        let with = folder.file("with.mcap");
        done(&["pair", text(&run), "--same", "--arm", arm, "--out", text(&with)]);
        assert_eq!(error_of(&with, arm), expected, "{arm}");
    }
    let one = folder.file("one");
    assert!(simulate(&one, &[]).status.success());
    let gold = one.join("run_0001.mcap");
    refused(&ravenpose(&["pair", text(&gold), "--same", "--arm", "green", "--out", text(&pairs)]), &["is of the gold arm"]);
}

#[test]
fn every_recording_beside_the_repository_is_described_and_converted() {
    let data = match std::env::var_os("RAVENPOSE_DATA") {
        Some(data) => data.into(),
        None => match common::shared("data") {
            Some(data) => data,
            None => return,
        },
    };
    let folder = Folder::new("shared");
    let mut files = Vec::new();
    let mut folders = vec![data];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).expect("folder") {
            let path = entry.expect("entry").path();
            let name = path.to_string_lossy().into_owned();
            if path.is_dir() {
                folders.push(path);
            } else if name.contains(".csv") {
                files.push(path);
            }
        }
    }
    assert!(files.len() > 60, "{} files", files.len());
    for file in files {
        done(&["info", text(&file)]);
        let out = folder.file("out.parquet");
        done(&["convert", text(&file), text(&out)]);
        std::fs::remove_file(&out).expect("written");
    }
}

#[test]
fn bad_input_gets_one_line_and_nothing_is_left() {
    let folder = Folder::new("bad");
    refused(&ravenpose(&["info", text(&folder.file("absent.mcap"))]), &["absent.mcap"]);
    let garbage = folder.write("garbage.mcap", [7_u8; 5000]);
    refused(&ravenpose(&["info", text(&garbage)]), &["garbage.mcap"]);
    let out = folder.file("out.mcap");
    refused(&ravenpose(&["convert", text(&garbage), text(&out)]), &["garbage.mcap"]);
    assert!(!out.exists());
    let table = folder.write("table.csv", "t_s,mpos_1_rad\n0,1\n0.001,2\n");
    refused(&ravenpose(&["convert", text(&table), text(&folder.file("out.xyz"))]), &["no format has this ending"]);
    refused(&ravenpose(&["convert", text(&table), text(&table)]), &["both input and output"]);
    refused(&simulate(&folder.file("runs"), &["--run-minutes", "0"]), &["--run-minutes 0"]);
    let runs = folder.file("runs");
    let many = ["simulate", "--minutes", "5e6", "--seed", "1", "--out", text(&runs), "--run-minutes"];
    for (run, said) in [("1e-4", "into 50000000000 runs"), ("5e6", "10000 minutes at most"), ("6e6", "from 0.0001 to 5000000")] {
        refused(&ravenpose(&[&many[..], &[run]].concat()), &["--run-minutes", said]);
    }
    refused(
        &ravenpose(&["simulate", "--minutes", "1", "--seed", "1", "--robot", "nowhere.toml", "--out", text(&folder.file("r"))]),
        &["nowhere.toml"],
    );
    let effect = "physics = \"cable_creep\"\njoint = 5\nparameters = { J_k = 1e-4, T_k = 10 }";
    let robot = folder.write("robot.toml", with_effect(effect));
    let runs = folder.file("creep");
    refused(
        &ravenpose(&["simulate", "--minutes", "0.01", "--seed", "1", "--robot", text(&robot), "--out", text(&runs)]),
        &["cable_creep on joint 5"],
    );
    assert_eq!(std::fs::read_dir(&runs).map_or(0, Iterator::count), 0);
}

#[test]
fn what_is_killed_leaves_nothing_half_written() {
    let folder = Folder::new("killed");
    let out = folder.file("runs");
    done(&["simulate", "--minutes", "0.5", "--seed", "3", "--out", text(&out)]);
    let names = || {
        let of = |entry: std::io::Result<std::fs::DirEntry>| entry.expect("entry").file_name().into_string().expect("UTF-8");
        let mut names: Vec<String> = std::fs::read_dir(&out).expect("folder").map(of).collect();
        names.sort();
        names
    };
    let before = names();
    let mut cut_short = 0;
    for ending in ["mcap", "bag", "parquet", "csv.gz", "rvs", "txt"] {
        let made = out.join(format!("made.{ending}"));
        for wait_ms in [20, 60, 150] {
            let mut convert = program();
            let convert =
                convert.args(["convert", text(&out.join("run_0001.mcap")), text(&made)]).stdout(std::process::Stdio::null());
            let mut convert = convert.spawn().expect("ravenpose runs");
            std::thread::sleep(std::time::Duration::from_millis(wait_ms));
            convert.kill().expect("killed");
            let _status = convert.wait().expect("status");
            if made.exists() {
                done(&["info", text(&made)]);
                std::fs::remove_file(&made).expect("made");
            } else {
                cut_short += 1;
            }
            // In the moment in which a file gets its name it has another one, and is whole.
            for hidden in names().into_iter().filter(|name| name.starts_with(".made.")) {
                std::fs::rename(out.join(hidden), &made).expect("renamed");
                done(&["info", text(&made)]);
                std::fs::remove_file(&made).expect("made");
            }
            assert_eq!(names(), before, "{ending}, killed after {wait_ms} ms");
        }
    }
    assert!(cut_short > 0, "every conversion was done before it was killed");
}

#[test]
fn where_nothing_can_be_written_is_said_before_the_work() {
    // None of the inputs is there: the output is looked at first.
    for command in [
        &["evaluate", "--model", "none.onnx", "--data", "none.mcap", "--out", "/proc/ravenpose"][..],
        &["gap", "--real", "none.csv", "--sim", "none.csv", "--robot", "none.urdf", "--out", "/proc/ravenpose"],
        &["convert", "none.mcap", "/proc/ravenpose.csv"],
        &["train", "--data", "none.mcap", "--out", "/proc/ravenpose.onnx"],
    ] {
        refused(&ravenpose(command), &["/proc/ravenpose", "cannot be written"]);
    }
}

#[test]
fn a_simulation_into_a_format_without_truth_says_so() {
    let folder = Folder::new("truthless");
    for (format, told) in [("rvs", true), ("txt", true), ("mcap", false)] {
        let output = simulate(&folder.file(format), &["--format", format]);
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(said.lines().any(|line| line.starts_with("note: ") && line.contains("truth")), told, "{format}: {said}");
    }
}

#[test]
fn a_second_simulation_does_not_overwrite_the_first() {
    let folder = Folder::new("twice");
    let out = folder.file("runs");
    assert!(simulate(&out, &[]).status.success());
    let before = std::fs::read(out.join("run_0001.mcap")).expect("run");
    refused(&simulate(&out, &["--arm", "green"]), &["is there already"]);
    assert_eq!(std::fs::read(out.join("run_0001.mcap")).expect("run"), before);
}

#[test]
fn commands_are_those_of_the_arm_that_the_recording_is_of_and_no_file_of_the_user_is_touched() {
    let folder = Folder::new("arm-of-commands");
    let out = folder.file("runs");
    assert!(simulate(&out, &["--arm", "green"]).status.success());
    let (run, table) = (out.join("run_0001.mcap"), folder.file("run.csv"));
    done(&["convert", text(&run), text(&table)]);
    let again = folder.file("again");
    for file in [&run, &table] {
        let commands = ["simulate", "--robot", "raven2-worn", "--commands", text(file), "--out", text(&again)];
        refused(&ravenpose(&commands), &["is of the green arm, not of the gold one", "--arm green"]);
        assert!(!again.exists());
    }
    // A table is made of states, through a file of its own.
    std::fs::create_dir(&again).expect("folder");
    let own = again.join("run_0001.states.mcap");
    std::fs::write(&own, "mine").expect("written");
    let green = ["--commands", text(&run), "--arm", "green", "--seed", "5", "--format", "csv"];
    done(&[&["simulate", "--robot", "raven2-worn", "--out", text(&again)], &green[..]].concat());
    assert_eq!(std::fs::read_to_string(&own).expect("still there"), "mine");
    assert_eq!(std::fs::read_dir(&again).expect("folder").count(), 3, "the run, the summary, the user's file");
    let summary = std::fs::read_to_string(again.join("simulation.txt")).expect("summary");
    assert!(summary.contains("arm = green") && summary.contains("seed = 5") && summary.contains("homing seed 5"), "{summary}");
    let metadata = csv::read(&again.join("run_0001.csv")).expect("run").metadata;
    assert_eq!(["seed", "homing_seed"].map(|key| metadata.get(key).map(String::as_str)), [Some("5"); 2]);
}
