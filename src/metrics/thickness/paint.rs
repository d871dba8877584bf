//! Maps of the largest size that covers each node.

use crate::parallel::*;

use super::Ball;
use super::thin::{moved, thin_out};
use crate::bits::{Ones, ones};
use crate::cancel::checkpoint;
use crate::metrics::nodes::words_between;
use crate::metrics::{BoundaryCondition, NodeSet};

/// The value of a node that no ball covers.
const UNPAINTED: f32 = -1.0;

/// Number of balls that are read before the first of them is painted: they lie apart in memory, and the reads overlap.
const READ_AHEAD: usize = 16;

/// Distance beyond a ball that it also paints, in pitches: more than is lost where balls are dropped, or were not searched
/// because others extend nearly as far. Otherwise later balls, such as the false ridges of a rough surface, would paint the
/// crescents in between.
const MARGIN: f32 = 0.25;

/// Returns for each node of a phase the greatest size of the balls that contain it, and 0 at other nodes; sizes, one for each
/// ball, are not negative. A node that no ball covers gets the greatest size among its 26 neighbours in the phase, beginning
/// with nodes next to covered ones, and 0 where no path leads to a covered one. With [`BoundaryCondition::Periodic`] balls
/// leave at one face and enter at the opposite one.
///
/// Where balls lie close, not all are painted: sizes are accurate to 0.5 pitches.
///
/// # Panics
/// If there is not a size for each ball.
pub fn paint(balls: &[Ball], sizes: &[f32], nodes: &NodeSet, edges: BoundaryCondition) -> Vec<f32> {
    assert_eq!(balls.len(), sizes.len(), "a size for each ball");
    let raster @ [columns, rows, planes] = nodes.size();
    // In the order of painting.
    let balls: Vec<(Ball, f32)> = thin_out(balls, sizes, raster, edges)
        .into_par_iter()
        .with_min_len(1 << 12)
        .map(|index| (balls[index as usize], sizes[index as usize]))
        .collect();
    let by_plane = ByPlane::of(&balls, planes, edges);
    let mut map = vec![0.0; nodes.volume()];
    let plane_size = (columns * rows).max(1);
    let paint_plane = |(z, plane): (usize, &mut [f32])| -> Vec<usize> {
        checkpoint();
        let mut canvas = Canvas::new(nodes, z, edges);
        let mut near = Vec::with_capacity(READ_AHEAD);
        for some in by_plane.at(z).chunks(READ_AHEAD) {
            if canvas.left == 0 {
                break;
            }
            near.clear();
            near.extend(some.iter().map(|&index| balls[index as usize]));
            near.iter().for_each(|(ball, size)| canvas.paint(ball, *size, plane));
        }
        canvas.unpainted().inspect(|&place| plane[place] = UNPAINTED).map(|place| z * plane_size + place).collect()
    };
    let unpainted: Vec<Vec<usize>> = map.par_chunks_mut(plane_size).enumerate().map(paint_plane).collect();
    fill(&mut map, unpainted.concat(), nodes, edges);
    map
}

/// For each plane the balls that meet it, in their order.
struct ByPlane {
    starts: Vec<usize>,
    balls: Vec<u32>,
}

impl ByPlane {
    fn of(balls: &[(Ball, f32)], planes: usize, edges: BoundaryCondition) -> ByPlane {
        let depth = planes as i64;
        let met = |(ball, _): &(Ball, f32)| {
            let (low, high) = (ceil(ball.centre[2] - ball.radius), floor(ball.centre[2] + ball.radius));
            let [low, high] = match edges {
                BoundaryCondition::Periodic => [low, high.min(low + depth - 1)],
                BoundaryCondition::Clip | BoundaryCondition::Border => [low.max(0), high.min(depth - 1)],
            };
            (low..=high).map(move |z| match z {
                within if (0..depth).contains(&within) => within as usize,
                beyond => beyond.rem_euclid(depth) as usize,
            })
        };
        let mut starts = vec![0; planes + 1];
        balls.iter().flat_map(met).for_each(|z| starts[z + 1] += 1);
        (0..planes).for_each(|z| starts[z + 1] += starts[z]);
        let mut next = starts.clone();
        let mut list = vec![0; starts[planes]];
        for (index, ball) in (0u32..).zip(balls) {
            for z in met(ball) {
                list[next[z]] = index;
                next[z] += 1;
            }
        }
        ByPlane { starts, balls: list }
    }

    fn at(&self, z: usize) -> &[u32] {
        &self.balls[self.starts[z]..self.starts[z + 1]]
    }
}

/// A plane with its unpainted nodes.
struct Canvas {
    z: usize,
    size: [usize; 3],
    edges: BoundaryCondition,
    words: usize,
    bits: Vec<u64>,
    /// Numbers of unpainted nodes, of each row and of all.
    of_rows: Vec<u32>,
    left: u32,
}

impl Canvas {
    fn new(nodes: &NodeSet, z: usize, edges: BoundaryCondition) -> Canvas {
        let size = nodes.size();
        let bits: Vec<u64> = (0..size[1]).flat_map(|y| nodes.row(y, z)).copied().collect();
        let words = nodes.words();
        let of_rows: Vec<u32> = bits.chunks(words).map(|row| row.iter().map(|word| word.count_ones()).sum()).collect();
        let left = of_rows.iter().sum();
        Canvas { z, size, edges, words, bits, of_rows, left }
    }

    /// Paints the part of the plane that the ball covers and no earlier one did.
    fn paint(&mut self, ball: &Ball, size: f32, plane: &mut [f32]) {
        let [x, y, z] = ball.centre;
        let radius = ball.radius + MARGIN;
        let squared = radius * radius;
        match self.edges {
            BoundaryCondition::Periodic => {
                // Once for each repetition of the plane within the ball.
                let depth = self.size[2] as f32;
                let first = ceil((z - radius - self.z as f32) / depth);
                let last = floor((z + radius - self.z as f32) / depth);
                for repetition in first..=last {
                    let off = self.z as f32 + repetition as f32 * depth - z;
                    self.paint_disc([x, y], squared - off * off, size, plane);
                }
            }
            BoundaryCondition::Clip | BoundaryCondition::Border => {
                let off = self.z as f32 - z;
                self.paint_disc([x, y], squared - off * off, size, plane);
            }
        }
    }

    fn paint_disc(&mut self, [x, y]: [f32; 2], squared: f32, size: f32, plane: &mut [f32]) {
        if squared < 0.0 {
            return;
        }
        let radius = squared.sqrt();
        let repeats = self.edges == BoundaryCondition::Periodic;
        let rows = self.size[1] as i64;
        let (mut low, mut high) = (ceil(y - radius), floor(y + radius));
        if !repeats {
            (low, high) = (low.max(0), high.min(rows - 1));
        }
        let columns = [ceil(x - radius), floor(x + radius)];
        for at in low..=high {
            let row = if (0..rows).contains(&at) { at as usize } else { at.rem_euclid(rows) as usize };
            if self.of_rows[row] == 0 || self.is_painted(row, columns) {
                continue;
            }
            let off = at as f32 - y;
            let half = (squared - off * off).max(0.0).sqrt();
            let (first, last) = (ceil(x - half), floor(x + half));
            let columns = self.size[0] as i64;
            if !repeats {
                self.paint_span(row, first.max(0), last.min(columns - 1), size, plane);
            } else if last - first + 1 >= columns {
                self.paint_span(row, 0, columns - 1, size, plane);
            } else {
                let from = first.rem_euclid(columns);
                let to = from + last - first;
                self.paint_span(row, from, to.min(columns - 1), size, plane);
                self.paint_span(row, 0, to - columns, size, plane);
            }
        }
    }

    /// Returns whether all nodes of a row in some columns of the raster are known to be painted: most are, where balls overlap.
    #[inline]
    fn is_painted(&self, row: usize, [first, last]: [i64; 2]) -> bool {
        let last_column = self.size[0] as i64 - 1;
        if self.edges == BoundaryCondition::Periodic && (first < 0 || last > last_column) {
            return false;
        }
        let (first, last) = (first.max(0), last.min(last_column));
        last < first
            || words_between(first as usize, last as usize)
                .all(|(word, mask)| self.bits[row * self.words + word] & mask == 0)
    }

    /// Paints the unpainted nodes from `first` to `last`; none if `last` comes before `first`.
    #[inline]
    fn paint_span(&mut self, row: usize, first: i64, last: i64, size: f32, plane: &mut [f32]) {
        if last < first {
            return;
        }
        for (word, mask) in words_between(first as usize, last as usize) {
            let bits = &mut self.bits[row * self.words + word];
            let found = *bits & mask;
            if found == 0 {
                continue;
            }
            *bits &= !found;
            self.of_rows[row] -= found.count_ones();
            self.left -= found.count_ones();
            let at = row * self.size[0] + word * 64;
            Ones(found).for_each(|bit| plane[at + bit as usize] = size);
        }
    }

    /// Returns the places in the plane of the nodes that are left.
    fn unpainted(&self) -> impl Iterator<Item = usize> {
        let rows = self.bits.chunks(self.words).enumerate().filter(|(row, _)| self.of_rows[*row] > 0);
        rows.flat_map(|(row, bits)| {
            let first = row * self.size[0];
            ones(bits).map(move |x| first + x)
        })
    }
}

/// Rounds a coordinate below 2³¹ down. `f32::floor` calls a function where the oldest processors of x86-64 are allowed.
#[inline]
fn floor(at: f32) -> i64 {
    let toward_0 = at as i32;
    i64::from(toward_0) - i64::from(toward_0 as f32 > at)
}

/// Rounds a coordinate below 2³¹ up.
#[inline]
fn ceil(at: f32) -> i64 {
    -floor(-at)
}

/// Assigns to uncovered nodes the greatest value of their neighbours, until no more have a neighbour with a value.
fn fill(map: &mut [f32], mut left: Vec<usize>, nodes: &NodeSet, edges: BoundaryCondition) {
    let size @ [columns, rows, _] = nodes.size();
    while !left.is_empty() {
        checkpoint();
        let greatest = |&index: &usize| {
            let node = [index % columns, index / columns % rows, index / columns / rows];
            let around = (0..27).filter_map(|place: i64| {
                let offset = [place % 3 - 1, place / 3 % 3 - 1, place / 9 - 1];
                let mut other = [0; 3];
                for axis in 0..3 {
                    other[axis] = moved(node[axis], offset[axis], size[axis], edges)?;
                }
                nodes.contains(other).then(|| map[(other[2] * rows + other[1]) * columns + other[0]])
            });
            around.fold(UNPAINTED, f32::max)
        };
        let found: Vec<f32> = left.par_iter().with_min_len(1 << 10).map(greatest).collect();
        if found.iter().all(|&value| value == UNPAINTED) {
            break;
        }
        left.iter().zip(&found).for_each(|(&index, &value)| map[index] = value);
        left.retain(|&index| map[index] == UNPAINTED);
    }
    left.into_iter().for_each(|index| map[index] = 0.0);
}
