//! Chords: the segments of rays within a phase.
//!
//! The rays of an image are the test lines of stereology, and the segments that the surface cuts them into are chords of the
//! solid and of its pores. Their lengths are accurate to a millionth of a pitch. Weighted by number they give the chord-length
//! distribution p(z) of Torquato (*Random Heterogeneous Materials*, Springer 2002, § 2.5), where every chord counts once;
//! weighted by length, each counts in proportion to its length, as for a random point of the phase.
//!
//! # Censored chords
//! A chord that ends at the region's boundary is *censored*: it continues beyond, and only its least length is known. Neither
//! simple treatment is unbiased. Omitting such chords ([`Counted::Complete`]) makes the mean too short, as long chords are cut
//! more often; counting their visible length ([`Counted::All`]) does so, too. The distribution of this module by default
//! consists of complete chords: each of its lengths is one that the structure has, and PoreSpy does the same. [`Censored`]
//! reports the omitted share.
//!
//! The **mean** has an unbiased estimate: the length of the phase on the lines over half the number of ends at the surface
//! ([`Chords::mean`]). An end is visible irrespective of the length of its chord, so every chord counts as often as its ends
//! are visible, which is correct on average. With the crossings per unit length P_L of [`anisotropy`](super::anisotropy), a
//! mean over the same lines, that is 2φ/P_L for the pores of a porosity φ: each chord has two ends. In a periodic cell nothing
//! needs to be cut ([`BoundaryCondition::Periodic`]): a chord that leaves at one face continues at the opposite one.
//!
//! A ball of radius R has chords of mean 4R/3 and standard deviation √2 R/3 by number.

use crate::parallel::*;

use super::segments::{End, flush, segments};
use super::{BoundaryCondition, Distribution, Phase, Region};
use crate::cancel::checkpoint;
use crate::ldi::{Ldi, Spans};

/// The weight of a chord.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Weighting {
    /// Every chord counts once.
    #[default]
    Number,
    /// Every chord counts in proportion to its length.
    Length,
}

/// The chords that count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Counted {
    /// Chords that end at the surface on both sides.
    #[default]
    Complete,
    /// All chords, censored ones with their visible length.
    All,
}

/// Chords that end at the region's boundary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Censored {
    /// Number of censored chords.
    pub count: u64,
    /// Their share of all chords by number.
    pub share: f64,
    /// Their visible length, in world units.
    pub length: f64,
    /// Their share of the length of all chords.
    pub share_of_length: f64,
}

/// The chords of a phase within a region.
#[derive(Clone, Debug, PartialEq)]
pub struct Chords {
    step: f64,
    /// Complete chords, in lattice steps.
    complete: Vec<i32>,
    /// Visible lengths of censored chords, in lattice steps.
    censored: Vec<i32>,
    /// Number of ends at the surface.
    ends: u64,
}

/// Chords of a few rows, in lattice steps.
#[derive(Default)]
struct Found {
    complete: Vec<i32>,
    censored: Vec<i32>,
    ends: u64,
}

impl Found {
    fn add(&mut self, length: i32, ends: [End; 2]) {
        let seen = ends.iter().filter(|&&end| end == End::Surface).count();
        self.ends += seen as u64;
        match seen {
            2 => self.complete.push(length),
            _ => self.censored.push(length),
        }
    }
}

impl Chords {
    /// Finds the chords on the rays of one exact image of the solid. Of [`BoundaryCondition`], `Periodic` joins chords across a
    /// box; the others leave them cut, and so does every region that is not a box.
    pub fn along(image: &Ldi, region: &Region, phase: Phase, edges: BoundaryCondition) -> Chords {
        let (columns, rows) = image.size();
        let flush = flush(image.grid());
        let joins = edges == BoundaryCondition::Periodic && region.is_box();
        let of_row = |row: u32| {
            checkpoint();
            let mut found = Found::default();
            let mut of_ray = Vec::new();
            for ray in row * columns..(row + 1) * columns {
                of_ray.clear();
                let (solid, spans) = (Spans::new(image.samples(ray)), region.spans(image.axis(), ray));
                segments(solid, spans, phase, flush, |segment| of_ray.push(segment));
                if let (true, [first, .., last]) = (joins, &of_ray[..])
                    && (first.ends[0], last.ends[1]) == (End::Boundary, End::Boundary)
                {
                    found.add(first.length() + last.length(), [last.ends[0], first.ends[1]]);
                    of_ray.pop();
                    of_ray.swap_remove(0);
                }
                of_ray.iter().for_each(|segment| found.add(segment.length(), segment.ends));
            }
            found
        };
        let by_row: Vec<Found> = (0..rows).into_par_iter().map(of_row).collect();
        Chords {
            step: image.grid().step(),
            complete: by_row.iter().flat_map(|found| &found.complete).copied().collect(),
            censored: by_row.iter().flat_map(|found| &found.censored).copied().collect(),
            ends: by_row.iter().map(|found| found.ends).sum(),
        }
    }

    /// Combines the chords of several images of one grid, such as those along x, y and z.
    ///
    /// # Panics
    /// If there are none, or their lattices differ in step.
    pub fn together(parts: &[Chords]) -> Chords {
        let step = parts.first().expect("chords to put together").step;
        assert!(parts.iter().all(|part| part.step == step), "chords on lattices of different steps");
        Chords {
            step,
            complete: parts.iter().flat_map(|part| &part.complete).copied().collect(),
            censored: parts.iter().flat_map(|part| &part.censored).copied().collect(),
            ends: parts.iter().map(|part| part.ends).sum(),
        }
    }

    /// Returns the number of chords, including censored ones.
    pub fn count(&self) -> u64 {
        (self.complete.len() + self.censored.len()) as u64
    }

    /// Returns the length of all chords, with the visible length of censored ones, in world units.
    pub fn length(&self) -> f64 {
        self.world(total(&self.complete) + total(&self.censored))
    }

    /// Returns the mean chord, in world units: the total length over half the number of ends at the surface, so that cut chords
    /// cause no bias; see the module's docs. `None` where no chord ends at the surface.
    pub fn mean(&self) -> Option<f64> {
        (self.ends > 0).then(|| self.length() / (0.5 * self.ends as f64))
    }

    /// Returns the chords that the region's boundary ends; shares are NaN where there are no chords at all.
    pub fn censored(&self) -> Censored {
        let length = self.world(total(&self.censored));
        let count = self.censored.len() as u64;
        Censored { count, share: count as f64 / self.count() as f64, length, share_of_length: length / self.length() }
    }

    /// Returns the distribution of lengths in world units; `None` where no chord counts.
    pub fn distribution(&self, weighting: Weighting, counted: Counted) -> Option<Distribution> {
        let censored = match counted {
            Counted::Complete => &[][..],
            Counted::All => &self.censored,
        };
        let complete = self.complete.len();
        Distribution::gather(complete + censored.len(), |i| {
            let steps = if i < complete { self.complete[i] } else { censored[i - complete] };
            let length = self.step * f64::from(steps);
            match weighting {
                Weighting::Number => (length, 1.0),
                Weighting::Length => (length, length),
            }
        })
    }

    fn world(&self, steps: i64) -> f64 {
        self.step * steps as f64
    }
}

fn total(lengths: &[i32]) -> i64 {
    lengths.par_iter().with_min_len(1 << 16).map(|&length| i64::from(length)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    use crate::grid::{Axis, LatticeBox};
    use crate::integrate;
    use crate::metrics::anisotropy::crossings_along;
    use crate::metrics::surface_area::SurfaceElements;
    use crate::metrics::surface_area::tests::{Sampled, grid_of, network, order, struts, turned, turns};
    use crate::solids::{self, Surface};
    use crate::testing::meshes::together;

    fn of_axes(sampled: &Sampled, region: &Region, phase: Phase, edges: BoundaryCondition) -> Chords {
        Chords::together(&sampled.images.each_ref().map(|image| Chords::along(image, region, phase, edges)))
    }

    #[test]
    fn chord_lengths_of_a_ball_converge_to_the_closed_form() {
        // By length, the mean is ⟨l²⟩/⟨l⟩ = 2R²/(4R/3).
        let exact = [4.0 / 3.0, 2.0f64.sqrt() / 3.0, 1.5];
        let errors = [32, 64, 128].map(|resolution| {
            // At ten positions between the rays.
            let found: Vec<[f64; 3]> = (0..10)
                .map(|i| {
                    let place = DVec3::new(0.618034, 0.754878, 0.569840) * f64::from(i);
                    let corner = DVec3::splat(-1.1) - 2.2 / f64::from(resolution) * place.fract();
                    let grid = grid_of(corner, corner + 2.2, resolution);
                    let ball = Sampled::on(&grid, solids::geodesic(1.0, 64).unwrap());
                    let chords = of_axes(&ball, &ball.whole(), Phase::Solid, BoundaryCondition::Clip);
                    let number = chords.distribution(Weighting::Number, Counted::Complete).unwrap();
                    let length = chords.distribution(Weighting::Length, Counted::Complete).unwrap();
                    assert_eq!((chords.censored().count, number.count()), (0, chords.count()));
                    assert!((chords.mean().unwrap() - number.mean()).abs() < 1e-12);
                    [number.mean(), number.deviation(), length.mean()]
                })
                .collect();
            let mean = [0, 1, 2].map(|k| found.iter().map(|values| values[k]).sum::<f64>() / 10.0);
            let off = |value: f64, k: usize| (value / exact[k] - 1.0).abs();
            let worst = [0, 1, 2].map(|k| found.iter().map(|values| off(values[k], k)).fold(0.0, f64::max));
            println!("ball of {resolution} rays: mean, SD, mean by length {mean:.5?}, off by {worst:.5?} at most");
            [[off(mean[0], 0), off(mean[1], 1), off(mean[2], 2)], worst]
        });
        let orders = [0, 1, 2].map(|k| order(errors.map(|[_, worst]| worst[k])));
        println!("ball, chords: orders {orders:.2?}");
        let [mean, worst] = errors[2];
        assert!(mean.iter().all(|&error| error < 1e-3) && worst.iter().all(|&error| error < 5e-3), "{errors:?}");
    }

    /// Returns the largest deviation of the mean chord from 2φ/P_L, along every axis, of either phase, cut or joined.
    fn off_from_crossings(mesh: &Sampled, region: &Region) -> f64 {
        let facets = mesh.facets();
        let surface = SurfaceElements::within(&facets, &mesh.images, region);
        let mut worst = 0.0f64;
        for (image, direction) in mesh.images.iter().zip(DVec3::AXES) {
            let crossings = crossings_along(&surface, region.volume(), direction);
            let [solid, pore] =
                Phase::BOTH.map(|phase| Chords::along(image, region, phase, BoundaryCondition::Clip).length());
            for (phase, length) in [(Phase::Solid, solid), (Phase::Pore, pore)] {
                let expected = 2.0 * length / (solid + pore) / crossings;
                for edges in [BoundaryCondition::Clip, BoundaryCondition::Periodic] {
                    let mean = Chords::along(image, region, phase, edges).mean().unwrap();
                    worst = worst.max((mean / expected - 1.0).abs());
                }
            }
        }
        worst
    }

    #[test]
    fn mean_chords_converge_to_twice_the_share_over_the_crossings() {
        for surface in [Surface::Gyroid, Surface::Diamond] {
            let mesh = network(surface, 1, 32);
            let errors = [32, 64, 128].map(|resolution| {
                let cell = Sampled::of(mesh.clone(), resolution);
                off_from_crossings(&cell, &cell.boxed())
            });
            println!("{surface:?}: mean chord off 2φ/P_L by {errors:.5?}, order {:.2}", order(errors));
            assert!(errors[2] < 1e-2, "{surface:?}: {errors:?}");
        }
        // Inclined struts in a box that cuts them anywhere: crossings are those of hits. (Those of facets, along rays parallel
        // to the struts, are 5 % off at ten rays to a strut.)
        let mesh = turned(struts(3, 16), turns(4).last().unwrap());
        let errors = [32, 64, 128].map(|resolution| {
            let grid = grid_of(DVec3::splat(-2.7), DVec3::splat(2.7), resolution);
            let lattice = Sampled::on(&grid, mesh.clone());
            let side = grid.length(0) / 32;
            let bounds = LatticeBox { min: [11 * side; 3], max: [21 * side; 3] };
            off_from_crossings(&lattice, &Region::of_box(&grid, bounds))
        });
        println!("struts: mean chord off 2φ/P_L by {errors:.5?}, order {:.2}", order(errors));
        assert!(errors[2] < 2e-2, "struts: {errors:?}");
    }

    #[test]
    fn chords_cut_by_the_box_are_censored_and_periodic_ones_are_joined() {
        // Pores of 3 between plates of 1 in a box that begins in the middle of a pore: 1.5, then 3, then 1.5.
        let plate = |z: f64| solids::cuboid(DVec3::new(0.0, 0.0, z), DVec3::new(8.0, 8.0, z + 1.0)).unwrap();
        let plates = together(&[plate(1.5), plate(5.5)]);
        let plates = Sampled::on(&grid_of(DVec3::ZERO, DVec3::splat(8.0), 16), plates);
        let [along_x, _, along_z] = [Axis::X, Axis::Y, Axis::Z].map(|axis| {
            Phase::BOTH.map(|phase| {
                [BoundaryCondition::Clip, BoundaryCondition::Periodic]
                    .map(|edges| Chords::along(&plates.images[axis.depth()], &plates.whole(), phase, edges))
            })
        });
        let [solid, [clipped, periodic]] = &along_z;
        assert_eq!(solid[0], solid[1]);
        assert!(solid[0].count() == 512 && (solid[0].mean().unwrap() - 1.0).abs() < 1e-6);
        assert_eq!(solid[0].censored().count, 0);
        let cut = clipped.censored();
        assert_eq!((clipped.count(), cut.count), (768, 512));
        assert!((cut.share - 2.0 / 3.0).abs() < 1e-12 && (cut.share_of_length - 0.5).abs() < 1e-6);
        let mean = |counted| clipped.distribution(Weighting::Number, counted).unwrap().mean();
        assert!((mean(Counted::Complete) - 3.0).abs() < 1e-6 && (mean(Counted::All) - 2.0).abs() < 1e-6);
        // The ends give the mean of all pores, whole and cut.
        assert!((clipped.mean().unwrap() - 3.0).abs() < 1e-6);
        assert_eq!((periodic.count(), periodic.censored().count), (512, 0));
        let joined = periodic.distribution(Weighting::Length, Counted::Complete).unwrap();
        assert!((joined.min() - 3.0).abs() < 1e-6 && (joined.max() - 3.0).abs() < 1e-6);
        // Along x pores and plates continue for ever.
        for chords in along_x.iter().flatten() {
            assert!(chords.mean().is_none() && chords.distribution(Weighting::Number, Counted::Complete).is_none());
            assert_eq!(chords.censored().share, 1.0);
            assert!((chords.distribution(Weighting::Number, Counted::All).unwrap().mean() - 8.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_mesh_region_ends_chords_as_a_box_does() {
        // A rod within a ball: solid chords along it end at the ball, those across it at its sides.
        let grid = grid_of(DVec3::splat(-2.0), DVec3::splat(2.0), 64);
        let rod = solids::cuboid(DVec3::new(-0.3, -0.3, -1.9), DVec3::new(0.3, 0.3, 1.9)).unwrap();
        let [rod, ball] = [rod, solids::geodesic(1.0, 24).unwrap()].map(|mesh| Sampled::on(&grid, mesh));
        let region = Region::of_solid(&ball.images);
        let along = Chords::along(&rod.images[2], &region, Phase::Solid, BoundaryCondition::Clip);
        assert_eq!(along.censored().share, 1.0);
        let across = Chords::along(&rod.images[0], &region, Phase::Solid, BoundaryCondition::Clip);
        let complete = across.distribution(Weighting::Number, Counted::Complete).unwrap();
        assert!((complete.mean() - 0.6).abs() < 1e-6 && complete.deviation() < 1e-6);
        assert!(across.censored().share < 0.1);
        // The pore chords along the rod are those of the ball beside it, and cut at both ends.
        let pores = Chords::along(&rod.images[2], &region, Phase::Pore, BoundaryCondition::Clip);
        let of_ball = integrate::length(&ball.images[2]) as f64 * grid.step();
        assert!((pores.length() + along.length() - of_ball).abs() < 1e-9 * of_ball);
        assert_eq!(pores.censored().share, 1.0);
    }

    #[test]
    fn chords_that_end_at_faces_of_the_region_are_censored() {
        // A rod that ends where the region does: its ends are not surface.
        let grid = grid_of(DVec3::splat(-2.0), DVec3::splat(2.0), 32);
        let block = |x: f64, z: f64| solids::cuboid(DVec3::new(-x, -x, -z), DVec3::new(x, x, z)).unwrap();
        let [rod, region] = [block(0.5, 1.7), block(1.2, 1.7)].map(|mesh| Sampled::on(&grid, mesh));
        let region = Region::of_solid(&region.images);
        let along = Chords::along(&rod.images[2], &region, Phase::Solid, BoundaryCondition::Clip);
        assert_eq!(along.censored().share, 1.0);
        let pores = Chords::along(&rod.images[2], &region, Phase::Pore, BoundaryCondition::Clip);
        assert!((pores.distribution(Weighting::Number, Counted::All).unwrap().min() - 3.4).abs() < 1e-6);
    }
}
