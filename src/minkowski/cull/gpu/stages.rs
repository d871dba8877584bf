//! The stages of culling: their WGSL files, bindings and uniforms.

use std::fmt::Write;

use crate::gpu::{Access, Stage, WORKGROUP, shared_struct};
use crate::sampler::gpu::Arithmetic;

use Access::{Read, Uniform, Write as ReadWrite};

macro_rules! shader {
    ($name:literal) => {
        include_str!(concat!("../../../../shaders/", $name, ".wgsl"))
    };
}

/// Words of a normal on the device: three components of 64 bits, three in `f32`, and the largest size of those.
pub const NORMAL_WORDS: usize = 10;

/// Words of a direction: three components, three in `f32`, and the largest size of those.
pub const DIRECTION_WORDS: usize = 7;

pub static CORNERS: Stage = Stage {
    name: "cull (corners)",
    entry: "cull_corners",
    files: &[shader!("signs"), shader!("cull_corners")],
    bindings: &[(0, Uniform), (1, Read), (2, Read), (3, Read), (4, ReadWrite), (5, ReadWrite)],
};

pub static EDGES: Stage = Stage {
    name: "cull (edges)",
    entry: "cull_edges",
    files: &[shader!("signs"), shader!("cull_edges")],
    bindings: &[(0, Uniform), (1, Read), (2, Read), (3, Read), (4, Read), (5, ReadWrite), (6, ReadWrite)],
};

shared_struct! {
    /// The pairs of one dispatch.
    pub struct PairView {
        /// The first feature of the first solid.
        first: u32,
        /// Number of features of the second solid.
        others: u32,
        /// Number of pairs.
        pairs: u32,
        /// Capacity of the buffer of kept pairs.
        capacity: u32,
    }
}

/// Returns the text that precedes every shader.
pub fn head(arithmetic: Arithmetic) -> String {
    let mut text = String::new();
    let constants =
        [("WORKGROUP", WORKGROUP), ("NORMAL_WORDS", NORMAL_WORDS as u32), ("DIRECTION_WORDS", DIRECTION_WORDS as u32)];
    for (name, value) in constants {
        let _ = writeln!(text, "const {name}: u32 = {value}u;");
    }
    let wide = match arithmetic {
        Arithmetic::Native => shader!("wide_native"),
        Arithmetic::Pairs => shader!("wide_pair"),
    };
    text + PairView::WGSL + "\n" + shader!("places") + "\n" + wide
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::validation::{bindings, members, validated};

    #[test]
    fn shaders_are_valid_and_declare_the_hosts_bindings() {
        for arithmetic in [Arithmetic::Native, Arithmetic::Pairs] {
            for stage in [&CORNERS, &EDGES] {
                let name = format!("{}, {arithmetic:?}", stage.name);
                let module = validated(&name, &stage.source(&head(arithmetic)), arithmetic == Arithmetic::Native);
                assert_eq!(bindings(&name, &module), stage.bindings, "{name}");
                assert!(module.entry_points.iter().any(|point| point.name == stage.entry), "{name}");
                assert_eq!(members(&module, "PairView").as_deref(), Some(&PairView::OFFSETS[..]), "{name}");
            }
        }
    }
}
