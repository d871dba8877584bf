//! The comparison that all twins use: it compares all parts of a result, bit by bit.

use std::fmt::Display;

use ldi_ops::fixed::Hit;
use ldi_ops::ldi::{Ldi, VolumeSums, Windings};
use ldi_ops::minkowski::RaySpans;
use ldi_ops::sampler::SampleError;
use ldi_ops::sampler::stages::{ListStages, MaskStages};

/// A result taken apart into named runs of words.
pub struct Parts(Vec<(&'static str, Vec<u32>)>);

fn words(number: u64) -> [u32; 2] {
    [number as u32, (number >> 32) as u32]
}

impl From<&Ldi> for Parts {
    fn from(image: &Ldi) -> Parts {
        let grid = image.grid();
        let mut raster = vec![grid.shift(), grid.lod(), image.axis().depth() as u32, image.size().0, image.size().1];
        raster.extend(grid.rays());
        raster.extend(
            [grid.pitch(), grid.origin().x, grid.origin().y, grid.origin().z].map(f64::to_bits).map(words).concat(),
        );
        let windings = image.windings().map(|Windings { wound, aligned, changes, unpaired }| {
            [wound, aligned, changes, unpaired].map(|sum| words(sum as u64)).concat()
        });
        Parts(vec![
            ("raster", raster),
            ("rays", vec![image.rays()]),
            ("offsets", image.offsets().to_vec()),
            ("depths", image.depths().iter().map(|&depth| depth as u32).collect()),
            // An image without samples may still have triangles: an empty list differs from none.
            ("has triangles", vec![u32::from(image.triangles().is_some())]),
            ("triangles", image.triangles().unwrap_or_default().to_vec()),
            ("windings", windings.unwrap_or_default()),
            ("unclosed", image.unclosed().to_vec()),
        ])
    }
}

impl From<&VolumeSums> for Parts {
    fn from(volume_sums: &VolumeSums) -> Parts {
        let sums = volume_sums.sums();
        let wide = |sums: &[i64]| sums.iter().flat_map(|&sum| words(sum as u64)).collect();
        let windings = volume_sums.windings().map(|Windings { wound, aligned, changes, unpaired }| {
            [wound, aligned, changes, unpaired].map(|sum| words(sum as u64)).concat()
        });
        Parts(vec![
            ("axis", vec![volume_sums.axis().depth() as u32, volume_sums.grid().lod(), volume_sums.grid().shift()]),
            ("steps", wide(&sums.steps)),
            ("nodes", wide(sums.nodes.as_flattened())),
            ("level", wide(&sums.level)),
            ("layers", vec![volume_sums.layers()]),
            ("samples", words(volume_sums.samples()).to_vec()),
            ("unclosed", words(volume_sums.unclosed()).to_vec()),
            ("windings", windings.unwrap_or_default()),
        ])
    }
}

impl From<&MaskStages> for Parts {
    fn from(stages: &MaskStages) -> Parts {
        let MaskStages { masks, single, pair, ranks, counts, offsets } = stages;
        let names = [["change", "any"], ["change of the second", "any of the second"]];
        assert!(masks.len() <= names.len());
        let mut parts = Vec::new();
        for (names, masks) in names.iter().zip(masks) {
            parts.extend(names.iter().zip(masks).map(|(name, mask)| (*name, mask.clone())));
        }
        let rest = [("single", single), ("pair", pair), ("ranks", ranks), ("counts", counts), ("offsets", offsets)];
        parts.extend(rest.map(|(name, part)| (name, part.clone())));
        Parts(parts)
    }
}

impl From<&ListStages> for Parts {
    fn from(stages: &ListStages) -> Parts {
        let ListStages { starts, crossings } = stages;
        Parts(vec![("starts", starts.clone()), ("crossings", crossings.clone())])
    }
}

impl<H: Hit> From<&(RaySpans<H>, u64)> for Parts {
    fn from((spans, crossings): &(RaySpans<H>, u64)) -> Parts {
        Parts(vec![
            ("axis", vec![spans.axis.depth() as u32]),
            ("offsets", spans.offsets.clone()),
            ("hits", spans.hits.iter().map(|hit| hit.crossing().0).collect()),
            ("triangles", spans.hits.iter().filter_map(|hit| hit.triangle()).collect()),
            ("crossings", words(*crossings).to_vec()),
        ])
    }
}

/// Returns the first word in which two results differ.
pub fn difference(found: &Parts, expected: &Parts) -> Option<String> {
    let (found, expected) = (&found.0, &expected.0);
    if !found.iter().map(|(name, _)| name).eq(expected.iter().map(|(name, _)| name)) {
        return Some("other parts".to_owned());
    }
    for ((name, found), (_, expected)) in found.iter().zip(expected) {
        let differing = found.iter().zip(expected).filter(|(found, expected)| found != expected).count();
        if let Some(at) = (0..found.len().min(expected.len())).find(|&at| found[at] != expected[at]) {
            let (is, should) = (found[at], expected[at]);
            return Some(format!(
                "{name}[{at}] is {is} ({is:#x}) instead of {should} ({should:#x}), and {differing} such"
            ));
        }
        if found.len() != expected.len() {
            return Some(format!("{} {name} instead of {}", found.len(), expected.len()));
        }
    }
    None
}

/// Asserts that the outcome of the GPU is that of the CPU: the same bits, or the same error.
pub fn assert_same<T>(what: impl Display, found: &Result<T, SampleError>, expected: &Result<T, SampleError>)
where
    for<'t> Parts: From<&'t T>,
{
    match (found, expected) {
        (Ok(found), Ok(expected)) => {
            if let Some(difference) = difference(&found.into(), &expected.into()) {
                panic!("{what}: {difference}");
            }
        }
        (Err(found), Err(expected)) => assert_eq!(found, expected, "{what}"),
        (Ok(_), Err(error)) => panic!("{what}: an image where the CPU says: {error}"),
        (Err(error), Ok(_)) => panic!("{what}: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use ldi_ops::grid::Axis;
    use ldi_ops::sampler::cpu::CpuSampler;
    use ldi_ops::sampler::{Estimate, FillRule, Mode, Sampler};

    use super::*;
    use crate::on_lattice::{closed, grid, mesh};
    use crate::soups::{self, Frame, Soup};
    use crate::twin;

    const FRAME: Frame = Frame { shift: 4, rays: [7, 8, 9] };

    /// Returns two boxes that overlap, one of them with a cavity.
    fn solid() -> Soup {
        let mut soup = soups::cuboid([10, 12, 14], [90, 100, 120]);
        soup.add(&soups::cuboid([30, 30, 30], [60, 60, 60]).inverted());
        soup.add(&soups::octahedron([80, 80, 80], 28));
        soup
    }

    fn less_a_triangle() -> Soup {
        let mut soup = solid();
        soup.triangles.pop();
        soup
    }

    fn differ(found: &Ldi, expected: &Ldi) -> bool {
        difference(&found.into(), &expected.into()).is_some()
    }

    /// Changes every bit of every part in turn and asserts that each change is found. Returns the names of the parts that are not
    /// empty.
    fn every_bit_shows(mut parts: Parts, expected: &Parts) -> BTreeSet<&'static str> {
        assert_eq!(difference(&parts, expected), None);
        for part in 0..parts.0.len() {
            for at in 0..parts.0[part].1.len() {
                for bit in 0..32 {
                    parts.0[part].1[at] ^= 1 << bit;
                    assert!(difference(&parts, expected).is_some(), "bit {bit} of {}[{at}]", parts.0[part].0);
                    parts.0[part].1[at] ^= 1 << bit;
                }
            }
            parts.0[part].1.push(0);
            assert!(difference(&parts, expected).is_some(), "a word more");
            assert!(difference(expected, &parts).is_some(), "a word less");
            parts.0[part].1.pop();
        }
        parts.0.iter().filter(|(_, part)| !part.is_empty()).map(|(name, _)| *name).collect()
    }

    #[test]
    fn every_changed_bit_of_an_image_is_found() {
        let (whole, open) = (closed(&solid()), mesh(&less_a_triangle()));
        let grid = grid(&FRAME, 64);
        let (whole, open) = (grid.quantise(&whole).unwrap(), grid.quantise_open(&open).unwrap());
        let mut seen = BTreeSet::new();
        for solid in [&whole, &open] {
            let image = CpuSampler::default().sample_surface(solid, Axis::Z, FillRule::EvenOdd).unwrap();
            seen.extend(every_bit_shows(Parts::from(&image), &Parts::from(&image)));
        }
        let parts = ["raster", "rays", "offsets", "depths", "has triangles", "triangles", "windings", "unclosed"];
        assert_eq!(seen, BTreeSet::from(parts));
    }

    #[test]
    fn every_changed_bit_between_the_stages_is_found() {
        let whole = closed(&solid());
        let solid = grid(&FRAME, 64).quantise(&whole).unwrap();
        let cpu = CpuSampler::default();
        let masks = cpu.mask_stages(&[&solid, &solid], Axis::Z, Estimate::Over).unwrap();
        let seen = every_bit_shows(Parts::from(&masks), &Parts::from(&masks));
        assert_eq!(seen.len(), 9, "{seen:?}");
        let lists = cpu.list_stages(&solid, Axis::Z).unwrap();
        let seen = every_bit_shows(Parts::from(&lists), &Parts::from(&lists));
        assert_eq!(seen.len(), 2, "{seen:?}");
    }

    #[test]
    fn images_that_differ_in_one_part_are_not_equal() {
        let cpu = CpuSampler::default();
        let sample = |soup: &Soup, lod: u32| {
            let mesh = closed(soup);
            cpu.sample_surface(&grid(&FRAME, lod).quantise(&mesh).unwrap(), Axis::Z, FillRule::EvenOdd).unwrap()
        };
        let soup = solid();
        let image = sample(&soup, 64);
        assert!(!differ(&image, &sample(&soup, 64)));

        let mut renumbered = soup.clone();
        renumbered.triangles.reverse();
        let renumbered = sample(&renumbered, 64);
        assert_eq!((renumbered.depths(), renumbered.windings()), (image.depths(), image.windings()));
        assert!(differ(&renumbered, &image), "other triangles");

        let inverted = sample(&soup.inverted(), 64);
        assert_eq!((inverted.depths(), inverted.triangles()), (image.depths(), image.triangles()));
        assert!(differ(&inverted, &image), "other windings");

        assert!(differ(&sample(&soup, 65), &image), "another grid");

        let offsets = image.offsets().to_vec();
        let rebuilt = |offsets: Vec<u32>, unclosed| {
            Ldi::from_parts(*image.grid(), Axis::Z, offsets, image.depths().to_vec(), unclosed).unwrap()
        };
        let same = rebuilt(offsets.clone(), vec![]);
        assert!(differ(&same, &image), "no triangles and no windings");
        assert!(image.samples(0).is_empty());
        assert!(differ(&rebuilt(offsets.clone(), vec![0]), &same), "an unclosed ray");
        let full = (1..offsets.len() - 1).find(|&ray| offsets[ray + 1] - offsets[ray] == 2).unwrap();
        let mut moved = offsets.clone();
        // The samples of a ray move to the ray before it, which is empty.
        assert_eq!(offsets[full], offsets[full - 1]);
        moved[full] += 2;
        assert!(differ(&rebuilt(moved, vec![]), &same), "samples on another ray");
    }

    #[test]
    fn different_outcomes_are_not_equal() {
        let mesh = closed(&solid());
        let solid = grid(&FRAME, 64).quantise(&mesh).unwrap();
        let image = CpuSampler::default().sample(&solid, Axis::X, Mode::Exact, FillRule::EvenOdd);
        let refused = Err(SampleError::NotOriented);
        let refused_otherwise = Err(SampleError::GridsDiffer { first: 1.0, second: 2.0 });
        let outcomes: [&Result<Ldi, _>; 3] = [&image, &refused, &refused_otherwise];
        for (i, found) in outcomes.iter().enumerate() {
            for (j, expected) in outcomes.iter().enumerate() {
                let same = std::panic::catch_unwind(|| assert_same("this panic is wanted", found, expected)).is_ok();
                assert_eq!(same, i == j);
            }
        }
    }

    /// The smallest possible error of a shader: one vertex is off by one even step.
    #[test]
    fn a_vertex_moved_by_one_step_changes_the_image_of_the_gpu() {
        let soup = soups::tetrahedron([[4, 6, 8], [100, 20, 30], [40, 110, 50], [30, 20, 130]]);
        let whole = closed(&soup);
        let grid = grid(&FRAME, 1024);
        let expected = grid.quantise(&whole).unwrap();
        for axis in Axis::ALL {
            let mut aside = soup.clone();
            for position in aside.positions.iter_mut().filter(|position| **position == [100, 20, 30]) {
                position[axis.depth()] += 2;
            }
            let aside = closed(&aside);
            let aside = grid.quantise(&aside).unwrap();
            let cpu = CpuSampler::default();
            for twin in twin::all() {
                let (found, expected) = (twin.gpu.list_stages(&aside, axis), cpu.list_stages(&expected, axis));
                assert!(difference(&(&found.unwrap()).into(), &(&expected.unwrap()).into()).is_some());
            }
            for mode in twin::MODES {
                let expected = cpu.sample(&expected, axis, mode, FillRule::EvenOdd).unwrap();
                for twin in twin::all() {
                    let found = twin.gpu.sample(&aside, axis, mode, FillRule::EvenOdd).unwrap();
                    assert!(differ(&found, &expected), "{axis:?}, {mode:?}; {}", twin.name());
                }
            }
        }
    }
}
