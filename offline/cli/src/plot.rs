//! `ravenpose plot`: an overview of a run as one page.

use crate::convert::same_file;
use crate::output;
use recordings::Recording;
use recordings::open::{Opened, open};
use recordings::table;
use recordings::tidy::{self, StateTable};
use std::path::Path;
use std::process::ExitCode;

pub(crate) fn run(input: &Path, out: &Path) -> Result<ExitCode, String> {
    if same_file(input, out) {
        return Err(format!("{}: is both input and output; choose another output", out.display()));
    }
    let recording = read(input)?;
    let options = plot::Options::default();
    let svg = out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("svg"));
    let page = if svg { plot::overview_svg(&recording, &options) } else { plot::overview(&recording, &options) };
    let page = page.map_err(|error| error.to_string())?;
    output::whole(out, |file| file.write_all(page.as_bytes()).map_err(|error| error.to_string()))?;
    say!("{}: {} kB", out.display(), page.len() / 1000);
    Ok(ExitCode::SUCCESS)
}

/// A recording of any format as a table in memory.
pub(crate) fn read(input: &Path) -> Result<Recording, String> {
    read_with(input, tidy::Options::default())
}

/// The same, with these columns of states.
pub(crate) fn read_with(input: &Path, options: tidy::Options) -> Result<Recording, String> {
    let name = input.display().to_string();
    let recording = match open(input).map_err(|error| error.to_string())? {
        Opened::Table(mut source) => table::collect(&name, source.as_mut()),
        Opened::States(source) => StateTable::new(source, options).and_then(|mut source| table::collect(&name, &mut source)),
    };
    recording.map_err(|error| error.to_string())
}
