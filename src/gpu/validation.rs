//! Validation of shaders without a device, for the tests of all modules that have shaders, and their translation for every
//! graphics API.

use naga::back::{hlsl, msl, spv};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};

use super::Access;

/// Returns the module of a shader.
///
/// # Panics
/// Panics if the shader is not valid, or cannot be translated for Vulkan, Metal or DirectX 12.
pub fn validated(name: &str, source: &str, has_int64: bool) -> naga::Module {
    let module =
        naga::front::wgsl::parse_str(source).unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(source)));
    let capabilities = if has_int64 { Capabilities::SHADER_INT64 } else { Capabilities::empty() };
    let info = Validator::new(ValidationFlags::all(), capabilities).validate(&module);
    let info = info.unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(source)));
    translate(name, &module, &info);
    module
}

/// Translates a shader for Vulkan, Metal and DirectX 12.
///
/// # Panics
/// Panics if one of them cannot express it.
fn translate(name: &str, module: &naga::Module, info: &ModuleInfo) {
    let words = spv::write_vec(module, info, &spv::Options::default(), None);
    let words = words.unwrap_or_else(|error| panic!("{name}, SPIR-V: {error}"));
    // The first word is SPIR-V's own.
    assert_eq!(words[0], 0x0723_0203, "{name}");
    // Integers of 64 bits came with version 2.2, and their atomics are not used.
    let options = msl::Options { lang_version: (2, 4), ..msl::Options::default() };
    let text = msl::write_string(module, info, &options, &msl::PipelineOptions::default());
    let (text, _) = text.unwrap_or_else(|error| panic!("{name}, MSL: {error}"));
    assert!(text.contains("kernel void"), "{name}");
    let options = hlsl::Options { shader_model: hlsl::ShaderModel::V6_0, ..hlsl::Options::default() };
    let mut text = String::new();
    let written = hlsl::Writer::new(&mut text, &options, &hlsl::PipelineOptions::default()).write(module, info, None);
    written.unwrap_or_else(|error| panic!("{name}, HLSL: {error}"));
    assert!(text.contains("numthreads"), "{name}");
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

/// Returns the members of a struct, and their offsets in bytes; `None` where the shader has no such struct.
pub fn members<'m>(module: &'m naga::Module, name: &str) -> Option<Vec<(&'m str, usize)>> {
    let kind = module.types.iter().map(|(_, kind)| kind).find(|kind| kind.name.as_deref() == Some(name))?;
    let naga::TypeInner::Struct { members, .. } = &kind.inner else { panic!("{name} is no struct") };
    Some(members.iter().map(|member| (member.name.as_deref().unwrap_or(""), member.offset as usize)).collect())
}
