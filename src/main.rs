//! `ravenposed`; everything is in the library.

fn main() -> std::process::ExitCode {
    ravenpose::service::main(std::env::args().skip(1))
}
