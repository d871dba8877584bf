//! Contouring: turns an implicit solid into a closed 2-manifold, clipped by a box whose faces stay exactly planar.
//!
//! # Theory
//! A solid {F < 0} is sampled on the nodes of a block of cubic cells; one further layer of nodes on every side counts
//! as outside. The result is the dual surface of this padded block: one quadrilateral for each grid edge whose ends
//! differ, one vertex in a cell for each loop that the surface leaves on the six faces of the cell. Faces are joined
//! where that surface would not be manifold; see [`cell`](crate::cell).
//!
//! Vertices of the outer layer do not lie half a cell outside: that layer has no thickness, so its vertices lie exactly
//! on the faces, edges and corners of the box. The axes along which a cell has thickness are *free*. A vertex whose
//! loop crosses an edge along a free axis is moved onto F = 0 within its free axes, so that the surface, and its
//! outline on the box, are exact to rounding; the other vertices tile the box face itself.
//!
//! Finally vertices move along the surface towards the mean of their neighbours and are put back on F = 0, which makes
//! the triangles more regular. Where this would turn a triangle over, it is undone.

use std::collections::HashSet;

use crate::parallel::*;
use glam::DVec3;

use super::{MAX_TRIANGLES, SolidError};
use crate::cancel::checkpoint;
use crate::cell::{Loops, Signs, at_fault, edge_at, edge_ends, loops};
use crate::mesh::TriangleMesh;

/// Largest number of sampled grid nodes; each takes a byte.
const MAX_NODES: u64 = 1 << 31;

/// Number of relaxation steps, in which vertices move towards their neighbours.
const RELAXATIONS: usize = 4;

/// Distance, in cells, by which a vertex may leave its cell when it moves along the surface.
const RELAXATION_REACH: f64 = 0.3;

/// Quality of a quadrilateral's split below which its vertices return to their positions before relaxation.
const POOR_QUALITY: f64 = 0.02;

/// A solid {F < 0}.
pub(super) trait Implicit: Sync {
    /// Returns F, continuous, in any unit.
    fn value(&self, p: DVec3) -> f64;

    /// Returns F and its gradient. The gradient steers the search for F = 0 and so need not be exact.
    ///
    /// `spacing` is the size of a grid cell, for solids that take differences.
    fn value_and_gradient(&self, p: DVec3, spacing: f64) -> (f64, DVec3) {
        let h = 1e-4 * spacing;
        let along = |e: DVec3| self.value(p + h * e) - self.value(p - h * e);
        (self.value(p), DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)) / (2.0 * h))
    }
}

/// The box that clips the solid, cut into cubic cells.
pub(super) struct Block {
    /// The least corner.
    pub min: DVec3,
    /// Side of a cell.
    pub spacing: f64,
    /// Number of cells along each axis, at least one.
    pub cells: [usize; 3],
}

/// Returns the triangles of the boundary of {F < 0} ∩ block: closed, outward, each edge in two triangles.
///
/// `fineness` is the parameter, with its value, that an error about too many nodes or triangles names.
pub(super) fn contour(
    solid: &dyn Implicit,
    block: &Block,
    fineness: (&'static str, f64),
) -> Result<TriangleMesh, SolidError> {
    let (parameter, value) = fineness;
    let nodes = block.cells.iter().fold(1_u64, |nodes, &n| nodes.saturating_mul(n as u64 + 3));
    if nodes > MAX_NODES {
        return Err(SolidError::TooManyNodes { parameter, value, nodes, limit: MAX_NODES });
    }
    let grid = Grid::sample(solid, block);
    let triangles = 2 * grid.count_crossings();
    if triangles > MAX_TRIANGLES {
        return Err(SolidError::TooManyTriangles { parameter, value, triangles, limit: MAX_TRIANGLES });
    }
    if triangles == 0 {
        return Err(SolidError::Empty { parameter, value });
    }
    let joined = grid.faces_to_join();
    let layers = grid.place_vertices(&joined);
    let quads = grid.quads(&layers);
    let vertices: Vec<Vertex> = layers.into_iter().flat_map(|layer| layer.vertices).collect();
    let placed: Vec<DVec3> = vertices.iter().map(|v| v.position).collect();
    let mut relaxed = grid.relax(&vertices, &quads);
    undo_poor(&placed, &mut relaxed, &quads);
    let triangles = quads.par_iter().flat_map_iter(|&quad| split(&relaxed, quad).1).collect();
    let positions = relaxed.iter().map(|&u| block.min + block.spacing * u).collect();
    Ok(TriangleMesh { positions, triangles })
}

/// The index of a node or cell of the padded block; on each axis node 0 and the last lie outside the box.
type Index = [usize; 3];

/// Signs on the padded nodes. Positions inside this module are in cells from `block.min`.
struct Grid<'a> {
    solid: &'a dyn Implicit,
    block: &'a Block,
    /// Number of nodes along each axis, padding included.
    nodes: Index,
    /// True for each node that is inside, x fastest.
    inside: Vec<bool>,
}

/// A vertex of the dual surface, with its constraints.
#[derive(Clone, Copy)]
struct Vertex {
    position: DVec3,
    /// The bounds of its cell, equal on an axis that is not free.
    low: DVec3,
    high: DVec3,
    /// True if it is constrained to F = 0.
    on_surface: bool,
}

impl Vertex {
    /// Returns one on the axes along which the vertex may move, zero on the others.
    fn free(&self) -> DVec3 {
        free_axes(self.low, self.high)
    }

    /// Returns whether every plane and surface that constrains `self` also constrains `other`, a neighbour.
    fn may_follow(&self, other: &Vertex) -> bool {
        other.free().cmple(self.free()).all() && (!self.on_surface || other.on_surface)
    }
}

/// Least number of vertices or quadrilaterals in one task: when the operation is stopped, each task that has begun unwinds.
const CHUNK: usize = 1 << 12;

fn free_axes(low: DVec3, high: DVec3) -> DVec3 {
    DVec3::select(low.cmplt(high), DVec3::ONE, DVec3::ZERO)
}

/// A cell that the surface crosses, with the index of its first vertex.
struct SurfaceCell {
    /// x + y · cells along x.
    place: usize,
    first_vertex: u32,
    loops: Loops,
}

/// All cells of one z.
struct Layer {
    cells: Vec<SurfaceCell>,
    vertices: Vec<Vertex>,
}

impl<'a> Grid<'a> {
    fn sample(solid: &'a dyn Implicit, block: &'a Block) -> Self {
        let nodes = block.cells.map(|n| n + 3);
        let [nx, ny, nz] = nodes;
        let mut inside = vec![false; nx * ny * nz];
        inside.par_chunks_mut(nx * ny).enumerate().filter(|&(z, _)| z > 0 && z < nz - 1).for_each(|(z, plane)| {
            for y in 1..ny - 1 {
                checkpoint();
                for x in 1..nx - 1 {
                    let u = DVec3::new((x - 1) as f64, (y - 1) as f64, (z - 1) as f64);
                    plane[y * nx + x] = solid.value(block.min + block.spacing * u) < 0.0;
                }
            }
        });
        Grid { solid, block, nodes, inside }
    }

    fn value(&self, u: DVec3) -> f64 {
        self.solid.value(self.block.min + self.block.spacing * u)
    }

    /// Returns F and its gradient in units of F per cell.
    fn value_and_gradient(&self, u: DVec3) -> (f64, DVec3) {
        let spacing = self.block.spacing;
        let (value, gradient) = self.solid.value_and_gradient(self.block.min + spacing * u, spacing);
        (value, spacing * gradient)
    }

    fn strides(&self) -> Index {
        [1, self.nodes[0], self.nodes[0] * self.nodes[1]]
    }

    fn node(&self, [x, y, z]: Index) -> usize {
        (z * self.nodes[1] + y) * self.nodes[0] + x
    }

    /// Returns the nodes of plane z, and the axes along which an edge leads upwards from them to a node of the other
    /// sign.
    fn crossings(&self, z: usize) -> impl Iterator<Item = (Index, usize)> + '_ {
        let [nx, ny, nz] = self.nodes;
        let strides = self.strides();
        (0..ny - 1).flat_map(move |y| {
            (0..nx - 1).flat_map(move |x| {
                let at = self.node([x, y, z]);
                let sign = self.inside[at];
                // The last plane has no edge along z, and all of it is outside, so that no edge along x or y changes
                // sign.
                (0..3)
                    .filter(move |_| z + 1 < nz)
                    .filter(move |&axis| self.inside[at + strides[axis]] != sign)
                    .map(move |axis| ([x, y, z], axis))
            })
        })
    }

    fn count_crossings(&self) -> u64 {
        (0..self.nodes[2]).into_par_iter().map(|z| self.crossings(z).count() as u64).sum()
    }

    /// Returns the corners of a cell that are inside, as bits.
    fn corners_inside(&self, cell: Index) -> u8 {
        let at = self.node(cell);
        let [dx, dy, dz] = self.strides();
        let is_inside = |c: usize| self.inside[at + (c & 1) * dx + ((c >> 1) & 1) * dy + (c >> 2) * dz];
        (0..8).fold(0, |bits, corner| bits | u8::from(is_inside(corner)) << corner)
    }

    /// Returns the key of the face of `cell` on `side` of `axis`: its least node and the axis across it.
    fn face(&self, mut cell: Index, axis: usize, side: usize) -> usize {
        cell[axis] += side;
        3 * self.node(cell) + axis
    }

    /// Returns the joined faces of a cell, as bits.
    fn faces_joined(&self, cell: Index, joined: &HashSet<usize>) -> u8 {
        if joined.is_empty() {
            return 0;
        }
        let is_joined = |face: usize| joined.contains(&self.face(cell, face / 2, face % 2));
        (0..6).fold(0, |bits, face| bits | u8::from(is_joined(face)) << face)
    }

    /// Finds the faces on which inside corners must be joined so that no four quadrilaterals meet in one edge.
    fn faces_to_join(&self) -> HashSet<usize> {
        let [nx, ny, nz] = self.nodes;
        let strides = self.strides();
        let ambiguous: Vec<(Index, usize)> = (1..nz - 1)
            .into_par_iter()
            .flat_map_iter(|z| {
                let places = (1..ny - 1).flat_map(move |y| (1..nx - 1).map(move |x| [x, y, z]));
                places.flat_map(move |place| {
                    (0..3).filter_map(move |axis| {
                        let at = self.node(place);
                        let (u, v) = (strides[(axis + 1) % 3], strides[(axis + 2) % 3]);
                        let [a, b, c, d] = [at, at + u, at + u + v, at + v].map(|node| self.inside[node]);
                        (a == c && b == d && a != b).then_some((place, axis))
                    })
                })
            })
            .collect();
        let mut joined = HashSet::new();
        for (above, axis) in ambiguous {
            let mut below = above;
            below[axis] -= 1;
            let of_cell =
                |cell| Signs { inside: self.corners_inside(cell), joined: self.faces_joined(cell, &joined), cut: 0 };
            if at_fault(axis, of_cell(below), of_cell(above)) {
                joined.insert(3 * self.node(above) + axis);
            }
        }
        joined
    }

    /// Returns the interval of a cell on each axis; the padding has no thickness.
    fn bounds(&self, cell: Index) -> (DVec3, DVec3) {
        let at = |axis: usize, node: usize| (node.max(1) - 1).min(self.block.cells[axis]) as f64;
        let corner = |s: usize| DVec3::new(at(0, cell[0] + s), at(1, cell[1] + s), at(2, cell[2] + s));
        (corner(0), corner(1))
    }

    /// Places the vertices of all cells, numbered consecutively by layer.
    fn place_vertices(&self, joined: &HashSet<usize>) -> Vec<Layer> {
        let [cx, cy, cz] = self.nodes.map(|n| n - 1);
        let mut layers: Vec<Layer> = (0..cz)
            .into_par_iter()
            .map(|z| {
                let mut layer = Layer { cells: Vec::new(), vertices: Vec::new() };
                for y in 0..cy {
                    checkpoint();
                    for x in 0..cx {
                        let cell = [x, y, z];
                        let inside = self.corners_inside(cell);
                        if inside == 0 || inside == u8::MAX {
                            continue;
                        }
                        let loops = loops(Signs { inside, joined: self.faces_joined(cell, joined), cut: 0 });
                        let first_vertex = layer.vertices.len() as u32;
                        layer.cells.push(SurfaceCell { place: y * cx + x, first_vertex, loops });
                        self.place_in_cell(cell, inside, &loops, &mut layer.vertices);
                    }
                }
                layer
            })
            .collect();
        let mut first = 0;
        for layer in &mut layers {
            layer.cells.iter_mut().for_each(|cell| cell.first_vertex += first);
            first += layer.vertices.len() as u32;
        }
        layers
    }

    fn place_in_cell(&self, cell: Index, inside: u8, loops: &Loops, vertices: &mut Vec<Vertex>) {
        let (low, high) = self.bounds(cell);
        let free = free_axes(low, high);
        let at = |corner: usize| {
            let bits = DVec3::new((corner & 1) as f64, ((corner >> 1) & 1) as f64, (corner >> 2) as f64);
            low + bits * (high - low)
        };
        // Nodes of the padding coincide with nodes of the box but are not on F; only edges along free axes are.
        let mut values = [f64::NAN; 8];
        let mut value_at = |corner: usize| {
            if values[corner].is_nan() {
                values[corner] = self.value(at(corner));
            }
            values[corner]
        };
        for this in 0..loops.count {
            let (mut sum, mut count, mut anchors) = (DVec3::ZERO, 0, [0; 2]);
            for edge in (0..12).filter(|&edge| loops.of_crossing[edge] == this && free[edge / 4] > 0.0) {
                let (a, b) = edge_ends(edge);
                let (fa, fb) = (value_at(a), value_at(b));
                let t = (fa / (fa - fb)).clamp(0.0, 1.0);
                sum += at(a).lerp(at(b), t);
                count += 1;
                anchors = if inside >> a & 1 == 1 { [a, b] } else { [b, a] };
            }
            if count == 0 {
                vertices.push(Vertex { position: (low + high) / 2.0, low, high, on_surface: false });
                continue;
            }
            // A margin keeps vertices of neighbouring cells apart, and with them the corners of every triangle.
            let margin = 1e-3 * (high - low);
            let start = (sum / f64::from(count)).clamp(low + margin, high - margin);
            let position = self.resolve(start, free, low + margin, high - margin).unwrap_or_else(|| {
                // The edge crossed last has both signs at its ends, so a path from either meets the surface.
                let end = at(if self.value(start) < 0.0 { anchors[1] } else { anchors[0] });
                self.bisect(start, end).clamp(low + margin, high - margin)
            });
            vertices.push(Vertex { position, low, high, on_surface: true });
        }
    }

    /// Runs Newton's method from `u` to F = 0 along the `free` axes and within bounds; `None` if it does not converge.
    fn resolve(&self, mut u: DVec3, free: DVec3, low: DVec3, high: DVec3) -> Option<DVec3> {
        let start = u;
        for _ in 0..12 {
            let (value, slope) = self.value_and_gradient(u);
            let mut gradient = slope * free;
            // An axis against whose bound the step presses is no longer free.
            let outwards = DVec3::select(
                u.cmple(low),
                DVec3::splat(value.signum()) * gradient,
                DVec3::select(u.cmpge(high), DVec3::splat(-value.signum()) * gradient, DVec3::ZERO),
            );
            gradient = DVec3::select(outwards.cmpgt(DVec3::ZERO), DVec3::ZERO, gradient);
            let steepness = gradient.length_squared();
            if value * value <= 1e-22 * steepness {
                return Some(u);
            }
            let step = -value / steepness * gradient;
            if !step.is_finite() || u.distance_squared(start) > 1.0 {
                return None;
            }
            u = (u + step.clamp_length_max(0.5)).clamp(low, high);
        }
        None
    }

    /// Returns a point of F = 0 between `a` and `b`, which have different signs.
    fn bisect(&self, a: DVec3, b: DVec3) -> DVec3 {
        let inside = self.value(a) < 0.0;
        let (mut near, mut far) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = (near + far) / 2.0;
            if (self.value(a.lerp(b, middle)) < 0.0) == inside {
                near = middle;
            } else {
                far = middle;
            }
        }
        a.lerp(b, near)
    }

    /// Returns four vertices, counter-clockwise seen from outside, for each crossed edge.
    fn quads(&self, layers: &[Layer]) -> Vec<[u32; 4]> {
        let [cx, cy, _] = self.nodes.map(|n| n - 1);
        (1..self.nodes[2] - 1)
            .into_par_iter()
            .flat_map_iter(|z| {
                checkpoint();
                // Edges of plane z and those that rise from it touch only the cells below and above the plane.
                let index = |layer: &Layer| {
                    let mut at = vec![u32::MAX; cx * cy];
                    layer.cells.iter().enumerate().for_each(|(i, cell)| at[cell.place] = i as u32);
                    at
                };
                let near = [index(&layers[z - 1]), index(&layers[z])];
                let above = self.crossings(z);
                let rising_into = (z == 1).then(|| self.crossings(0)).into_iter().flatten();
                let vertex = move |cell: Index, edge: usize| {
                    let cell_of = &layers[cell[2]].cells[near[cell[2] + 1 - z][cell[1] * cx + cell[0]] as usize];
                    cell_of.first_vertex + u32::from(cell_of.loops.of_crossing[edge])
                };
                let quads: Vec<[u32; 4]> = rising_into
                    .chain(above)
                    .map(|(node, axis)| {
                        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                        let mut quad = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(du, dv)| {
                            let mut cell = node;
                            cell[u] -= 1 - du;
                            cell[v] -= 1 - dv;
                            vertex(cell, edge_at(axis, 1 - du, 1 - dv))
                        });
                        if !self.inside[self.node(node)] {
                            quad.reverse();
                        }
                        quad
                    })
                    .collect();
                quads
            })
            .collect()
    }

    /// Returns the vertices after they moved towards their neighbours within their constraints.
    fn relax(&self, vertices: &[Vertex], quads: &[[u32; 4]]) -> Vec<DVec3> {
        // Each side of a quadrilateral occurs once in either direction, so a vertex meets each neighbour once.
        let mut first = vec![0_u32; vertices.len() + 1];
        quads.iter().flatten().for_each(|&v| first[v as usize + 1] += 1);
        (1..first.len()).for_each(|i| first[i] += first[i - 1]);
        let mut fill = first.clone();
        let mut neighbours = vec![0_u32; 4 * quads.len()];
        for quad in quads {
            for i in 0..4 {
                let at = &mut fill[quad[i] as usize];
                neighbours[*at as usize] = quad[(i + 1) % 4];
                *at += 1;
            }
        }
        drop(fill);
        let mut positions: Vec<DVec3> = vertices.iter().map(|v| v.position).collect();
        for _ in 0..RELAXATIONS {
            positions = vertices
                .par_iter()
                .with_min_len(CHUNK)
                .enumerate()
                .map(|(i, vertex)| {
                    checkpoint();
                    let here = positions[i];
                    let (mut sum, mut count) = (DVec3::ZERO, 0);
                    for &j in &neighbours[first[i] as usize..first[i + 1] as usize] {
                        if vertex.may_follow(&vertices[j as usize]) {
                            sum += positions[j as usize];
                            count += 1;
                        }
                    }
                    if count < 2 {
                        return here;
                    }
                    let free = vertex.free();
                    let reach = RELAXATION_REACH * free;
                    let limit = DVec3::from_array(self.block.cells.map(|n| n as f64));
                    // Vertices that are still free may not reach the box, which belongs to the vertices constrained
                    // there.
                    let inset = 0.05 * free;
                    let low = (vertex.low - reach).max(DVec3::select(free.cmpgt(DVec3::ZERO), inset, vertex.low));
                    let high =
                        (vertex.high + reach).min(DVec3::select(free.cmpgt(DVec3::ZERO), limit - inset, vertex.high));
                    let mut shift = 0.6 * (sum / f64::from(count) - here) * free;
                    if !vertex.on_surface {
                        return (here + shift).clamp(low, high);
                    }
                    let normal = (self.value_and_gradient(here).1 * free).normalize_or_zero();
                    shift -= shift.dot(normal) * normal;
                    self.resolve((here + shift).clamp(low, high), free, low, high).unwrap_or(here)
                })
                .collect();
        }
        positions
    }
}

/// Returns the better split of a quadrilateral, and the quality of its worse triangle: 1 for half a square, below 0 if
/// it is turned over.
fn split(positions: &[DVec3], [a, b, c, d]: [u32; 4]) -> (f64, [[u32; 3]; 2]) {
    let at = |v: u32| positions[v as usize];
    let normal = (at(c) - at(a)).cross(at(d) - at(b)).normalize_or_zero();
    let quality = |[p, q, r]: [u32; 3]| {
        let (p, q, r) = (at(p), at(q), at(r));
        let spread = p.distance_squared(q) + q.distance_squared(r) + r.distance_squared(p);
        if spread > 0.0 { 4.0 * (q - p).cross(r - p).dot(normal) / spread } else { -1.0 }
    };
    let worse = |pair: [[u32; 3]; 2]| (quality(pair[0]).min(quality(pair[1])), pair);
    let (one, other) = (worse([[a, b, c], [a, c, d]]), worse([[a, b, d], [b, c, d]]));
    if one.0 >= other.0 { one } else { other }
}

/// Returns vertices to their placed positions wherever the move made a worse and poor quadrilateral.
fn undo_poor(placed: &[DVec3], relaxed: &mut [DVec3], quads: &[[u32; 4]]) {
    loop {
        let poor: Vec<u32> = quads
            .par_iter()
            .with_min_len(CHUNK)
            .filter(|&&quad| {
                checkpoint();
                let moved = quad.iter().any(|&v| placed[v as usize] != relaxed[v as usize]);
                let quality = split(relaxed, quad).0;
                moved && quality < POOR_QUALITY && quality < split(placed, quad).0
            })
            .flat_map_iter(|&quad| quad)
            .collect();
        if poor.is_empty() {
            return;
        }
        poor.iter().for_each(|&v| relaxed[v as usize] = placed[v as usize]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::closure::{assert_solid, volume};

    /// A solid whose inside nodes are chosen by a hash: every configuration of cells and faces, many at once.
    struct Noise(u64);

    impl Implicit for Noise {
        fn value(&self, p: DVec3) -> f64 {
            let node = p.round();
            let mut hash = self.0;
            for c in [node.x, node.y, node.z] {
                hash = (hash ^ c as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                hash ^= hash >> 29;
            }
            // The value decreases away from nodes, so that edges between nodes of different sign have one root near the
            // middle.
            let sign = if hash & 1 == 0 { 1.0 } else { -1.0 };
            sign * (0.6 - p.distance(node)).max(0.01)
        }
    }

    #[test]
    fn noise_gives_manifolds_and_needs_joined_faces() {
        let mut joins = 0;
        for seed in 0..40 {
            let block = Block { min: DVec3::ZERO, spacing: 1.0, cells: [7, 6, 9] };
            assert_solid(&contour(&Noise(seed), &block, ("resolution", 1.0)).unwrap());
            joins += Grid::sample(&Noise(seed), &block).faces_to_join().len();
        }
        assert!(joins > 0, "the case that only joining cures did not come up");
    }

    #[test]
    fn a_full_block_gives_the_box() {
        struct Full;
        impl Implicit for Full {
            fn value(&self, _: DVec3) -> f64 {
                -1.0
            }
        }
        for cells in [[1, 1, 1], [3, 1, 2]] {
            let block = Block { min: DVec3::new(1.0, 2.0, 3.0), spacing: 0.5, cells };
            let mesh = contour(&Full, &block, ("resolution", 1.0)).unwrap();
            assert_solid(&mesh);
            assert!((volume(&mesh) - cells.iter().product::<usize>() as f64 / 8.0).abs() < 1e-12);
        }
    }

    #[test]
    fn solids_between_nodes_are_refused() {
        struct Speck;
        impl Implicit for Speck {
            fn value(&self, p: DVec3) -> f64 {
                p.distance(DVec3::splat(0.5)) - 0.1
            }
        }
        let block = Block { min: DVec3::ZERO, spacing: 1.0, cells: [2; 3] };
        let error = contour(&Speck, &block, ("resolution", 4.0)).unwrap_err();
        assert_eq!(error.to_string(), "resolution = 4 is too coarse: no grid node lies inside the solid");
    }
}
