//! Normals of samples, as in files, and normals of triangles, as images refer to them.

use crate::parallel::*;

use super::{Images, Normals, NpzError};
use crate::ldi::Ldi;

/// Returns the normal of each sample of an image that was sampled with its triangles: that of its triangle in
/// `of_triangles`, turned outwards, which is against the ray where the ray enters. Zero where the triangle has none;
/// `None` for an image without triangles.
pub fn normals_of_samples(image: &Ldi, of_triangles: &[[f32; 3]]) -> Option<Normals> {
    let triangles = image.triangles()?;
    let depth = image.axis().depth();
    let outwards = |sample: usize, enters: bool| {
        let normal = of_triangles.get(triangles[sample] as usize).copied().unwrap_or_default();
        let is_inwards = if enters { normal[depth] > 0.0 } else { normal[depth] < 0.0 };
        // Not by a negation alone, which would make negative zeros.
        if is_inwards { normal.map(|n| 0.0 - n) } else { normal }
    };
    let each = |ends: &[u32]| {
        let samples = ends[0] as usize..ends[1] as usize;
        // Rays enter and leave alternately.
        samples.enumerate().map(|(i, sample)| outwards(sample, i % 2 == 0))
    };
    Some(image.offsets().par_windows(2).with_min_len(1 << 12).flat_map_iter(each).collect())
}

/// Normals may be rounded; a component below this counts as zero.
const NO_SIDE: f32 = 1e-3;

/// Counts the samples whose normal points into the solid (along the ray where it enters, against it where it leaves),
/// and returns the first.
pub(super) fn turned_inwards(image: &Ldi, normals: &[[f32; 3]]) -> Option<(usize, usize)> {
    let depth = image.axis().depth();
    let of_ray = |ends: &[u32]| {
        let samples = ends[0] as usize..ends[1] as usize;
        let is_wrong = move |(i, sample): (usize, usize)| {
            let along = normals[sample][depth];
            let inwards = if i % 2 == 0 { along } else { -along };
            (inwards > NO_SIDE).then_some(sample)
        };
        samples.enumerate().filter_map(is_wrong)
    };
    let wrong = image.offsets().par_windows(2).with_min_len(1 << 12).flat_map_iter(of_ray);
    wrong.map(|sample| (1, sample)).reduce_with(|(n, a), (m, b)| (n + m, a.min(b)))
}

impl Images {
    /// Returns the images with triangles that represent their samples, and the normals of those triangles, as the
    /// surface needs them. Images without known normals have no triangles.
    ///
    /// # Errors
    /// Fails if a list has another length than its image has samples, which no file gives, or if 32 bits cannot number
    /// all samples.
    pub fn with_triangles(self) -> Result<(Vec<Ldi>, Normals), NpzError> {
        let samples = self.extras.normals.iter().flatten().map(Vec::len).sum();
        if u32::try_from(samples).is_err() {
            return Err(NpzError::TooManyNormals { samples });
        }
        let mut of_triangles = Normals::new();
        let mut normals = self.extras.normals.into_iter();
        let images = self.images.into_iter().map(|image| match normals.next().flatten() {
            None => Ok(image),
            Some(of_image) => {
                let first = of_triangles.len() as u32;
                of_triangles.extend(of_image);
                let axis = image.axis().name();
                let numbered = image.with_triangles((first..of_triangles.len() as u32).collect());
                numbered.map_err(|source| NpzError::Image { axis, source })
            }
        });
        let images = images.collect::<Result<_, _>>()?;
        Ok((images, of_triangles))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::Extras;
    use super::*;
    use crate::grid::{Axis, Grid};
    use crate::ldi::LdiError;

    fn image(axis: Axis) -> Ldi {
        let grid = Grid::from_parts(DVec3::ZERO, 1.0, [1, 1, 2], 4, 64).unwrap();
        let offsets = if axis == Axis::Z { vec![0, 4] } else { vec![0, 2, 4] };
        Ldi::from_parts(grid, axis, offsets, vec![2, 4, 6, 10], vec![]).unwrap()
    }

    #[test]
    fn normals_of_samples_point_outwards() {
        let (up, slope) = ([0.0, 0.0, 1.0], [0.6, 0.0, -0.8]);
        let table = [up, slope, [0.0; 3]];
        for axis in [Axis::Z, Axis::Y] {
            let along = |n: [f32; 3]| [n[1], n[2], n[0]];
            let table = if axis == Axis::Z { table } else { table.map(along) };
            let found = normals_of_samples(&image(axis).with_triangles(vec![0, 0, 1, 7]).unwrap(), &table).unwrap();
            let expected = [table[0].map(|n| 0.0 - n), table[0], table[1], [0.0; 3]];
            if axis == Axis::Z {
                assert_eq!(found, expected);
            } else {
                // Along y, `up` is (0, 1, 0); the slope lies across and keeps its sign.
                assert_eq!(found, [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [0.0, -0.8, 0.6], [0.0; 3]]);
            }
            assert!(found.iter().flatten().all(|n| *n != 0.0 || n.is_sign_positive()));
        }
        assert_eq!(normals_of_samples(&image(Axis::Z), &table), None);
    }

    #[test]
    fn sample_normals_are_numbered_as_triangles() {
        let images = Axis::ALL.map(image).to_vec();
        let normals: Normals = (0..8).map(|i| [i as f32, 0.0, 0.0]).collect();
        let with = |normals| Images {
            images: images.clone(),
            extras: Extras { normals, ..Extras::default() },
            ignored: Vec::new(),
        };
        let (numbered, table) =
            with(vec![Some(normals[..4].to_vec()), None, Some(normals[4..].to_vec())]).with_triangles().unwrap();
        let triangles: Vec<Option<&[u32]>> = numbered.iter().map(Ldi::triangles).collect();
        assert_eq!(triangles, [Some(&[0, 1, 2, 3][..]), None, Some(&[4, 5, 6, 7])]);
        assert_eq!(table, normals);
        assert_eq!(with(vec![]).with_triangles().unwrap(), (images.clone(), vec![]));
        let error = with(vec![Some(normals)]).with_triangles().unwrap_err();
        let count = LdiError::TriangleCount { found: 8, samples: 4 };
        assert!(matches!(error, NpzError::Image { axis: "x", source } if source == count));
    }
}
