//! The part of the original that new triangles must be near.

use glam::DVec3;

use super::face::Face;
use crate::cancel::checkpoint;

/// Most subdivisions of a triangle's sides where its distance is sampled.
const MOST_PARTS: f64 = 16.0;

/// Least cosine of the angle, 75°, between a new triangle and one of the original near it. One collapse turns a triangle by less,
/// but several together may turn it farther.
const LIKE: f64 = 0.25;

/// Most cells for each triangle, and most entries of triangles in cells.
const MOST_CELLS: f64 = 16.0;
const MOST_ENTRIES: f64 = 64.0;

/// Number of triangles between two checkpoints.
const BETWEEN_CHECKPOINTS: u32 = 1 << 12;

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
    pub fn new(corners: impl Iterator<Item = [DVec3; 3]>, bound: f64) -> Original {
        let faces: Vec<Face> = corners.map(Face::new).collect();
        let count = faces.len().max(1) as f64;
        let length = |[a, b, c]: [DVec3; 3]| a.distance(b) + b.distance(c) + c.distance(a);
        let spacing = faces.iter().map(|face| length(face.corners)).sum::<f64>() / (3.0 * count);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner in faces.iter().flat_map(|face| face.corners) {
            (low, high) = (low.min(corner - bound), high.max(corner + bound));
        }
        let extent = if faces.is_empty() { DVec3::ZERO } else { high - low };
        let (ends, near) = (Vec::new(), Vec::new());
        let mut grid =
            Original { faces, spacing, bound, origin: low, side: spacing.max(2.0 * bound), cells: [1; 3], ends, near };
        // Triangles much longer than the others lie in many cells.
        loop {
            let cells = (extent / grid.side).floor() + 1.0;
            grid.cells = cells.to_array().map(|count| count as usize);
            if cells.element_product() <= MOST_CELLS * count + 64.0 && grid.entries() as f64 <= MOST_ENTRIES * count {
                break;
            }
            grid.side *= 1.25;
        }
        let mut ends = vec![0u32; grid.cells.iter().product()];
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

    /// Returns the least and the greatest cell of the box around a triangle.
    fn cells_of(&self, face: &Face) -> [[usize; 3]; 2] {
        let [a, b, c] = face.corners;
        [self.place(a.min(b).min(c) - self.bound), self.place(a.max(b).max(c) + self.bound)]
    }

    /// Returns the number of pairs of a triangle and a cell.
    fn entries(&self) -> u64 {
        let of_face = |face: &Face| {
            let [low, high] = self.cells_of(face);
            (0..3).map(|i| (high[i] - low[i] + 1) as u64).product::<u64>()
        };
        self.faces.iter().map(of_face).sum()
    }

    /// Visits the cells of the box around each triangle.
    fn each_cell(&self, mut visit: impl FnMut(usize, u32)) {
        for (number, face) in (0..).zip(&self.faces) {
            if number % BETWEEN_CHECKPOINTS == 0 {
                checkpoint();
            }
            let [low, high] = self.cells_of(face);
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

    /// Returns whether a triangle is within the bound at its [`samples`], and faces as the original does at its centroid.
    pub fn is_near(&self, face: &Face) -> bool {
        let [a, b, c] = face.corners;
        let faces_like = |other: &Face| other.normal.dot(face.normal) >= LIKE;
        self.is_within((a + b + c) / 3.0, faces_like)
            && samples(face.corners, self.spacing).all(|point| self.is_within(point, |_| true))
    }

    /// Returns whether a point is within the bound of a triangle with a property.
    fn is_within(&self, point: DVec3, has: impl Fn(&Face) -> bool) -> bool {
        let squared = self.bound * self.bound;
        // Nearly every point lies above the inside of a triangle.
        self.around(point).any(|face| face.squared_height(point).is_some_and(|height| height <= squared) && has(face))
            || self.around(point).any(|face| face.squared_distance(point) <= squared && has(face))
    }

    /// Returns the square of the largest distance of the points at which a triangle is within the bound.
    pub fn squared_distance(&self, corners: [DVec3; 3]) -> f64 {
        let centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
        let squared = |point| self.around(point).map(|face| face.squared_distance(point)).fold(f64::INFINITY, f64::min);
        samples(corners, self.spacing).chain([centroid]).map(squared).fold(0.0, f64::max)
    }
}

/// Returns points of a triangle about `spacing` apart, but at most 16 along a side: in its interior and on its first side. Of the
/// triangles around a new vertex, each begins with it, so that the last side is the first of the next; the side between is old.
fn samples([a, b, c]: [DVec3; 3], spacing: f64) -> impl Iterator<Item = DVec3> {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let parts = 2 * (longest / (2.0 * spacing)).ceil().clamp(1.0, MOST_PARTS / 2.0) as u32;
    let raster = (1..parts).flat_map(move |i| (1..=parts - i).map(move |j| (i, j, parts - i - j)));
    raster.map(move |(i, j, k)| (a * f64::from(i) + b * f64::from(j) + c * f64::from(k)) / f64::from(parts))
}
