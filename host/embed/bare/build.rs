//! Links the program to its place in the memory of QEMU's `virt` board.

fn main() {
    println!("cargo:rerun-if-changed=virt.ld");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let here = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
        println!("cargo:rustc-link-arg-bins=-T{here}/virt.ld");
    }
}
