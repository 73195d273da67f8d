//! `ravenpose plot`: an overview of a run as one page.

use crate::output;
use crate::read::read;
use std::path::Path;
use std::process::ExitCode;

pub(crate) fn run(input: &Path, out: &Path) -> Result<ExitCode, String> {
    output::check_file(out, &[input])?;
    let ending = out.extension().map(std::ffi::OsStr::to_ascii_lowercase);
    let svg = match ending.as_deref().and_then(|ending| ending.to_str()) {
        Some("svg") => true,
        Some("html" | "htm") => false,
        _ => return Err(format!("{}: a page or its figures can be drawn; name the output .html or .svg", out.display())),
    };
    let (recording, status) = read(input)?;
    let options = plot::Options::default();
    let page = if svg { plot::overview_svg(&recording, &options) } else { plot::overview(&recording, &options) };
    let page = page.map_err(|error| error.to_string())?;
    output::all(out, page.as_bytes())?;
    say!("{}: {} kB", out.display(), page.len() / 1000);
    Ok(status)
}
