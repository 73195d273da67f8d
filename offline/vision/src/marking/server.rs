//! The page to click in, on this machine only.

use super::http::{self, Request};
use super::{Mark, Marker, Marking};
use crate::error::{Error, Result};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

const PAGE: &str = include_str!("page.html");

/// A page that waits for its browser.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    marking: Mutex<Marking>,
    finished: AtomicBool,
}

impl Server {
    /// Takes a port of 127.0.0.1; 0 is any free one.
    ///
    /// # Errors
    /// If the port is taken.
    pub fn bind(marking: Marking, port: u16) -> Result<Self> {
        let fault = |error: std::io::Error| {
            let what = format!("port {port} cannot be used: {error}");
            Error::content(Path::new("127.0.0.1"), format!("port {port}"), what, "give another --port")
        };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(fault)?;
        let address = listener.local_addr().map_err(fault)?;
        let shared = Arc::new(Shared { marking: Mutex::new(marking), finished: AtomicBool::new(false) });
        Ok(Self { listener, address, shared })
    }

    /// What to open in a browser.
    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Serves until somebody presses Finish; answers how many marks there are.
    pub fn run(self) -> usize {
        for stream in self.listener.incoming() {
            if self.shared.finished.load(Ordering::Relaxed) {
                break;
            }
            let Ok(stream) = stream else { continue };
            let (shared, address) = (Arc::clone(&self.shared), self.address);
            // Browsers open connections ahead and say nothing on them: each waits in a thread of its own.
            std::thread::spawn(move || {
                if let Some(request) = http::read(&stream) {
                    serve(&shared, address, &request, &stream);
                } else {
                    http::answer(&stream, "400 Bad Request", "text/plain", b"no request of HTTP/1.1");
                }
                if shared.finished.load(Ordering::Relaxed) {
                    // The listener waits for a connection: one more, and it sees that it is over.
                    drop(TcpStream::connect(address));
                }
            });
        }
        self.shared.marking.lock().unwrap_or_else(PoisonError::into_inner).count()
    }
}

fn serve(shared: &Shared, address: SocketAddr, request: &Request, stream: &TcpStream) {
    // Another site's page must not read or write here, by whatever name it calls this machine.
    let port = address.port();
    let ours = [format!("127.0.0.1:{port}"), format!("localhost:{port}")].contains(&request.host);
    let refused = !ours || (request.method == "POST" && !request.from_page);
    if refused {
        return http::answer(stream, "403 Forbidden", "text/plain", b"only the page itself may ask");
    }
    let mut marking = shared.marking.lock().unwrap_or_else(PoisonError::into_inner);
    match (request.method.as_str(), request.path.as_str()) {
        ("GET", "/") => http::answer(stream, "200 OK", "text/html; charset=utf-8", PAGE.as_bytes()),
        ("GET", "/marks.json") => http::answer(stream, "200 OK", "application/json", marking.json().as_bytes()),
        ("GET", path) if path.starts_with("/image/") => image(&marking, &path["/image/".len()..], stream),
        ("POST", "/finish") => {
            shared.finished.store(true, Ordering::Relaxed);
            http::answer(stream, "200 OK", "application/json", b"{}");
        }
        ("POST", path) => match changed(&mut marking, path, &request.body) {
            Ok(()) => http::answer(stream, "200 OK", "application/json", marking.json().as_bytes()),
            Err(line) => http::answer(stream, "422 Unprocessable Content", "text/plain; charset=utf-8", line.as_bytes()),
        },
        _ => http::answer(stream, "404 Not Found", "text/plain", b"nothing here"),
    }
}

fn image(marking: &Marking, camera: &str, stream: &TcpStream) {
    match marking.image(camera).map(|path| (path, std::fs::read(path))) {
        Some((path, Ok(bytes))) => {
            let png = path.extension().is_some_and(|ending| ending == "png");
            http::answer(stream, "200 OK", if png { "image/png" } else { "image/jpeg" }, &bytes);
        }
        _ => http::answer(stream, "404 Not Found", "text/plain", b"no image of this camera"),
    }
}

fn changed(marking: &mut Marking, path: &str, body: &[u8]) -> std::result::Result<(), String> {
    fn parsed<'a, T: serde::Deserialize<'a>>(body: &'a [u8]) -> std::result::Result<T, String> {
        serde_json::from_slice(body).map_err(|error| format!("not understood: {error}"))
    }
    match path {
        "/set" => marking.set(parsed::<Mark>(body)?),
        "/remove" => {
            let [camera, marker] = parsed::<[String; 2]>(body)?;
            marking.remove(&camera, &marker)
        }
        "/add" => marking.add(parsed::<Marker>(body)?),
        _ => Err(format!("{path}: nothing here")),
    }
}
