//! Limits that every kernel observes, so that it runs on even the most limited Vulkan devices.

use crate::arithmetic::Constants;
use crate::reflect::Bound;
use naga::{AddressSpace, Block, EntryPoint, Module, Statement};
use std::path::Path;

/// Maximum number of storage buffers of a kernel.
const BUFFERS_MAX: usize = 8;
/// Maximum number of invocations of a workgroup.
const INVOCATIONS_MAX: u32 = 256;
/// Maximum size of workgroup memory.
const SHARED_BYTES_MAX: u32 = 16 << 10;
/// Maximum number of iterations of all loops of an invocation: a software device silently ends
/// loops after 65,535.
const ITERATIONS_MAX: u64 = 50_000;

/// Checks an entry point.
pub fn check_entry(file: &Path, module: &Module, entry: &EntryPoint, bindings: &[Bound]) {
    let fail = |what: String| -> ! { panic!("{}, {}: {what}", file.display(), entry.name) };
    let storage_buffers = bindings.iter().filter(|b| !b.uniform).count();
    if storage_buffers > BUFFERS_MAX {
        fail(format!("{storage_buffers} storage buffers, {BUFFERS_MAX} allowed"));
    }
    let invocations: u32 = entry.workgroup_size.iter().product();
    if invocations > INVOCATIONS_MAX {
        fail(format!("{invocations} invocations, {INVOCATIONS_MAX} allowed"));
    }
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(module.to_ctx()).expect("a valid module");
    let shared: u32 = module
        .global_variables
        .iter()
        .filter(|(_, g)| g.space == AddressSpace::WorkGroup)
        .map(|(_, g)| layouter[g.ty].size)
        .sum();
    if shared > SHARED_BYTES_MAX {
        fail(format!("{shared} bytes of workgroup memory, {SHARED_BYTES_MAX} allowed"));
    }
    // A barrier that some invocations do not reach is undefined behaviour, and the compiler does
    // not check for it. A break out of a loop with a barrier is not detected here either: the
    // bounds of such loops are constants.
    if has_conditional_barrier(&entry.function.body, false) {
        fail("a barrier under a condition or after an early return".into());
    }
    for (_, function) in module.functions.iter() {
        if has_conditional_barrier(&function.body, false) {
            fail("a barrier under a condition in a function".into());
        }
    }
}

/// Whether there is a barrier inside an `if` or `switch`, or after a possible return. Loops may
/// contain barriers: the bounds of those that do are constants.
fn has_conditional_barrier(block: &Block, conditional: bool) -> bool {
    let mut returned = false;
    for statement in block.iter() {
        let bad = match statement {
            Statement::ControlBarrier(_) => conditional || returned,
            Statement::If { condition: _, accept, reject } => {
                // The exit of a loop is an `if` with only a break in it.
                returned |= returns(accept) || returns(reject);
                has_conditional_barrier(accept, true) || has_conditional_barrier(reject, true)
            }
            Statement::Switch { cases, .. } => {
                cases.iter().any(|c| has_conditional_barrier(&c.body, true))
            }
            Statement::Loop { body, continuing, .. } => {
                has_conditional_barrier(body, conditional || returned)
                    || has_conditional_barrier(continuing, conditional || returned)
            }
            Statement::Block(block) => has_conditional_barrier(block, conditional || returned),
            _ => false,
        };
        if bad {
            return true;
        }
    }
    false
}

fn returns(block: &Block) -> bool {
    block.iter().any(|s| match s {
        Statement::Return { .. } => true,
        Statement::If { accept, reject, .. } => returns(accept) || returns(reject),
        Statement::Block(b) => returns(b),
        Statement::Loop { body, .. } => returns(body),
        _ => false,
    })
}

/// Bounds the iterations of all loops in a file: nested loops multiply, others add up. The count of
/// a loop whose header runs from constant to constant is computed; any other loop states on its
/// line, as `// <= N`, an expression of constants that it never exceeds.
pub fn check_loops(file: &Path, source: &str) {
    let constants = Constants::of(source);
    let mut open: Vec<u64> = Vec::new();
    let mut total = 0u64;
    for (n, line) in source.lines().enumerate() {
        let code = line.split("//").next().unwrap_or_default();
        let word = code.trim_start().split([' ', '(', '{']).next().unwrap_or_default();
        let mut factor = 1;
        if ["for", "while", "loop"].contains(&word) {
            let stated = || line.split("// <= ").nth(1).and_then(|t| constants.value(t));
            let bound = constants.iterations(code).or_else(stated);
            factor = bound.and_then(|n| u64::try_from(n).ok()).unwrap_or_else(|| {
                panic!("{}, line {}: a loop without `// <= N`", file.display(), n + 1)
            });
            total += open.iter().product::<u64>() * factor;
        }
        for c in code.chars() {
            match c {
                '{' => open.push(std::mem::replace(&mut factor, 1)),
                '}' => drop(open.pop()),
                _ => {}
            }
        }
    }
    assert!(total <= ITERATIONS_MAX, "{}: {total} loop iterations", file.display());
}
