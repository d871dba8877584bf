//! A solid on the lattice as its features: distinct vertices, and facets between them.

use std::collections::HashMap;

use glam::DVec3;

use crate::cancel::checkpoint;
use crate::grid::{LatticeBox, LatticeSolid};

/// A solid by its facets, welded on the lattice: vertices of one position are one, and facets whose vertices coincide are
/// omitted. Facets may still have no area, where three vertices are collinear.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyhedron {
    positions: Vec<[i32; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// The height in lattice steps below which rounding may have flipped a facet; rounding moved each of its vertices by at most
/// √3.
const TURNED: f64 = 4.0;

/// Returns whether a facet has an area but is so thin that rounding to the lattice may have flipped it: the side of the solid
/// is unknown.
pub(super) fn may_be_turned([a, b, c]: [[i32; 3]; 3]) -> bool {
    let along = |from: [i32; 3], to: [i32; 3]| DVec3::from_array([0, 1, 2].map(|i| f64::from(to[i] - from[i])));
    let (u, v, w) = (along(a, b), along(a, c), along(b, c));
    let doubled_area = u.cross(v).length();
    doubled_area > 0.0 && doubled_area < TURNED * u.length().max(v.length()).max(w.length())
}

impl Polyhedron {
    /// Extracts the features of a quantised solid, whose triangles must be consistently oriented.
    pub fn new(solid: &LatticeSolid) -> Polyhedron {
        let mut welded = HashMap::with_capacity(solid.positions().len());
        let mut positions = Vec::new();
        let mut of_vertex = vec![u32::MAX; solid.positions().len()];
        let mut triangles = Vec::with_capacity(solid.triangles().len());
        for triangle in solid.triangles() {
            checkpoint();
            let [a, b, c] = triangle.map(|vertex| {
                let of_vertex = &mut of_vertex[vertex as usize];
                if *of_vertex == u32::MAX {
                    let position = solid.positions()[vertex as usize];
                    *of_vertex = *welded.entry(position).or_insert_with(|| {
                        positions.push(position);
                        positions.len() as u32 - 1
                    });
                }
                *of_vertex
            });
            if a != b && b != c && c != a {
                triangles.push([a, b, c]);
            }
        }
        Polyhedron { positions, triangles }
    }

    /// Creates a polyhedron from distinct positions and triangles between three different ones.
    pub fn from_parts(positions: Vec<[i32; 3]>, triangles: Vec<[u32; 3]>) -> Polyhedron {
        Polyhedron { positions, triangles }
    }

    /// Returns the same surface seen from the other side.
    pub fn complement(mut self) -> Polyhedron {
        self.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        self
    }

    /// Returns every facet together with its reverse. The sum of such a surface with a solid covers the boundary of the sum of
    /// the surface and everything that it winds around, also where the solid lies before a facet and not behind it: where folds
    /// cross themselves. No edge is reflex then, so that there are several times more primitives.
    pub fn two_sided(&self) -> Polyhedron {
        let reversed = self.triangles.iter().map(|&[a, b, c]| [a, c, b]);
        let triangles = self.triangles.iter().copied().chain(reversed).collect();
        Polyhedron { positions: self.positions.clone(), triangles }
    }

    /// Returns the lattice positions, which are distinct.
    pub fn positions(&self) -> &[[i32; 3]] {
        &self.positions
    }

    /// Returns three different indices into [`positions`](Self::positions) for each triangle; the outward normal is (b − a) ×
    /// (c − a).
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns the box of all positions.
    pub fn bounds(&self) -> LatticeBox {
        let point = |&p: &[i32; 3]| LatticeBox { min: p, max: p };
        self.positions.iter().map(point).fold(LatticeBox::EMPTY, |all, one| all.hull(&one))
    }
}
