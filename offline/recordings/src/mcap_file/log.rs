//! Writing an MCAP file while a robot runs: whatever happens to the process, all but the last half second is on record.

use std::ffi::OsString;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::writer::{Body, Trouble};
use crate::ros::MessageType;
use crate::stream::{Record, Sink, StreamError};

/// A chunk is closed when it is this old.
const CHUNK_AGE_MAX: Duration = Duration::from_millis(500);

/// A log. It is written as `NAME.part` and becomes `NAME` with [`Sink::finish`]; dropped before, it stays as `NAME.part`,
/// complete. See [`super`] for what a kill leaves.
pub struct McapLog {
    path: PathBuf,
    part: PathBuf,
    body: Body,
    /// When the first message came that is not yet written.
    since: Option<Instant>,
}

/// A channel of a log beside those of [`crate::ros`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LogChannel(u16);

impl McapLog {
    /// Begins a log.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses, or `NAME.part` is there already: what is left of an earlier run is not
    /// overwritten.
    pub fn create(path: &Path, metadata: &[(String, String)]) -> Result<Self, StreamError> {
        let part = part_of(path);
        let file = File::options().write(true).create_new(true).open(&part).map_err(|error| occupied(&part, error))?;
        let mut body = Body::new(file, metadata).map_err(|trouble| trouble.of(&part))?;
        body.flush().map_err(|trouble| trouble.of(&part))?;
        Ok(Self { path: path.to_owned(), part, body, since: None })
    }

    /// Where it stands until it is complete.
    pub fn part(&self) -> &Path {
        &self.part
    }

    /// Appends a record under a log time of its own, ns since 1970: one clock for all that a logger hears, whatever clock the
    /// record's own stamp is from.
    ///
    /// # Errors
    /// [`StreamError`] as [`Sink::write`].
    pub fn write_at(&mut self, record: &Record, time_ns: u64) -> Result<(), StreamError> {
        let written = self.body.write_at(record, Some(time_ns));
        written.and_then(|()| self.written(Instant::now())).map_err(|trouble| self.failed(&trouble))
    }

    /// Adds a channel with ROS 1 messages of any type.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    pub fn add_channel(&mut self, topic: &str, message: &MessageType) -> Result<LogChannel, StreamError> {
        self.body.add_channel(topic, message).map(LogChannel).map_err(|trouble| self.failed(&trouble))
    }

    /// Appends a message to such a channel; its time is in ns since 1970.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    pub fn write_message(&mut self, channel: LogChannel, time_ns: u64, sequence: u32, bytes: &[u8]) -> Result<(), StreamError> {
        let written = self.body.write_message(channel.0, time_ns, sequence, bytes);
        written.and_then(|()| self.written(Instant::now())).map_err(|trouble| self.failed(&trouble))
    }

    /// Writes what has waited for half a second. [`Sink::write`] does so itself; to be called now and then while nothing is
    /// written, at least every quarter second.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    pub fn tick(&mut self) -> Result<(), StreamError> {
        self.flush_if_due(Instant::now()).map_err(|trouble| self.failed(&trouble))
    }

    /// Writes all that was appended.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    pub fn flush(&mut self) -> Result<(), StreamError> {
        self.since = None;
        self.body.flush().map_err(|trouble| self.failed(&trouble))
    }

    fn written(&mut self, now: Instant) -> Result<(), Trouble> {
        let _ = self.since.get_or_insert(now);
        self.flush_if_due(now)
    }

    fn flush_if_due(&mut self, now: Instant) -> Result<(), Trouble> {
        if self.since.is_some_and(|since| now.saturating_duration_since(since) >= CHUNK_AGE_MAX) {
            self.since = None;
            self.body.flush()?;
        }
        Ok(())
    }

    fn append(&mut self, record: &Record, now: Instant) -> Result<(), Trouble> {
        self.body.write(record)?;
        self.written(now)
    }

    fn failed(&self, trouble: &Trouble) -> StreamError {
        trouble.of(&self.part)
    }
}

impl Sink for McapLog {
    fn write(&mut self, record: &Record) -> Result<(), StreamError> {
        self.append(record, Instant::now()).map_err(|trouble| self.failed(&trouble))
    }

    fn finish(self: Box<Self>) -> Result<(), StreamError> {
        let Self { path, part, body, .. } = *self;
        let finished = body.finish().and_then(|file| Ok(file.sync_all()?));
        let renamed = finished.and_then(|()| Ok(std::fs::rename(&part, &path)?));
        renamed.and_then(|()| Ok(sync_folder(&path)?)).map_err(|trouble| trouble.of(&part))
    }
}

/// `RUN.mcap.part`
fn part_of(path: &Path) -> PathBuf {
    let mut name = OsString::from(path.file_name().unwrap_or_default());
    name.push(".part");
    path.with_file_name(name)
}

fn occupied(part: &Path, error: std::io::Error) -> StreamError {
    if error.kind() != std::io::ErrorKind::AlreadyExists {
        return Trouble::from(error).of(part);
    }
    StreamError {
        file: part.to_owned(),
        place: None,
        what: "is there already, from a run that did not end".to_owned(),
        remedy: "give it another name to keep it, or remove it".to_owned(),
    }
}

/// A rename reaches the disk with the folder.
fn sync_folder(path: &Path) -> std::io::Result<()> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => File::open(folder)?.sync_all(),
        _ => File::open(".")?.sync_all(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mcap_file::McapSource;
    use crate::stream::Source;
    use ravenpose_wire::RavenState;

    fn states_in(path: &Path) -> usize {
        let mut source = McapSource::open(path).expect("a log");
        std::iter::from_fn(|| source.next().expect("readable")).count()
    }

    #[test]
    fn a_chunk_is_written_when_it_is_half_a_second_old() {
        let folder = std::env::temp_dir().join(format!("ravenpose-log-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("folder");
        let mut log = McapLog::create(&folder.join("run.mcap"), &[]).expect("log");
        let (begin, part) = (Instant::now(), log.part().to_owned());
        let record = Record::State(Box::new(RavenState::new()));
        for millisecond in 0..=500_u64 {
            assert_eq!(states_in(&part), 0);
            log.append(&record, begin + Duration::from_millis(millisecond)).expect("written");
        }
        assert_eq!(states_in(&part), 501);
        log.append(&record, begin + Duration::from_millis(501)).expect("written");
        log.flush_if_due(begin + Duration::from_secs(1)).expect("not due");
        assert_eq!(states_in(&part), 501);
        log.flush_if_due(begin + Duration::from_millis(1001)).expect("due");
        assert_eq!(states_in(&part), 502);
        drop(log);
        std::fs::remove_dir_all(&folder).expect("removed");
    }
}
