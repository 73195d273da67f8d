//! State files as streams.

use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use ravenpose_wire::RavenState;

use super::{
    FNV_BASIS, HEADER_BYTES, PERIOD_NS, RECORD_BYTES, StateFileProblem, as_bytes, as_bytes_mut, check_header, check_record,
    fnv1a_on, header,
};
use crate::file::{Input, InputProblem, WholeFile, cannot_write, refusal};
use crate::stream::{Damage, Place, Record, Sink, Source, StreamError};

/// What a state or truth loses in this format.
pub const LOSSES: [&str; 3] = [
    "state files number the states anew from 1 and keep times relative to the first state",
    "state files hold no truth: poses, joints and cable forces of trackers, encoders or the simulator are dropped",
    "state files hold no metadata",
];

/// A state file being read, compressed or not.
pub struct Reader {
    path: PathBuf,
    input: Input,
    metadata: Vec<(String, String)>,
    period_ns: i64,
    said: u64,
    said_hash: u64,
    read: u64,
    hash: u64,
    done: bool,
    damage: Option<Damage>,
}

impl Reader {
    /// Opens a file and checks its header.
    ///
    /// # Errors
    /// [`StreamError`] if it cannot be opened or its header is not that of a state file with states.
    pub fn open(path: &Path) -> Result<Self, StreamError> {
        Self::new(path, Input::open(path).map_err(|problem| problem.refusal(path))?)
    }

    /// The same from memory; `name` stands for the file in messages.
    ///
    /// # Errors
    /// As [`Reader::open`].
    pub fn from_bytes(name: &Path, bytes: Vec<u8>) -> Result<Self, StreamError> {
        let input = Input::from_bytes(bytes).map_err(|error| InputProblem::Read(error).refusal(name))?;
        Self::new(name, input)
    }

    fn new(path: &Path, mut input: Input) -> Result<Self, StreamError> {
        let mut bytes = Vec::with_capacity(HEADER_BYTES);
        let read = input.by_ref().take(HEADER_BYTES as u64).read_to_end(&mut bytes);
        read.map_err(|error| InputProblem::Read(error).refusal(path))?;
        let (said, period_ns, said_hash) = match <&[u8; HEADER_BYTES]>::try_from(bytes.as_slice()) {
            Ok(header) => {
                check_header(header).and_then(|checked| if checked.0 == 0 { Err(StateFileProblem::Empty) } else { Ok(checked) })
            }
            Err(_) => Err(StateFileProblem::NoHeader { bytes: bytes.len() }),
        }
        .map_err(|problem| refused(path, &problem))?;
        Ok(Self {
            path: path.to_owned(),
            input,
            metadata: vec![("period_ns".to_owned(), period_ns.to_string())],
            period_ns,
            said,
            said_hash,
            read: 0,
            hash: FNV_BASIS,
            done: false,
            damage: None,
        })
    }

    /// Period at which to replay, ns.
    pub fn period_ns(&self) -> i64 {
        self.period_ns
    }

    fn record(&mut self) -> Result<Option<Box<RavenState>>, StreamError> {
        let mut state = Box::new(RavenState::new());
        let bytes = as_bytes_mut(std::slice::from_mut(&mut *state));
        match self.input.read_exact(bytes) {
            Ok(()) => self.hash = fnv1a_on(self.hash, bytes),
            Err(error) if error.kind() == ErrorKind::UnexpectedEof || self.input.compressed() => {
                let what = format!("the file ends after {} of {} states, so its checksum cannot be verified", self.read, self.said);
                return Ok(self.end_with(what));
            }
            Err(error) => {
                let place = Some(Place::Byte(self.place()));
                return Err(refusal(&self.path, place, format!("cannot be read on ({error})"), "check the disk"));
            }
        }
        if let Err(what) = check_record(self.read, &state) {
            return Ok(self.end_with(format!("state {} {what}", self.read)));
        }
        self.read += 1;
        Ok(Some(state))
    }

    /// Byte at which the next record begins.
    fn place(&self) -> u64 {
        HEADER_BYTES as u64 + self.read.saturating_mul(RECORD_BYTES as u64)
    }

    fn end_with(&mut self, what: String) -> Option<Box<RavenState>> {
        self.damage = Some(Damage { place: Place::Byte(self.place()), what });
        self.done = true;
        None
    }

    /// All records are read: is there more than the header says, and is the checksum right?
    fn check_end(&mut self) {
        self.done = true;
        let mut more = [0];
        let what = if self.input.read(&mut more).is_ok_and(|count| count > 0) {
            "more bytes follow than the header says".to_owned()
        } else if self.hash == self.said_hash {
            return;
        } else {
            format!(
                "the states have the checksum {:016x}, the header says {:016x}: one of them was changed",
                self.hash, self.said_hash
            )
        };
        self.damage = Some(Damage { place: Place::Byte(self.place()), what });
    }
}

impl Source for Reader {
    fn format(&self) -> &'static str {
        "state file"
    }

    fn metadata(&self) -> &[(String, String)] {
        &self.metadata
    }

    fn progress(&self) -> (u64, u64) {
        self.input.progress()
    }

    fn next(&mut self) -> Result<Option<Record>, StreamError> {
        if self.done {
            return Ok(None);
        }
        if self.read == self.said {
            self.check_end();
            return Ok(None);
        }
        Ok(self.record()?.map(Record::State))
    }

    fn damage(&self) -> Option<&Damage> {
        self.damage.as_ref()
    }
}

fn refused(path: &Path, problem: &StateFileProblem) -> StreamError {
    let text = problem.to_string();
    let (what, remedy) = text.split_once("; ").unwrap_or((&text, "write it again"));
    refusal(path, None, what, remedy)
}

/// Spacings that decide the period of a file being written.
const SPACINGS: usize = 1024;

/// A state file being written.
pub struct Writer {
    path: PathBuf,
    file: WholeFile,
    count: u64,
    hash: u64,
    period_ns: Option<i64>,
    first: Option<Times>,
    before_ns: i64,
    spacings_ns: Vec<i64>,
}

/// The two clocks of a state, ns.
#[derive(Clone, Copy)]
struct Times {
    source_ns: i64,
    stamp_ns: i64,
}

impl Writer {
    /// Begins a file. Without a period, the replay keeps that of the states (the median of the first thousand spacings).
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    pub fn create(path: &Path, period_ns: Option<i64>) -> Result<Self, StreamError> {
        let begun = WholeFile::create(path).and_then(|mut file| {
            file.write_all(&[0; HEADER_BYTES])?;
            Ok(file)
        });
        let file = begun.map_err(|error| cannot_write(path, &error))?;
        let (path, hash) = (path.to_owned(), FNV_BASIS);
        Ok(Self { path, file, count: 0, hash, period_ns, first: None, before_ns: 0, spacings_ns: Vec::new() })
    }

    fn put(&mut self, state: &RavenState, stamp_ns: i64) -> Result<(), StreamError> {
        let times = Times { source_ns: state.source_time_ns, stamp_ns };
        let first = *self.first.get_or_insert(times);
        let mut state = *state;
        // Where the source has no clock of its own, the stamps tell.
        state.source_time_ns = match times.source_ns.wrapping_sub(first.source_ns) {
            0 => times.stamp_ns - first.stamp_ns,
            since => since,
        };
        if self.count > 0 && self.spacings_ns.len() < SPACINGS {
            self.spacings_ns.push(state.source_time_ns.wrapping_sub(self.before_ns));
        }
        self.before_ns = state.source_time_ns;
        self.count += 1;
        state.seal(self.count);
        let bytes = as_bytes(std::slice::from_ref(&state));
        self.hash = fnv1a_on(self.hash, bytes);
        self.file.write_all(bytes).map_err(|error| cannot_write(&self.path, &error))
    }

    /// The median spacing, to the microsecond; RAVEN's period where the states tell none.
    fn period(&mut self) -> i64 {
        self.spacings_ns.retain(|spacing| *spacing > 0);
        self.spacings_ns.sort_unstable();
        let median = self.spacings_ns.get(self.spacings_ns.len() / 2).map(|median| (median + 500) / 1000 * 1000);
        median.filter(|median| *median > 0).unwrap_or(PERIOD_NS)
    }
}

impl Sink for Writer {
    fn write(&mut self, record: &Record) -> Result<(), StreamError> {
        match record {
            Record::State(state) => self.put(state, record.time_ns()),
            Record::Truth(_) => Ok(()),
        }
    }

    fn finish(mut self: Box<Self>) -> Result<(), StreamError> {
        if self.count == 0 {
            return Err(refused(&self.path, &StateFileProblem::Empty));
        }
        let period_ns = match self.period_ns {
            Some(period_ns) if period_ns > 0 => period_ns,
            _ => self.period(),
        };
        let Self { path, mut file, count, hash, .. } = *self;
        file.seek(SeekFrom::Start(0))
            .and_then(|_| file.write_all(&header(count, period_ns, hash)))
            .and_then(|()| file.finish())
            .map_err(|error| cannot_write(&path, &error))
    }
}
