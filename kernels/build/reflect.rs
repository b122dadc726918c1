//! What an entry point binds, according to naga's analysis.

use naga::valid::{FunctionInfo, GlobalUse};
use naga::{AddressSpace, Module, StorageAccess, TypeInner};

/// A buffer of an entry point.
pub struct Bound {
    /// Name of the variable.
    pub name: String,
    /// Bytes from one element of its array to the next.
    pub stride: Option<u32>,
    /// Whether it is read.
    pub reads: bool,
    /// Whether it is written; atomics are both read and written.
    pub writes: bool,
    /// Whether it is a uniform buffer.
    pub uniform: bool,
}

/// The buffers of the whole module in binding order, with how this entry point accesses them.
pub fn bindings(module: &Module, info: &FunctionInfo) -> Vec<Bound> {
    let mut bound = Vec::new();
    for (handle, global) in module.global_variables.iter() {
        let Some(binding) = &global.binding else { continue };
        let access = match global.space {
            AddressSpace::Storage { access } => access,
            _ => StorageAccess::LOAD,
        };
        let uniform = global.space == AddressSpace::Uniform;
        let used = info[handle];
        let atomic = access.contains(StorageAccess::STORE) && is_atomic(module, global.ty);
        let writes = used.contains(GlobalUse::WRITE) || atomic && !used.is_empty();
        let reads = used.contains(GlobalUse::READ) || atomic && !used.is_empty();
        let name = global.name.clone().unwrap_or_default();
        let stride = stride(module, global.ty);
        bound.push((binding.binding, Bound { name, stride, reads, writes, uniform }));
    }
    bound.sort_by_key(|(binding, _)| *binding);
    bound.into_iter().map(|(_, b)| b).collect()
}

fn stride(module: &Module, ty: naga::Handle<naga::Type>) -> Option<u32> {
    let TypeInner::Struct { members, .. } = &module.types[ty].inner else { return None };
    match module.types[members[0].ty].inner {
        TypeInner::Array { stride, .. } => Some(stride),
        _ => None,
    }
}

fn is_atomic(module: &Module, ty: naga::Handle<naga::Type>) -> bool {
    match &module.types[ty].inner {
        TypeInner::Atomic(_) => true,
        TypeInner::Array { base, .. } => is_atomic(module, *base),
        TypeInner::Struct { members, .. } => members.iter().any(|m| is_atomic(module, m.ty)),
        _ => false,
    }
}
