//! The stages of the flood: their WGSL files, bindings and uniforms.

use std::fmt::Write;

use crate::gpu::{Access, Stage, WORKGROUP, shared_struct};
use crate::grid::Axis;
use crate::minkowski::Exterior;
use crate::minkowski::resolve::layer::Raster;
use crate::sampler::layout::WORD_BITS;

use Access::{Read, Uniform, Write as ReadWrite};

macro_rules! shader {
    ($name:literal) => {
        include_str!(concat!("../../../../shaders/", $name, ".wgsl"))
    };
}

const VIEW: (u32, Access) = (0, Uniform);

pub static CAST: Stage = Stage {
    name: "cast",
    entry: "cast_spans",
    files: &[shader!("lattice"), shader!("crossing"), shader!("ray_of"), shader!("cast")],
    bindings: &[VIEW, (1, Read), (2, Read), (3, ReadWrite), (4, ReadWrite), (5, ReadWrite)],
};

macro_rules! spread {
    ($name:literal, $entry:literal) => {
        Stage {
            name: $name,
            entry: $entry,
            files: &[shader!("parity"), shader!("lines"), shader!("spread")],
            bindings: &[VIEW, (1, Read), (2, Read), (3, ReadWrite), (4, ReadWrite)],
        }
    };
}

macro_rules! flood {
    ($name:literal, $entry:literal) => {
        Stage {
            name: $name,
            entry: $entry,
            files: &[shader!("lines"), shader!("flood")],
            bindings: &[VIEW, (1, Read), (2, ReadWrite), (3, ReadWrite), (4, ReadWrite)],
        }
    };
}

/// The stages along x, y and z.
pub static SPREAD: [Stage; 3] = [
    spread!("spread (rows)", "spread_rows"),
    spread!("spread (lines)", "spread_lines"),
    spread!("spread (lines)", "spread_lines"),
];

/// The stages along x, y and z.
pub static FLOOD: [Stage; 3] = [
    flood!("flood (rows)", "flood_rows"),
    flood!("flood (lines)", "flood_lines"),
    flood!("flood (lines)", "flood_lines"),
];

pub static SEEDS: Stage = Stage {
    name: "seeds",
    entry: "seeds",
    files: &[shader!("lines"), shader!("seeds")],
    bindings: &[VIEW, (1, ReadWrite), (2, ReadWrite)],
};

pub static REACHED: Stage = Stage {
    name: "reached",
    entry: "reached",
    files: &[shader!("reached")],
    bindings: &[VIEW, (1, Read), (2, Read), (3, ReadWrite)],
};

/// Returns the text that precedes every shader.
pub fn head() -> String {
    let mut text = String::new();
    let constants = [
        ("WORD_BITS", WORD_BITS),
        ("WORKGROUP", WORKGROUP),
        ("AXIS_X", Axis::X.depth() as u32),
        ("AXIS_Y", Axis::Y.depth() as u32),
    ];
    for (name, value) in constants {
        let _ = writeln!(text, "const {name}: u32 = {value}u;");
    }
    text + NodeView::WGSL + NodeTally::WGSL + "\n" + shader!("places")
}

shared_struct! {
    /// The nodes in the order of the rays along one axis.
    pub struct NodeView {
        /// A pixel is 2^shift lattice steps wide.
        shift: u32,
        /// The lattice position of node 0 of any axis.
        first_ray: i32,
        /// The coordinate along the rays: 0, 1 or 2.
        axis: u32,
        /// Number of rays.
        rays: u32,
        /// Number of columns of rays.
        columns: u32,
        /// Number of nodes of a ray.
        ray_nodes: u32,
        /// Number of nodes of a row along x, and of rows of a plane.
        nodes_x: u32,
        nodes_y: u32,
        /// Number of words of a row, and of all rows.
        words: u32,
        all_words: u32,
        /// 1 if the side beyond all crossings is inside.
        exterior_is_in: u32,
        /// Number of lines of words along the axis, and of consecutive lines before the next block of words begins.
        lines: u32,
        lines_of_block: u32,
        /// Number of words of a block.
        block: u32,
        /// Distance from a word of a line to the next, and number of words of a line.
        stride: u32,
        steps: u32,
    }
}

shared_struct! {
    /// The counts and flags over all nodes.
    pub struct NodeTally {
        /// Number of nodes that no state has reached, in two words.
        open_low: u32 atomic,
        open_high: u32 atomic,
        /// Not zero if both states have reached a node.
        contradictory: u32 atomic,
        /// Not zero if the flood has reached anything new.
        changed: u32 atomic,
    }
}

/// Words of a tally.
pub const TALLY_WORDS: u64 = size_of::<NodeTally>() as u64 / 4;

impl NodeView {
    /// Creates the view of a raster whose masks have fewer than 2^32 words.
    pub fn new(raster: &Raster, axis: Axis, exterior: Exterior) -> NodeView {
        let [nodes_x, nodes_y, nodes_z] = raster.nodes.map(|nodes| nodes as u32);
        let words = device_words(raster);
        let row = words * nodes_y;
        let (lines, lines_of_block, block, stride, steps) = match axis {
            Axis::X => (nodes_y * nodes_z, 1, words, 1, words),
            Axis::Y => (words * nodes_z, words, row, words, nodes_y),
            Axis::Z => (row, row, 0, row, nodes_z),
        };
        NodeView {
            shift: raster.pixels.shift,
            first_ray: raster.pixels.first,
            axis: axis.depth() as u32,
            rays: (raster.nodes[axis.column()] * raster.nodes[axis.row()]) as u32,
            columns: raster.nodes[axis.column()] as u32,
            ray_nodes: raster.nodes[axis.depth()] as u32,
            nodes_x,
            nodes_y,
            words,
            all_words: row * nodes_z,
            exterior_is_in: u32::from(exterior == Exterior::In),
            lines,
            lines_of_block,
            block,
            stride,
            steps,
        }
    }
}

/// Returns the number of words of a row on the device, which are half as long as those of the host.
pub fn device_words(raster: &Raster) -> u32 {
    raster.words as u32 * (u64::BITS / WORD_BITS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::validation::{bindings, members, validated};

    #[test]
    fn shaders_are_valid_and_declare_the_hosts_bindings() {
        for stage in SPREAD.iter().chain(&FLOOD).chain([&CAST, &SEEDS, &REACHED]) {
            let source = stage.source(&head());
            let module = validated(stage.name, &source, false);
            assert_eq!(bindings(stage.name, &module), stage.bindings, "{}", stage.name);
            assert!(module.entry_points.iter().any(|point| point.name == stage.entry), "{}", stage.name);
            assert_eq!(members(&module, "NodeView").as_deref(), Some(NodeView::OFFSETS), "{}", stage.name);
            assert_eq!(members(&module, "NodeTally").as_deref(), Some(NodeTally::OFFSETS), "{}", stage.name);
        }
    }
}
