//! Builds `allocations.c` as a library of its own, which the soak loads in front of the C library. `[build-dependencies]` beside `cc` are not used:
//! Cargo.toml says what they are for.

use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=allocations.c");
    let out = std::env::var_os("OUT_DIR").expect("cargo names it");
    let library = Path::new(&out).join("allocations.so");
    // It hides names of the GNU C library; with another there is nothing to count with, and the soak says so.
    let built = std::env::var("CARGO_CFG_TARGET_ENV").is_ok_and(|env| env == "gnu")
        && cc::Build::new()
            .get_compiler()
            .to_command()
            .args(["-O2", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror", "allocations.c", "-o"])
            .arg(&library)
            .status()
            .is_ok_and(|status| status.success());
    if !built {
        println!("cargo::warning=allocations.c could not be built: the soak counts no allocations");
        std::fs::write(&library, []).expect("a file in OUT_DIR");
    }
}
