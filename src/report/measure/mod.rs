//! Measuring: from meshes to the content of a report.
//!
//! [`forecast`] refuses what would not fit into memory. [`raster`] samples; [`rays`], [`topology`], [`balls`], [`bounds`] and
//! [`transport`] take the images and the region and put metrics into the [`record`]; [`convergence`] repeats the main ones on
//! coarser rasters; [`alerts`] states reasons for doubt.
//! Distance fields and maps are the large arrays (4 to 8 bytes per node each): fields are dropped as soon as their balls are
//! found, and maps as soon as they are measured.

mod alerts;
mod balls;
mod bounds;
mod clock;
mod convergence;
mod forecast;
mod growth;
mod plots;
mod raster;
mod rays;
pub mod record;
mod slices;
mod topology;
mod transport;
mod view;

use crate::driver::memory::Limit;
use crate::grid::LatticeSolid;
use crate::integrate;
use crate::ldi::{Ldi, Mode, NodePlanes};
use crate::mesh::LengthUnit;
use crate::metrics::{NodeSet, Region};
use crate::sampler::Sampler;

pub use clock::Clock;
pub use forecast::admit_fields;
pub use raster::Subject;

use self::balls::Balls;
use self::growth::Growth;
use self::raster::Images;
use self::record::Record;
use self::slices::SliceMaker;
use super::id;
use super::scaffold_report::{Metric, Pictures, ScaffoldReport};
use crate::Error;
use crate::Monitor;
use crate::report::Settings;

/// A solid on a raster, ready to be measured.
pub struct Study<'s> {
    pub subject: Subject<'s>,
    pub settings: &'s Settings,
    pub images: &'s Images<'s>,
    pub region: &'s Region<'s>,
    /// Nodes of the solid, within the region or not.
    pub solid: NodeSet,
}

/// The relation between the shells of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shells {
    /// Every facet is surface.
    Apart,
    /// Shells overlap or touch: facets lie within the solid, or face it from the wrong side.
    Meeting,
}

impl Shells {
    /// Determines the relation from exact images under the even-odd rule, which keep every crossing.
    pub fn of(images: &[Ldi; 3]) -> Shells {
        if images.iter().all(integrate::shows_every_facet) { Shells::Apart } else { Shells::Meeting }
    }
}

/// The reason for a missing value where shells meet.
pub const SHELLS_MEET: &str =
    "shells of the mesh overlap or touch, so facets within the solid cannot be separated from its surface";

/// Returns all metrics, without values.
pub fn unmeasured(unit: Option<LengthUnit>) -> Vec<Metric> {
    let mut record = Record::default();
    for id in id::all() {
        record.lacks(id, "not measured");
    }
    record.into_metrics(unit)
}

/// Returns the number of stages that [`measure`] counts as steps, which the caller announces.
pub fn stages(has_roi: bool) -> usize {
    // Whether a region of interest is a box is not known yet.
    9 + if has_roi { 0 } else { transport::SOLUTIONS }
}

/// Measures a solid within its region. Schema, title, unit, verdict and provenance of the report are left empty.
pub fn measure(
    subject: Subject,
    settings: &Settings,
    lattice: LatticeSolid,
    sampler: &dyn Sampler,
    clock: &mut Clock,
    progress: &Monitor,
) -> Result<ScaffoldReport, Error> {
    let mut record = Record::default();
    let grid = *lattice.grid();
    let stage = |name: &'static str| progress.stage(format!("{}: {name}", subject.solid.name()));
    stage("sampling")?;
    let images = clock.time("sampling", || subject.sample_on(lattice, settings.fill, sampler))?;
    let region = images.region();
    let planes = NodePlanes::new(&images.solid, Mode::Exact).expect("images along the three axes of one grid");
    let solid = clock.time("sampling", || NodeSet::of_planes(&planes));
    let study = Study { subject, settings, images: &images, region: &region, solid };
    forecast::admit_equations(&study)?;
    let coarser = clock.time("sampling", || subject.check_volumes(&grid, settings.fill, sampler))?;
    progress.step()?;

    // Before the long stages, as it may not fit into memory.
    stage("pictures")?;
    let limit = Limit::new(settings.memory);
    let draw = || settings.is_drawn.then(|| view::view(subject, (settings.fill, limit), sampler)).transpose();
    let view = clock.time("pictures", draw)?;
    progress.step()?;

    stage("rays and facets")?;
    let drawn = clock.time("rays and facets", || rays::measure(&study, &coarser, &mut record));
    progress.step()?;
    stage("topology")?;
    clock.time("topology", || topology::measure(&study, &mut record));
    progress.step()?;
    stage("thickness")?;
    let found = clock.time("distances and balls", || Balls::of(&study));
    let mut slices = slices::through_the_middle(&region, &study.solid);
    let mut growth = Growth::of(&region, &study.solid);
    let of_thickness =
        clock.time("thickness", || balls::thickness(&study, &found, &mut slices, &mut growth, &mut record));
    progress.step()?;
    stage("access")?;
    let (access, of_access) = clock.time("access", || balls::access(&study, found, &mut record));
    progress.step()?;
    stage("bounds")?;
    bounds::measure(&study, sampler, clock, &mut record)?;
    progress.step()?;
    stage("convergence")?;
    let over_pitch =
        clock.time("convergence", || convergence::over_pitch(subject, settings, &grid, sampler, &record))?;
    progress.step()?;
    stage("tortuosity")?;
    clock.time("tortuosity", || transport::measure(&study, sampler, progress, &mut record))?;
    let convergence = vec![over_pitch, growth.finished()];
    let alerts = alerts::of(&study, &record, &convergence);
    Ok(ScaffoldReport {
        metrics: record.into_metrics(subject.solid.unit),
        histograms: of_thickness.into_iter().chain(of_access).chain(drawn.histograms).collect(),
        access,
        profiles: drawn.profiles,
        anisotropy: drawn.anisotropy,
        convergence,
        alerts,
        pictures: Pictures { view, slices: slices.into_iter().map(SliceMaker::finished).collect() },
        ..ScaffoldReport::default()
    })
}
