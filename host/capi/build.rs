//! Sets the name that programs look the shared library up by: that of its ABI.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=src/lib.rs");
    let constant = "pub const RAYWAKE_ABI_VERSION: u32 = ";
    let abi = include_str!("src/lib.rs").lines().find_map(|line| line.strip_prefix(constant));
    let abi = abi.expect("the version of the ABI").trim_end_matches(';');
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libraywake.so.{abi}");
    }
}
