//! Conversion of the crossings of rays to bits of nodes.

use std::ops::Range;

use super::layer::Raster;
use crate::bits::{accumulate, accumulate_rows, flip};
use crate::fixed::{Hit, Pixels};
use crate::grid::Axis;
use crate::minkowski::spans::{RangeOnRay, RayEnds};
use crate::minkowski::{Exterior, RaySpans};

/// The state of nodes by the rays along one axis.
#[derive(Debug, Default)]
pub struct Masks {
    /// The node lies in no gap of its ray, nor beyond its crossings.
    pub inside: Vec<u64>,
    /// The node does not lie beyond the crossings of its ray.
    pub hull: Vec<u64>,
    /// There is a crossing between the node and the one before it.
    pub walls: Vec<u64>,
}

/// A gap of a ray, by nodes of that ray.
#[derive(Clone, Copy, Debug)]
pub struct RayGap {
    /// Index of the hit that begins it.
    pub hit: u32,
    /// The range of nodes that lie in it.
    pub nodes: (usize, usize),
}

/// The rays along an axis, prepared for conversion to nodes.
#[derive(Clone, Copy, Debug)]
pub struct Rays<'a, H> {
    spans: &'a RaySpans<H>,
    ends: Option<&'a RayEnds>,
    exterior: Exterior,
    pixels: Pixels,
    nodes: usize,
    columns: usize,
    words: usize,
}

impl<'a, H: Hit> Rays<'a, H> {
    /// Prepares the rays of some spans.
    pub fn new(raster: &Raster, spans: &'a RaySpans<H>, exterior: Exterior) -> Rays<'a, H> {
        let Raster { nodes, words, pixels } = *raster;
        let [nodes, columns] = [spans.axis.depth(), spans.axis.column()].map(|axis| nodes[axis]);
        Rays { spans, ends: None, exterior, pixels, nodes, columns, words }
    }

    /// Adds the ends of the rays, for walks in short ranges.
    pub fn with_ends(self, ends: &'a RayEnds) -> Rays<'a, H> {
        Rays { ends: Some(ends), ..self }
    }

    fn node_behind(&self, hit: H) -> usize {
        self.pixels.index_from(hit.crossing().nearest()) as usize
    }

    /// Calls `wall` for each crossing with the node behind it, if that is in a range, and `gap` for each gap that begins with
    /// such a crossing. The last range includes crossings behind the last node. Returns the number of crossings before the range,
    /// and the nodes behind the first and last of all; or nothing, if there are none, or all are known to lie on one side of it.
    #[inline]
    pub fn walk(
        &self,
        ray: u32,
        range: &Range<usize>,
        mut wall: impl FnMut(usize),
        mut gap: impl FnMut(RayGap),
    ) -> Option<(usize, [usize; 2])> {
        let end = if range.end == self.nodes { usize::MAX } else { range.end };
        match self.ends.map(|ends| ends.place(ray, range.start, end - 1)) {
            Some(RangeOnRay::Beyond) => return None,
            Some(RangeOnRay::Between(ends)) => return Some((1, ends)),
            Some(RangeOnRay::Among) | None => {}
        }
        let hits = self.spans.of_ray(ray);
        let ends = [self.node_behind(*hits.first()?), self.node_behind(*hits.last()?)];
        let passed = match ends[0] < range.start {
            true => hits.partition_point(|&hit| self.node_behind(hit) < range.start),
            false => 0,
        };
        let (first_gap, first_hit) = (self.exterior.first_gap(), self.spans.offsets[ray as usize]);
        let mut begin = None;
        for (index, &hit) in hits.iter().enumerate().skip(passed) {
            let node = self.node_behind(hit);
            if let Some((hit, from)) = begin.take() {
                gap(RayGap { hit, nodes: (from, node) });
            }
            if node >= end {
                break;
            }
            wall(node);
            if index >= first_gap && (index - first_gap).is_multiple_of(2) && index + 1 < hits.len() {
                begin = Some((first_hit + index as u32, node));
            }
        }
        Some((passed, ends))
    }

    /// Computes the nodes of one ray along x; the masks must be clear. Bits of the last word beyond the last node have the
    /// state outside of everything; if that node has another one, there is a crossing between them.
    pub fn row(&self, ray: u32, masks: [&mut [u64]; 3], gap: impl FnMut(RayGap)) {
        let [inside, hull, walls] = masks;
        let wall = |node: usize| {
            if let Some(word) = walls.get_mut(node / 64) {
                *word |= 1 << (node % 64);
                inside[node / 64] ^= 1 << (node % 64);
            }
        };
        let crossed = self.walk(ray, &(0..self.nodes), wall, gap);
        if crossed.is_some() {
            accumulate(inside);
        }
        match (self.exterior, crossed) {
            (Exterior::Out, None) => {}
            (Exterior::Out, Some((_, ends))) => {
                ends.into_iter().for_each(|node| flip(hull, node));
                accumulate(hull);
            }
            (Exterior::In, _) => {
                inside.iter_mut().for_each(|word| *word = !*word);
                hull.fill(u64::MAX);
            }
        }
    }
}

impl Masks {
    /// Computes the nodes of consecutive rays along y or z, one for each node of a row along x, in a range of the nodes of
    /// each: row by row.
    pub fn cast<H: Hit>(
        &mut self,
        rays: &Rays<H>,
        first_ray: u32,
        range: Range<usize>,
        mut gap: impl FnMut(usize, RayGap),
    ) {
        debug_assert_ne!(rays.spans.axis, Axis::X);
        let words = rays.words;
        for bits in [&mut self.inside, &mut self.hull, &mut self.walls] {
            bits.clear();
            bits.resize(range.len() * words, 0);
        }
        let (inside, hull, walls) = (&mut self.inside, &mut self.hull, &mut self.walls);
        for column in 0..rays.columns {
            let (word, bit) = (column / 64, 1 << (column % 64));
            let wall = |node: usize| {
                let at = (node - range.start) * words + word;
                if at < walls.len() {
                    walls[at] |= bit;
                    inside[at] ^= bit;
                }
            };
            let crossed = rays.walk(first_ray + column as u32, &range, wall, |ray_gap| gap(column, ray_gap));
            let Some((passed, ends)) = crossed else { continue };
            if passed % 2 == 1 {
                inside[word] ^= bit;
            }
            for node in ends.into_iter().filter(|&node| node < range.end) {
                hull[node.saturating_sub(range.start) * words + word] ^= bit;
            }
        }
        [&mut *inside, &mut *hull].into_iter().for_each(|bits| accumulate_rows(bits, words));
        if rays.exterior == Exterior::In {
            inside.iter_mut().for_each(|word| *word = !*word);
            hull.fill(u64::MAX);
        }
    }
}
