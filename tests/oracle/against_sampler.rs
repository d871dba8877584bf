//! Compares the sampler, the merges and the node signs of the library with the oracle, sample by sample.

use std::num::NonZeroU32;

use ldi_ops::boolean::{self, BooleanOperation};
use ldi_ops::grid::{Axis, Grid, LatticeSolid};
use ldi_ops::ldi::{Ldi, Windings};
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Estimate, FillRule, MaskIntersection, Mode, SampleError, Sampler};

use super::brute_force as oracle;
use super::on_lattice::{closed, grid, mesh};
use super::soups::{self, Frame, Soup, oriented};
use super::testing::random::Random;
use super::{lattice, random_frame, solid};

const MODES: [(Mode, oracle::Mode); 3] = [
    (Mode::Exact, oracle::Mode::Exact),
    (Mode::Estimate(Estimate::Over), oracle::Mode::Over),
    (Mode::Estimate(Estimate::Under), oracle::Mode::Under),
];
const FILLS: [(FillRule, oracle::FillRule); 2] =
    [(FillRule::EvenOdd, oracle::FillRule::EvenOdd), (FillRule::NonZero, oracle::FillRule::NonZero)];

fn quantised<'m>(grid: &Grid, mesh: &'m ClosedMesh, soup: &Soup) -> LatticeSolid<'m> {
    let solid = grid.quantise(mesh).unwrap();
    assert_eq!(solid.positions(), soup.positions, "quantising moved a vertex that was on the lattice");
    solid
}

/// Draws LOD-C, from the least to more voxels than there are lattice steps.
fn random_lod(random: &mut Random) -> u32 {
    random.choose(&[32, 33, 64, 100, 256, 1024, 65_536])
}

fn random_sampler(random: &mut Random) -> CpuSampler {
    CpuSampler::with_band_rows(NonZeroU32::new(random.choose(&[1, 2, 3, 8, 64])).unwrap())
}

/// Returns the first ray where the two differ, with both sides.
fn difference(image: &Ldi, expected: &oracle::Image) -> Option<String> {
    if image.size() != (expected.columns, expected.rows) {
        return Some(format!("size {:?} instead of {:?}", image.size(), (expected.columns, expected.rows)));
    }
    if image.unclosed() != expected.unclosed {
        return Some(format!("unclosed {:?} instead of {:?}", image.unclosed(), expected.unclosed));
    }
    (0..image.rays())
        .find(|&ray| image.samples(ray) != expected.samples[ray as usize])
        .map(|ray| format!("ray {ray}: {:?} instead of {:?}", image.samples(ray), expected.samples[ray as usize]))
}

fn assert_same(what: &str, image: &Ldi, expected: &oracle::Image) {
    if let Some(difference) = difference(image, expected) {
        panic!("{what}: {difference}");
    }
}

fn for_every_case(
    generators: &[(&str, soups::Generator)],
    seeds: u64,
    check: impl Fn(&str, &Frame, &Soup, &mut Random),
) {
    super::for_every_soup(generators, seeds, check);
}

#[test]
fn single_solids_agree_in_all_modes_and_both_fill_rules() {
    for_every_case(&oriented(), 60, |name, frame, soup, random| {
        let lod = random_lod(random);
        let (grid, mesh) = (grid(frame, lod), closed(soup));
        assert!(mesh.oriented(), "{name}");
        let quantised = quantised(&grid, &mesh, soup);
        let sampler = random_sampler(random);
        for axis in Axis::ALL {
            for (mode, oracle_mode) in MODES {
                for (fill, oracle_fill) in FILLS {
                    let what = format!("{name}, {axis:?}, {mode:?}, {fill:?}, LOD-C {lod}");
                    let image = sampler.sample(&quantised, axis, mode, fill).unwrap();
                    let lattice = lattice(frame, lod);
                    let expected = oracle::image(&lattice, solid(soup), axis.depth(), oracle_mode, oracle_fill);
                    assert_same(&what, &image, &expected);
                    assert!(image.unclosed().is_empty(), "{what}: a closed mesh has unclosed rays");
                }
            }
        }
    });
}

#[test]
fn windings_agree_in_all_modes_and_both_fill_rules() {
    for_every_case(&oriented(), 60, |name, frame, soup, random| {
        let lod = random_lod(random);
        let (grid, mesh) = (grid(frame, lod), closed(soup));
        let quantised = quantised(&grid, &mesh, soup);
        let sampler = random_sampler(random);
        let axis = random.choose(&Axis::ALL);
        for (mode, oracle_mode) in MODES {
            for (fill, oracle_fill) in FILLS {
                let what = format!("{name}, {axis:?}, {mode:?}, {fill:?}, LOD-C {lod}");
                let oracle::Windings { wound, aligned, changes, unpaired } =
                    oracle::windings(&lattice(frame, lod), solid(soup), axis.depth(), oracle_mode, oracle_fill);
                let expected = Some(Windings { wound, aligned, changes, unpaired });
                let image = sampler.sample(&quantised, axis, mode, fill).unwrap();
                assert_eq!(image.windings(), expected, "{what}");
                if mode == Mode::Exact {
                    let surface = sampler.sample_surface(&quantised, axis, fill).unwrap();
                    assert_eq!(surface.windings(), expected, "{what}, with triangles");
                }
            }
        }
    });
}

#[test]
fn unoriented_meshes_agree_under_even_odd_and_are_refused_under_non_zero() {
    let disoriented: [(&str, soups::Generator); 1] = [("disoriented", soups::disoriented)];
    for_every_case(&disoriented, 100, |name, frame, soup, random| {
        let lod = random_lod(random);
        let (grid, mesh) = (grid(frame, lod), closed(soup));
        let quantised = quantised(&grid, &mesh, soup);
        for (mode, oracle_mode) in MODES {
            let image = random_sampler(random).sample(&quantised, Axis::Y, mode, FillRule::EvenOdd).unwrap();
            let lattice = lattice(frame, lod);
            let expected = oracle::image(&lattice, solid(soup), 1, oracle_mode, oracle::FillRule::EvenOdd);
            assert_same(name, &image, &expected);
        }
        if !mesh.oriented() {
            let refused = CpuSampler::default().sample(&quantised, Axis::Y, Mode::Exact, FillRule::NonZero);
            assert_eq!(refused, Err(SampleError::NotOriented), "{name}");
        }
    });
}

#[test]
fn open_meshes_agree_about_unclosed_rays() {
    for_every_case(&oriented(), 20, |name, frame, soup, random| {
        let lod = random_lod(random);
        let mut soup = soup.clone();
        soup.triangles.remove(random.below(soup.triangles.len()));
        let grid = grid(frame, lod);
        let mesh = mesh(&soup);
        let quantised = grid.quantise_open(&mesh).unwrap();
        for axis in Axis::ALL {
            for (mode, oracle_mode) in MODES {
                for (fill, oracle_fill) in FILLS {
                    let what = format!("{name} less a triangle, {axis:?}, {mode:?}, {fill:?}");
                    let image = random_sampler(random).sample(&quantised, axis, mode, fill).unwrap();
                    let lattice = lattice(frame, lod);
                    let expected = oracle::image(&lattice, solid(&soup), axis.depth(), oracle_mode, oracle_fill);
                    assert_same(&what, &image, &expected);
                }
            }
        }
    });
}

#[test]
fn intersections_and_merges_of_two_solids_agree() {
    const OPERATIONS: [(BooleanOperation, oracle::Operation); 4] = [
        (BooleanOperation::Intersection, oracle::Operation::Intersection),
        (BooleanOperation::Union, oracle::Operation::Union),
        (BooleanOperation::Difference, oracle::Operation::Difference),
        (BooleanOperation::Xor, oracle::Operation::Xor),
    ];
    for seed in 0..600 {
        let mut random = Random::new(seed);
        let frame = random_frame(&mut random);
        let lod = random_lod(&mut random);
        let soups = [super::random_oriented(&mut random, &frame), super::random_oriented(&mut random, &frame)];
        let (grid, lattice) = (grid(&frame, lod), lattice(&frame, lod));
        let meshes = soups.each_ref().map(closed);
        let [a, b] = [0, 1].map(|i| quantised(&grid, &meshes[i], &soups[i]));
        let sampler = random_sampler(&mut random);
        let axis = random.choose(&Axis::ALL);
        for (fill, oracle_fill) in FILLS {
            for (mode, oracle_mode) in MODES {
                let what = format!("seed {seed}, {axis:?}, {mode:?}, {fill:?}");
                let images = [&a, &b].map(|solid| sampler.sample(solid, axis, mode, fill).unwrap());
                let expected =
                    [0, 1].map(|i| oracle::image(&lattice, solid(&soups[i]), axis.depth(), oracle_mode, oracle_fill));
                for (operation, oracle_operation) in OPERATIONS {
                    let merged = boolean::merge(operation, &images[0], &images[1]).unwrap();
                    let expected = oracle::boolean(oracle_operation, &expected[0], &expected[1]);
                    assert_same(&format!("{what}, {operation:?}"), &merged, &expected);
                }
                let expected = oracle::intersection(
                    &lattice,
                    solid(&soups[0]),
                    solid(&soups[1]),
                    axis.depth(),
                    oracle_mode,
                    oracle_fill,
                );
                let image = match mode {
                    // Sampling each solid only where the other one is does not change what they share.
                    Mode::Exact => {
                        let near = [a.clone().within(b.bounds()), b.clone().within(a.bounds())];
                        let images = near.each_ref().map(|solid| sampler.sample(solid, axis, mode, fill).unwrap());
                        boolean::merge(BooleanOperation::Intersection, &images[0], &images[1]).unwrap()
                    }
                    Mode::Estimate(estimate) => sampler.sample_intersection([&a, &b], axis, estimate, fill).unwrap(),
                };
                assert_same(&format!("{what}, intersection"), &image, &expected);
            }
        }
    }
}

#[test]
fn the_comparison_finds_changed_samples_and_unclosed_rays() {
    let frame = Frame { shift: 7, rays: [8, 8, 8] };
    let soup = soups::cuboid([100, 100, 100], [900, 800, 700]);
    let mesh = closed(&soup);
    let grid = grid(&frame, 64);
    let quantised = quantised(&grid, &mesh, &soup);
    let image = CpuSampler::default().sample(&quantised, Axis::Z, Mode::Exact, FillRule::EvenOdd).unwrap();
    let expected = oracle::image(&lattice(&frame, 64), solid(&soup), 2, oracle::Mode::Exact, oracle::FillRule::EvenOdd);
    assert_eq!(difference(&image, &expected), None);
    let occupied = expected.samples.iter().position(|samples| !samples.is_empty()).unwrap();
    for spoil in [
        |e: &mut oracle::Image, ray: usize| e.samples[ray][0] += 2,
        |e: &mut oracle::Image, ray: usize| e.samples[ray].clear(),
        |e: &mut oracle::Image, _| e.unclosed.push(0),
        |e: &mut oracle::Image, _| e.columns += 1,
    ] {
        let mut spoiled = expected.clone();
        spoil(&mut spoiled, occupied);
        assert!(difference(&image, &spoiled).is_some());
    }
}
