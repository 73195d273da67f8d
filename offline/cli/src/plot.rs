//! `ravenpose plot`: an overview of a run as one page.

use crate::convert::{PARTLY, same_file};
use crate::output;
use recordings::Recording;
use recordings::open::{Opened, open};
use recordings::table::{self, TableSource};
use recordings::tidy::{self, StateTable};
use std::path::Path;
use std::process::ExitCode;

pub(crate) fn run(input: &Path, out: &Path) -> Result<ExitCode, String> {
    if same_file(input, out) {
        return Err(format!("{}: is both input and output; choose another output", out.display()));
    }
    let (recording, status) = read(input)?;
    let options = plot::Options::default();
    let svg = out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("svg"));
    let page = if svg { plot::overview_svg(&recording, &options) } else { plot::overview(&recording, &options) };
    let page = page.map_err(|error| error.to_string())?;
    output::whole(out, |file| file.write_all(page.as_bytes()).map_err(|error| error.to_string()))?;
    say!("{}: {} kB", out.display(), page.len() / 1000);
    Ok(status)
}

/// A recording of any format as a table in memory, and the status to end with: where a part of it is lost that is told, and it is 1.
pub(crate) fn read(input: &Path) -> Result<(Recording, ExitCode), String> {
    read_with(input, tidy::Options::default())
}

/// The same, with these columns of states.
pub(crate) fn read_with(input: &Path, options: tidy::Options) -> Result<(Recording, ExitCode), String> {
    let name = input.display().to_string();
    let mut source: Box<dyn TableSource> = match open(input).map_err(|error| error.to_string())? {
        Opened::Table(source) => source,
        Opened::States(source) => Box::new(StateTable::new(source, options).map_err(|error| error.to_string())?),
    };
    let recording = table::collect(&name, source.as_mut()).map_err(|error| error.to_string())?;
    let Some(damage) = source.damage() else { return Ok((recording, ExitCode::SUCCESS)) };
    complain!("ravenpose: {name}: {}: {}; what stands before it is used, the rest is lost", damage.place, damage.what);
    Ok((recording, ExitCode::from(PARTLY)))
}
