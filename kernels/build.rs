//! WGSL to SPIR-V at build time: prelude, naga, checks, and a table of what each kernel binds.
//! A kernel that breaks a limit of `build/limits.rs` does not build.

#[path = "build/limits.rs"]
mod limits;
#[path = "build/prelude.rs"]
mod prelude;
#[path = "build/reflect.rs"]
mod reflect;

use naga::back::spv;
use std::fmt::Write;
use std::path::{Path, PathBuf};

fn main() {
    let root = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").expect("set by cargo"));
    println!("cargo::rerun-if-changed=wgsl");
    println!("cargo::rerun-if-changed=build");
    println!("cargo::rerun-if-env-changed=RAYWAKE_KERNELS");
    // `RAYWAKE_KERNELS=restrict` clamps every index, for the test that the results stay the same;
    // `debug` names things, for the layer that reports accesses out of bounds.
    let mode = std::env::var("RAYWAKE_KERNELS").unwrap_or_default();
    let shared = read(&root.join("wgsl/shared.wgsl"));
    let prelude = prelude::prelude() + &shared;
    let mut files = Vec::new();
    collect(&root.join("wgsl"), &mut files);
    files.sort();
    let mut table = String::new();
    for file in files.iter().filter(|f| !f.ends_with("shared.wgsl")) {
        let source = read(file);
        limits::check_loops(file, &source);
        compile(&mut table, file, &format!("{prelude}{source}"), &mode);
    }
    let out = PathBuf::from(std::env::var("OUT_DIR").expect("set by cargo"));
    std::fs::write(out.join("kernels.rs"), table).expect("the output folder is writable");
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("the folder of kernels") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|e| e == "wgsl") {
            files.push(path);
        }
    }
}

/// Compiles every entry point of a file and appends a static per entry point to `table`.
fn compile(table: &mut String, file: &Path, source: &str, mode: &str) {
    let fail = |what: String| -> ! { panic!("{}: {what}", file.display()) };
    let module =
        naga::front::wgsl::parse_str(source).unwrap_or_else(|e| fail(e.emit_to_string(source)));
    let flags = naga::valid::ValidationFlags::all();
    let info = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty())
        .validate(&module)
        .unwrap_or_else(|e| fail(e.emit_to_string(source)));
    for (index, entry) in module.entry_points.iter().enumerate() {
        let bindings = reflect::bindings(&module, info.get_entry_point(index));
        limits::check_entry(file, &module, entry, &bindings);
        let words = spirv(&module, &info, &entry.name, mode).unwrap_or_else(|e| fail(e));
        write_static(table, entry, &bindings, &words);
    }
}

fn spirv(
    module: &naga::Module,
    info: &naga::valid::ModuleInfo,
    entry: &str,
    mode: &str,
) -> Result<Vec<u32>, String> {
    use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
    let policy = match mode {
        "restrict" => BoundsCheckPolicy::Restrict,
        _ => BoundsCheckPolicy::Unchecked,
    };
    let options = spv::Options {
        lang_version: (1, 3),
        flags: if mode == "debug" { spv::WriterFlags::DEBUG } else { spv::WriterFlags::empty() },
        fake_missing_bindings: true,
        bounds_check_policies: BoundsCheckPolicies {
            index: policy,
            buffer: policy,
            ..BoundsCheckPolicies::default()
        },
        // The polyfill makes one invocation clear the whole array; the kernels write before they
        // read. Loops are bounded by `limits.rs`, divisors are never zero.
        zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
        force_loop_bounding: false,
        emit_int_div_checks: false,
        capabilities: Some([spv::Capability::Shader].into_iter().collect()),
        ..spv::Options::default()
    };
    let pipeline = spv::PipelineOptions {
        shader_stage: naga::ShaderStage::Compute,
        entry_point: entry.to_string(),
    };
    spv::write_vec(module, info, &options, Some(&pipeline)).map_err(|e| e.to_string())
}

fn write_static(
    table: &mut String,
    entry: &naga::EntryPoint,
    bindings: &[reflect::Bound],
    words: &[u32],
) {
    let name = &entry.name;
    let mut list = String::new();
    for b in bindings {
        let (binding, reads, writes) = (&b.name, b.reads, b.writes);
        let _ = write!(list, "Binding {{ name: {binding:?}, reads: {reads}, writes: {writes} }}, ");
    }
    let _ = writeln!(
        table,
        "/// Kernel `{name}`.\npub static {}: Kernel = Kernel {{ name: {name:?}, \
         workgroup: {:?}, bindings: &[{list}], spirv: &{words:?} }};",
        name.to_uppercase(),
        entry.workgroup_size,
    );
}
