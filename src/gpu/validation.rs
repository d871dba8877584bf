//! Validation of shaders without a device, for the tests of all modules that have shaders.

use naga::valid::{Capabilities, ValidationFlags, Validator};

use super::Access;

/// Returns the module of a shader.
///
/// # Panics
/// Panics if the shader is not valid.
pub fn validated(name: &str, source: &str, has_int64: bool) -> naga::Module {
    let module =
        naga::front::wgsl::parse_str(source).unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(source)));
    let capabilities = if has_int64 { Capabilities::SHADER_INT64 } else { Capabilities::empty() };
    if let Err(error) = Validator::new(ValidationFlags::all(), capabilities).validate(&module) {
        panic!("{name}: {}", error.emit_to_string(source));
    }
    module
}

/// Returns the buffers that it declares, ascending.
pub fn bindings(name: &str, module: &naga::Module) -> Vec<(u32, Access)> {
    let mut declared = Vec::new();
    for (_, global) in module.global_variables.iter() {
        let Some(binding) = global.binding else { continue };
        assert_eq!(binding.group, 0, "{name}");
        let access = match global.space {
            naga::AddressSpace::Uniform => Access::Uniform,
            naga::AddressSpace::Storage { access } if access.contains(naga::StorageAccess::STORE) => Access::Write,
            naga::AddressSpace::Storage { .. } => Access::Read,
            other => panic!("{name}: a binding in {other:?}"),
        };
        declared.push((binding.binding, access));
    }
    declared.sort_by_key(|(binding, _)| *binding);
    declared
}

/// Returns the members of a struct of 32-bit numbers, and their offsets in bytes; `None` where the shader has no such
/// struct.
pub fn members<'m>(module: &'m naga::Module, name: &str) -> Option<Vec<(&'m str, usize)>> {
    let kind = module.types.iter().map(|(_, kind)| kind).find(|kind| kind.name.as_deref() == Some(name))?;
    let naga::TypeInner::Struct { members, span } = &kind.inner else { panic!("{name} is no struct") };
    assert_eq!(*span as usize, 4 * members.len(), "{name}");
    Some(members.iter().map(|member| (member.name.as_deref().unwrap_or(""), member.offset as usize)).collect())
}
