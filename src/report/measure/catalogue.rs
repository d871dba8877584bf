//! The catalogue of metrics: names, definitions, references and methods.

use crate::report::quantity::Quantity;
use crate::report::scaffold_report::Group;

/// The definition of a metric.
#[derive(Clone, Copy, Debug)]
pub struct Definition {
    pub id: &'static str,
    pub group: Group,
    pub symbol: &'static str,
    pub name: &'static str,
    pub definition: &'static str,
    pub quantity: Quantity,
    pub method: &'static str,
    pub reference: &'static str,
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
    "stretches of rays along this axis that end at the surface on both sides; cut ones are left out";
const CUBES: &str = "V − E + F − C of the cubes around solid nodes";
const POISSON: &str = "Laplace's equation on raster nodes, conjugate gradients with multigrid";
const MARCHING: &str = "fast marching on raster nodes";

macro_rules! definition {
    ($id:expr, $group:ident, $symbol:expr, $name:expr, $quantity:expr, $method:expr, $reference:expr, $text:expr) => {
        Definition {
            id: $id,
            group: Group::$group,
            symbol: $symbol,
            name: $name,
            definition: $text,
            quantity: $quantity,
            method: $method,
            reference: $reference,
        }
    };
}

/// Expands to definitions along x, y and z.
macro_rules! along_axes {
    ($id:literal, $group:ident, $symbol:literal, $name:literal, $quantity:expr, $method:expr, $reference:expr, $text:literal) => {
        [
            definition!(
                concat!($id, ".x"),
                $group,
                concat!($symbol, " x"),
                concat!($name, " along x"),
                $quantity,
                $method,
                $reference,
                $text
            ),
            definition!(
                concat!($id, ".y"),
                $group,
                concat!($symbol, " y"),
                concat!($name, " along y"),
                $quantity,
                $method,
                $reference,
                $text
            ),
            definition!(
                concat!($id, ".z"),
                $group,
                concat!($symbol, " z"),
                concat!($name, " along z"),
                $quantity,
                $method,
                $reference,
                $text
            ),
        ]
    };
}

/// Expands to the statistics of a distribution of lengths.
macro_rules! spread {
    ($id:literal, $group:ident, $symbol:literal, $name:literal, $method:expr, $reference:expr, $text:literal) => {
        [
            definition!(
                concat!($id, ".mean"),
                $group,
                $symbol,
                concat!($name, ", mean"),
                Quantity::Length(1),
                $method,
                $reference,
                $text
            ),
            definition!(
                concat!($id, ".sd"),
                $group,
                concat!($symbol, ".SD"),
                concat!($name, ", standard deviation"),
                Quantity::Length(1),
                $method,
                $reference,
                "Standard deviation by volume."
            ),
            definition!(
                concat!($id, ".min"),
                $group,
                concat!($symbol, " min"),
                concat!($name, ", least"),
                Quantity::Length(1),
                $method,
                $reference,
                "The least value of any node."
            ),
            definition!(
                concat!($id, ".p1"),
                $group,
                concat!($symbol, " p1"),
                concat!($name, ", 1st percentile"),
                Quantity::Length(1),
                $method,
                $reference,
                "1 % of the volume has less."
            ),
            definition!(
                concat!($id, ".p5"),
                $group,
                concat!($symbol, " p5"),
                concat!($name, ", 5th percentile"),
                Quantity::Length(1),
                $method,
                $reference,
                "5 % of the volume has less."
            ),
            definition!(
                concat!($id, ".p50"),
                $group,
                concat!($symbol, " p50"),
                concat!($name, ", median"),
                Quantity::Length(1),
                $method,
                $reference,
                "Half of the volume has less."
            ),
            definition!(
                concat!($id, ".p95"),
                $group,
                concat!($symbol, " p95"),
                concat!($name, ", 95th percentile"),
                Quantity::Length(1),
                $method,
                $reference,
                "95 % of the volume has less."
            ),
            definition!(
                concat!($id, ".max"),
                $group,
                concat!($symbol, " max"),
                concat!($name, ", largest"),
                Quantity::Length(1),
                $method,
                $reference,
                "The largest value of any node."
            ),
        ]
    };
}

const NUMBER: Quantity = Quantity::Number;
const SHARE: Quantity = Quantity::Share;
const fn length(power: i8) -> Quantity {
    Quantity::Length(power)
}

/// All metrics, in the order of the report.
#[rustfmt::skip]
pub const CATALOGUE: &[&[Definition]] = &[
    &[
        definition!("volume.total", Volume, "TV", "Volume of the region", length(3), "product of the box's sides; of a region of interest, integral along rays of three directions", BOUXSEIN, "The volume within which all else is measured: the solid's box, or the region of interest."),
        definition!("volume.solid", Volume, "BV", "Volume of the solid", length(3), RAYS, BOUXSEIN, "The volume of the solid within the region."),
        definition!("volume.mesh", Volume, "V mesh", "Volume of the whole mesh", length(3), "divergence sum over the facets, f64", MIRTICH, "What the triangles themselves enclose, in or out of the region: a check on BV."),
        definition!("volume.fraction", Volume, "BV/TV", "Solid volume fraction", SHARE, RAYS, BOUXSEIN, "The share of the region that is solid."),
        definition!("porosity", Volume, "φ", "Porosity", SHARE, RAYS, BOUXSEIN, "The share of the region that is not solid, 1 − BV/TV."),
        definition!("porosity.open", Volume, "φ open", "Open porosity", SHARE, "flood through faces of nodes from the faces of the region", BOUXSEIN, "The share of the region that is pore and reached from outside."),
        definition!("porosity.closed", Volume, "φ closed", "Closed porosity", SHARE, "flood through faces of nodes from the faces of the region", BOUXSEIN, "The share of the region that is pore and walled in."),
        definition!("surface.area", Surface, "BS", "Surface", length(2), FACETS, BOUXSEIN, "The surface between solid and pore within the region, without faces that the region cuts."),
        definition!("surface.mesh", Surface, "S mesh", "Surface of the whole mesh", length(2), "sum of the areas of all triangles, f64", OWN, "The area of all triangles, in or out of the region, with the faces that lie in the faces of the box: BS leaves those out, as the solid counts as cut there."),
        definition!("surface.specific", Surface, "BS/BV", "Specific surface", length(-1), FACETS, BOUXSEIN, "Surface by volume of solid."),
        definition!("surface.density", Surface, "BS/TV", "Surface density", length(-1), FACETS, BOUXSEIN, "Surface by volume of the region."),
        definition!("surface.curvature.mean", Surface, "∫H", "Integral of mean curvature", length(1), "half the sum of edge lengths times exterior angles, over the edges of the mesh, without those in faces of the box", SANTALO, "The integral over the surface of the mean of the principal curvatures: positive where the solid bulges."),
        definition!("surface.curvature.gauss", Surface, "∫K", "Integral of Gaussian curvature", NUMBER, "sum of angle deficits at the vertices of the mesh, without those in faces of the box", SANTALO, "Of a closed surface that nothing cuts, 2π times its Euler characteristic."),
    ],
    &[
        definition!("percolation", Access, "d perc", "Percolation diameter", length(1), FLOOD, MOORE, "The largest ball that gets through the pores from face to opposite face along each of the axes, the hardest included."),
    ],
    &along_axes!("percolation", Access, "d perc", "Percolation diameter", length(1), FLOOD, MOORE, "The largest ball that gets through the pores from face to face along this axis."),
    &[
        definition!("pore.largest", Access, "d max", "Largest pore", length(1), BALLS, MOORE, "The largest ball that fits into the pores."),
        definition!("access.half", Access, "d 50", "Diameter with half access", length(1), FLOOD, MOORE, "A ball of this diameter reaches half of the pore volume from outside."),
    ],
    &spread!("pore.access", Access, "Acc.Dm", "Access-limited pore size", FLOOD, MOORE, "The diameter of the largest ball that gets from outside to where it holds a point, averaged over the pore volume; closed pores are left out."),
    &spread!("solid.thickness", Thickness, "Tb.Th", "Thickness of the solid", BALLS, HILDEBRAND, "The diameter of the largest ball in the solid that holds a point, averaged over its volume."),
    &spread!("pore.thickness", Thickness, "Tb.Sp", "Width of the pores", BALLS, HILDEBRAND, "The diameter of the largest ball in the pores that holds a point, averaged over their volume."),
    &[
        definition!("number", Thickness, "Tb.N", "Trabecular number", length(-1), BALLS, HILDEBRAND, "Walls met on a length: 1 / (Tb.Th + Tb.Sp)."),
        definition!("wall.thinnest", Thickness, "Th p1", "Thinnest wall (1st percentile)", length(1), BALLS, HILDEBRAND, "The thickness that 1 % of the solid falls below, without what the faces of the region cut thinner; sharp edges are thin."),
    ],
    &along_axes!("chord.solid", Chords, "ℓ solid", "Mean solid chord", length(1), CHORDS, TORQUATO, "Mean length of the stretches of lines along this axis within the solid."),
    &along_axes!("chord.pore", Chords, "ℓ pore", "Mean pore chord", length(1), CHORDS, TORQUATO, "Mean length of the stretches of lines along this axis within the pores."),
    &along_axes!("chord.solid.weighted", Chords, "ℓL solid", "Length-weighted solid chord", length(1), WHOLE_CHORDS, TORQUATO, "Of whole chords, each counted by its length: what a random point of the solid lies on."),
    &along_axes!("chord.pore.weighted", Chords, "ℓL pore", "Length-weighted pore chord", length(1), WHOLE_CHORDS, TORQUATO, "Of whole chords, each counted by its length: what a random point of the pores lies on."),
    &along_axes!("chord.censored", Chords, "cut", "Chords cut by the region", SHARE, "stretches of rays along this axis", TORQUATO, "The share of chords, of both phases, that end at the region's boundary and not at a surface."),
    &[
        definition!("anisotropy", Anisotropy, "DA", "Degree of anisotropy", NUMBER, FACETS, HARRIGAN, "1 − (c/a)² of the mean intercept lengths' ellipsoid: 0 of an isotropic solid, 1 of parallel plates."),
        definition!("intercept.long", Anisotropy, "MIL a", "Longest mean intercept", length(1), FACETS, HARRIGAN, "The longest half axis of the ellipsoid of mean intercept lengths."),
        definition!("intercept.middle", Anisotropy, "MIL b", "Middle mean intercept", length(1), FACETS, HARRIGAN, "Its middle half axis."),
        definition!("intercept.short", Anisotropy, "MIL c", "Shortest mean intercept", length(1), FACETS, HARRIGAN, "Its shortest half axis."),
        definition!("euler", Topology, "χ", "Euler characteristic", NUMBER, CUBES, ODGAARD, "Pieces minus tunnels plus cavities of the solid within the region."),
        definition!("euler.mesh", Topology, "χ mesh", "Euler characteristic of the mesh", NUMBER, "half of V − E + F of the whole mesh", ODGAARD, "The same of the mesh, which knows no raster."),
        definition!("betti.0", Topology, "β₀", "Pieces of the solid", NUMBER, "nodes joined through faces, edges and corners", ODGAARD, "Connected pieces of the solid."),
        definition!("betti.1", Topology, "β₁", "Tunnels", NUMBER, "β₀ + β₂ − χ", ODGAARD, "Independent loops: how many struts can be cut before a piece comes off."),
        definition!("betti.2", Topology, "β₂", "Cavities", NUMBER, "pore nodes joined through faces", ODGAARD, "Pores that the solid walls in on all sides."),
        definition!("piece.largest", Topology, "largest", "Share of the largest piece", SHARE, NODES, OWN, "The share of the solid's volume in its largest piece: less than 1 where something is loose."),
        definition!("connectivity", Topology, "Conn.D", "Connectivity density", length(-3), CUBES, ODGAARD, "(1 − Δχ)/TV, Δχ being the Euler characteristic without what the region's faces add."),
    ],
    &along_axes!("tortuosity.pore.geodesic", Transport, "τ geo", "Geodesic tortuosity of the pores", NUMBER, MARCHING, GHANBARIAN, "The mean shortest path through the pores from face to face, over the straight one."),
    &along_axes!("tortuosity.pore.diffusive", Transport, "τ diff", "Diffusive tortuosity of the pores", NUMBER, POISSON, GHANBARIAN, "φ D₀/D: how much slower diffusion is than through straight tubes; φ is the porosity of the pores that reach from face to face along the axis, closed and blind ones left out."),
    &along_axes!("tortuosity.solid.diffusive", Transport, "τ cond", "Conductive tortuosity of the solid", NUMBER, POISSON, GHANBARIAN, "φ k₀/k: how much worse the solid conducts than straight bars; φ is the volume fraction of the pieces that reach from face to face along the axis."),
    &[
        definition!("permeability", Transport, "k", "Permeability, Kozeny–Carman", length(2), "estimate φ³/(K·(BS/TV)²); no flow is computed", CARMAN, "A rule of thumb for granular beds; of scaffolds, an order of magnitude."),
    ],
    &along_axes!("centroid.solid", Moments, "c solid", "Centroid of the solid", length(1), RAYS, MIRTICH, "The centre of mass of the solid within the region, in the file's coordinates."),
    &along_axes!("centroid.pore", Moments, "c pore", "Centroid of the pores", length(1), RAYS, MIRTICH, "The centre of mass of the pores."),
    &[
        definition!("inertia.xx", Moments, "I xx", "Moment of inertia about x", length(5), RAYS, MIRTICH, "Of the solid, of unit density, about its centroid."),
        definition!("inertia.yy", Moments, "I yy", "Moment of inertia about y", length(5), RAYS, MIRTICH, "Of the solid, of unit density, about its centroid."),
        definition!("inertia.zz", Moments, "I zz", "Moment of inertia about z", length(5), RAYS, MIRTICH, "Of the solid, of unit density, about its centroid."),
        definition!("inertia.xy", Moments, "I xy", "Product of inertia xy", length(5), RAYS, MIRTICH, "Of the solid, of unit density, about its centroid: −∫xy."),
        definition!("inertia.xz", Moments, "I xz", "Product of inertia xz", length(5), RAYS, MIRTICH, "Of the solid, of unit density, about its centroid: −∫xz."),
        definition!("inertia.yz", Moments, "I yz", "Product of inertia yz", length(5), RAYS, MIRTICH, "Of the solid, of unit density, about its centroid: −∫yz."),
        definition!("overhang", Manufacture, "overhang", "Overhanging surface", SHARE, FACETS, OWN, "The share of the surface that faces down more steeply than the limit angle allows when it is printed."),
    ],
];

/// Returns all metrics, in the order of the report.
pub fn all() -> impl Iterator<Item = &'static Definition> {
    CATALOGUE.iter().copied().flatten()
}

/// Returns the metric of an id.
///
/// # Panics
/// If no metric has this id: ids are constants.
pub fn definition(id: &str) -> &'static Definition {
    all().find(|definition| definition.id == id).unwrap_or_else(|| panic!("no metric is called {id}"))
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn every_metric_has_one_name_and_says_what_it_is() {
        let mut ids = HashSet::new();
        for definition in all() {
            assert!(ids.insert(definition.id), "{} stands twice", definition.id);
            assert!(definition.definition.ends_with(['.', 'z', 'y']), "{}", definition.id);
        }
        assert!(ids.len() > 90, "{}", ids.len());
    }
}
