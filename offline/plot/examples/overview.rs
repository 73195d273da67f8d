//! `cargo run --release -p ravenpose-plot --example overview RUN.csv OUT.html [OUT.svg]`: the page of any table.

use recordings::open::open_table;
use recordings::table;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, page, rest @ ..] = arguments.as_slice() else { return Err("usage: overview RUN.csv OUT.html [OUT.svg]".into()) };
    let recording = table::collect(input, open_table(Path::new(input))?.as_mut())?;
    std::fs::write(page, plot::overview(&recording, &plot::Options::default())?)?;
    if let Some(svg) = rest.first() {
        std::fs::write(svg, plot::overview_svg(&recording, &plot::Options::default())?)?;
    }
    Ok(())
}
