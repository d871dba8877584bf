//! Parts put in their places: the instances of glTF nodes and of 3MF components as one mesh.

use glam::DAffine3;

use super::error::{Fault, Place, Problem};
use crate::mesh::TriangleMesh;

/// How many parts a file may place. Components may refer to one another, so that a few lines describe more than any
/// memory holds; this and [`TRIANGLES_MAX`] end that.
pub(super) const PLACEMENTS_MAX: usize = 1 << 20;

/// How many triangles the placed parts of a file may have together.
pub(super) const TRIANGLES_MAX: u64 = 1 << 28;

/// One part in one place.
pub(super) struct Placement {
    /// Which of the parts.
    pub(super) part: usize,
    /// From the part's space to the file's.
    pub(super) world_from_part: DAffine3,
}

/// All parts in their places, in order, after checking that they fit.
pub(super) fn assemble(parts: &[TriangleMesh], placements: &[Placement]) -> Result<TriangleMesh, Fault> {
    let sum = |size: fn(&TriangleMesh) -> usize| placements.iter().map(|p| size(&parts[p.part]) as u64).sum::<u64>();
    let (positions, triangles) = (sum(|part| part.positions.len()), sum(|part| part.triangles.len()));
    if triangles > TRIANGLES_MAX {
        let problem =
            Problem::TooMany { what: "triangles in all places".into(), found: triangles, limit: TRIANGLES_MAX };
        return Err(Fault::Malformed(Place::File, problem));
    }
    if positions > u64::from(u32::MAX) {
        let limit = u64::from(u32::MAX);
        let problem = Problem::TooMany { what: "vertices in all places".into(), found: positions, limit };
        return Err(Fault::Malformed(Place::File, problem));
    }
    let mut mesh = TriangleMesh {
        positions: Vec::with_capacity(positions as usize),
        triangles: Vec::with_capacity(triangles as usize),
    };
    for placement in placements {
        append(&mut mesh, &parts[placement.part], placement.world_from_part);
    }
    Ok(mesh)
}

fn append(mesh: &mut TriangleMesh, part: &TriangleMesh, world_from_part: DAffine3) {
    let first = mesh.positions.len() as u32;
    if world_from_part == DAffine3::IDENTITY {
        // Multiplying by one and adding zero would turn −0 into 0.
        mesh.positions.extend_from_slice(&part.positions);
    } else {
        mesh.positions.extend(part.positions.iter().map(|&p| world_from_part.transform_point3(p)));
    }
    // A mirror turns the inside out; listing the corners the other way round turns it back.
    let [i, j] = if world_from_part.matrix3.determinant() < 0.0 { [2, 1] } else { [1, 2] };
    mesh.triangles.extend(part.triangles.iter().map(|t| [t[0] + first, t[i] + first, t[j] + first]));
}
