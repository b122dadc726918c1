//! WGSL to SPIR-V at build time: prelude, naga, checks, and a table of what each kernel binds.
//! A kernel that exceeds a limit of `build/limits.rs` does not build.

#[path = "build/arithmetic.rs"]
mod arithmetic;
#[path = "build/limits.rs"]
mod limits;
#[path = "build/prelude.rs"]
mod prelude;
#[path = "build/reflect.rs"]
mod reflect;
#[path = "build/stages.rs"]
mod stages;

use naga::back::spv;
use std::fmt::Write;
use std::path::{Path, PathBuf};

fn main() {
    let root = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").expect("set by cargo"));
    println!("cargo::rerun-if-changed=wgsl");
    println!("cargo::rerun-if-changed=build");
    println!("cargo::rerun-if-env-changed=RAYWAKE_KERNELS");
    // `RAYWAKE_KERNELS=restrict` clamps every index, for the test that the results stay the same;
    // `debug` includes names, for the layer that reports out-of-bounds accesses.
    let mode = std::env::var("RAYWAKE_KERNELS").unwrap_or_default();
    let shared = read(&root.join("wgsl/shared.wgsl"));
    let prelude = prelude::prelude() + &shared;
    let declared = stages::entries();
    let mut files = Vec::new();
    collect(&root.join("wgsl"), &mut files);
    files.sort();
    let (mut table, mut built) = (String::new(), 0);
    for file in files.iter().filter(|f| !f.ends_with("shared.wgsl")) {
        let source = read(file);
        limits::check_loops(file, &source);
        let entries = stages::of_source(&declared, &source);
        built += entries.len();
        for index in 0..entries.len() {
            let arguments = stages::of_file(&entries, index);
            let text = format!("{prelude}{}{source}", prelude::bindings(&arguments));
            compile(&mut table, file, &text, &entries[index], &arguments, &mode);
        }
    }
    assert_eq!(built, declared.len(), "every stage has its kernels below wgsl/");
    let names: String = declared.iter().map(|e| format!("&{}, ", e.name.to_uppercase())).collect();
    let _ = writeln!(table, "/// All kernels.\npub static KERNELS: &[&Kernel] = &[{names}];");
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

/// Compiles an entry point and appends a static for it to `table`.
fn compile(
    table: &mut String,
    file: &Path,
    source: &str,
    declared: &stages::Entry,
    arguments: &[raywake_core::stages::Argument],
    mode: &str,
) {
    let fail = |what: String| -> ! { panic!("{}: {what}", file.display()) };
    let module =
        naga::front::wgsl::parse_str(source).unwrap_or_else(|e| fail(e.emit_to_string(source)));
    let flags = naga::valid::ValidationFlags::all();
    let info = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty())
        .validate(&module)
        .unwrap_or_else(|e| fail(e.emit_to_string(source)));
    let index = module.entry_points.iter().position(|e| e.name == declared.name);
    let index = index.unwrap_or_else(|| fail(format!("no entry point `{}`", declared.name)));
    let entry = &module.entry_points[index];
    let mut bindings = reflect::bindings(&module, info.get_entry_point(index));
    if let Some(what) = contradiction(declared, &bindings, arguments) {
        fail(format!("`{}` {what}", declared.name));
    }
    bindings.truncate(declared.arguments.len());
    limits::check_entry(file, &module, entry, &bindings);
    let words = spirv(&module, &info, &entry.name, mode).unwrap_or_else(|e| fail(e));
    write_static(table, entry, &bindings, &words);
}

/// What an entry point does with its bindings in contradiction to its stage, if anything.
fn contradiction(
    declared: &stages::Entry,
    bindings: &[reflect::Bound],
    arguments: &[raywake_core::stages::Argument],
) -> Option<String> {
    bindings.iter().zip(arguments).enumerate().find_map(|(n, (bound, argument))| {
        let (name, own) = (&bound.name, declared.arguments.get(n));
        if (bound.reads || bound.writes) && own.is_none() {
            return Some(format!("uses `{name}`, which its stage does not have"));
        }
        if bound.writes && own.is_some_and(|a| !a.writes) {
            return Some(format!("writes `{name}`, which its stage only reads"));
        }
        let (found, wanted) = (bound.stride?, prelude::stride(argument)?);
        let mismatch = || format!("sees {found} bytes per element of `{name}`, core has {wanted}");
        (found != wanted).then(mismatch)
    })
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
        // The polyfill has one invocation clear the whole array; the kernels write before they
        // read. Loops are bounded by `limits.rs`, and divisors are never zero.
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
        let _ = match b {
            reflect::Bound { name, uniform: true, .. } => {
                write!(list, "Binding::uniform({name:?}), ")
            }
            reflect::Bound { name, reads, writes, .. } => {
                write!(list, "Binding::storage({name:?}, {reads}, {writes}), ")
            }
        };
    }
    let _ = writeln!(
        table,
        "/// Kernel `{name}`.\npub static {}: Kernel = Kernel {{ name: {name:?}, workgroup: {:?}, \
         bindings: &[{list}], spirv: unsafe {{ Spirv::new(&{words:?}) }} }};",
        name.to_uppercase(),
        entry.workgroup_size,
    );
}
