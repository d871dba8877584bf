//! Crossings of rows of nodes with the surface.

use crate::parallel::*;

use crate::bits::{Ones, after, is_set};
use crate::grid::{Axis, Grid};
use crate::ldi::{Ldi, LdiError};
use crate::metrics::{BoundaryCondition, NodeSet, Region};

/// Distance in lattice steps within which a crossing counts as lying in a face of the box, or in the surface of the region: two
/// for the rounding of each of the two.
const FACE_STEPS: i32 = 4;

/// Rows in one task.
const TASK: usize = 1 << 12;

/// For each axis and each row of nodes along it, the crossings of the row with the surface: in pitches, node `i` lying at `i`,
/// ascending.
///
/// Rows are numbered as the rays of images are: row · columns + column, where the columns of rows along x run along y, and
/// those of rows along y and z run along x.
#[derive(Clone, Debug)]
pub struct Crossings {
    size: [usize; 3],
    rows: [Rows; 3],
    walls: Option<[[f32; 3]; 2]>,
}

/// The crossings of the rows along an axis; those of row `r` are `places[starts[r] .. starts[r + 1]]`.
#[derive(Clone, Debug)]
struct Rows {
    starts: Vec<u32>,
    places: Vec<f32>,
}

impl Crossings {
    /// Finds the crossings of a solid, from its exact images along x, y and z.
    ///
    /// With [`BoundaryCondition::Clip`] and [`BoundaryCondition::Periodic`], crossings in a face of the box, or in the surface
    /// of a solid that is the region, arose from cutting and do not count. Surfaces beyond the region do: they are real. With
    /// [`BoundaryCondition::Periodic`] the raster repeats, and where solid meets pore at its seam, there is a crossing. With
    /// [`BoundaryCondition::Border`] the boundary of the region is surface too: the planes of a box, and the crossings of a
    /// solid.
    ///
    /// # Panics
    /// If the images are not those along x, y and z of the region's grid.
    pub fn of_images(images: &[Ldi; 3], region: &Region, edges: BoundaryCondition) -> Crossings {
        let grid = region.grid();
        let whole = (1u64 << grid.shift()) as f64;
        let bounds = region.bounds();
        let rows = Axis::ALL.map(|axis| {
            let image = &images[axis.depth()];
            assert!(image.axis() == axis && image.grid() == grid, "images along x, y and z of the region's grid");
            let border = region.images().map(|images| &images[axis.depth()]);
            let faces = [bounds.min[axis.depth()], bounds.max[axis.depth()]];
            Rows::each(image.rays() as usize, |row, places| {
                let depths = alternating(image.samples(row as u32));
                let of_border = border.map_or(&[][..], |border| border.samples(row as u32));
                // The buffer already holds the rows before this one.
                let first = places.len();
                let in_boundary = |depth: i32| match border {
                    None => faces.iter().any(|face| (depth - face).abs() <= FACE_STEPS),
                    Some(_) => of_border.iter().any(|other| (depth - other).abs() <= FACE_STEPS),
                };
                let place = |depth: i32| (f64::from(depth - grid.node(0)) / whole) as f32;
                if edges == BoundaryCondition::Periodic && border.is_none() {
                    let ends = [depths.first(), depths.last()].map(|end| end.is_some_and(|&depth| in_boundary(depth)));
                    if ends[0] != ends[1] {
                        places.push(-0.5);
                    }
                }
                places.extend(depths.iter().filter(|&&depth| !in_boundary(depth)).map(|&depth| place(depth)));
                if edges == BoundaryCondition::Border && border.is_some() {
                    places.extend(of_border.iter().map(|&depth| place(depth)));
                    places[first..].sort_unstable_by(f32::total_cmp);
                }
            })
        });
        let walls = (edges == BoundaryCondition::Border).then(|| region.walls()).flatten();
        Crossings { size: grid.rays().map(|n| n as usize), rows, walls }
    }

    /// Finds the crossings of a set of nodes, halfway between neighbours along an axis of which one belongs to it: the faces of
    /// its voxels. With [`BoundaryCondition::Periodic`] the first and the last node of a row are neighbours, with their face at
    /// −0.5; with [`BoundaryCondition::Border`] the faces of the raster are walls.
    pub fn of_nodes(solid: &NodeSet, edges: BoundaryCondition) -> Crossings {
        let size @ [columns, rows, planes] = solid.size();
        let seam = edges == BoundaryCondition::Periodic;
        let along_x = Rows::each(rows * planes, |row, places| {
            let bits = solid.row(row % rows, row / rows);
            if seam && is_set(bits, 0) != is_set(bits, columns - 1) {
                places.push(-0.5);
            }
            for (word, &here) in bits.iter().enumerate() {
                for bit in Ones(here ^ after(bits, word)) {
                    let x = word * 64 + bit as usize;
                    if x + 1 < columns {
                        places.push(x as f32 + 0.5);
                    }
                }
            }
        });
        let along_y = Rows::across(columns, rows, planes, seam, |z, y| solid.row(y, z));
        let along_z = Rows::across(columns, planes, rows, seam, |y, z| solid.row(y, z));
        let walls = (edges == BoundaryCondition::Border).then(|| solid.walls());
        Crossings { size, rows: [along_x, along_y, along_z], walls }
    }

    /// Finds the crossings between neighbours of which one satisfies `belongs`, interpolated linearly from `value`, whose sign
    /// differs there.
    pub(in crate::metrics) fn between(
        size: [usize; 3],
        belongs: impl Fn([usize; 3]) -> bool + Sync,
        value: impl Fn([usize; 3]) -> f64 + Sync,
    ) -> Crossings {
        let rows = Axis::ALL.map(|axis| {
            let columns = size[axis.column()];
            Rows::each(columns * size[axis.row()], |row, places| {
                let node = |depth: usize| {
                    let mut node = [0; 3];
                    (node[axis.depth()], node[axis.column()], node[axis.row()]) = (depth, row % columns, row / columns);
                    node
                };
                for next in 1..size[axis.depth()] {
                    let ends = [node(next - 1), node(next)];
                    if belongs(ends[0]) != belongs(ends[1]) {
                        let [a, b] = ends.map(&value);
                        places.push((next as f64 - b / (b - a)) as f32);
                    }
                }
            })
        });
        Crossings { size, rows, walls: None }
    }

    /// Returns the image along an axis of a grid of as many nodes, with samples strictly between its nodes.
    pub(in crate::metrics) fn image(&self, grid: &Grid, axis: Axis) -> Result<Ldi, LdiError> {
        let rows = &self.rows[axis.depth()];
        let whole = f64::from(1u32 << grid.shift());
        let depth = |&place: &f32| {
            let node = place.floor().min(self.size[axis.depth()] as f32 - 2.0);
            let within = (f64::from(place - node) * whole).round().clamp(1.0, whole - 1.0);
            grid.node(node as u32) + within as i32
        };
        Ldi::from_parts(*grid, axis, rows.starts.clone(), rows.places.iter().map(depth).collect(), Vec::new())
    }

    /// Returns the number of nodes along x, y and z.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Returns the crossings of a row with the surface, ascending.
    #[inline]
    pub fn row(&self, axis: Axis, row: usize) -> &[f32] {
        let rows = &self.rows[axis.depth()];
        &rows.places[rows.starts[row] as usize..rows.starts[row + 1] as usize]
    }

    /// Returns the number of crossings along an axis.
    pub fn count(&self, axis: Axis) -> usize {
        self.rows[axis.depth()].places.len()
    }

    /// Returns the index of the first crossing of a row among those of an axis.
    #[inline]
    pub(super) fn first(&self, axis: Axis, row: usize) -> u32 {
        self.rows[axis.depth()].starts[row]
    }

    /// Returns the lower and upper corner of a box whose faces are walls, in pitches.
    pub fn walls(&self) -> Option<[[f32; 3]; 2]> {
        self.walls
    }
}

impl Rows {
    /// # Panics
    /// If there are more crossings than 32 bits count.
    fn each(rows: usize, fill: impl Fn(usize, &mut Vec<f32>) + Sync) -> Rows {
        let tasks: Vec<(Vec<u32>, Vec<f32>)> = (0..rows.div_ceil(TASK))
            .into_par_iter()
            .map(|task| {
                let mut places = Vec::new();
                let ends = (task * TASK..rows.min((task + 1) * TASK)).map(|row| {
                    fill(row, &mut places);
                    places.len() as u32
                });
                (ends.collect(), places)
            })
            .collect();
        let mut all = Rows { starts: Vec::with_capacity(rows + 1), places: Vec::new() };
        all.places.reserve_exact(tasks.iter().map(|(_, places)| places.len()).sum());
        all.starts.push(0);
        for (ends, places) in tasks {
            let before = u32::try_from(all.places.len()).expect("fewer crossings than 2^32");
            all.starts.extend(ends.into_iter().map(|end| before + end));
            all.places.extend(places);
        }
        u32::try_from(all.places.len()).expect("fewer crossings than 2^32");
        all
    }

    /// Finds the crossings of rows across those of words: for each of `outer`, one row for each column, of `steps` nodes, whose
    /// bits are column by column those of `words(outer, step)`.
    fn across<'a>(
        columns: usize,
        steps: usize,
        outer: usize,
        seam: bool,
        words: impl Fn(usize, usize) -> &'a [u64] + Sync,
    ) -> Rows {
        let changes = |at: usize, take: &mut dyn FnMut(usize, f32)| {
            let mut compare = |before: usize, after: usize, place: f32| {
                for (word, (a, b)) in words(at, before).iter().zip(words(at, after)).enumerate() {
                    Ones(a ^ b).for_each(|bit| take(word * 64 + bit as usize, place));
                }
            };
            if seam {
                compare(steps - 1, 0, -0.5);
            }
            (1..steps).for_each(|step| compare(step - 1, step, step as f32 - 0.5));
        };
        let tasks: Vec<(Vec<u32>, Vec<f32>)> = (0..outer)
            .into_par_iter()
            .map(|at| {
                let mut starts = vec![0; columns + 1];
                changes(at, &mut |column, _| starts[column + 1] += 1);
                (0..columns).for_each(|column| starts[column + 1] += starts[column]);
                let mut places = vec![0.0; starts[columns] as usize];
                let mut next = starts.clone();
                changes(at, &mut |column, place| {
                    places[next[column] as usize] = place;
                    next[column] += 1;
                });
                (starts, places)
            })
            .collect();
        let mut all = Rows { starts: vec![0], places: Vec::new() };
        for (starts, places) in tasks {
            let before = u32::try_from(all.places.len()).expect("fewer crossings than 2^32");
            all.starts.extend(starts[1..].iter().map(|start| before + start));
            all.places.extend(places);
        }
        u32::try_from(all.places.len()).expect("fewer crossings than 2^32");
        all
    }
}

/// Returns the depths at which a ray actually changes sides: pairs at the same depth enclose nothing and are dropped.
fn alternating(depths: &[i32]) -> Vec<i32> {
    let mut left: Vec<i32> = Vec::with_capacity(depths.len());
    for &depth in depths {
        match left.last() {
            Some(&last) if last == depth => drop(left.pop()),
            _ => left.push(depth),
        }
    }
    left
}

#[cfg(test)]
impl Crossings {
    /// Returns crossings at the given places of each row along each axis, ascending.
    pub(super) fn of_places(size: [usize; 3], mut places: impl FnMut(Axis, usize) -> Vec<f32>) -> Crossings {
        let rows = Axis::ALL.map(|axis| {
            let mut rows = Rows { starts: vec![0], places: Vec::new() };
            for row in 0..size[axis.column()] * size[axis.row()] {
                rows.places.extend(places(axis, row));
                rows.starts.push(rows.places.len() as u32);
            }
            rows
        });
        Crossings { size, rows, walls: None }
    }

    /// Returns the crossings of the solid where a function of the position in pitches is negative, found by bisection between
    /// neighbours, and its nodes. With [`BoundaryCondition::Periodic`] the function must have the raster's periods.
    pub(crate) fn of_function(
        size: [usize; 3],
        edges: BoundaryCondition,
        function: impl Fn([f64; 3]) -> f64 + Sync,
    ) -> (Crossings, NodeSet) {
        let rows = Axis::ALL.map(|axis| {
            let (depth, columns) = (axis.depth(), size[axis.column()]);
            Rows::each(columns * size[axis.row()], |row, places| {
                let at = |place: f64| {
                    let mut position = [0.0; 3];
                    position[depth] = place;
                    position[axis.column()] = (row % columns) as f64;
                    position[axis.row()] = (row / columns) as f64;
                    function(position) < 0.0
                };
                let first = if edges == BoundaryCondition::Periodic { -1 } else { 0 };
                for before in first..size[depth] as i64 - 1 {
                    let (mut low, mut high) = (before as f64, before as f64 + 1.0);
                    let side = at(low);
                    if side == at(high) {
                        continue;
                    }
                    for _ in 0..24 {
                        let middle = 0.5 * (low + high);
                        *(if at(middle) == side { &mut low } else { &mut high }) = middle;
                    }
                    places.push(low as f32);
                }
            })
        });
        let walls = (edges == BoundaryCondition::Border).then(|| [[-0.5; 3], size.map(|n| n as f32 - 0.5)]);
        (Crossings { size, rows, walls }, NodeSet::from_fn(size, |node| function(node.map(|i| i as f64)) < 0.0))
    }
}
