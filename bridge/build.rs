//! Gives the shared library its soname: programs linked against one ABI version never load another.

fn main() {
    println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libravenpose_bridge.so.1");
    println!("cargo:rerun-if-changed=build.rs");
}
