//! Compares volumes of the real meshes in the folder `LDI_CORPUS` with those of other software.
//!
//! The volumes are those that `ldi-ops volume --axis all` prints with its defaults: over-estimates with LOD-C 1024, even-odd.

#[path = "corpus/manifest.rs"]
mod manifest;

use ldi_ops::boolean::{BooleanOperation, merge};
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::integrate::{AxisVolume, VolumeEstimate};
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::mesh::io::{self, ReadNote};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Estimate, FillRule, Mode, Sampler};
use manifest::Entry;

const OVER: Mode = Mode::Estimate(Estimate::Over);
const RESOLUTIONS: [u32; 4] = [64, 128, 256, 512];

/// The tolerance of a volume: a tenth of a percent.
const PROMISED: f64 = 1e-3;

/// A solid of the corpus.
struct Sound {
    name: String,
    mesh: ClosedMesh,
    volume: f64,
}

/// Returns the files classed as solids, scaffolds and bones, with the volume that the manifest states.
fn sound() -> impl Iterator<Item = Sound> {
    manifest::entries().into_iter().filter(|entry| entry.class != "nasty").filter_map(
        |Entry { name, path, volume, .. }| {
            // The manifest lists a scaffold of beams alone without a volume.
            let volume = volume?;
            let file = io::read(&path).unwrap_or_else(|error| panic!("{error}"));
            // The other software left beams out.
            if file.notes.iter().any(|note| matches!(note, ReadNote::BeamsMeshed { .. })) {
                return None;
            }
            let mesh = file.mesh;
            let mesh = ClosedMesh::check(mesh).unwrap_or_else(|error| panic!("{name}: {error}"));
            Some(Sound { name, mesh, volume: volume.abs() })
        },
    )
}

fn along_axes(mesh: &ClosedMesh, resolution: u32, mode: Mode) -> [AxisVolume; 3] {
    let grid = Grid::with_resolution(mesh.bounds(), resolution, 1024).unwrap();
    let solid = grid.quantise(mesh).unwrap();
    Axis::ALL.map(|axis| {
        let image = CpuSampler::default().sample(&solid, axis, mode, FillRule::EvenOdd).unwrap();
        assert!(image.unclosed().is_empty(), "{} rays of a closed mesh are unclosed", image.unclosed().len());
        AxisVolume::of(&image)
    })
}

/// Returns the relative error of a volume.
fn off(found: f64, expected: f64) -> f64 {
    (found / expected - 1.0).abs()
}

/// Returns whether the true error is at most twice the estimated error, up to rounding in f64.
fn is_honest(error: f64, estimate: f64) -> bool {
    error <= 2.0 * estimate + 1e-9
}

#[test]
#[ignore = "needs LDI_CORPUS"]
fn volumes_are_within_a_tenth_of_a_percent_and_most_errors_within_twice_the_estimate() {
    let (mut wrong, mut dishonest, mut cases) = (Vec::new(), Vec::new(), 0);
    let mut files = 0;
    eprintln!("{:26}{:>16}   error % (estimate %) at {RESOLUTIONS:?} rays", "file", "volume");
    for Sound { name, mesh, volume } in sound() {
        files += 1;
        let mut line = format!("{name:26}{volume:16.8e}");
        for resolution in RESOLUTIONS {
            let found = VolumeEstimate::from_axes(&along_axes(&mesh, resolution, OVER));
            let (error, estimate) = (off(found.value, volume), found.error / volume);
            line += &format!("   {:.4} ({:.4})", 100.0 * error, 100.0 * estimate);
            cases += 1;
            if !is_honest(error, estimate) {
                dishonest.push(format!("{name} at {resolution}: {:.1} times the estimate", error / estimate));
                line += "!";
            }
            // A NaN counts as wrong.
            if resolution == 512 && (error.is_nan() || error > PROMISED) {
                wrong.push(format!("{name}: off by {:.4} %, {:.4} % allowed", 100.0 * error, 100.0 * PROMISED));
            }
        }
        eprintln!("{line}");
    }
    eprintln!("{} of {cases} cases are beyond twice the estimate: {dishonest:#?}", dishonest.len());
    assert!(files >= 30, "only {files} files");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(20 * dishonest.len() <= cases, "{}", dishonest.join("\n"));
}

#[test]
#[ignore = "needs LDI_CORPUS"]
fn the_three_exact_images_agree_about_nodes() {
    for Sound { name, mesh, .. } in sound() {
        for resolution in [77, 256] {
            let [x, y, z] = along_axes(&mesh, resolution, Mode::Exact);
            assert!(x.nodes > 0.0, "{name}");
            assert_eq!((x.nodes, x.nodes), (y.nodes, z.nodes), "{name} at {resolution}");
            assert_eq!(x.coarser_nodes, y.coarser_nodes, "{name} at {resolution}");
            assert_eq!(x.coarser_nodes, z.coarser_nodes, "{name} at {resolution}");
        }
    }
}

/// Volumes computed by manifold3d 3.5.4.
const PIA_LESS_WM: f64 = 268_030.002_5;
const WM_LESS_PIA: f64 = 67.170_7;

#[test]
#[ignore = "needs LDI_CORPUS"]
fn cortex_differences_are_near_those_of_manifold3d() {
    let solids: Vec<Sound> = sound().collect();
    let of = |name: &str| solids.iter().find(|solid| solid.name == name).unwrap_or_else(|| panic!("{name} is missing"));
    let (pia, wm) = (of("cortex_pia_lh.ply"), of("cortex_wm_lh.ply"));
    let grid = Grid::with_resolution(pia.mesh.bounds().union(wm.mesh.bounds()), 512, 1024).unwrap();
    let [pia_solid, wm_solid] = [pia, wm].map(|solid| grid.quantise(&solid.mesh).unwrap());
    let sample = |solid, axis, mode| CpuSampler::default().sample(solid, axis, mode, FillRule::EvenOdd).unwrap();
    for mode in [Mode::Exact, OVER] {
        for (name, a, b, expected) in
            [("pia − wm", &pia_solid, &wm_solid, PIA_LESS_WM), ("wm − pia", &wm_solid, &pia_solid, WM_LESS_PIA)]
        {
            let images = Axis::ALL.map(|axis| {
                let (a, b) = (sample(a, axis, mode), sample(b, axis, mode.opposite()));
                merge(BooleanOperation::Difference, &a, &b).unwrap()
            });
            let found = VolumeEstimate::from_axes(&images.each_ref().map(AxisVolume::of));
            let error = found.value - expected;
            eprintln!(
                "{name}, {mode:?}: {} ± {}, manifold3d {expected}: off by {error:.4}, {:.5} % of pia's volume",
                found.value,
                found.error,
                100.0 * error.abs() / pia.volume
            );
            assert!(error.abs() <= 2e-3 * pia.volume, "{name}, {mode:?}: {} is not {expected}", found.value);
        }
    }
}

#[test]
fn comparisons_reject_wrong_volumes() {
    assert!(off(1.002, 1.0) > PROMISED && off(0.998, 1.0) > PROMISED && off(1.0005, 1.0) < PROMISED);
    assert!(is_honest(2.0, 1.0) && !is_honest(2.1, 1.0) && !is_honest(f64::NAN, 1.0) && is_honest(1e-12, 0.0));
}
