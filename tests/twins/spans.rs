//! Lists of crossings that may bound gaps; their triangles bound nothing by themselves.

use std::fmt::Display;

use ldi_ops::fixed::{Crossing, Hit, TriangleHit};
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::minkowski::{Exterior, Primitives, RaySpans};
use ldi_ops::sampler::SampleError;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::{GpuOptions, Route};

use crate::comparison::{Parts, assert_same, difference};
use crate::lattice::{frame, generators, lod};
use crate::layers::plates;
use crate::on_lattice::grid;
use crate::soups::{self, Frame, Soup};
use crate::testing::random::Random;
use crate::twin::{self, Twin};

const OUTERS: [Exterior; 2] = [Exterior::Out, Exterior::In];

type Spans<H> = Result<(RaySpans<H>, u64), SampleError>;

fn primitives(soup: &Soup) -> Primitives {
    Primitives { positions: soup.positions.clone(), triangles: soup.triangles.clone() }
}

fn by_cpu<H: Hit>(primitives: &Primitives, grid: &Grid, axis: Axis, exterior: Exterior) -> Spans<H> {
    primitives.spans(grid, axis, exterior, &CpuSampler::default()).map_err(SampleError::from)
}

/// Compares the crossings kept along an axis, with triangles and without; returns those kept with triangles.
fn compare(
    what: impl Display,
    twins: &[&Twin],
    primitives: &Primitives,
    grid: &Grid,
    axis: Axis,
    exterior: Exterior,
) -> RaySpans<TriangleHit> {
    let plain: Spans<Crossing> = by_cpu(primitives, grid, axis, exterior);
    let hits: Spans<TriangleHit> = by_cpu(primitives, grid, axis, exterior);
    for twin in twins {
        let what = format_args!("{what}, {axis:?}, {exterior:?}; {}", twin.name());
        assert_same(what, &primitives.spans(grid, axis, exterior, &twin.gpu), &plain);
        assert_same(format_args!("{what}, triangles"), &primitives.spans(grid, axis, exterior, &twin.gpu), &hits);
    }
    hits.unwrap().0
}

fn by_lists(twins: &[Twin]) -> Vec<&Twin> {
    twins.iter().filter(|twin| twin.options.route == Route::Lists).collect()
}

#[test]
fn soups_have_equal_gaps() {
    let twins = by_lists(twin::all());
    let (mut gaps, mut alone) = (0, 0);
    for (name, generator) in generators() {
        for seed in 300..303 {
            let mut random = Random::new(seed);
            let frame = frame(&mut random);
            // A heap that overlaps itself, now and then with a missing triangle.
            let mut soup = generator(&mut random, &frame);
            soup.add(&generator(&mut random, &frame));
            if random.chance(2) {
                soup.triangles.remove(random.below(soup.triangles.len()));
            }
            let grid = grid(&frame, lod(&mut random));
            for (axis, exterior) in Axis::ALL.into_iter().zip([Exterior::Out, Exterior::In, OUTERS[seed as usize % 2]])
            {
                let what = format_args!("{name}, seed {seed}");
                let kept = compare(what, &twins, &primitives(&soup), &grid, axis, exterior);
                let rays = kept.offsets.windows(2).map(|ends| ends[1] - ends[0]);
                for ray in rays.enumerate().filter(|(_, count)| *count > 0).map(|(ray, _)| kept.of_ray(ray as u32)) {
                    gaps += (ray.len() - exterior.first_gap()) / 2;
                    alone += usize::from(exterior == Exterior::Out && ray.len() == 2 && ray[0] == ray[1]);
                }
            }
        }
    }
    assert!(gaps > 1000 && alone > 10, "{gaps} gaps and {alone} rays with a single crossing");
}

/// Rays of thousands of crossings are sorted and reduced by many invocations, on any adapter.
#[test]
fn thousands_of_crossings_on_a_ray_have_equal_gaps() {
    let frame = Frame { shift: 20, rays: [2, 3, 2] };
    for (axis, exterior, thickness) in
        [(Axis::X, Exterior::Out, 2), (Axis::Y, Exterior::In, 100), (Axis::Z, Exterior::Out, 1000)]
    {
        let mut random = Random::new(9);
        let mut soup = Soup::default();
        for _ in 0..1500 {
            // Some are far apart, and many are at one of a few places.
            let most = frame.most(axis.depth()) - thickness;
            let first = random.even(0, most);
            let first = if random.chance(2) { first / 4096 * 4096 } else { first };
            soup.add(&plates(&frame, axis, 1, thickness, 0, first));
        }
        let grid = grid(&frame, 64);
        let kept = compare("plates", &by_lists(twin::all()), &primitives(&soup), &grid, axis, exterior);
        let most = kept.offsets.windows(2).map(|ends| ends[1] - ends[0]).max();
        assert!(most > Some(1500), "{most:?} ends of gaps on a ray");
    }
}

#[test]
fn bands_have_equal_gaps() {
    let small = GpuOptions { route: Route::Lists, prefill: Some(0x5a5a_5a5a), binding: 64 << 10, ..Default::default() };
    let options = [
        GpuOptions { band_rays: 1, ..small },
        GpuOptions { band_rays: 7, ..small },
        GpuOptions { band_rays: 13, memory: 1 << 10, ..small },
        GpuOptions { memory: 0, ..small },
        GpuOptions { binding: 2 << 10, ..small },
    ];
    let twins = options.map(Twin::open);
    let twins: Vec<&Twin> = twins.iter().collect();
    let mut random = Random::new(4);
    let frame = Frame { shift: 5, rays: [6, 7, 8] };
    let mut soup = soups::mixture(&mut random, &frame);
    soup.add(&soups::mixture(&mut random, &frame));
    soup.triangles.remove(0);
    let grid = grid(&frame, 100);
    for (axis, exterior) in Axis::ALL.into_iter().zip([Exterior::In, Exterior::Out, Exterior::In]) {
        compare("a heap", &twins, &primitives(&soup), &grid, axis, exterior);
    }
}

#[test]
fn empty_and_missed_primitives_have_no_gaps() {
    let frame = Frame { shift: 4, rays: [3, 4, 5] };
    let empty = Primitives::default();
    // A triangle that every ray misses.
    let edge_on = primitives(&Soup { positions: vec![[0; 3], [40, 0, 0], [0, 2, 0]], triangles: vec![[0, 1, 2]] });
    for axis in Axis::ALL {
        for (name, primitives) in [("no triangle", &empty), ("a missed one", &edge_on)] {
            let kept = compare(name, &by_lists(twin::all()), primitives, &grid(&frame, 64), axis, Exterior::Out);
            assert!(kept.hits.is_empty() && kept.offsets.iter().all(|&offset| offset == 0), "{name}");
        }
    }
}

#[test]
fn different_lists_are_not_equal() {
    let frame = Frame { shift: 4, rays: [7, 8, 9] };
    let grid = grid(&frame, 64);
    let mut soup = soups::cuboid([10, 12, 14], [40, 100, 120]);
    soup.add(&soups::cuboid([60, 10, 10], [90, 100, 120]));
    let parts = |soup: &Soup, exterior: Exterior| {
        let spans: (RaySpans<TriangleHit>, u64) = by_cpu(&primitives(soup), &grid, Axis::X, exterior).unwrap();
        Parts::from(&spans)
    };
    let whole = parts(&soup, Exterior::Out);
    assert_eq!(difference(&whole, &parts(&soup, Exterior::Out)), None);
    assert!(difference(&whole, &parts(&soup, Exterior::In)).is_some(), "other hits");
    let mut renumbered = soup.clone();
    renumbered.triangles.reverse();
    assert!(difference(&whole, &parts(&renumbered, Exterior::Out)).is_some(), "other triangles");
    let mut with_inner = soup.clone();
    with_inner.add(&soups::cuboid([20, 20, 20], [30, 90, 90]));
    assert!(difference(&whole, &parts(&with_inner, Exterior::Out)).is_some(), "more crossings");
}
