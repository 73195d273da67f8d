//! Output files appear whole or not at all; what is said goes where somebody still listens.

use outputs::Whole;
use std::fmt::Arguments;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::Path;

/// Writes through `write` into a file that is there when it is complete; on any failure, and when a signal ends the program, nothing is left.
pub(crate) fn whole(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<(), String>) -> Result<(), String> {
    let failed = |cause: std::io::Error| unwritten(path, &cause);
    let (whole, file) = Whole::create(path).map_err(failed)?;
    let mut buffered = BufWriter::new(file);
    write(&mut buffered)?;
    buffered.flush().and_then(|()| whole.commit()).map_err(failed)
}

/// Writes bytes so.
pub(crate) fn all(path: &Path, bytes: &[u8]) -> Result<(), String> {
    whole(path, |file| file.write_all(bytes).map_err(|cause| unwritten(path, &cause)))
}

fn unwritten(path: &Path, cause: &std::io::Error) -> String {
    let remedy =
        if cause.kind() == ErrorKind::StorageFull { "make room on that disk" } else { "check the folder and its permissions" };
    format!("{}: cannot be written: {cause}; {remedy}", path.display())
}

/// Does an output replace none of the inputs?
pub(crate) fn check_no_input(out: &Path, inputs: &[&Path]) -> Result<(), String> {
    let same = |input: &&Path| matches!((input.canonicalize(), out.canonicalize()), (Ok(a), Ok(b)) if a == b);
    if inputs.iter().any(same) {
        return Err(format!("{}: is both input and output; choose another output", out.display()));
    }
    Ok(())
}

/// Is there a folder for a file, and does it replace none of the inputs and nothing else than a file? Asked before the work whose result it is for.
pub(crate) fn check_file(out: &Path, inputs: &[&Path]) -> Result<(), String> {
    check_no_input(out, inputs)?;
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
        return Err(format!("{}: there is no folder {}; make it first", out.display(), folder.display()));
    }
    match out.metadata() {
        Ok(there) if there.is_dir() => Err(format!("{}: is a folder; give the name of a file", out.display())),
        Ok(there) if !there.is_file() => {
            Err(format!("{}: is no file, and would be replaced by one; choose another output", out.display()))
        }
        _ => check_writable(out, folder.unwrap_or(Path::new("."))),
    }
}

/// Can a folder be made there, or is it one? Asked before the work whose results it is for; `option` gives it.
pub(crate) fn check_folder(out: &Path, option: &str) -> Result<(), String> {
    match out.ancestors().find(|path| path.exists()) {
        Some(file) if !file.is_dir() => Err(format!("{}: is a file; give a folder with {option}", file.display())),
        Some(folder) => check_writable(out, folder),
        // A name without a folder, not there yet.
        None => check_writable(out, Path::new(".")),
    }
}

/// Makes a folder, with those that it is in; one that is there stays.
pub(crate) fn make_folder(path: &Path) -> Result<(), String> {
    let failed = |cause| format!("{}: cannot be made: {cause}; check the folder that it is in and its permissions", path.display());
    std::fs::create_dir_all(path).map_err(failed)
}

/// Can there be another file in a folder?
fn check_writable(out: &Path, folder: &Path) -> Result<(), String> {
    outputs::try_in(folder).map_err(|cause| unwritten(out, &cause))
}

/// Says a line on standard output; see [`say`].
macro_rules! say {
    ($($told:tt)*) => {{
        let _ = $crate::output::say(format_args!("{}\n", format_args!($($told)*)));
    }};
}

/// Says a line on standard error; see [`complain`].
macro_rules! complain {
    ($($told:tt)*) => {
        $crate::output::complain(format_args!("{}\n", format_args!($($told)*)));
    };
}

/// Writes to standard output; false where nobody reads any more. A reader that has had enough (`| head`) is no error: the
/// command does its work and ends with its usual status. Output that cannot be written for another reason (a full disk) is.
pub(crate) fn say(told: Arguments) -> bool {
    let mut out = std::io::stdout().lock();
    match out.write_fmt(told).and_then(|()| out.flush()) {
        Ok(()) => true,
        Err(error) if error.kind() == ErrorKind::BrokenPipe => false,
        Err(error) => {
            complain!("ravenpose: standard output cannot be written: {error}");
            std::process::exit(2);
        }
    }
}

/// Writes to standard error; where that is gone there is nobody left to tell.
pub(crate) fn complain(told: Arguments) {
    let _ = std::io::stderr().lock().write_fmt(told);
}
