//! Only here so that `[build-dependencies]` count: Cargo.toml says what for.
fn main() {}
