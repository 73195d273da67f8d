//! `ravenpose plot`: an overview of a run as one page.

use crate::output;
use crate::read::read;
use std::path::Path;
use std::process::ExitCode;

pub(crate) fn run(input: &Path, out: &Path) -> Result<ExitCode, String> {
    output::check_file(out, &[input])?;
    let (recording, status) = read(input)?;
    let options = plot::Options::default();
    let svg = out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("svg"));
    let page = if svg { plot::overview_svg(&recording, &options) } else { plot::overview(&recording, &options) };
    let page = page.map_err(|error| error.to_string())?;
    output::whole(out, |file| file.write_all(page.as_bytes()).map_err(|error| error.to_string()))?;
    say!("{}: {} kB", out.display(), page.len() / 1000);
    Ok(status)
}
