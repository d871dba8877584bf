//! The part of the original that new triangles must be near.

use glam::DVec3;

use super::face::Face;

/// Most subdivisions of a triangle's sides where its distance is sampled.
const MOST_PARTS: f64 = 16.0;

/// Least cosine of the angle, 75°, between a new triangle and one of the original near it. One collapse turns a triangle by less,
/// but several together may turn it farther.
const LIKE: f64 = 0.25;

/// Most cells for each triangle.
const MOST_CELLS: f64 = 16.0;

/// Triangles of the original, from which distances are measured, by the cells of a grid that they are within the bound of.
pub(super) struct Original {
    faces: Vec<Face>,
    /// The mean length of sides.
    spacing: f64,
    bound: f64,
    /// The least corner of the grid, the side of its cells, and their numbers along each axis.
    origin: DVec3,
    side: f64,
    cells: [usize; 3],
    /// For each cell the place in `near` after its last triangle.
    ends: Vec<u32>,
    near: Vec<u32>,
}

impl Original {
    pub fn new(corners: Vec<[DVec3; 3]>, bound: f64) -> Original {
        let count = corners.len().max(1) as f64;
        let lengths = corners.iter().map(|[a, b, c]| a.distance(*b) + b.distance(*c) + c.distance(*a));
        let spacing = lengths.sum::<f64>() / (3.0 * count);
        let box_of = |[a, b, c]: &[DVec3; 3]| (a.min(*b).min(*c) - bound, a.max(*b).max(*c) + bound);
        let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = corners.iter().map(box_of).fold(empty, |all, of| (all.0.min(of.0), all.1.max(of.1)));
        let extent = if corners.is_empty() { DVec3::ZERO } else { high - low };
        // A flat part has one layer of cells.
        let cells_of = |side: f64| (extent / side).floor() + 1.0;
        let mut side = spacing.max(2.0 * bound);
        while cells_of(side).element_product() > MOST_CELLS * count + 64.0 {
            side *= 1.25;
        }
        let cells = cells_of(side).to_array().map(|count| count as usize);
        let faces = corners.into_iter().map(Face::new).collect();
        let mut grid = Original { faces, spacing, bound, origin: low, side, cells, ends: Vec::new(), near: Vec::new() };
        let mut ends = vec![0u32; cells.iter().product()];
        grid.each_cell(|cell, _| ends[cell] += 1);
        let mut sum = 0;
        for end in &mut ends {
            sum += std::mem::replace(end, sum);
        }
        let mut near = vec![0; sum as usize];
        grid.each_cell(|cell, triangle| {
            near[ends[cell] as usize] = triangle;
            ends[cell] += 1;
        });
        (grid.ends, grid.near) = (ends, near);
        grid
    }

    /// Visits the cells of the box around each triangle.
    fn each_cell(&self, mut visit: impl FnMut(usize, u32)) {
        for (number, face) in (0..).zip(&self.faces) {
            let [a, b, c] = face.corners;
            let (low, high) = (a.min(b).min(c) - self.bound, a.max(b).max(c) + self.bound);
            let (low, high) = (self.place(low), self.place(high));
            for z in low[2]..=high[2] {
                for y in low[1]..=high[1] {
                    (low[0]..=high[0]).for_each(|x| visit(self.cell([x, y, z]), number));
                }
            }
        }
    }

    fn place(&self, point: DVec3) -> [usize; 3] {
        let place = ((point - self.origin) / self.side).to_array();
        [0, 1, 2].map(|i| (place[i].max(0.0) as usize).min(self.cells[i] - 1))
    }

    fn cell(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.cells[1] + y) * self.cells[0] + x
    }

    /// Returns the triangles that may be within the bound of a point.
    fn around(&self, point: DVec3) -> impl Iterator<Item = &Face> {
        let cell = self.cell(self.place(point));
        let start = cell.checked_sub(1).map_or(0, |before| self.ends[before]);
        self.near[start as usize..self.ends[cell] as usize].iter().map(|&number| &self.faces[number as usize])
    }

    /// Returns whether a triangle is within the bound, at points as dense as the original is meshed, and faces as the original
    /// does there. The points are its centroid and those of a raster, but for those on the side opposite to the corner `first` and
    /// on the side before it: of the triangles around a new vertex, the first is old, and the second belongs to the next.
    pub fn is_near(&self, face: &Face, first: usize) -> bool {
        let [a, b, c] = [0, 1, 2].map(|i| face.corners[(first + i) % 3]);
        let faces_like = |other: &Face| other.normal.dot(face.normal) >= LIKE;
        self.is_within((a + b + c) / 3.0, faces_like)
            && samples([a, b, c], self.spacing).all(|point| self.is_within(point, |_| true))
    }

    /// Returns whether a point is within the bound of a triangle with a property.
    fn is_within(&self, point: DVec3, has: impl Fn(&Face) -> bool) -> bool {
        let squared = self.bound * self.bound;
        // Nearly every point lies above the inside of a triangle.
        self.around(point).any(|face| face.squared_height(point).is_some_and(|height| height <= squared) && has(face))
            || self.around(point).any(|face| face.squared_distance(point) <= squared && has(face))
    }

    /// Returns the square of the largest distance of a triangle that is within the bound.
    pub fn squared_distance(&self, corners: [DVec3; 3]) -> f64 {
        let centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
        let squared =
            |point| self.around(point).map(|face| face.squared_distance(point)).fold(self.bound * self.bound, f64::min);
        samples(corners, self.spacing).chain([centroid]).map(squared).fold(0.0, f64::max)
    }
}

/// Returns points of a triangle, no more than about `spacing` apart, in its interior and on its first side.
fn samples([a, b, c]: [DVec3; 3], spacing: f64) -> impl Iterator<Item = DVec3> {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let parts = 2 * (longest / (2.0 * spacing)).ceil().clamp(1.0, MOST_PARTS / 2.0) as u32;
    let raster = (1..parts).flat_map(move |i| (1..=parts - i).map(move |j| (i, j, parts - i - j)));
    raster.map(move |(i, j, k)| (a * f64::from(i) + b * f64::from(j) + c * f64::from(k)) / f64::from(parts))
}
