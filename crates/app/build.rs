//! How the binary is linked.

use std::env;

/// Folds functions with identical code, which saves half a megabyte. The linker of Rust's toolchain for this target can
/// do this; linkers of other targets may not.
#[expect(clippy::disallowed_methods, reason = "the environment is how Cargo says what is built")]
fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let target = env::var("TARGET");
    if target.is_ok_and(|target| target == "x86_64-unknown-linux-gnu") {
        println!("cargo::rustc-link-arg-bins=-Wl,--icf=all");
    }
}
