//! Metrics from rays and facets: volume, surface, chords, profiles, intercepts, curvature, moments.

use super::plots::{self, Plot};
use super::record::Record;
use super::{SHELLS_MEET, Shells, Study};
use crate::grid::Axis;
use crate::integrate::{AxisVolume, Moments};
use crate::metrics::anisotropy::Crossings;
use crate::metrics::chords::{Chords, Counted, Weighting};
use crate::metrics::curvature::curvature;
use crate::metrics::inertia::phase_moments;
use crate::metrics::overhang::{Plate, overhang};
use crate::metrics::permeability::kozeny_carman;
use crate::metrics::profiles::profiles;
use crate::metrics::surface_area::SurfaceElements;
use crate::metrics::{Facets, Phase};
use crate::number::number;
use crate::report::id;
use crate::report::scaffold_report::{Anisotropy, HistogramPlot, Profile};
use crate::sampler::FillRule;

/// The results to be drawn.
#[derive(Default)]
pub struct Drawn {
    pub histograms: Vec<HistogramPlot>,
    pub profiles: Vec<Profile>,
    pub anisotropy: Option<Anisotropy>,
}

const NO_SURFACE: &str = "the region contains no surface";

/// Records all metrics from rays and facets. `coarser` are the volumes of the coarser rasters, for the error of the volume.
pub fn measure(study: &Study, coarser: &[Vec<AxisVolume>], record: &mut Record) -> Drawn {
    let mesh = study.subject.solid.mesh();
    let facets = Facets::of(&mesh.positions, &mesh.triangles);
    let surface = study.images.surface(&facets, study.region);
    volume(study, coarser, record);
    let mut drawn = Drawn { anisotropy: of_surface(study, &surface, record), ..Drawn::default() };
    of_mesh(study, &facets, record);
    for phase in Phase::BOTH {
        drawn.histograms.extend(chords(study, phase, record));
        let extent = study.subject.solid.bounds().extent().max_element();
        moments(phase, &phase_moments(&study.images.solid, study.region, phase), extent, record);
    }
    let each = profiles(&study.images.solid, study.region).into_iter();
    let profile = |p: crate::metrics::profiles::Profile| Profile {
        axis: p.axis.name(),
        positions: p.positions,
        porosity: p.porosities,
    };
    drawn.profiles = each.map(profile).collect();
    drawn
}

/// Records the volumes and the shares of the region that are solid and pore.
fn volume(study: &Study, coarser: &[Vec<AxisVolume>], record: &mut Record) {
    let solid = study.images.volume(study.region, coarser);
    let total = study.region.volume();
    record.put(id::VOLUME_TOTAL, total);
    record.put(id::VOLUME_SOLID, solid.value).error(solid.error);
    record.put(id::VOLUME_MESH, study.subject.solid.volume.abs());
    record.put(id::VOLUME_FRACTION, solid.value / total).error(solid.error / total);
    record.put(id::POROSITY, 1.0 - solid.value / total).error(solid.error / total);
}

/// Records the sums over the surface within the region.
fn of_surface(study: &Study, surface: &SurfaceElements, record: &mut Record) -> Option<Anisotropy> {
    let (area, total) = (surface.area(), study.region.volume());
    let solid = record.value(id::VOLUME_SOLID).unwrap_or(f64::NAN);
    let of_mesh = study.subject.solid.mesh().area();
    record.put(id::SURFACE_MESH, of_mesh);
    let flush = of_mesh - area;
    let entry = record.put(id::SURFACE_AREA, area);
    if study.subject.roi.is_none() && study.images.shells == Shells::Apart && flush > 1e-3 * of_mesh {
        entry.warn(format!(
            "{} % of the mesh's surface lies in the faces of the box and is left out, as the solid counts as cut there",
            number((1000.0 * flush / of_mesh).round() / 10.0)
        ));
    }
    record.put(id::SURFACE_SPECIFIC, area / solid);
    record.put(id::SURFACE_DENSITY, area / total);
    let settings = study.settings;
    let overhang = overhang(surface, settings.build, settings.overhang_angle, Plate::Counted);
    let entry = match (study.images.shells, settings.fill) {
        // The even-odd rule flips facets that the non-zero rule does not.
        (Shells::Meeting, FillRule::EvenOdd) => record.lacks(id::OVERHANG, SHELLS_MEET),
        _ => record.put_or(id::OVERHANG, overhang.map(|overhang| overhang.share), NO_SURFACE),
    };
    entry.with("angle from the horizontal, degrees", settings.overhang_angle);
    entry.with("build direction", settings.build);
    let porosity = record.value(id::POROSITY).unwrap_or(f64::NAN);
    let permeability = kozeny_carman(porosity, area / total, settings.kozeny);
    record
        .put_or(id::PERMEABILITY, permeability, "the region contains no pores or no surface")
        .with("K", settings.kozeny);

    let intercepts = [id::INTERCEPT_LONG, id::INTERCEPT_MIDDLE, id::INTERCEPT_SHORT];
    let Some(ellipsoid) = Crossings::of(surface, total).ellipsoid() else {
        for id in [id::ANISOTROPY].into_iter().chain(intercepts) {
            record.lacks(id, NO_SURFACE);
        }
        return None;
    };
    // A degree that is 0 by symmetry is 0 except for rounding.
    let degree = if ellipsoid.degree < 1e-9 { 0.0 } else { ellipsoid.degree };
    record.put(id::ANISOTROPY, degree);
    for (id, length) in intercepts.into_iter().zip(ellipsoid.half_axes) {
        let endless = "infinite: lines in this direction never meet the surface";
        record.put_or(id, length.is_finite().then_some(length), endless);
    }
    Some(Anisotropy {
        degree,
        lengths: ellipsoid.half_axes,
        directions: ellipsoid.directions.map(|direction| direction.to_array()),
    })
}

/// Records the curvature of the mesh.
fn of_mesh(study: &Study, facets: &Facets, record: &mut Record) {
    let ids = [id::SURFACE_CURVATURE_MEAN, id::SURFACE_CURVATURE_GAUSS];
    if study.images.shells == Shells::Meeting {
        ids.into_iter().for_each(|id| {
            record.lacks(id, SHELLS_MEET);
        });
        return;
    }
    match curvature(facets, study.region, study.settings.edges) {
        Ok(curvature) => {
            let entry = record.put(ids[0], curvature.mean);
            if curvature.irregular_edges > 0 {
                entry.warn(format!(
                    "{} edges do not have two facets each and are left out; repair the mesh",
                    curvature.irregular_edges
                ));
            }
            record.put(ids[1], curvature.gauss);
        }
        Err(error) => ids.into_iter().for_each(|id| {
            record.lacks(id, error.to_string());
        }),
    }
}

/// Records the chords of a phase along the axes; returns their distribution.
fn chords(study: &Study, phase: Phase, record: &mut Record) -> Option<HistogramPlot> {
    let edges = study.settings.edges;
    let along = |axis: Axis| Chords::along(&study.images.solid[axis.depth()], study.region, phase, edges);
    let all = Axis::ALL.map(along);
    let (by_number, by_length) = match phase {
        Phase::Solid => (id::CHORD_SOLID, id::CHORD_SOLID_WEIGHTED),
        Phase::Pore => (id::CHORD_PORE, id::CHORD_PORE_WEIGHTED),
    };
    for (axis, chords) in Axis::ALL.into_iter().zip(&all) {
        record.put_or(by_number.along(axis), chords.mean(), "no ray meets a surface along this axis");
        let weighted = chords.distribution(Weighting::Length, Counted::Complete).map(|lengths| lengths.mean());
        record.put_or(by_length.along(axis), weighted, "no chord ends at the surface on both sides");
    }
    if phase == Phase::Pore {
        let solid =
            Axis::ALL.map(|axis| Chords::along(&study.images.solid[axis.depth()], study.region, Phase::Solid, edges));
        for ((axis, pore), solid) in Axis::ALL.into_iter().zip(&all).zip(&solid) {
            let censored = pore.censored().count + solid.censored().count;
            let share = censored as f64 / (pore.count() + solid.count()) as f64;
            record.put(id::CHORD_CENSORED.along(axis), share);
        }
    }
    let lengths = Chords::together(&all).distribution(Weighting::Number, Counted::Complete)?;
    let plot = match phase {
        Phase::Solid => Plot {
            id: "chord.solid",
            title: "Solid chords",
            reading: "Segments of lines within the solid, by number. Many short ones are thin walls or grazing rays; a long tail \
                      is solid along an axis.",
        },
        Phase::Pore => Plot {
            id: "chord.pore",
            title: "Pore chords",
            reading: "Segments of lines within the pores, by number. One narrow peak is a regular lattice, a falling \
                      exponential a random one.",
        },
    };
    Some(plots::histogram(plot, phase, &lengths, study.subject.solid.unit))
}

/// Records the centroid of a phase, and the inertia of the solid.
fn moments(phase: Phase, moments: &Moments, extent: f64, record: &mut Record) {
    let nothing = "the region contains none of this phase";
    // Sums that cancel except for rounding are 0.
    let finite = |value: f64, size: f64| value.is_finite().then(|| if value.abs() < 1e-9 * size { 0.0 } else { value });
    let centroid = match phase {
        Phase::Solid => id::CENTROID_SOLID,
        Phase::Pore => id::CENTROID_PORE,
    };
    for (id, coordinate) in centroid.all().into_iter().zip(moments.centroid.to_array()) {
        record.put_or(id, finite(coordinate, extent), nothing);
    }
    if phase == Phase::Solid {
        let [x, y, z] = moments.inertia.to_cols_array_2d();
        let tensor = [
            (id::INERTIA_XX, x[0]),
            (id::INERTIA_YY, y[1]),
            (id::INERTIA_ZZ, z[2]),
            (id::INERTIA_XY, x[1]),
            (id::INERTIA_XZ, x[2]),
            (id::INERTIA_YZ, y[2]),
        ];
        for (id, value) in tensor {
            record.put_or(id, finite(value, x[0] + y[1] + z[2]), nothing);
        }
    }
}
