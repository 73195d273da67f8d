//! What systemd is told (sd_notify(3)), without ever waiting for it: the thread that tells it also watches the loop.

use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::Duration;

/// The service takes states.
pub const READY: &str = "READY=1\nSTATUS=running\n";
/// The loop moves.
pub const WATCHDOG: &str = "WATCHDOG=1\n";
/// The service ends by itself.
pub const STOPPING: &str = "STOPPING=1\n";

/// How long a message may wait while the manager takes none: what comes once has to arrive, a watchdog's comes again.
const ONCE: Duration = Duration::from_secs(1);
const AGAIN: Duration = Duration::from_millis(1);

/// Tells systemd; without it this does nothing, and a failure must not end the service.
pub fn notify(message: &str) {
    if let Some(path) = std::env::var_os("NOTIFY_SOCKET") {
        let _ = send(path.as_bytes(), message, if message == WATCHDOG { AGAIN } else { ONCE });
    }
}

fn send(path: &[u8], message: &str, patience: Duration) -> io::Result<usize> {
    let address = match path.strip_prefix(b"@") {
        Some(name) => SocketAddr::from_abstract_name(name)?,
        None => SocketAddr::from_pathname(std::ffi::OsStr::from_bytes(path))?,
    };
    let socket = UnixDatagram::unbound()?;
    socket.set_write_timeout(Some(patience))?;
    socket.send_to_addr(message.as_bytes(), &address)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_arrive_at_a_path_and_at_an_abstract_name() {
        let name = format!("ravenpose-notify-{}", std::process::id());
        let path = std::env::temp_dir().join(&name);
        let at_path = UnixDatagram::bind(&path).expect("a socket");
        let at_name = UnixDatagram::bind_addr(&SocketAddr::from_abstract_name(&name).expect("a name")).expect("a socket");
        for (socket, address) in [(at_path, path.as_os_str().as_bytes().to_vec()), (at_name, format!("@{name}").into_bytes())] {
            send(&address, READY, ONCE).expect("sent");
            let mut bytes = [0; 64];
            let size = socket.recv(&mut bytes).expect("received");
            assert_eq!(&bytes[..size], READY.as_bytes());
        }
        std::fs::remove_file(path).expect("removed");
    }

    #[test]
    fn a_manager_that_takes_nothing_holds_up_nobody() {
        let name = format!("ravenpose-notify-deaf-{}", std::process::id());
        let _deaf = UnixDatagram::bind_addr(&SocketAddr::from_abstract_name(&name).expect("a name")).expect("a socket");
        let address = format!("@{name}");
        // More than any queue holds. One that waited without end would never come back.
        let lost = (0..2000).filter(|_| send(address.as_bytes(), WATCHDOG, AGAIN).is_err()).count();
        assert!(lost > 1000, "{lost} of 2000 found no room");
    }
}
