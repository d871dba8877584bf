//! GPU samplers, their options, and the comparison of each with the CPU's sampler.

use std::fmt::Display;
use std::sync::LazyLock;

use ldi_ops::gpu::{Adapter, AdapterKind, adapters, choose};
use ldi_ops::grid::{Axis, LatticeSolid};
use ldi_ops::ldi::Ldi;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::{Arithmetic, GpuOptions, GpuSampler, Route};
use ldi_ops::sampler::{Estimate, FillRule, MaskIntersection, Mode, SampleError, Sampler};

use crate::comparison::assert_same;

pub const MODES: [Mode; 3] = [Mode::Exact, Mode::Estimate(Estimate::Over), Mode::Estimate(Estimate::Under)];
pub const ESTIMATES: [Estimate; 2] = [Estimate::Over, Estimate::Under];
pub const FILLS: [FillRule; 2] = [FillRule::EvenOdd, FillRule::NonZero];
pub const ROUTES: [Route; 2] = [Route::Masks, Route::Lists];

/// The initial content of buffers; as a count, an offset, a mask or a depth it is wrong.
const SENTINEL: u32 = 0xa5a5_a5a5;

/// The adapter that all of these tests run on.
pub static ADAPTER: LazyLock<Adapter> = LazyLock::new(|| {
    let wanted = std::env::var("LDI_ADAPTER").ok();
    let adapters = adapters();
    choose(&adapters, wanted.as_deref()).unwrap_or_else(|error| panic!("twins need an adapter: {error}")).clone()
});

/// A GPU sampler that is compared with the CPU's.
pub struct Twin {
    pub gpu: GpuSampler,
    pub options: GpuOptions,
}

impl Twin {
    pub fn open(options: GpuOptions) -> Twin {
        Twin { gpu: GpuSampler::open(&ADAPTER, options).unwrap_or_else(|error| panic!("{error}")), options }
    }

    /// The difference from other twins, for messages.
    pub fn name(&self) -> String {
        let GpuOptions { arithmetic, route, memory, band_rays, binding, prefill } = self.options;
        format!("{arithmetic:?}, {route:?}, memory {memory}, band_rays {band_rays}, binding {binding}, {prefill:x?}")
    }
}

/// Returns all routes in each arithmetic that the adapter has, with buffers filled with a sentinel.
///
/// A small binding keeps the buffers small that are filled for every job. It has room for the masks of 128 rays of the most
/// voxels.
pub fn all() -> &'static [Twin] {
    static ALL: LazyLock<Vec<Twin>> = LazyLock::new(|| {
        let native = ADAPTER.int64.then_some(Arithmetic::Native);
        let arithmetics = native.into_iter().chain([Arithmetic::Pairs]);
        let options = arithmetics.flat_map(|arithmetic| {
            ROUTES.map(|route| GpuOptions {
                arithmetic: Some(arithmetic),
                route,
                binding: 1 << 20,
                prefill: Some(SENTINEL),
                ..GpuOptions::default()
            })
        });
        options.map(Twin::open).collect()
    });
    &ALL
}

/// Returns all routes with the options that users get.
pub fn plain() -> &'static [Twin] {
    static PLAIN: LazyLock<[Twin; ROUTES.len()]> =
        LazyLock::new(|| ROUTES.map(|route| Twin::open(GpuOptions { route, ..GpuOptions::default() })));
    &*PLAIN
}

/// Returns whether the adapter is a program on the processor.
pub fn is_software() -> bool {
    ADAPTER.kind == AdapterKind::Software
}

/// Returns the twins that may differ: for exact images and the other fill rule every route takes the lists, so that one twin per
/// arithmetic is enough.
fn distinct(twins: &[Twin], mode: Mode, fill: FillRule) -> impl Iterator<Item = &Twin> {
    let routes_differ = mode != Mode::Exact && fill == FillRule::EvenOdd;
    twins.iter().filter(move |twin| routes_differ || twin.options.route == Route::Masks)
}

/// Compares the images of a solid along an axis in one mode, under one fill rule.
pub fn compare_image(what: impl Display, twins: &[Twin], solid: &LatticeSolid, axis: Axis, mode: Mode, fill: FillRule) {
    let expected = CpuSampler::default().sample(solid, axis, mode, fill);
    for twin in distinct(twins, mode, fill) {
        let found = twin.gpu.sample(solid, axis, mode, fill);
        assert_same(format_args!("{what}, {axis:?}, {mode:?}, {fill:?}; {}", twin.name()), &found, &expected);
    }
}

/// Compares the images and their sums along all axes, which a device makes together, in one mode, under one fill rule.
pub fn compare_together(what: impl Display, twins: &[Twin], solid: &LatticeSolid, mode: Mode, fill: FillRule) {
    let cpu = CpuSampler::default();
    let each = |result: Result<Vec<Ldi>, SampleError>| match result {
        Ok(images) => images.into_iter().map(Ok).collect(),
        Err(error) => vec![Err(error)],
    };
    let expected = each(cpu.sample_along(solid, &Axis::ALL, mode, fill));
    let sums = cpu.volume_sums_along(solid, &Axis::ALL, mode, fill);
    let all_sums = cpu.solid_sums_along(solid, &Axis::ALL, mode, fill);
    for twin in distinct(twins, mode, fill) {
        let what = format!("{what}, all axes, {mode:?}, {fill:?}; {}", twin.name());
        let found = each(twin.gpu.sample_along(solid, &Axis::ALL, mode, fill));
        assert_eq!(found.len(), expected.len(), "{what}");
        found.iter().zip(&expected).for_each(|(found, expected)| assert_same(&what, found, expected));
        assert_eq!(twin.gpu.volume_sums_along(solid, &Axis::ALL, mode, fill), sums, "{what}");
        assert_eq!(twin.gpu.solid_sums_along(solid, &Axis::ALL, mode, fill), all_sums, "{what}");
    }
}

/// Compares the images of a solid along an axis: all modes, both fill rules, and the surfaces.
pub fn compare_along(what: impl Display, twins: &[Twin], solid: &LatticeSolid, axis: Axis) {
    for fill in FILLS {
        for mode in MODES {
            compare_image(&what, twins, solid, axis, mode, fill);
        }
        let expected = CpuSampler::default().sample_surface(solid, axis, fill);
        for twin in distinct(twins, Mode::Exact, fill) {
            let found = twin.gpu.sample_surface(solid, axis, fill);
            assert_same(format_args!("{what}, {axis:?}, surface, {fill:?}; {}", twin.name()), &found, &expected);
        }
    }
}

/// Compares all images of a solid.
pub fn compare_all(what: impl Display, twins: &[Twin], solid: &LatticeSolid) {
    for axis in Axis::ALL {
        compare_along(&what, twins, solid, axis);
    }
    for (mode, fill) in MODES.into_iter().flat_map(|mode| FILLS.map(|fill| (mode, fill))) {
        compare_together(&what, twins, solid, mode, fill);
    }
}

/// Compares the estimates of the intersection of two solids along an axis, under both fill rules.
pub fn compare_intersections(what: impl Display, twins: &[Twin], a: &LatticeSolid, b: &LatticeSolid, axis: Axis) {
    for fill in FILLS {
        for estimate in ESTIMATES {
            let expected = CpuSampler::default().sample_intersection([a, b], axis, estimate, fill);
            for twin in distinct(twins, Mode::Estimate(estimate), fill) {
                let found = twin.gpu.sample_intersection([a, b], axis, estimate, fill);
                let what = format_args!("{what}, intersection, {axis:?}, {estimate:?}, {fill:?}; {}", twin.name());
                assert_same(what, &found, &expected);
            }
        }
    }
}
