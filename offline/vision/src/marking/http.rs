//! As much of HTTP/1.1 (RFC 9112) as one page on the same machine needs: a request, an answer, and the connection is closed.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// Longest line of a head, lines of a head, and body, bytes.
const LINE: u64 = 8192;
const LINES: usize = 100;
const BODY: usize = 65_536;
/// A browser that says nothing for so long is let go.
const PATIENCE: Duration = Duration::from_secs(10);

/// A request.
#[derive(Debug, Default)]
pub(super) struct Request {
    pub(super) method: String,
    pub(super) path: String,
    pub(super) host: String,
    /// Does it carry the header that only this project's page sends?
    pub(super) from_page: bool,
    pub(super) body: Vec<u8>,
}

/// Reads a request; `None` if it is none.
pub(super) fn read(stream: &TcpStream) -> Option<Request> {
    stream.set_read_timeout(Some(PATIENCE)).ok()?;
    stream.set_write_timeout(Some(PATIENCE)).ok()?;
    let mut reader = BufReader::new(stream);
    let first = line(&mut reader)?;
    let mut words = first.split(' ');
    let mut request = Request { method: words.next()?.to_owned(), path: words.next()?.to_owned(), ..Request::default() };
    if !words.next()?.starts_with("HTTP/1.") {
        return None;
    }
    let mut length = 0;
    for _ in 0..LINES {
        let own = line(&mut reader)?;
        if own.is_empty() {
            request.body = vec![0; length];
            reader.read_exact(&mut request.body).ok()?;
            return Some(request);
        }
        let (name, value) = own.split_once(':')?;
        match name.to_ascii_lowercase().as_str() {
            "host" => value.trim().clone_into(&mut request.host),
            "x-ravenpose" => request.from_page = value.trim() == "mark",
            "content-length" => length = value.trim().parse().ok().filter(|length| *length <= BODY)?,
            _ => {}
        }
    }
    None
}

fn line(reader: &mut BufReader<&TcpStream>) -> Option<String> {
    let mut text = Vec::new();
    reader.take(LINE).read_until(b'\n', &mut text).ok()?;
    let text = text.strip_suffix(b"\n")?;
    String::from_utf8(text.strip_suffix(b"\r").unwrap_or(text).to_vec()).ok()
}

/// Answers; what goes wrong then is the browser's affair.
pub(super) fn answer(mut stream: &TcpStream, status: &str, kind: &str, body: &[u8]) {
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nCache-Control: no-store\r\n\
         X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n",
        body.len()
    );
    drop(stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(body)));
}
