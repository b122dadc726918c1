//! What the table of stages says about a file of kernels.

use raywake_core::stages::{Argument, FLOW_PROGRAMS, MAP_PROGRAMS, Runner, StageOp, walk};

/// An entry point and its arguments, in the order of their bindings.
#[derive(Clone)]
pub struct Entry {
    pub name: &'static str,
    pub arguments: Vec<Argument>,
}

/// Every entry point of every stage, once. If a stage serves several buffers, the kernels see the
/// same names and types for each.
pub fn entries() -> Vec<Entry> {
    let mut all: Vec<Entry> = Vec::new();
    for program in FLOW_PROGRAMS.iter().chain(MAP_PROGRAMS) {
        walk(program.ops, Runner::Device, 1, &mut |op| {
            let StageOp::Run(stage) = op else { return };
            let arguments: Vec<Argument> = stage.bindings().collect();
            for (name, _) in stage.all_kernels() {
                match all.iter().find(|e| e.name == *name) {
                    Some(known) => check_alike(known, &arguments),
                    None => all.push(Entry { name, arguments: arguments.clone() }),
                }
            }
        });
    }
    all
}

fn check_alike(entry: &Entry, arguments: &[Argument]) {
    let seen = |a: &Argument| (a.name, a.buffer.row().wgsl, a.view, a.writes);
    let alike = entry.arguments.iter().map(seen).eq(arguments.iter().map(seen));
    assert!(alike, "`{}` is declared with different arguments", entry.name);
}

/// Those whose functions are in a file.
pub fn of_source(declared: &[Entry], source: &str) -> Vec<Entry> {
    let has = |e: &&Entry| source.contains(&format!("\nfn {}(", e.name));
    declared.iter().filter(has).cloned().collect()
}

/// The arguments of an entry point, then the additional ones of the other entry points in its file:
/// a file is compiled as a whole, for one entry point at a time. What one of them writes is
/// writable for all.
pub fn of_file(entries: &[Entry], index: usize) -> Vec<Argument> {
    let mut all = entries[index].arguments.clone();
    for argument in entries.iter().flat_map(|e| &e.arguments) {
        match all.iter_mut().find(|a| a.name == argument.name) {
            None => all.push(*argument),
            Some(known) => known.writes |= argument.writes,
        }
    }
    all
}
