//! Integrals over the inside of an image: volume, moments, and how far off they may be.
//!
//! Every ray stands for a column of square section h × h around it, within which the solid is taken to be what it is on
//! the ray. Sums are integers; world units enter once, at the end, in `f64`.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::fixed::Pixels;
use crate::grid::Axis;
use crate::ldi::{Ldi, Spans};

/// The inside length of all rays together, in lattice steps.
pub fn length(image: &Ldi) -> i64 {
    // Every ray has an even count, so pairs never straddle two rays.
    image
        .depths()
        .par_chunks(1 << 16)
        .map(|depths| depths.chunks_exact(2).map(|span| i64::from(span[1] - span[0])).sum::<i64>())
        .sum()
}

/// The volume of the solid in an image, h²·Σ(out − in), in cubic world units.
pub fn volume(image: &Ldi) -> f64 {
    volume_of_length(image, length(image))
}

fn volume_of_length(image: &Ldi, length: i64) -> f64 {
    let grid = image.grid();
    grid.pitch() * grid.pitch() * (grid.step() * length as f64)
}

/// What the image of a solid along one axis says of its volume; all that an estimate needs of the image.
///
/// Besides the volume h²·Σ(out − in) there is the *node volume*, h³ times the lattice nodes inside the solid. The two
/// differ by what the raster makes of the faces across the rays, and that is what the other two images suffer from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisVolume {
    /// The direction of the rays.
    pub axis: Axis,
    /// The volume of the solid in the image, h²·Σ(out − in), in cubic world units.
    pub volume: f64,
    /// The volumes that the four images of half the resolution inside the image give: entry `c + 2 r` for columns of
    /// parity c in rows of parity r. Their mean is the volume.
    pub coarser: [f64; 4],
    /// h³ times the nodes inside, in cubic world units.
    pub nodes: f64,
    /// The node volumes that the eight lattices of half the resolution give: entry `x + 2 y + 4 z` for the parities of
    /// the node's indices. Their mean is the node volume.
    pub coarser_nodes: [f64; 8],
}

/// Exact sums over rays: steps inside by the parity of column and row, nodes inside also by that of the depth.
#[derive(Clone, Copy, Default)]
struct ParitySums {
    steps: [i64; 4],
    nodes: [[i64; 2]; 4],
}

impl ParitySums {
    fn plus(mut self, other: ParitySums) -> ParitySums {
        for i in 0..4 {
            self.steps[i] += other.steps[i];
            self.nodes[i][0] += other.nodes[i][0];
            self.nodes[i][1] += other.nodes[i][1];
        }
        self
    }
}

impl AxisVolume {
    /// Integrates an image, in one pass.
    pub fn of(image: &Ldi) -> AxisVolume {
        let (columns, rows) = image.size();
        let pixels = Pixels::new(image.grid().shift());
        let row_sums = |row: u32| {
            let mut sums = ParitySums::default();
            for column in 0..columns {
                let parity = (column % 2 + row % 2 * 2) as usize;
                for span in image.samples(row * columns + column).chunks_exact(2) {
                    sums.steps[parity] += i64::from(span[1] - span[0]);
                    let (first, end) = (pixels.index_from(span[0]), pixels.index_from(span[1]));
                    // Of the first k indices, (k + 1) / 2 are even.
                    let even = (end + 1) / 2 - (first + 1) / 2;
                    sums.nodes[parity][0] += i64::from(even);
                    sums.nodes[parity][1] += i64::from(end - first - even);
                }
            }
            sums
        };
        let sums = (0..rows).into_par_iter().map(row_sums).reduce(ParitySums::default, ParitySums::plus);
        let (axis, pitch) = (image.axis(), image.grid().pitch());
        let node_volume = |nodes: i64| pitch * pitch * (pitch * nodes as f64);
        let mut coarser_nodes = [0.0; 8];
        for (parity, by_depth) in sums.nodes.iter().enumerate() {
            for (depth, &nodes) in by_depth.iter().enumerate() {
                let place = (parity % 2) << axis.column() | (parity / 2) << axis.row() | depth << axis.depth();
                coarser_nodes[place] = 8.0 * node_volume(nodes);
            }
        }
        AxisVolume {
            axis,
            volume: volume_of_length(image, sums.steps.iter().sum()),
            coarser: sums.steps.map(|steps| 4.0 * volume_of_length(image, steps)),
            nodes: node_volume(sums.nodes.iter().flatten().sum()),
            coarser_nodes,
        }
    }
}

/// A volume from one or three images of a solid, and how far it may be off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeEstimate {
    /// In cubic world units.
    pub value: f64,
    /// An estimate of the error of `value`; not a bound.
    pub error: f64,
}

impl VolumeEstimate {
    /// The volume of a solid from its images along one axis or all three.
    ///
    /// **Three axes.** The plain mean of three images is off by a whole layer of pixels wherever many faces are parallel
    /// to a coordinate plane: the image along z is exact about faces across z and rounds those across x and y to pixels.
    /// For a box of sides A + α in pixels (A whole), the images give AB(C + γ), A(B + β)C and (A + α)BC, and the nodes
    /// ABC. So V_x + V_y + V_z − 2 V_nodes is right to first order in α, β, γ, where the mean keeps a third of each
    /// image's error; and as the weights sum to one, it is as right as the mean for surfaces in general position. On the
    /// 33 closed solids, scaffolds and bones of the test corpus at 512 rays the worst error falls from 2.0 % to 0.16 %,
    /// and from above 0.1 % to 0.01 % or less on parts with flat faces.
    ///
    /// **One axis.** Only the volume of that image is there.
    ///
    /// **The error** is judged from the same formula at twice the pitch, which the image holds four (eight) times over,
    /// shifted, and from how much the node volume differs: for one axis twice that, as the two other directions may be
    /// hit as hard; for three a quarter of the correction. The factors are empirical: on that corpus at 64 to 512 rays
    /// the true error stays below twice the estimate in 98 % of 240 cases for three axes, and in 94 % of 720 for one.
    ///
    /// # Panics
    /// If there is neither one axis nor all three.
    pub fn from_axes(axes: &[AxisVolume]) -> VolumeEstimate {
        match axes {
            [only] => {
                let scatter = only.coarser.iter().map(|coarser| (coarser - only.volume).abs()).fold(0.0, f64::max);
                VolumeEstimate { value: only.volume, error: scatter.max(2.0 * (only.nodes - only.volume).abs()) }
            }
            [a, b, c] => {
                let axes = [a, b, c];
                let mean = axes.iter().map(|axis| axis.volume).sum::<f64>() / 3.0;
                let nodes = axes.iter().map(|axis| axis.nodes).sum::<f64>() / 3.0;
                // A solid thinner than the pitch everywhere may leave less than nothing.
                let value = (3.0 * mean - 2.0 * nodes).max(0.0);
                let coarser = |place: usize| -> f64 {
                    let seen = |axis: &AxisVolume| {
                        let parity = |coordinate: usize| place >> coordinate & 1;
                        axis.coarser[parity(axis.axis.column()) + 2 * parity(axis.axis.row())]
                            - 2.0 / 3.0 * axis.coarser_nodes[place]
                    };
                    axes.into_iter().map(seen).sum()
                };
                let squares = (0..8).map(|place| (coarser(place) - value).powi(2)).sum::<f64>();
                let scatter = (squares / 8.0).sqrt();
                let error = (0.75 * scatter).max(0.25 * (value - mean).abs());
                // The correction may overshoot on what is thinner than a pixel, and no solid has less than nothing.
                VolumeEstimate { value: if value < 0.0 { 0.0 } else { value }, error }
            }
            _ => panic!("a volume needs the images along one axis or all three, and {} were given", axes.len()),
        }
    }
}

/// Volume, first and second moments of a solid of unit density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// In cubic world units.
    pub volume: f64,
    /// The centre of mass, in world coordinates; NaN where the volume is zero.
    pub centroid: DVec3,
    /// The inertia tensor about the centroid, in world units to the fifth; NaN where the volume is zero.
    pub inertia: DMat3,
}

/// Exact sums over the columns of an image: the volume integrals of the monomials up to degree two in column, row and
/// depth. Columns and rows count in half pixels from the corner of the image, depths in lattice steps.
#[derive(Clone, Copy, Default)]
struct MomentSums {
    one: i128,
    column: i128,
    row: i128,
    twice_depth: i128,
    column_column: i128,
    row_row: i128,
    thrice_depth_depth: i128,
    column_row: i128,
    twice_column_depth: i128,
    twice_row_depth: i128,
}

impl MomentSums {
    fn add_ray(&mut self, column: u32, row: u32, samples: &[i32]) {
        let (mut one, mut two, mut three) = (0i128, 0i128, 0i128);
        for (start, end) in Spans::new(samples) {
            let (start, end) = (i128::from(start), i128::from(end));
            one += end - start;
            two += end * end - start * start;
            three += end * end * end - start * start * start;
        }
        let (column, row) = (i128::from(2 * column + 1), i128::from(2 * row + 1));
        self.one += one;
        self.column += column * one;
        self.row += row * one;
        self.twice_depth += two;
        self.column_column += column * column * one;
        self.row_row += row * row * one;
        self.thrice_depth_depth += three;
        self.column_row += column * row * one;
        self.twice_column_depth += column * two;
        self.twice_row_depth += row * two;
    }

    fn plus(self, other: MomentSums) -> MomentSums {
        MomentSums {
            one: self.one + other.one,
            column: self.column + other.column,
            row: self.row + other.row,
            twice_depth: self.twice_depth + other.twice_depth,
            column_column: self.column_column + other.column_column,
            row_row: self.row_row + other.row_row,
            thrice_depth_depth: self.thrice_depth_depth + other.thrice_depth_depth,
            column_row: self.column_row + other.column_row,
            twice_column_depth: self.twice_column_depth + other.twice_column_depth,
            twice_row_depth: self.twice_row_depth + other.twice_row_depth,
        }
    }
}

/// Volume, centroid and inertia tensor of the solid in an image.
pub fn moments(image: &Ldi) -> Moments {
    let (columns, rows) = image.size();
    let sums = (0..rows)
        .into_par_iter()
        .map(|row| {
            let mut sums = MomentSums::default();
            for column in 0..columns {
                sums.add_ray(column, row, image.samples(row * columns + column));
            }
            sums
        })
        .reduce(MomentSums::default, MomentSums::plus);
    let (grid, axis) = (image.grid(), image.axis());
    let volume = grid.pitch() * grid.pitch() * (grid.step() * sums.one as f64);
    if sums.one == 0 {
        return Moments { volume, centroid: DVec3::NAN, inertia: DMat3::NAN };
    }
    // Means over the solid, in half pixels and lattice steps; variances and covariances from differences of integers so
    // that nothing cancels in f64: N² var = N Σx² − (Σx)², which may exceed 128 bits and is therefore taken about a
    // whole number near the mean.
    let (half_pixel, step) = (0.5 * grid.pitch(), grid.step());
    let n = sums.one;
    let near = |sum: i128| sum.div_euclid(n);
    let (c, r, d) = (near(sums.column), near(sums.row), near(sums.twice_depth).div_euclid(2));
    let mean = |sum: i128, scale: f64| sum as f64 / n as f64 * scale;
    let offset = [
        mean(sums.column - c * n, half_pixel),
        mean(sums.row - r * n, half_pixel),
        mean(sums.twice_depth - 2 * d * n, 0.5 * step),
    ];
    let about = [
        mean(sums.column_column - 2 * c * sums.column + c * c * n, half_pixel * half_pixel),
        mean(sums.row_row - 2 * r * sums.row + r * r * n, half_pixel * half_pixel),
        mean(sums.thrice_depth_depth - 3 * d * sums.twice_depth + 3 * d * d * n, step * step / 3.0),
    ];
    let mixed = [
        mean(sums.column_row - c * sums.row - r * sums.column + c * r * n, half_pixel * half_pixel),
        mean(
            sums.twice_column_depth - c * sums.twice_depth - 2 * d * sums.column + 2 * c * d * n,
            0.5 * half_pixel * step,
        ),
        mean(sums.twice_row_depth - r * sums.twice_depth - 2 * d * sums.row + 2 * r * d * n, 0.5 * half_pixel * step),
    ];
    // The section of a column adds h²/12 to its second moments across the ray.
    let section = grid.pitch() * grid.pitch() / 12.0;
    let places = [axis.column(), axis.row(), axis.depth()];
    let mut centroid = DVec3::ZERO;
    let mut covariance = DMat3::ZERO;
    for i in 0..3 {
        let whole = [c, r, d][i] as f64 * [half_pixel, half_pixel, step][i];
        centroid[places[i]] = grid.origin()[places[i]] + whole + offset[i];
        let variance = about[i] - offset[i] * offset[i] + if i < 2 { section } else { 0.0 };
        covariance.col_mut(places[i])[places[i]] = variance;
    }
    for (k, (i, j)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
        let shared = mixed[k] - offset[i] * offset[j];
        covariance.col_mut(places[i])[places[j]] = shared;
        covariance.col_mut(places[j])[places[i]] = shared;
    }
    let trace = covariance.col(0)[0] + covariance.col(1)[1] + covariance.col(2)[2];
    Moments { volume, centroid, inertia: volume * (DMat3::from_diagonal(DVec3::splat(trace)) - covariance) }
}

/// What the image along one axis adds to the surface area: h²·Σ |n·axis| over its samples, in square world units.
///
/// The sum over the three axes is an unbiased estimate of the area, since the squares of a unit normal's components sum
/// to one and a surface element of area a meets a·|n·axis|/h² rays of that axis. `facing` gives |n·axis| of a triangle.
/// Surfaces inside the solid do not count: of samples at one depth only those count that change the state of the ray.
///
/// # Panics
/// If the image was sampled without triangles.
pub fn area_along(image: &Ldi, facing: impl Fn(u32) -> f64 + Sync) -> f64 {
    let triangles = image.triangles().expect("the image was sampled with triangles");
    let (columns, rows) = image.size();
    let row_sum = |row: u32| {
        let mut sum = 0.0;
        for ray in row * columns..(row + 1) * columns {
            let (start, samples) = (image.offsets()[ray as usize] as usize, image.samples(ray));
            let mut first = 0;
            for at_one_depth in samples.chunk_by(|a, b| a == b) {
                if at_one_depth.len() % 2 == 1 {
                    sum += facing(triangles[start + first]);
                }
                first += at_one_depth.len();
            }
        }
        sum
    };
    // Rows are summed in order, so that the last bits do not depend on the number of threads.
    let sums: Vec<f64> = (0..rows).into_par_iter().map(row_sum).collect();
    image.grid().pitch() * image.grid().pitch() * sums.into_iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use crate::mesh::ClosedMesh;
    use crate::sampler::cpu::CpuSampler;
    use crate::sampler::{Fill, Mode, Sampler};
    use crate::solids;

    fn box_of(min: DVec3, max: DVec3) -> ClosedMesh {
        ClosedMesh::check(solids::cuboid(min, max).unwrap()).unwrap()
    }

    #[test]
    fn a_box_has_its_volume_area_centroid_and_inertia() {
        let (min, max) = (DVec3::new(-1.0, 2.0, 30.0), DVec3::new(3.0, 4.0, 38.0));
        let mesh = box_of(min, max);
        let grid = Grid::with_resolution(mesh.bounds(), 64, 1024).unwrap();
        let solid = grid.quantise(&mesh).unwrap();
        let mut area = 0.0;
        for axis in Axis::ALL {
            let image = CpuSampler::default().sample_surface(&solid, axis, Fill::EvenOdd).unwrap();
            area += area_along(&image, |triangle| solid.facing(triangle, axis));
            let found = moments(&image);
            assert_eq!(found.volume, 64.0);
            assert!((found.centroid - 0.5 * (min + max)).length() < 1e-12, "{axis:?} {:?}", found.centroid);
            let (a, b, c) = (4.0f64, 2.0, 8.0);
            let expected = DVec3::new(b * b + c * c, a * a + c * c, a * a + b * b) * 64.0 / 12.0;
            let difference = found.inertia - DMat3::from_diagonal(expected);
            assert!(difference.to_cols_array().iter().all(|d| d.abs() < 1e-9), "{axis:?} {difference}");
        }
        assert!((area - 2.0 * (8.0 + 16.0 + 32.0)).abs() < 1e-9, "{area}");
    }

    fn axis_volumes(mesh: &ClosedMesh, resolution: u32) -> Vec<AxisVolume> {
        let grid = Grid::with_resolution(mesh.bounds(), resolution, 1024).unwrap();
        let solid = grid.quantise(mesh).unwrap();
        let sampler = CpuSampler::default();
        let image = |axis| sampler.sample(&solid, axis, Mode::Exact, Fill::EvenOdd).unwrap();
        Axis::ALL.iter().map(|&axis| AxisVolume::of(&image(axis))).collect()
    }

    #[test]
    fn faces_between_the_rays_are_right_to_first_order() {
        // Sides of 100, 7.3 and 3.4 pixels: each image is off by up to 14 %.
        let mesh = box_of(DVec3::ZERO, DVec3::new(100.0, 7.3, 3.4));
        let axes = axis_volumes(&mesh, 100);
        let exact = 100.0 * 7.3 * 3.4;
        let mean = axes.iter().map(|axis| axis.volume).sum::<f64>() / 3.0;
        let estimate = VolumeEstimate::from_axes(&axes);
        assert!((mean / exact - 1.0).abs() > 0.03, "the mean is not as bad as it was: {mean}");
        // Eight rays over 7.3 pixels and four over 3.4.
        let product_of_errors = 100.0 * 0.7 * 0.6;
        assert!((estimate.value - exact).abs() < 1.001 * product_of_errors, "{estimate:?} against {exact}");
        assert!(estimate.error > 0.5 * (estimate.value - exact).abs(), "{estimate:?} against {exact}");
    }

    #[test]
    fn no_volume_is_negative() {
        let axis = |axis, nodes| AxisVolume { axis, volume: 1.0, coarser: [1.0; 4], nodes, coarser_nodes: [nodes; 8] };
        let estimate = |nodes| VolumeEstimate::from_axes(&Axis::ALL.map(|a| axis(a, nodes)));
        assert_eq!(estimate(0.9).value, 3.0 - 2.0 * 0.9);
        assert_eq!(estimate(2.0).value, 0.0);
        assert!(estimate(2.0).error >= 0.5);
        assert!(estimate(f64::NAN).value.is_nan());
    }

    #[test]
    fn the_three_images_count_the_same_nodes() {
        let mesh = ClosedMesh::check(solids::torus(3.0, 1.0, 31, 17).unwrap()).unwrap();
        let axes = axis_volumes(&mesh, 77);
        assert!(axes[0].nodes > 0.0);
        for axis in &axes[1..] {
            assert_eq!(axis.nodes, axes[0].nodes);
            assert_eq!(axis.coarser_nodes, axes[0].coarser_nodes);
        }
    }

    #[test]
    fn the_inertia_of_a_turned_box_has_products() {
        // A prism over the right triangle (0,0), (1,0), (0,1): I_xy about the centroid is −∫(x − x̄)(y − ȳ) = 1/72 of h.
        let mut prism = solids::cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
        for p in &mut prism.positions {
            if p.x == 1.0 && p.y == 1.0 {
                (p.x, p.y) = (0.5, 0.5);
            }
        }
        let mesh = ClosedMesh::check(prism).unwrap();
        let grid = Grid::with_resolution(mesh.bounds(), 512, 1024).unwrap();
        let solid = grid.quantise(&mesh).unwrap();
        for axis in Axis::ALL {
            let image = CpuSampler::default().sample(&solid, axis, Mode::Exact, Fill::EvenOdd).unwrap();
            let found = moments(&image);
            assert!((found.volume - 0.5).abs() < 2e-3);
            assert!((found.inertia.col(0)[1] - 1.0 / 72.0).abs() < 1e-4, "{axis:?} {}", found.inertia);
            assert!(found.inertia.col(0)[2].abs() < 1e-9);
        }
    }

    #[test]
    fn the_area_of_a_sphere_is_found_from_its_hits() {
        let mesh = ClosedMesh::check(solids::geodesic(1.0, 40).unwrap()).unwrap();
        let exact = mesh.mesh().area();
        let grid = Grid::with_resolution(mesh.bounds(), 256, 1024).unwrap();
        let solid = grid.quantise(&mesh).unwrap();
        let area: f64 = Axis::ALL
            .iter()
            .map(|&axis| {
                let image = CpuSampler::default().sample_surface(&solid, axis, Fill::EvenOdd).unwrap();
                area_along(&image, |triangle| solid.facing(triangle, axis))
            })
            .sum();
        assert!((area / exact - 1.0).abs() < 1e-3, "{area} against {exact}");
    }

    #[test]
    fn a_face_between_two_touching_boxes_is_no_surface_under_the_non_zero_rule() {
        let mut pair = solids::cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
        let other = solids::cuboid(DVec3::new(0.0, 0.0, 1.0), DVec3::new(1.0, 1.0, 2.0)).unwrap();
        let base = pair.positions.len() as u32;
        pair.positions.extend(&other.positions);
        pair.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + base)));
        let mesh = ClosedMesh::check(pair).unwrap();
        let grid = Grid::with_resolution(mesh.bounds(), 64, 1024).unwrap();
        let solid = grid.quantise(&mesh).unwrap();
        for fill in [Fill::EvenOdd, Fill::NonZero] {
            let image = CpuSampler::default().sample_surface(&solid, Axis::Z, fill).unwrap();
            assert_eq!(area_along(&image, |triangle| solid.facing(triangle, Axis::Z)), 2.0, "{fill:?}");
            assert_eq!(volume(&image), 2.0);
        }
    }
}
