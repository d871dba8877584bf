//! The catalogue of metrics. Each is declared here once, as a constant, which is its id: [`POROSITY`]. Metrics that differ by
//! axis or by statistic are declared as a family: [`CHORD_SOLID`]`.along(Axis::X)`, [`SOLID_THICKNESS`]`.of(Statistic::Mean)`.
//!
//! The text of an id, in files and limits, is stable. It leads from phase or subject to axis (`x`, `y`, `z`) or statistic
//! (`mean`, `sd`, `min`, `p1`, `p5`, `p50`, `p95`, `max`); the name of the constant is this text in capitals, and
//! [`PERCOLATION_ALONG`] differs from [`PERCOLATION`] in its ending.

use std::ops::Deref;
use std::slice;

use serde::{Serialize, Serializer};

use super::quantity::Quantity::{self, Length, Number, Share};
use crate::grid::Axis;

/// The section of the table that a metric is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Group {
    /// Volumes and shares of volume.
    Volume,
    /// Areas and curvature.
    Surface,
    /// Access to the pores from outside, and percolation.
    Access,
    /// Thickness of the solid and width of the pores.
    Thickness,
    /// Chord lengths.
    Chords,
    /// Mean intercept lengths by direction.
    Anisotropy,
    /// Pieces, holes and cavities.
    Topology,
    /// Tortuosity and permeability.
    Transport,
    /// Centroid and inertia.
    Moments,
    /// Overhang and thin walls.
    Manufacture,
}

/// The id of a metric: a reference to its definition. The constants of this module are the only ids.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetricId(&'static Definition);

/// The definition of a metric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Definition {
    /// The text of the id.
    pub id: &'static str,
    /// The section of the table.
    pub group: Group,
    /// The symbol in the literature.
    pub symbol: &'static str,
    /// The name for readers.
    pub name: &'static str,
    /// The definition in one line.
    pub definition: &'static str,
    /// The dimension of the value.
    pub quantity: Quantity,
    /// The method of measurement.
    pub method: &'static str,
    /// The source of the definition.
    pub reference: &'static str,
}

/// The ids of metrics that differ by axis.
#[derive(Clone, Copy, Debug)]
pub struct ByAxis(&'static [Definition; 3]);

/// The ids of the statistics of one distribution of lengths.
#[derive(Clone, Copy, Debug)]
pub struct ByStatistic(&'static [Definition; 8]);

/// A statistic of a distribution, by volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Statistic {
    /// The mean.
    Mean,
    /// The standard deviation.
    StandardDeviation,
    /// The least value.
    Min,
    /// The 1st percentile.
    P1,
    /// The 5th percentile.
    P5,
    /// The median.
    P50,
    /// The 95th percentile.
    P95,
    /// The largest value.
    Max,
}

impl Deref for MetricId {
    type Target = Definition;

    fn deref(&self) -> &Definition {
        self.0
    }
}

/// Serialises the text of the id.
impl Serialize for MetricId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0.id)
    }
}

impl MetricId {
    const fn definitions(self) -> &'static [Definition] {
        slice::from_ref(self.0)
    }
}

impl ByAxis {
    /// Returns the metric along an axis.
    pub const fn along(self, axis: Axis) -> MetricId {
        MetricId(&self.0[axis.depth()])
    }

    /// Returns the metrics along x, y and z.
    pub fn all(self) -> [MetricId; 3] {
        self.0.each_ref().map(MetricId)
    }

    const fn definitions(self) -> &'static [Definition] {
        self.0
    }
}

impl ByStatistic {
    /// Returns the metric of a statistic.
    pub const fn of(self, statistic: Statistic) -> MetricId {
        MetricId(&self.0[statistic as usize])
    }

    /// Returns the metrics of all statistics.
    pub fn all(self) -> [MetricId; 8] {
        self.0.each_ref().map(MetricId)
    }

    const fn definitions(self) -> &'static [Definition] {
        self.0
    }
}

/// Returns all metrics, in the order of the report.
pub fn all() -> impl Iterator<Item = MetricId> {
    CATALOGUE.iter().copied().flatten().map(MetricId)
}

/// Expands to the definition of one metric: its declaration, with an ending for each of id, symbol and name.
macro_rules! definition {
    ([$id:literal, $group:ident, $symbol:literal, $name:literal, $quantity:expr, $method:expr, $reference:expr, $text:literal],
     $of_id:literal, $of_symbol:literal, $of_name:literal) => {
        Definition {
            id: concat!($id, $of_id),
            group: Group::$group,
            symbol: concat!($symbol, $of_symbol),
            name: concat!($name, $of_name),
            definition: $text,
            quantity: $quantity,
            method: $method,
            reference: $reference,
        }
    };
}

/// Expands to the definitions of a declaration: one, or all of a family.
#[rustfmt::skip]
macro_rules! definitions {
    (MetricId, $declared:tt) => {
        definition!($declared, "", "", "")
    };
    (ByAxis, $declared:tt) => {
        [
            definition!($declared, ".x", " x", " along x"),
            definition!($declared, ".y", " y", " along y"),
            definition!($declared, ".z", " z", " along z"),
        ]
    };
    (ByStatistic, [$id:literal, $group:ident, $symbol:literal, $name:literal, $quantity:expr, $method:expr, $reference:expr, $text:literal]) => {
        [
            definition!([$id, $group, $symbol, $name, $quantity, $method, $reference, $text], ".mean", "", ", mean"),
            definition!([$id, $group, $symbol, $name, $quantity, $method, $reference, "Standard deviation by volume."], ".sd", ".SD", ", standard deviation"),
            definition!([$id, $group, $symbol, $name, $quantity, $method, $reference, "The least value of any node."], ".min", " min", ", least"),
            definition!([$id, $group, $symbol, $name, $quantity, $method, $reference, "1 % of the volume has less."], ".p1", " p1", ", 1st percentile"),
            definition!([$id, $group, $symbol, $name, $quantity, $method, $reference, "5 % of the volume has less."], ".p5", " p5", ", 5th percentile"),
            definition!([$id, $group, $symbol, $name, $quantity, $method, $reference, "Half of the volume has less."], ".p50", " p50", ", median"),
            definition!([$id, $group, $symbol, $name, $quantity, $method, $reference, "95 % of the volume has less."], ".p95", " p95", ", 95th percentile"),
            definition!([$id, $group, $symbol, $name, $quantity, $method, $reference, "The largest value of any node."], ".max", " max", ", largest"),
        ]
    };
}

/// Declares metrics as constants, and the catalogue of all of them in this order.
macro_rules! catalogue {
    ($($constant:ident: $kind:ident = [$id:literal, $group:ident, $symbol:literal, $name:literal, $quantity:expr, $method:expr, $reference:expr, $text:literal];)*) => {
        $(
            #[doc = concat!("`", $id, "`, ", $symbol, ": ", $name, ". ", $text)]
            pub const $constant: $kind =
                $kind(&definitions!($kind, [$id, $group, $symbol, $name, $quantity, $method, $reference, $text]));
        )*

        const CATALOGUE: &[&[Definition]] = &[$($constant.definitions()),*];
    };
}

const BOUXSEIN: &str = "Bouxsein et al. 2010, J. Bone Miner. Res. 25:1468";
const HILDEBRAND: &str = "Hildebrand & Rüegsegger 1997, J. Microsc. 185:67";
const MOORE: &str = "Moore et al. 2004, J. Biomed. Mater. Res. A 71:258";
const TORQUATO: &str = "Torquato 2002, Random Heterogeneous Materials, §2.5";
const HARRIGAN: &str = "Harrigan & Mann 1984, J. Mater. Sci. 19:761";
const ODGAARD: &str = "Odgaard & Gundersen 1993, Bone 14:173";
const MIRTICH: &str = "Mirtich 1996, J. Graphics Tools 1:31";
const SANTALO: &str = "Santaló 1976, Integral Geometry and Geometric Probability, ch. 13";
const CARMAN: &str = "Carman 1937, Trans. Inst. Chem. Eng. 15:150";
const GHANBARIAN: &str = "Ghanbarian et al. 2013, Soil Sci. Soc. Am. J. 77:1461";
const OWN: &str = "defined in the method";

const RAYS: &str = "integral along rays of three directions";
const NODES: &str = "count of raster nodes";
const FACETS: &str =
    "sum over the facets of the mesh; in a region of interest, over the hits of rays of three directions";
const BALLS: &str = "largest balls between exact ray crossings, their centres not bound to the raster";
const FLOOD: &str = "flood of the largest balls' radii from the faces of the region";
const CHORDS: &str = "length of the phase on rays along this axis over half the ends that the surface makes; what the region cuts distorts nothing";
const WHOLE_CHORDS: &str =
    "segments of rays along this axis that end at the surface on both sides; cut ones are left out";
const CUBES: &str = "V − E + F − C of the cubes around solid nodes";
const POISSON: &str = "Laplace's equation on raster nodes, conjugate gradients with multigrid";
const MARCHING: &str = "fast marching on raster nodes";

// Id, group, symbol, name, dimension, method, reference, definition.
catalogue! {
    VOLUME_TOTAL: MetricId = ["volume.total", Volume, "TV", "Volume of the region", Length(3), "product of the box's sides; of a region of interest, integral along rays of three directions", BOUXSEIN, "The volume within which all else is measured: the solid's box, or the region of interest."];
    VOLUME_SOLID: MetricId = ["volume.solid", Volume, "BV", "Volume of the solid", Length(3), RAYS, BOUXSEIN, "The volume of the solid within the region."];
    VOLUME_MESH: MetricId = ["volume.mesh", Volume, "V mesh", "Volume of the whole mesh", Length(3), "divergence sum over the facets, f64", MIRTICH, "What the triangles themselves enclose, in or out of the region: a check on BV."];
    VOLUME_FRACTION: MetricId = ["volume.fraction", Volume, "BV/TV", "Solid volume fraction", Share, RAYS, BOUXSEIN, "The share of the region that is solid."];
    POROSITY: MetricId = ["porosity", Volume, "φ", "Porosity", Share, RAYS, BOUXSEIN, "The share of the region that is not solid, 1 − BV/TV."];
    POROSITY_OPEN: MetricId = ["porosity.open", Volume, "φ open", "Open porosity", Share, "flood through faces of nodes from the faces of the region", BOUXSEIN, "The share of the region that is pore and reached from outside."];
    POROSITY_CLOSED: MetricId = ["porosity.closed", Volume, "φ closed", "Closed porosity", Share, "flood through faces of nodes from the faces of the region", BOUXSEIN, "The share of the region that is pore and walled in."];
    SURFACE_AREA: MetricId = ["surface.area", Surface, "BS", "Surface", Length(2), FACETS, BOUXSEIN, "The surface between solid and pore within the region, without faces that the region cuts."];
    SURFACE_MESH: MetricId = ["surface.mesh", Surface, "S mesh", "Surface of the whole mesh", Length(2), "sum of the areas of all triangles, f64", OWN, "The area of all triangles, in or out of the region, with the faces that lie in the faces of the box: BS leaves those out, as the solid counts as cut there."];
    SURFACE_SPECIFIC: MetricId = ["surface.specific", Surface, "BS/BV", "Specific surface", Length(-1), FACETS, BOUXSEIN, "Surface by volume of solid."];
    SURFACE_DENSITY: MetricId = ["surface.density", Surface, "BS/TV", "Surface density", Length(-1), FACETS, BOUXSEIN, "Surface by volume of the region."];
    SURFACE_CURVATURE_MEAN: MetricId = ["surface.curvature.mean", Surface, "∫H", "Integral of mean curvature", Length(1), "half the sum of edge lengths times exterior angles, over the edges of the mesh, without those in faces of the box", SANTALO, "The integral over the surface of the mean of the principal curvatures: positive where the solid bulges."];
    SURFACE_CURVATURE_GAUSS: MetricId = ["surface.curvature.gauss", Surface, "∫K", "Integral of Gaussian curvature", Number, "sum of angle deficits at the vertices of the mesh, without those in faces of the box", SANTALO, "Of a closed surface that nothing cuts, 2π times its Euler characteristic."];
    PERCOLATION: MetricId = ["percolation", Access, "d perc", "Percolation diameter", Length(1), FLOOD, MOORE, "The largest ball that gets through the pores from face to opposite face along each of the axes, the hardest included."];
    PERCOLATION_ALONG: ByAxis = ["percolation", Access, "d perc", "Percolation diameter", Length(1), FLOOD, MOORE, "The largest ball that gets through the pores from face to face along this axis."];
    PORE_LARGEST: MetricId = ["pore.largest", Access, "d max", "Largest pore", Length(1), BALLS, MOORE, "The largest ball that fits into the pores."];
    ACCESS_HALF: MetricId = ["access.half", Access, "d 50", "Diameter with half access", Length(1), FLOOD, MOORE, "A ball of this diameter reaches half of the pore volume from outside."];
    PORE_ACCESS: ByStatistic = ["pore.access", Access, "Acc.Dm", "Access-limited pore size", Length(1), FLOOD, MOORE, "The diameter of the largest ball that gets from outside to where it holds a point, averaged over the pore volume; closed pores are left out."];
    SOLID_THICKNESS: ByStatistic = ["solid.thickness", Thickness, "Tb.Th", "Thickness of the solid", Length(1), BALLS, HILDEBRAND, "The diameter of the largest ball in the solid that holds a point, averaged over its volume."];
    PORE_THICKNESS: ByStatistic = ["pore.thickness", Thickness, "Tb.Sp", "Width of the pores", Length(1), BALLS, HILDEBRAND, "The diameter of the largest ball in the pores that holds a point, averaged over their volume."];
    NUMBER: MetricId = ["number", Thickness, "Tb.N", "Trabecular number", Length(-1), BALLS, HILDEBRAND, "Walls met on a length: 1 / (Tb.Th + Tb.Sp)."];
    WALL_THINNEST: MetricId = ["wall.thinnest", Thickness, "Th p1", "Thinnest wall (1st percentile)", Length(1), BALLS, HILDEBRAND, "The thickness that 1 % of the solid falls below, without what the faces of the region cut thinner; sharp edges are thin."];
    CHORD_SOLID: ByAxis = ["chord.solid", Chords, "ℓ solid", "Mean solid chord", Length(1), CHORDS, TORQUATO, "Mean length of the segments of lines along this axis within the solid."];
    CHORD_PORE: ByAxis = ["chord.pore", Chords, "ℓ pore", "Mean pore chord", Length(1), CHORDS, TORQUATO, "Mean length of the segments of lines along this axis within the pores."];
    CHORD_SOLID_WEIGHTED: ByAxis = ["chord.solid.weighted", Chords, "ℓL solid", "Length-weighted solid chord", Length(1), WHOLE_CHORDS, TORQUATO, "Of whole chords, each counted by its length: what a random point of the solid lies on."];
    CHORD_PORE_WEIGHTED: ByAxis = ["chord.pore.weighted", Chords, "ℓL pore", "Length-weighted pore chord", Length(1), WHOLE_CHORDS, TORQUATO, "Of whole chords, each counted by its length: what a random point of the pores lies on."];
    CHORD_CENSORED: ByAxis = ["chord.censored", Chords, "cut", "Chords cut by the region", Share, "segments of rays along this axis", TORQUATO, "The share of chords, of both phases, that end at the region's boundary and not at a surface."];
    ANISOTROPY: MetricId = ["anisotropy", Anisotropy, "DA", "Degree of anisotropy", Number, FACETS, HARRIGAN, "1 − (c/a)² of the mean intercept lengths' ellipsoid: 0 of an isotropic solid, 1 of parallel plates."];
    INTERCEPT_LONG: MetricId = ["intercept.long", Anisotropy, "MIL a", "Longest mean intercept", Length(1), FACETS, HARRIGAN, "The longest half axis of the ellipsoid of mean intercept lengths."];
    INTERCEPT_MIDDLE: MetricId = ["intercept.middle", Anisotropy, "MIL b", "Middle mean intercept", Length(1), FACETS, HARRIGAN, "Its middle half axis."];
    INTERCEPT_SHORT: MetricId = ["intercept.short", Anisotropy, "MIL c", "Shortest mean intercept", Length(1), FACETS, HARRIGAN, "Its shortest half axis."];
    EULER: MetricId = ["euler", Topology, "χ", "Euler characteristic", Number, CUBES, ODGAARD, "Pieces minus tunnels plus cavities of the solid within the region."];
    EULER_MESH: MetricId = ["euler.mesh", Topology, "χ mesh", "Euler characteristic of the mesh", Number, "half of V − E + F of the whole mesh", ODGAARD, "The same of the mesh, which knows no raster."];
    BETTI_0: MetricId = ["betti.0", Topology, "β₀", "Pieces of the solid", Number, "nodes joined through faces, edges and corners", ODGAARD, "Connected pieces of the solid."];
    BETTI_1: MetricId = ["betti.1", Topology, "β₁", "Tunnels", Number, "β₀ + β₂ − χ", ODGAARD, "Independent loops: how many struts can be cut before a piece comes off."];
    BETTI_2: MetricId = ["betti.2", Topology, "β₂", "Cavities", Number, "pore nodes joined through faces", ODGAARD, "Pores that the solid walls in on all sides."];
    PIECE_LARGEST: MetricId = ["piece.largest", Topology, "largest", "Share of the largest piece", Share, NODES, OWN, "The share of the solid's volume in its largest piece: less than 1 where something is loose."];
    CONNECTIVITY: MetricId = ["connectivity", Topology, "Conn.D", "Connectivity density", Length(-3), CUBES, ODGAARD, "(1 − Δχ)/TV, Δχ being the Euler characteristic without what the region's faces add."];
    TORTUOSITY_PORE_GEODESIC: ByAxis = ["tortuosity.pore.geodesic", Transport, "τ geo", "Geodesic tortuosity of the pores", Number, MARCHING, GHANBARIAN, "The mean shortest path through the pores from face to face, over the straight one."];
    TORTUOSITY_PORE_DIFFUSIVE: ByAxis = ["tortuosity.pore.diffusive", Transport, "τ diff", "Diffusive tortuosity of the pores", Number, POISSON, GHANBARIAN, "φ D₀/D: how much slower diffusion is than through straight tubes; φ is the porosity of the pores that reach from face to face along the axis, closed and blind ones left out."];
    TORTUOSITY_SOLID_DIFFUSIVE: ByAxis = ["tortuosity.solid.diffusive", Transport, "τ cond", "Conductive tortuosity of the solid", Number, POISSON, GHANBARIAN, "φ k₀/k: how much worse the solid conducts than straight bars; φ is the volume fraction of the pieces that reach from face to face along the axis."];
    PERMEABILITY: MetricId = ["permeability", Transport, "k", "Permeability, Kozeny–Carman", Length(2), "estimate φ³/(K·(BS/TV)²); no flow is computed", CARMAN, "A rule of thumb for granular beds; of scaffolds, an order of magnitude."];
    CENTROID_SOLID: ByAxis = ["centroid.solid", Moments, "c solid", "Centroid of the solid", Length(1), RAYS, MIRTICH, "The centre of mass of the solid within the region, in the file's coordinates."];
    CENTROID_PORE: ByAxis = ["centroid.pore", Moments, "c pore", "Centroid of the pores", Length(1), RAYS, MIRTICH, "The centre of mass of the pores."];
    INERTIA_XX: MetricId = ["inertia.xx", Moments, "I xx", "Moment of inertia about x", Length(5), RAYS, MIRTICH, "Of the solid, of unit density, about its centroid."];
    INERTIA_YY: MetricId = ["inertia.yy", Moments, "I yy", "Moment of inertia about y", Length(5), RAYS, MIRTICH, "Of the solid, of unit density, about its centroid."];
    INERTIA_ZZ: MetricId = ["inertia.zz", Moments, "I zz", "Moment of inertia about z", Length(5), RAYS, MIRTICH, "Of the solid, of unit density, about its centroid."];
    INERTIA_XY: MetricId = ["inertia.xy", Moments, "I xy", "Product of inertia xy", Length(5), RAYS, MIRTICH, "Of the solid, of unit density, about its centroid: −∫xy."];
    INERTIA_XZ: MetricId = ["inertia.xz", Moments, "I xz", "Product of inertia xz", Length(5), RAYS, MIRTICH, "Of the solid, of unit density, about its centroid: −∫xz."];
    INERTIA_YZ: MetricId = ["inertia.yz", Moments, "I yz", "Product of inertia yz", Length(5), RAYS, MIRTICH, "Of the solid, of unit density, about its centroid: −∫yz."];
    OVERHANG: MetricId = ["overhang", Manufacture, "overhang", "Overhanging surface", Share, FACETS, OWN, "The share of the surface that faces down more steeply than the limit angle allows when it is printed."];
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn every_metric_has_one_name_and_says_what_it_is() {
        let mut ids = HashSet::new();
        for metric in all() {
            assert!(ids.insert(metric.id), "{} stands twice", metric.id);
            assert!(metric.definition.ends_with(['.', 'z', 'y']), "{}", metric.id);
        }
        assert!(ids.len() > 90, "{}", ids.len());
    }

    #[test]
    fn statistics_and_axes_select_members_by_name() {
        use Statistic::*;
        let ends = [Mean, StandardDeviation, Min, P1, P5, P50, P95, Max].map(|of| SOLID_THICKNESS.of(of).id);
        let stem = "solid.thickness";
        assert_eq!(ends, ["mean", "sd", "min", "p1", "p5", "p50", "p95", "max"].map(|end| format!("{stem}.{end}")));
        assert_eq!(
            Axis::ALL.map(|axis| CHORD_SOLID.along(axis).id),
            ["chord.solid.x", "chord.solid.y", "chord.solid.z"]
        );
    }
}
