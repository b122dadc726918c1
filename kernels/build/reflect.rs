//! What an entry point binds, from naga's analysis.

use naga::valid::{FunctionInfo, GlobalUse};
use naga::{AddressSpace, Module, StorageAccess, TypeInner};

/// A storage buffer of an entry point.
pub struct Bound {
    /// Name of the variable.
    pub name: String,
    /// The type is a struct: a bare array would hide from the validation layer.
    pub is_struct: bool,
    /// Read.
    pub reads: bool,
    /// Written; atomics are both.
    pub writes: bool,
}

/// The buffers of the whole module in binding order, with the access of this entry point. An
/// entry point that leaves some unused still has their bindings, so that one list serves a file.
pub fn bindings(module: &Module, info: &FunctionInfo) -> Vec<Bound> {
    let mut bound = Vec::new();
    for (handle, global) in module.global_variables.iter() {
        let (AddressSpace::Storage { access }, Some(binding)) = (global.space, &global.binding)
        else {
            continue;
        };
        let used = info[handle];
        let atomic = access.contains(StorageAccess::STORE) && is_atomic(module, global.ty);
        let writes = used.contains(GlobalUse::WRITE) || atomic && !used.is_empty();
        let name = global.name.clone().unwrap_or_default();
        assert_eq!(binding.group, 0, "{name}: only group 0 is bound");
        let is_struct = matches!(module.types[global.ty].inner, TypeInner::Struct { .. });
        let reads = used.contains(GlobalUse::READ) || atomic && !used.is_empty();
        bound.push((binding.binding, Bound { name, is_struct, reads, writes }));
    }
    bound.sort_by_key(|(binding, _)| *binding);
    for (n, (binding, b)) in bound.iter().enumerate() {
        assert_eq!(*binding as usize, n, "{}: bindings are numbered without gaps", b.name);
    }
    bound.into_iter().map(|(_, b)| b).collect()
}

fn is_atomic(module: &Module, ty: naga::Handle<naga::Type>) -> bool {
    match &module.types[ty].inner {
        TypeInner::Atomic(_) => true,
        TypeInner::Array { base, .. } => is_atomic(module, *base),
        TypeInner::Struct { members, .. } => members.iter().any(|m| is_atomic(module, m.ty)),
        _ => false,
    }
}
