//! A recording of any format as a table in memory, and what of it was lost.

use recordings::Recording;
use recordings::stream::Damage;
use recordings::table::{self, TableSource};
use recordings::tidy;
use std::path::Path;
use std::process::ExitCode;

/// A part of the input is lost; what there is was done.
pub(crate) const PARTLY: u8 = 1;

/// The table, and the status to end with: where a part of it is lost that is told, and it is 1.
pub(crate) fn read(input: &Path) -> Result<(Recording, ExitCode), String> {
    read_with(input, tidy::Options::default())
}

/// The same, with these columns of states.
pub(crate) fn read_with(input: &Path, options: tidy::Options) -> Result<(Recording, ExitCode), String> {
    all_of(input, tidy::open(input, options).map_err(|error| error.to_string())?)
}

/// The same, of a table that is open.
pub(crate) fn all_of(input: &Path, mut source: Box<dyn TableSource>) -> Result<(Recording, ExitCode), String> {
    let recording = table::collect(&input.display().to_string(), source.as_mut()).map_err(|error| error.to_string())?;
    let status = told(input, source.as_ref(), "used");
    Ok((recording, status))
}

/// After the end of a table: says what is to be known of it; 1 where a part of it is lost.
pub(crate) fn told(input: &Path, source: &dyn TableSource, what_was_done: &str) -> ExitCode {
    for finding in source.findings() {
        say!("note: {}: {finding}", input.display());
    }
    let mut status = ExitCode::SUCCESS;
    if source.cells_lost() > 0 {
        complain!(
            "ravenpose: {}: {} cells are no numbers; the rest is {what_was_done}, they are missing",
            input.display(),
            source.cells_lost()
        );
        status = ExitCode::from(PARTLY);
    }
    if let Some(damage) = source.damage() {
        status = told_of(input, damage, what_was_done);
    }
    status
}

/// Says where a recording is damaged; 1.
pub(crate) fn told_of(input: &Path, damage: &Damage, what_was_done: &str) -> ExitCode {
    complain!(
        "ravenpose: {}: {}: {}; what stands before it is {what_was_done}, the rest is lost",
        input.display(),
        damage.place,
        damage.what
    );
    ExitCode::from(PARTLY)
}
