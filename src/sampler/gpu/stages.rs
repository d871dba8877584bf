//! The stages: the WGSL files of each, its bindings, and its variants.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use super::network;
use super::view::{BandView, Found, LONG_WORKGROUP, SCAN_WORKGROUP, Tally, View, constants};
use crate::gpu::{Access, Device, DeviceError, Kernel, Needs, WORKGROUP, held};

use Access::{Read, Uniform, Write};

/// A property in which the variants of a stage differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Flag {
    /// The estimate is the over-estimate, not the under-estimate.
    Over,
    /// The image is exact, not an estimate.
    Exact,
    /// The non-zero rule, not even-odd.
    NonZero,
    /// An intersection of two solids.
    TwoSolids,
    /// Samples carry their triangles.
    KeepsTriangles,
    /// The first and the last crossing of a ray are kept.
    KeepsEnds,
    /// Depths need integers of 96 bits.
    Hard,
    /// There are more leaves than [`FEW_LEAVES`](super::view::FEW_LEAVES).
    ManyLeaves,
}

const ALL_FLAGS: [(Flag, &str); 8] = [
    (Flag::Over, "OVER"),
    (Flag::Exact, "EXACT"),
    (Flag::NonZero, "NON_ZERO"),
    (Flag::TwoSolids, "TWO_SOLIDS"),
    (Flag::KeepsTriangles, "KEEPS_TRIANGLES"),
    (Flag::KeepsEnds, "KEEPS_ENDS"),
    (Flag::Hard, "HARD"),
    (Flag::ManyLeaves, "MANY_LEAVES"),
];

/// A set of flags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Flags(u8);

impl Flags {
    /// Returns the set of those flags that are true.
    pub fn of(flags: &[(Flag, bool)]) -> Flags {
        Flags(flags.iter().filter(|(_, on)| *on).fold(0, |set, (flag, _)| set | 1 << *flag as u8))
    }

    /// Returns the set with another flag.
    pub fn with(self, flag: Flag) -> Flags {
        Flags(self.0 | 1 << flag as u8)
    }

    fn has(self, flag: Flag) -> bool {
        self.0 & 1 << flag as u8 != 0
    }

    fn among(self, flags: &[Flag]) -> Flags {
        Flags(flags.iter().fold(0, |set, &flag| set | self.0 & 1 << flag as u8))
    }
}

/// The implementation of 64- and 96-bit integers in shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Arithmetic {
    /// With the device's own 64-bit integers.
    Native,
    /// Pairs of 32-bit words, for devices without them.
    Pairs,
}

/// A stage: one entry point with all the files that it needs.
#[derive(Debug)]
pub struct Stage {
    /// Its name: that of its file and, where a file has several, of the entry point.
    pub name: &'static str,
    entry: &'static str,
    files: &'static [&'static str],
    bindings: &'static [(u32, Access)],
    flags: &'static [Flag],
}

macro_rules! shader {
    ($name:literal) => {
        include_str!(concat!("../../../shaders/", $name, ".wgsl"))
    };
}

const VIEW: (u32, Access) = (0, Uniform);
/// After its view, every geometry pass binds positions, triangles and blocks of rows.
const GEOMETRY: [(u32, Access); 4] = [VIEW, (1, Read), (2, Read), (3, Read)];

macro_rules! bindings {
    ($head:expr; $($rest:expr),*) => {
        &{
            const HEAD: &[(u32, Access)] = &$head;
            const REST: &[(u32, Access)] = &[$($rest),*];
            let mut all = [(0, Uniform); HEAD.len() + REST.len()];
            let mut i = 0;
            while i < HEAD.len() {
                all[i] = HEAD[i];
                i += 1;
            }
            let mut i = 0;
            while i < REST.len() {
                all[HEAD.len() + i] = REST[i];
                i += 1;
            }
            all
        }
    };
}

/// A geometry pass: a dispatch over small triangles and others over the rows of larger ones.
#[derive(Debug)]
pub struct GeometryPass {
    pub triangles: Stage,
    pub rows: Stage,
}

macro_rules! geometry_pass {
    ($name:literal, [$($file:literal),*], $bindings:expr, $flags:expr) => {
        GeometryPass {
            triangles: geometry_pass!($name, "cover_triangles", [$($file),*], $bindings, $flags),
            rows: geometry_pass!(concat!($name, " (rows)"), "cover_rows", [$($file),*], $bindings, $flags),
        }
    };
    ($name:expr, $entry:literal, [$($file:literal),*], $bindings:expr, $flags:expr) => {
        Stage {
            name: $name,
            entry: $entry,
            files: &[shader!("fixed"), shader!("triangle"), $(shader!($file),)* shader!("cover")],
            bindings: $bindings,
            flags: $flags,
        }
    };
}

pub static APPEND: GeometryPass = geometry_pass!(
    "cover",
    ["append"],
    bindings!(GEOMETRY; (4, Write), (5, Write), (6, Write), (7, Write), (8, Write)),
    &[Flag::KeepsTriangles, Flag::Hard]
);

pub static PLACE: Stage = Stage {
    name: "place",
    entry: "place",
    files: &[shader!("place")],
    bindings: &[VIEW, (1, Read), (2, Read), (3, Write), (4, Read), (5, Read), (6, Read), (7, Write), (8, Write)],
    flags: &[Flag::KeepsTriangles],
};

pub static MASKS: GeometryPass =
    geometry_pass!("masks", ["masks"], bindings!(GEOMETRY; (4, Write), (5, Write)), &[Flag::Hard]);

pub static RETRIEVE: GeometryPass = geometry_pass!(
    "retrieve",
    ["windings", "rank", "retrieve"],
    bindings!(GEOMETRY; (4, Read), (5, Read), (6, Read), (7, Read), (8, Write), (9, Write)),
    &[Flag::Over, Flag::TwoSolids, Flag::Hard]
);

pub static CLASSIFY: Stage = Stage {
    name: "classify",
    entry: "classify",
    files: &[shader!("fixed"), shader!("parity"), shader!("windings"), shader!("unclosed"), shader!("classify")],
    bindings: &[VIEW, (1, Write), (2, Write), (3, Write), (4, Write), (5, Write), (6, Write), (7, Write)],
    flags: &[Flag::Over, Flag::TwoSolids],
};

macro_rules! scan {
    ($name:literal, $entry:literal) => {
        Stage {
            name: $name,
            entry: $entry,
            files: &[shader!("scan")],
            bindings: &[VIEW, (1, Read), (2, Write), (3, Write), (4, Write), (5, Write)],
            flags: &[],
        }
    };
}

/// The prefix sum, in the order of its dispatches.
pub static SCAN: [Stage; 2] =
    [scan!("scan (sum blocks)", "sum_blocks"), scan!("scan (spread blocks)", "spread_blocks")];

pub static IDENTITIES: Stage = Stage {
    name: "identities",
    entry: "identities",
    files: &[shader!("rank"), shader!("identities")],
    bindings: &[VIEW, (1, Read), (2, Write)],
    flags: &[Flag::Over],
};

pub static SORT: Stage = Stage {
    name: "sort",
    entry: "sort_short",
    files: &[shader!("sort"), shader!("sort_list"), shader!("sort_short")],
    bindings: &[VIEW, (1, Read), (2, Write), (3, Write)],
    flags: &[Flag::KeepsTriangles],
};

pub static SORT_LONG: Stage = Stage {
    name: "sort (long lists)",
    entry: "sort_long",
    files: &[shader!("sort"), shader!("sort_long")],
    bindings: &[VIEW, (1, Read), (2, Write), (3, Write), (4, Write), (5, Write), (6, Read), (7, Read)],
    flags: &[Flag::KeepsTriangles],
};

pub static RESOLVE: Stage = Stage {
    name: "resolve",
    entry: "resolve",
    files: &[
        shader!("fixed"),
        shader!("windings"),
        shader!("unclosed"),
        shader!("sort"),
        shader!("sort_list"),
        shader!("walk"),
        shader!("resolve"),
    ],
    bindings: &[VIEW, (1, Read), (2, Write), (3, Write), (4, Write), (5, Write)],
    flags: &[Flag::Over, Flag::Exact, Flag::NonZero, Flag::KeepsTriangles],
};

pub static MEET: Stage = Stage {
    name: "meet",
    entry: "meet",
    files: &[shader!("fixed"), shader!("unclosed"), shader!("walk"), shader!("loose"), shader!("meet")],
    bindings: &[VIEW, (1, Read), (2, Read), (3, Write), (4, Write), (5, Write)],
    flags: &[Flag::Over, Flag::NonZero],
};

pub static COMBINE: Stage = Stage {
    name: "combine",
    entry: "combine",
    files: &[shader!("unclosed"), shader!("loose"), shader!("combine")],
    bindings: &[VIEW, (1, Read), (2, Read), (3, Read), (4, Read), (5, Write), (6, Write), (7, Write)],
    flags: &[Flag::ManyLeaves],
};

pub static COMPACT: Stage = Stage {
    name: "compact",
    entry: "compact",
    files: &[shader!("loose"), shader!("compact")],
    bindings: &[VIEW, (1, Read), (2, Read), (3, Read), (4, Write)],
    flags: &[],
};

pub static GAPS: Stage = Stage {
    name: "gaps",
    entry: "gaps",
    files: &[shader!("crossing"), shader!("ray_of"), shader!("gaps")],
    bindings: &[VIEW, (1, Read), (2, Read), (3, Write)],
    flags: &[Flag::KeepsEnds],
};

pub static OFFSETS: Stage = Stage {
    name: "offsets",
    entry: "offset_rays",
    files: &[shader!("offsets")],
    bindings: &[VIEW, (1, Read), (2, Read), (3, Write)],
    flags: &[],
};

pub static KEEP: Stage = Stage {
    name: "keep",
    entry: "keep",
    files: &[shader!("keep")],
    bindings: &[VIEW, (1, Read), (2, Read), (3, Read), (4, Read), (5, Write), (6, Write)],
    flags: &[Flag::KeepsTriangles],
};

pub static VOLUME_SUMS: Stage = Stage {
    name: "volume_sums",
    entry: "summarise",
    files: &[shader!("loose"), shader!("volume_sums")],
    bindings: &[VIEW, (1, Read), (2, Read), (3, Read), (4, Write), (5, Write)],
    flags: &[],
};

pub static MOMENT_SUMS: Stage = Stage {
    name: "moments",
    entry: "sum_moments",
    files: &[shader!("loose"), shader!("upper_product"), shader!("moments")],
    bindings: &[VIEW, (1, Read), (2, Read), (3, Read), (4, Write)],
    flags: &[],
};

/// Returns all stages.
fn all() -> Vec<&'static Stage> {
    let passes = [&APPEND, &MASKS, &RETRIEVE];
    let single = [
        &PLACE,
        &CLASSIFY,
        &IDENTITIES,
        &SORT,
        &SORT_LONG,
        &RESOLVE,
        &MEET,
        &COMBINE,
        &COMPACT,
        &GAPS,
        &OFFSETS,
        &KEEP,
        &VOLUME_SUMS,
        &MOMENT_SUMS,
    ];
    passes.into_iter().flat_map(|pass| [&pass.triangles, &pass.rows]).chain(single).chain(&SCAN).collect()
}

/// Returns the requirements for a device: those of all stages, but of the route by masks only where it is wanted.
pub fn needs(by_masks: bool) -> Needs {
    let storage = |stage: &Stage| stage.bindings.iter().filter(|(_, access)| *access != Uniform).count() as u32;
    let is_wanted =
        |stage: &&Stage| by_masks || ![&RETRIEVE.triangles, &RETRIEVE.rows].map(|s| s.name).contains(&stage.name);
    let bindings = all().iter().filter(|stage| is_wanted(stage)).map(|stage| storage(stage)).max().unwrap_or(0);
    Needs { bindings, workgroup: WORKGROUP.max(SCAN_WORKGROUP).max(LONG_WORKGROUP) }
}

impl Stage {
    /// Returns the whole WGSL of a variant.
    pub fn source(&self, flags: Flags, arithmetic: Arithmetic) -> String {
        let mut text = constants();
        let flags = flags.among(self.flags);
        for (flag, name) in ALL_FLAGS {
            text += &format!("const {name} = {};\n", flags.has(flag));
        }
        text += BandView::WGSL;
        text += View::WGSL;
        text += Tally::WGSL;
        text += Found::WGSL;
        text += Found::READ_WGSL;
        text += "\n";
        text += shader!("places");
        text += "\n";
        text += shader!("view");
        text += "\n";
        text += shader!("lattice");
        text += "\n";
        if self.files.contains(&shader!("fixed")) {
            text += match arithmetic {
                Arithmetic::Native => shader!("wide_native"),
                Arithmetic::Pairs => concat!(shader!("upper_product"), "\n", shader!("wide_pair")),
            };
            text += "\n";
            text += shader!("crossing");
        }
        if self.files.contains(&shader!("sort_list")) {
            text += "\n";
            text += &network::wgsl();
        }
        for file in self.files {
            text += "\n";
            text += file;
        }
        text
    }
}

/// The compiled variants of a device, each compiled when it is first needed.
pub struct Kernels {
    arithmetic: Arithmetic,
    made: Mutex<HashMap<(&'static str, Flags), Arc<Kernel>>>,
}

impl Kernels {
    /// Returns an empty set of kernels.
    pub fn new(arithmetic: Arithmetic) -> Kernels {
        Kernels { arithmetic, made: Mutex::default() }
    }

    /// Returns their arithmetic.
    pub fn arithmetic(&self) -> Arithmetic {
        self.arithmetic
    }

    /// Returns the kernel of a stage in the variant that the flags select.
    pub fn get(&self, device: &Device, stage: &Stage, flags: Flags) -> Result<Arc<Kernel>, DeviceError> {
        let key = (stage.name, flags.among(stage.flags));
        let mut made = held(&self.made);
        if let Some(kernel) = made.get(&key) {
            return Ok(Arc::clone(kernel));
        }
        let source = stage.source(flags, self.arithmetic);
        let kernel = Arc::new(Kernel::new(device, stage.name, &source, stage.entry, stage.bindings)?);
        made.insert(key, Arc::clone(&kernel));
        Ok(kernel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::validation::{bindings, members, validated};

    /// Returns every variant of a stage, in either arithmetic.
    fn variants(stage: &'static Stage) -> impl Iterator<Item = (String, naga::Module)> {
        let sets = (0..=u8::MAX >> (u8::BITS as usize - ALL_FLAGS.len()))
            .map(Flags)
            .filter(|flags| flags.among(stage.flags) == *flags);
        sets.flat_map(move |flags| {
            [Arithmetic::Native, Arithmetic::Pairs].map(|arithmetic| {
                let source = stage.source(flags, arithmetic);
                let name = format!("{}, {flags:?}, {arithmetic:?}", stage.name);
                let module = validated(&name, &source, arithmetic == Arithmetic::Native);
                (name, module)
            })
        })
    }

    #[test]
    fn every_shader_variant_is_valid() {
        for stage in all() {
            assert!(variants(stage).count() >= 2, "{}", stage.name);
        }
    }

    #[test]
    fn invalid_shaders_are_rejected() {
        let source =
            PLACE.source(Flags::default(), Arithmetic::Native).replace("= found_rays[index]", "= found_rays.x");
        assert!(naga::front::wgsl::parse_str(&source).is_err());
    }

    #[test]
    fn shaders_declare_the_hosts_bindings() {
        for stage in all() {
            for (name, module) in variants(stage) {
                assert_eq!(bindings(&name, &module), stage.bindings, "{name}");
                assert!(module.entry_points.iter().any(|point| point.name == stage.entry), "{name}");
            }
        }
    }

    #[test]
    fn shader_structs_have_the_layout_of_the_rust_structs() {
        let mut seen = 0;
        for stage in all() {
            for (name, module) in variants(stage) {
                for (of, expected) in [
                    ("View", View::OFFSETS),
                    ("BandView", BandView::OFFSETS),
                    ("Tally", Tally::OFFSETS),
                    ("Found", Found::OFFSETS),
                    ("FoundRead", Found::OFFSETS),
                ] {
                    let Some(found) = members(&module, of) else { continue };
                    assert_eq!(found, expected, "{name}");
                    seen += 1;
                }
            }
        }
        assert!(seen > 20, "only {seen} structs were found");
    }
}
