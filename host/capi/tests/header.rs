//! `raywake.h` matches the code.

use std::path::Path;

use cbindgen::{Builder, Config};

#[test]
fn the_header_matches_the_code() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = Config::from_file(here.join("cbindgen.toml")).unwrap();
    let sources = ["src/lib.rs", "../embed/src/records.rs"].map(|file| here.join(file));
    let [own, records] = sources;
    let builder = Builder::new().with_config(config).with_src(own).with_src(records);
    let mut text = Vec::new();
    builder.generate().unwrap().write(&mut text);
    let path = here.join("include/raywake.h");
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let found = std::fs::read(&path).unwrap_or_default();
    assert!(found == text, "raywake.h is out of date; UPDATE=1 rewrites it");
}
