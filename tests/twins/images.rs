//! Final images.

use glam::DVec3;
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::ldi::Ldi;
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::{Arithmetic, GpuOptions, GpuSampler, Route};
use ldi_ops::sampler::{Estimate, Fill, Mode, Sampler};

use crate::soups::{self, Frame, Random, Soup};

const MODES: [Mode; 3] = [Mode::Exact, Mode::Estimate(Estimate::Over), Mode::Estimate(Estimate::Under)];
const FILLS: [Fill; 2] = [Fill::EvenOdd, Fill::NonZero];

pub fn mesh(soup: &Soup) -> TriangleMesh {
    let positions = soup.positions.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
    TriangleMesh { positions, triangles: soup.triangles.clone() }
}

pub fn frame(random: &mut Random) -> Frame {
    let shift = random.choose(&[2, 2, 2, 3, 4, 7, 12, 26]);
    Frame { shift, rays: std::array::from_fn(|_| random.between(6, if shift == 26 { 15 } else { 9 }) as u32) }
}

/// Where two images differ first.
fn difference(found: &Ldi, expected: &Ldi) -> String {
    if found.size() != expected.size() || found.unclosed() != expected.unclosed() {
        return format!("unclosed {:?} instead of {:?}", found.unclosed(), expected.unclosed());
    }
    let ray = (0..expected.rays()).find(|&ray| found.samples(ray) != expected.samples(ray));
    match ray {
        Some(ray) => format!("ray {ray}: {:?} instead of {:?}", found.samples(ray), expected.samples(ray)),
        None => format!("{:?} instead of {:?}", found.windings(), expected.windings()),
    }
}

/// A grid on which one lattice step is one world unit, so that soups are quantised to themselves.
pub fn grid_of(frame: &Frame, lod: u32) -> Grid {
    Grid::from_parts(DVec3::ZERO, f64::from(1u32 << frame.shift), frame.rays, frame.shift, lod).unwrap()
}

fn soups_agree(gpu: &GpuSampler, seeds: std::ops::Range<u64>) {
    let cpu = CpuSampler::default();
    for (name, generator) in soups::oriented() {
        for seed in seeds.clone() {
            let mut random = Random::new(seed);
            let frame = frame(&mut random);
            let soup = generator(&mut random, &frame);
            let lod = random.choose(&[32, 33, 64, 100, 256, 1024]);
            let grid = grid_of(&frame, lod);
            let closed = ClosedMesh::check(mesh(&soup)).unwrap();
            let solid = grid.quantise(&closed).unwrap();
            for axis in Axis::ALL {
                for mode in MODES {
                    for fill in FILLS {
                        let what = format!("{name}, seed {seed}, {axis:?}, {mode:?}, {fill:?}");
                        let expected = cpu.sample(&solid, axis, mode, fill).unwrap();
                        let found = gpu.sample(&solid, axis, mode, fill).unwrap_or_else(|e| panic!("{what}: {e}"));
                        assert!(found == expected, "{what}: {}", difference(&found, &expected));
                    }
                }
            }
        }
    }
}

#[test]
fn soups_native() {
    soups_agree(&crate::sampler(GpuOptions::default()), 0..12);
}

#[test]
fn soups_pairs() {
    soups_agree(&crate::sampler(GpuOptions { arithmetic: Some(Arithmetic::Pairs), ..GpuOptions::default() }), 0..12);
}

#[test]
fn soups_by_lists() {
    soups_agree(&crate::sampler(GpuOptions { route: Route::Lists, ..GpuOptions::default() }), 0..12);
}
