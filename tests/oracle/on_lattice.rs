//! Soups as meshes, on grids of their own.

// Each test binary that includes this file uses a part of it.
#![allow(dead_code)]

use glam::DVec3;
use ldi_ops::grid::Grid;
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};

use crate::soups::{Frame, Soup};

pub fn mesh(soup: &Soup) -> TriangleMesh {
    let positions = soup.positions.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
    TriangleMesh { positions, triangles: soup.triangles.clone() }
}

#[track_caller]
pub fn closed(soup: &Soup) -> ClosedMesh {
    ClosedMesh::check(mesh(soup)).unwrap_or_else(|error| panic!("a soup is not closed: {:?}", error.report))
}

/// A grid on which one lattice step is one world unit, so that soups are quantised to themselves.
pub fn grid(frame: &Frame, lod: u32) -> Grid {
    Grid::from_parts(DVec3::ZERO, f64::from(1u32 << frame.shift), frame.rays, frame.shift, lod).unwrap()
}
