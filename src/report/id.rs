//! Stable names of metrics, for programs, limits and the parts of a report that select metrics by name.
//!
//! A name is the path from phase or subject to statistic. Statistics of a distribution are `mean`, `sd`, `min`, `p1`,
//! `p5`, `p50`, `p95` and `max`; directions are `x`, `y` and `z`.

/// TV, the volume of the region.
pub const TOTAL_VOLUME: &str = "volume.total";
/// BV, the volume of the solid in the region.
pub const SOLID_VOLUME: &str = "volume.solid";
/// 1 − BV/TV.
pub const POROSITY: &str = "porosity";
/// The share of the region in pores that reach its faces.
pub const OPEN_POROSITY: &str = "porosity.open";
/// The share of the region in pores that do not reach its faces.
pub const CLOSED_POROSITY: &str = "porosity.closed";
/// BS.
pub const SURFACE: &str = "surface.area";
/// BS/BV.
pub const SURFACE_PER_SOLID: &str = "surface.specific";
/// BS/TV.
pub const SURFACE_PER_TOTAL: &str = "surface.density";
/// The diameter of the largest ball that passes from face to face along the hardest of the axes.
pub const PERCOLATION: &str = "percolation";
/// The diameter of the largest ball that fits into the pores.
pub const LARGEST_PORE: &str = "pore.largest";
/// Tb.Th.
pub const THICKNESS: &str = "solid.thickness.mean";
/// Tb.Sp.
pub const SEPARATION: &str = "pore.thickness.mean";
/// Tb.N.
pub const NUMBER: &str = "number";
/// The 1st percentile of the thickness.
pub const THINNEST_WALL: &str = "wall.thinnest";
/// DA.
pub const ANISOTROPY: &str = "anisotropy";
/// Conn.D.
pub const CONNECTIVITY: &str = "connectivity";
/// The share of the surface that overhangs.
pub const OVERHANG: &str = "overhang";
