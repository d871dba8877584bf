//! The solid of a voxel array.

use glam::DVec3;

use super::{MAX_TRIANGLES, SolidError, check_length};
use crate::cancel::checkpoint;
use crate::mesh::TriangleMesh;

/// A vertex that no triangle uses yet.
const UNUSED: u32 = u32::MAX;

/// Returns the solid of the voxels whose value is not 0: the faces between these and others, two triangles each. Voxel
/// (x, y, z) is at `(x · size[1] + y) · size[2] + z`, `origin` is the centre of voxel (0, 0, 0), and `spacing` has the distances
/// of centres. Where voxels touch along an edge, four triangles meet.
///
/// # Errors
/// Fails for a spacing that is not a length, and for arrays without a voxel or with too many faces.
///
/// # Panics
/// If there is not a value for each voxel.
pub fn voxels(size: [usize; 3], values: &[u8], origin: DVec3, spacing: DVec3) -> Result<TriangleMesh, SolidError> {
    let [columns, rows, layers] = size;
    assert_eq!(values.len(), size.iter().product::<usize>(), "a value for each voxel");
    spacing.to_array().into_iter().try_for_each(|side| check_length("spacing", side))?;
    // The value of a voxel by its indices plus one; those around the array are outside.
    let inside = |[x, y, z]: [usize; 3]| {
        let within = (1..=columns).contains(&x) && (1..=rows).contains(&y) && (1..=layers).contains(&z);
        within && values[((x - 1) * rows + y - 1) * layers + z - 1] != 0
    };
    let mut mesh = TriangleMesh::default();
    let mut planes = [vec![UNUSED; (rows + 1) * (layers + 1)], vec![UNUSED; (rows + 1) * (layers + 1)]];
    for x in 0..=columns {
        checkpoint();
        for y in 0..=rows {
            for z in 0..=layers {
                let at = [x + 1, y + 1, z + 1];
                let here = inside(at);
                for axis in 0..3 {
                    let mut before = at;
                    before[axis] -= 1;
                    if here == inside(before) {
                        continue;
                    }
                    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                    let corner = |across: usize, up: usize| {
                        let mut corner = [0, y, z];
                        corner[u] += across;
                        corner[v] += up;
                        corner
                    };
                    let mut vertex = |[plane, y, z]: [usize; 3]| {
                        let id = &mut planes[plane][y * (layers + 1) + z];
                        if *id == UNUSED {
                            *id = mesh.positions.len() as u32;
                            let index = DVec3::new((x + plane) as f64, y as f64, z as f64);
                            mesh.positions.push(origin + (index - 0.5) * spacing);
                        }
                        *id
                    };
                    let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)].map(&mut vertex);
                    // The face looks away from the voxel inside.
                    mesh.triangles.extend(if here { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] });
                }
            }
        }
        if mesh.triangles.len() as u64 > MAX_TRIANGLES {
            let (value, triangles) = (columns as f64, mesh.triangles.len() as u64);
            return Err(SolidError::TooManyTriangles {
                parameter: "voxels along x",
                value,
                triangles,
                limit: MAX_TRIANGLES,
            });
        }
        let [low, high] = &mut planes;
        low.fill(UNUSED);
        std::mem::swap(low, high);
    }
    match mesh.triangles.is_empty() {
        true => Err(SolidError::Empty { parameter: "voxels along x", value: columns as f64 }),
        false => Ok(mesh),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{Axis, Grid};
    use crate::ldi::NodePlanes;
    use crate::sampler::Mode;
    use crate::solids::closure;
    use crate::testing::images::{closed, surface_images};
    use crate::testing::random::Random;

    #[test]
    fn random_voxels_have_their_volume_and_their_nodes() {
        let mut random = Random::new(9);
        for size in [[1, 1, 1], [4, 3, 5], [2, 7, 3], [6, 6, 6]] {
            let count = size.iter().product::<usize>();
            let mut values: Vec<u8> = (0..count).map(|_| u8::from(random.share() < 0.5)).collect();
            values[count / 2] = 1;
            let (origin, spacing) = (DVec3::new(3.0, -1.0, 0.5), DVec3::new(0.5, 0.25, 2.0));
            let mesh = voxels(size, &values, origin, spacing).unwrap();
            let inside = values.iter().filter(|&&value| value != 0).count() as f64;
            assert_eq!(closure::volume(&mesh), 0.25 * inside);

            let cubic = closed(voxels(size, &values, DVec3::splat(0.5), DVec3::ONE).unwrap());
            let grid = Grid::from_parts(DVec3::ZERO, 1.0, size.map(|n| n as u32), 8, 64).unwrap();
            let images = surface_images(&grid.quantise(&cubic).unwrap());
            assert_eq!(images.each_ref().map(|image| image.axis()), Axis::ALL);
            assert_eq!(NodePlanes::new(&images, Mode::Exact).unwrap().to_bytes(), values);
        }
    }

    #[test]
    fn cubes_have_the_faces_of_their_boundary() {
        let cube = voxels([3, 3, 3], &[1; 27], DVec3::ZERO, DVec3::ONE).unwrap();
        closure::assert_solid(&cube);
        assert_eq!((cube.positions.len(), cube.triangles.len()), (56, 108));
        assert!(voxels([2, 2, 2], &[0; 8], DVec3::ZERO, DVec3::ONE).is_err());
        assert!(voxels([1, 1, 1], &[1], DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0)).is_err());
    }
}
