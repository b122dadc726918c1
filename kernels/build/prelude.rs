//! What is prepended to a kernel: constants, records and bindings as `raywake-core` declares them.

use raywake_core::record::SweepUniform;
use raywake_core::stages::{Argument, Buffer, CONSTANTS, View};
use std::fmt::Write;

/// Constants and the uniform record, prepended to every kernel.
pub fn prelude() -> String {
    let mut text = String::new();
    for (name, value, signed) in CONSTANTS {
        let (kind, suffix) = if *signed { (": i32", "") } else { ("", "u") };
        let _ = writeln!(text, "const {name}{kind} = {value}{suffix};");
    }
    let fields: String = SweepUniform::FIELDS.iter().map(|f| format!("{f}: i32, ")).collect();
    let _ = writeln!(text, "struct SweepUniform {{ {fields}}}");
    text
}

/// Bindings of a file, numbered: those of one entry point first, then what others in the file bind.
/// Arrays are wrapped in structs: the validation layer would not see a bare array.
pub fn bindings(arguments: &[Argument]) -> String {
    let mut text = String::new();
    for (n, a) in arguments.iter().enumerate() {
        let (name, access) = (a.name, if a.writes { "read_write" } else { "read" });
        let _ = write!(text, "@group(0) @binding({n}) ");
        let _ = if a.buffer == Buffer::sweep {
            writeln!(text, "var<uniform> {name}: {};", a.buffer.row().wgsl)
        } else {
            let kind = format!("Buffer_{name}");
            writeln!(
                text,
                "var<storage, {access}> {name}: {kind};\nstruct {kind} {{ d: array<{}> }}",
                element(a)
            )
        };
    }
    text
}

/// Type of an element as the kernel sees it.
fn element(a: &Argument) -> String {
    let own = a.buffer.row().wgsl;
    let scalar = own.trim_start_matches(|c: char| c != '<').trim_matches(['<', '>']);
    let scalar = if scalar.is_empty() { own } else { scalar };
    match a.view {
        View::Elements => own.to_string(),
        View::Atomic => format!("atomic<{scalar}>"),
        View::Quads => format!("vec4<{scalar}>"),
    }
}

/// Bytes from one element of a buffer to the next, which the kernels must agree on if they view it
/// by elements; at least a word, which two 16-bit elements share.
pub fn stride(a: &Argument) -> Option<u32> {
    let elements = a.view == View::Elements && a.buffer != Buffer::sweep;
    elements.then_some((a.buffer.row().element_bytes as u32).max(4))
}
