//! `ravenposed`; everything is in the library.

fn main() -> std::process::ExitCode {
    ravenpose::service::main(std::env::args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned()))
}
