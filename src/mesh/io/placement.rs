//! Placement of parts: the instances of glTF nodes and of 3MF components, as one mesh or apart.

use std::collections::TryReserveError;

use glam::DAffine3;

use super::error::{Fault, Place, Problem};
use super::note::ReadNote;
use super::{MeshFile, NamedMesh, PartsFile};
use crate::allocation::try_vec_with_room;
use crate::mesh::{LengthUnit, TriangleMesh};

/// Largest number of parts that a file may place. Components may refer to one another, so that a few lines can describe
/// more than any memory holds; this limit, [`COPIES_MAX`] and [`TRIANGLES_MAX`] prevent that.
pub(super) const PLACEMENTS_MAX: usize = 1 << 20;

/// Largest number of triangles of all placed parts of a file together.
pub(super) const TRIANGLES_MAX: u64 = 1 << 28;

/// Largest number of triangles of all instances beyond the first of each part. Copies take almost no bytes in a file,
/// and with three positions to a triangle this many of them take 1.4 GB.
pub(super) const COPIES_MAX: u64 = 1 << 24;

/// One instance of a part.
pub(super) struct Placement {
    /// The index of the part.
    pub(super) part: usize,
    /// The map from the part's space to the file's.
    pub(super) world_from_part: DAffine3,
    /// The name of the instance, or that of its part.
    pub(super) name: String,
}

/// The parts of a file, and their instances.
pub(super) struct Scene {
    pub(super) parts: Vec<TriangleMesh>,
    pub(super) placements: Vec<Placement>,
    pub(super) unit: LengthUnit,
    /// Notes about the parts.
    pub(super) notes: Vec<ReadNote>,
}

impl Scene {
    /// Returns all instances as one mesh.
    pub(super) fn merged(mut self) -> Result<MeshFile, Fault> {
        let mesh = assemble(&mut self.parts, &self.placements)?;
        if self.placements.len() > 1 {
            self.notes.insert(0, ReadNote::ObjectsMerged { count: self.placements.len() });
        }
        Ok(MeshFile { mesh, unit: Some(self.unit), notes: self.notes })
    }

    /// Returns a mesh for each instance that has triangles.
    pub(super) fn apart(mut self) -> Result<PartsFile, Fault> {
        check_limits(&self.parts, &self.placements)?;
        self.parts.iter_mut().for_each(drop_unused);
        let mut meshes = Vec::new();
        for Placement { part, world_from_part, name } in self.placements {
            let mut mesh = TriangleMesh::default();
            append(&mut mesh, &self.parts[part], world_from_part);
            if !mesh.triangles.is_empty() {
                meshes.push(NamedMesh { name: Some(name), mesh });
            }
        }
        Ok(PartsFile { meshes, unit: Some(self.unit), notes: self.notes })
    }
}

/// Checks that all instances fit; returns the number of their triangles.
fn check_limits(parts: &[TriangleMesh], placements: &[Placement]) -> Result<u64, Fault> {
    let too_many = |what: &'static str, found, limit| {
        Err(Fault::Malformed(Place::File, Problem::TooMany { what: what.into(), found, limit }))
    };
    let mut is_placed = vec![false; parts.len()];
    let (mut triangles, mut copies) = (0, 0);
    for placement in placements {
        let count = parts[placement.part].triangles.len() as u64;
        triangles += count;
        copies += if std::mem::replace(&mut is_placed[placement.part], true) { count } else { 0 };
    }
    if copies > COPIES_MAX {
        return too_many("triangles in copies of parts", copies, COPIES_MAX);
    }
    if triangles > TRIANGLES_MAX {
        return too_many("triangles in all instances", triangles, TRIANGLES_MAX);
    }
    Ok(triangles)
}

/// Merges all instances, in order, after checking that they fit. Vertices that no triangle uses are left out.
fn assemble(parts: &mut [TriangleMesh], placements: &[Placement]) -> Result<TriangleMesh, Fault> {
    let triangles = check_limits(parts, placements)?;
    parts.iter_mut().for_each(drop_unused);
    // No part now has more than three positions to a triangle, so that 32 bits can number all of them.
    let positions: usize = placements.iter().map(|placement| parts[placement.part].positions.len()).sum();
    let no_memory = |_: TryReserveError| {
        Fault::invalid(Place::File, format!("not enough memory for {triangles} triangles in all instances"))
    };
    let mut mesh = TriangleMesh {
        positions: try_vec_with_room(positions).map_err(no_memory)?,
        triangles: try_vec_with_room(triangles as usize).map_err(no_memory)?,
    };
    for placement in placements {
        append(&mut mesh, &parts[placement.part], placement.world_from_part);
    }
    Ok(mesh)
}

/// Removes the positions that no triangle uses; the others keep their order.
pub(super) fn drop_unused(mesh: &mut TriangleMesh) {
    let mut is_used = vec![false; mesh.positions.len()];
    for &index in mesh.triangles.iter().flatten() {
        is_used[index as usize] = true;
    }
    if is_used.iter().all(|&is_used| is_used) {
        return;
    }
    let mut count = 0;
    let new_index: Vec<u32> = is_used
        .iter()
        .map(|&is_used| {
            let index = count;
            count += u32::from(is_used);
            index
        })
        .collect();
    let mut flags = is_used.into_iter();
    mesh.positions.retain(|_| flags.next().unwrap_or_default());
    mesh.positions.shrink_to_fit();
    for index in mesh.triangles.iter_mut().flatten() {
        *index = new_index[*index as usize];
    }
}

fn append(mesh: &mut TriangleMesh, part: &TriangleMesh, world_from_part: DAffine3) {
    let first = mesh.positions.len() as u32;
    if world_from_part == DAffine3::IDENTITY {
        // Multiplying by one and adding zero would turn −0 into 0.
        mesh.positions.extend_from_slice(&part.positions);
    } else {
        mesh.positions.extend(part.positions.iter().map(|&p| world_from_part.transform_point3(p)));
    }
    // A mirroring map turns the mesh inside out; listing the corners in reverse turns it back.
    let [i, j] = if world_from_part.matrix3.determinant() < 0.0 { [2, 1] } else { [1, 2] };
    mesh.triangles.extend(part.triangles.iter().map(|t| [t[0] + first, t[i] + first, t[j] + first]));
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn placed(part: &TriangleMesh, times: usize) -> Result<TriangleMesh, Fault> {
        let place = |_| Placement { part: 0, world_from_part: DAffine3::IDENTITY, name: String::new() };
        assemble(&mut [part.clone()], &(0..times).map(place).collect::<Vec<_>>())
    }

    #[test]
    fn copies_hold_only_the_used_vertices() {
        let positions = (0..4000).map(|k| DVec3::splat(k.into())).collect();
        let part = TriangleMesh { positions, triangles: vec![[3999, 7, 20]] };
        let mesh = placed(&part, PLACEMENTS_MAX).unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (3 * PLACEMENTS_MAX, PLACEMENTS_MAX));
        assert_eq!(mesh.positions[3..6], [7.0, 20.0, 3999.0].map(DVec3::splat));
        assert_eq!(mesh.triangles[..2], [[2, 0, 1], [5, 3, 4]]);
    }

    #[test]
    fn copied_triangles_are_limited_and_single_parts_are_not() {
        let many = |count| TriangleMesh { positions: vec![DVec3::ZERO], triangles: vec![[0; 3]; count] };
        assert!(placed(&many(COPIES_MAX as usize + 1), 1).is_ok());
        assert!(placed(&many(1 << 14), (1 << 10) + 1).is_ok());
        let Err(Fault::Malformed(Place::File, problem)) = placed(&many(1 << 14), (1 << 10) + 2) else {
            panic!("copies beyond the limit are refused");
        };
        let message = "16793600 triangles in copies of parts; the limit is 16777216";
        assert_eq!(problem.to_string(), message);
    }
}
