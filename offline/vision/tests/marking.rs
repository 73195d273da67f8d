//! Marking by hand, as the page does it: requests to 127.0.0.1.

mod common;

use common::{Folder, data};
use std::io::{Read, Write as _};
use std::net::TcpStream;
use vision::marking::server::Server;
use vision::marking::{Mark, Marker, Marking, Write};

fn scene(name: &str) -> Option<Folder> {
    Some(Folder::of_scene(name, &data("vision-rendered")?.join("easy"), 1))
}

/// Status and body of a request.
fn ask(port: u16, head: &str, body: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("a server");
    let text = format!("{head}\r\nContent-Length: {}\r\n\r\n{body}", body.len());
    stream.write_all(text.as_bytes()).expect("sent");
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).expect("an answer");
    let answer = String::from_utf8_lossy(&answer).into_owned();
    let status = answer.split(' ').nth(1).and_then(|word| word.parse().ok()).expect("a status");
    (status, answer.split_once("\r\n\r\n").map(|(_, body)| body.to_owned()).unwrap_or_default())
}

fn get(port: u16, path: &str) -> (u16, String) {
    ask(port, &format!("GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}"), "")
}

fn post(port: u16, path: &str, body: &str) -> (u16, String) {
    ask(port, &format!("POST {path} HTTP/1.1\r\nHost: localhost:{port}\r\nX-Ravenpose: mark"), body)
}

const WRITE: Write = |path, text| std::fs::write(path, text).map_err(|error| vision::Error::write(path)(error).to_string());

/// A running page and its port.
fn served(folder: &Folder) -> (std::thread::JoinHandle<usize>, u16) {
    let server = Server::bind(Marking::open(&folder.0, None, WRITE).expect("a rig"), 0).expect("a port");
    let port = server.url().trim_end_matches('/').rsplit(':').next().and_then(|port| port.parse().ok()).expect("a port");
    (std::thread::spawn(move || server.run()), port)
}

#[test]
fn a_click_is_written_at_once_and_calibration_reads_it() {
    let Some(own) = scene("mark") else { return };
    let (running, port) = served(&own);
    let (status, page) = get(port, "/");
    assert!(status == 200 && page.contains("<canvas"), "{status}");
    assert_eq!(get(port, "/image/cam2").0, 200);
    let (_, before) = get(port, "/marks.json");
    assert_eq!(
        before.matches("\"pixel\"").count(),
        std::fs::read_to_string(own.0.join("markers.csv")).expect("marks").lines().count() - 1
    );
    let (status, after) = post(port, "/set", r#"{"camera":"cam0","marker":"m00","pixel":[653.25,89.5]}"#);
    assert!(status == 200 && after.contains("[653.25,89.5]"), "{after}");
    let text = std::fs::read_to_string(own.0.join("markers.csv")).expect("marks");
    assert!(text.contains("\nm00,127.08,-127.03,279.3,cam0,653.25,89.50\n"), "{text}");
    assert_eq!(post(port, "/remove", r#"["cam0","m00"]"#).0, 200);
    assert!(!std::fs::read_to_string(own.0.join("markers.csv")).expect("marks").contains("m00,127.08,-127.03,279.3,cam0"));
    assert_eq!(post(port, "/add", r#"{"name":"new","place_mm":[1.5,2,3]}"#).0, 200);
    assert_eq!(post(port, "/set", r#"{"camera":"cam1","marker":"new","pixel":[10,20]}"#).0, 200);
    assert!(std::fs::read_to_string(own.0.join("markers.csv")).expect("marks").contains("\nnew,1.5,2,3,cam1,10.00,20.00\n"));
    assert_eq!(post(port, "/remove", r#"["cam1","new"]"#).0, 200);
    assert_eq!(post(port, "/finish", "{}").0, 200);
    let count = running.join().expect("an end");
    assert_eq!(count + 1, before.matches("\"pixel\"").count());
    assert!(Marking::open(&own.0, None, WRITE).expect("again").json().contains("\"new\""), "an unmarked marker stays known");
    vision::commands::calibrate(&own.0, vision::track::Mode::Default).expect("cameras");
}

#[test]
fn what_makes_no_sense_is_refused_and_changes_nothing() {
    let Some(own) = scene("nonsense") else { return };
    let text = || std::fs::read_to_string(own.0.join("markers.csv")).expect("marks");
    let before = text();
    let (running, port) = served(&own);
    for (path, body, word) in [
        ("/set", r#"{"camera":"cam9","marker":"m00","pixel":[1,1]}"#, "cam9"),
        ("/set", r#"{"camera":"cam0","marker":"nobody","pixel":[1,1]}"#, "nobody"),
        ("/set", r#"{"camera":"cam0","marker":"m00","pixel":[-5,1]}"#, "outside"),
        ("/set", r#"{"camera":"cam0"}"#, "not understood"),
        ("/add", r#"{"name":"a,b","place_mm":[1,2,3]}"#, "letters"),
        ("/add", r#"{"name":"far","place_mm":[1,2,1e300]}"#, "three numbers"),
        ("/other", "{}", "nothing here"),
    ] {
        let (status, line) = post(port, path, body);
        assert!(status == 422 && line.contains(word) && !line.contains('\n'), "{status} {line}");
    }
    assert_eq!(get(port, "/image/../rig.toml").0, 404);
    assert_eq!(get(port, "/nothing").0, 404);
    // Pages of other sites: a foreign name for this machine, or a plain form.
    let foreign = format!("POST /remove HTTP/1.1\r\nHost: example.org:{port}\r\nX-Ravenpose: mark");
    assert_eq!(ask(port, &foreign, r#"["cam0","m00"]"#).0, 403);
    let plain = format!("POST /remove HTTP/1.1\r\nHost: 127.0.0.1:{port}");
    assert_eq!(ask(port, &plain, r#"["cam0","m00"]"#).0, 403);
    assert_eq!(ask(port, "nonsense", "").0, 400);
    // A connection that says nothing keeps nobody waiting.
    let silent = TcpStream::connect(("127.0.0.1", port)).expect("a server");
    assert_eq!(get(port, "/marks.json").0, 200);
    drop(silent);
    assert_eq!(post(port, "/finish", "{}").0, 200);
    running.join().expect("an end");
    assert_eq!(text(), before);
}

#[test]
fn a_rig_without_images_or_with_a_foreign_table_is_refused_in_one_line() {
    let Some(own) = scene("foreign") else { return };
    let line = |result: Result<Marking, vision::Error>, word: &str| {
        let text = result.expect_err("refused").to_string();
        assert!(text.contains(word) && !text.contains('\n'), "{text}");
    };
    let empty = Folder::new("no-images");
    line(Marking::open(&own.0, Some(&empty.0), WRITE), "cam0");
    own.edit("markers.csv", |text| text.replace("marker,x_mm", "object,x_mm"));
    line(Marking::open(&own.0, None, WRITE), "markers.csv");
}

#[test]
fn a_file_that_cannot_be_written_leaves_the_marks_as_they_were() {
    let Some(own) = scene("unwritable") else { return };
    let mut marking = Marking::open(&own.0, None, WRITE).expect("a rig");
    let before = marking.json();
    std::fs::remove_file(own.0.join("markers.csv")).expect("file");
    std::fs::create_dir_all(own.0.join("markers.csv/in-the-way")).expect("folder");
    let line = marking.set(Mark { camera: "cam0".into(), marker: "m00".into(), pixel: [1.0, 2.0] }).expect_err("refused");
    assert!(line.contains("markers.csv") && !line.contains('\n'), "{line}");
    assert!(marking.add(Marker { name: "new".into(), place_mm: [0.0; 3] }).is_err());
    assert_eq!(marking.json(), before);
}
