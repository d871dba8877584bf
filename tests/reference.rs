//! Compares volumes of intersections, unions and differences with those of manifold3d and CGAL, pinned in `data/reference`.
//!
//! # The tolerance
//! Let h be the pitch and S the area of both inputs together, which is at least that of any Boolean of them. A volume found from
//! rays is wrong only in the pixels that the surface cuts, each by no more than the part of the pixel beyond the surface. A flat
//! face that lies between rays is wrong by up to h/2 all over, so no image along one axis can be off by more than h S / 2. Each
//! image corrects the faces that the others miss, so that this first order cancels where a face is parallel to a coordinate plane
//! or axis. Faces in general position meet pixels at depths that are nearly uniformly distributed: N = S / h² errors of at most
//! h³ / 2 each, independent, add up to about h³ √(N / 12) = h S / √(12 N), and with the largest correction, by weights of 1, 1, 1
//! and −2, to √7 times that. At 512 rays N is 300 000 or more for all of the pairs, which makes a 700th of h S; twice the sum for
//! the union with its two independent surfaces, and three standard deviations, stay below a hundredth. The rest is the error at
//! edges, h² times their length: h² L / (h S) = h L / S is another hundredth for the finest lattice among the pairs. So the
//! tolerance is **h S / 50**: a fiftieth of a pixel all over the surface. It is the same for over-estimates, which differ from
//! the exact image only where two crossings share a voxel of half a pixel, that is along edges and curves of intersection; where
//! whole surfaces coincide, as in A ∩ A, the ends that two solids share still lie within one voxel of half a pixel, and all
//! depths but theirs are the same.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DVec3};
use ldi_ops::boolean::{BooleanOperation, Expression, merge};
use ldi_ops::exact;
use ldi_ops::grid::{Axis, Grid, LatticeSolid};
use ldi_ops::integrate::{AxisVolume, VolumeEstimate};
use ldi_ops::ldi::Ldi;
use ldi_ops::mesh::{ClosedMesh, MassProperties, Precision, io};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Estimate, FillRule, MaskIntersection, Mode, Sampler};
use ldi_ops::surface::Coordinates;
use ldi_ops::surface::manifold::ManifoldReport;
use serde_json::Value;
use sha2::{Digest, Sha256};

const RESOLUTION: u32 = 512;

const OPERATIONS: [(&str, BooleanOperation); 3] = [
    ("intersection", BooleanOperation::Intersection),
    ("union", BooleanOperation::Union),
    ("difference", BooleanOperation::Difference),
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// One pair of solids with the answers of the peers.
struct Pair {
    name: String,
    solids: [ClosedMesh; 2],
    /// The answers of the peers, one JSON object each.
    results: Vec<Value>,
}

fn pairs() -> Vec<Pair> {
    let folder = root().join("data/reference");
    let mut paths: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "json"));
    paths.sort();
    paths.iter().map(|path| pair(path)).collect()
}

fn pair(path: &Path) -> Pair {
    let value: Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    let solids = [0, 1].map(|i| {
        let input = &value["inputs"][i];
        let path = root().join(input["path"].as_str().unwrap());
        assert_eq!(Some(sha256(&path).as_str()), input["sha256"].as_str(), "{} was changed", path.display());
        let mut mesh = io::read(&path).unwrap().mesh;
        assert_eq!(Some(mesh.triangles.len() as u64), input["triangles"].as_u64());
        if let Some(text) = input["transform"].as_str() {
            mesh.transform(&placement(text));
        }
        // The exact route counts a copy once. With other corners first it is none, and all faces of equal solids coincide.
        mesh.triangles.iter_mut().for_each(|triangle| triangle.rotate_left(i));
        ClosedMesh::check(mesh).unwrap()
    });
    Pair {
        name: value["pair"].as_str().unwrap().to_owned(),
        solids,
        results: value["results"].as_array().unwrap().clone(),
    }
}

fn sha256(path: &Path) -> String {
    Sha256::digest(fs::read(path).unwrap()).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Returns the affine map of a placement such as `rotate(0,0,1,30) translate(1,0,0)`; the leftmost step is applied first.
fn placement(text: &str) -> DAffine3 {
    let steps = text.split(')').map(str::trim).filter(|step| !step.is_empty());
    steps.fold(DAffine3::IDENTITY, |before, step| {
        let (name, numbers) = step.split_once('(').expect("a step has a parenthesis");
        let numbers: Vec<f64> = numbers.split(',').map(|number| number.trim().parse().unwrap()).collect();
        let map = match (name, numbers.as_slice()) {
            ("translate", &[x, y, z]) => DAffine3::from_translation(DVec3::new(x, y, z)),
            ("rotate", &[x, y, z, angle]) => {
                DAffine3::from_axis_angle(DVec3::new(x, y, z).normalize(), angle.to_radians())
            }
            ("scale", &[s]) => DAffine3::from_scale(DVec3::splat(s)),
            _ => panic!("{step}: no such step"),
        };
        map * before
    })
}

/// Returns the image of an operation, made as the command line makes it.
fn image(operation: BooleanOperation, [a, b]: &[LatticeSolid; 2], axis: Axis, mode: Mode) -> Ldi {
    let sampler = CpuSampler::default();
    let fill = FillRule::EvenOdd;
    match (operation, mode) {
        (BooleanOperation::Intersection, Mode::Estimate(estimate)) => {
            sampler.sample_intersection([a, b], axis, estimate, fill).unwrap()
        }
        _ => {
            let taken = if operation == BooleanOperation::Difference { mode.opposite() } else { mode };
            let [a, b] = [(a, mode), (b, taken)].map(|(solid, mode)| sampler.sample(solid, axis, mode, fill).unwrap());
            merge(operation, &a, &b).unwrap()
        }
    }
}

/// Returns the volume on which the peers agree; `None` where all of them refuse.
fn agreed(pair: &Pair, operation: &str) -> Option<f64> {
    let values: Vec<f64> = pair.results.iter().filter_map(|result| result[operation].as_f64()).collect();
    let scale = pair.solids[0].signed_volume();
    for &value in &values {
        assert!(is_same(value, values[0], scale), "{}, {operation}: the peers differ: {values:?}", pair.name);
    }
    values.first().copied()
}

/// Applies the rule of `tests/reference/live_manifold.py`: the difference is at most 1e-9 of the value, or of `scale`, the volume
/// of A, where the value is mere rounding.
fn is_same(found: f64, pinned: f64, scale: f64) -> bool {
    const TOLERANCE: f64 = 1e-9;
    let reference = if pinned.abs() > TOLERANCE * scale { pinned.abs() } else { scale };
    (found - pinned).abs() <= TOLERANCE * reference
}

fn is_within(found: f64, expected: f64, tolerance: f64) -> bool {
    (found - expected).abs() <= tolerance
}

#[test]
fn volumes_of_all_pairs_are_within_a_fiftieth_of_a_pixel_of_the_peers() {
    let pairs = pairs();
    assert!(pairs.len() >= 10, "only {} pairs", pairs.len());
    let (mut wrong, mut compared, mut honest) = (Vec::new(), 0, 0);
    eprintln!(
        "{:22}{:14}{:7}{:>14}{:>14}{:>12}{:>12}{:>12}",
        "pair", "operation", "mode", "peers", "found", "error", "estimate", "tolerance"
    );
    for pair in &pairs {
        let [a, b] = &pair.solids;
        let grid = Grid::with_resolution(a.bounds().union(b.bounds()), RESOLUTION, 1024).unwrap();
        let solids = [a, b].map(|mesh| grid.quantise(mesh).unwrap());
        let tolerance = grid.pitch() * (a.mesh().area() + b.mesh().area()) / 50.0;
        for (mode_name, mode) in [("exact", Mode::Exact), ("over", Mode::Estimate(Estimate::Over))] {
            for (name, operation) in OPERATIONS {
                let Some(expected) = agreed(pair, name) else { continue };
                let images = Axis::ALL.map(|axis| image(operation, &solids, axis, mode));
                assert!(images.iter().all(|image| image.unclosed().is_empty()), "{}", pair.name);
                let found = VolumeEstimate::from_axes(&images.each_ref().map(AxisVolume::of));
                let error = found.value - expected;
                compared += 1;
                // Peers round too: sums of f64 give about 1e-12 where the value is zero.
                honest += usize::from(error.abs() <= 2.0 * found.error + 1e-9 * expected.abs() + 1e-9);
                let line = format!(
                    "{:22}{name:14}{mode_name:7}{expected:14.6}{:14.6}{error:12.2e}{:12.2e}{tolerance:12.2e}",
                    pair.name, found.value, found.error
                );
                eprintln!("{line}");
                if !is_within(found.value, expected, tolerance) {
                    wrong.push(line);
                }
            }
        }
    }
    eprintln!("{honest} of {compared} within twice the estimate");
    assert!(wrong.is_empty(), "beyond the tolerance:\n{}", wrong.join("\n"));
    assert!(compared >= 60, "only {compared} values were compared");
    assert!(10 * honest >= 9 * compared, "only {honest} of {compared} are within twice the estimate");
}

/// The peers' own rounding, and that of coordinates to the lattice, as a share of the volume of both inputs.
const ROUNDING: f64 = 2e-12;

#[test]
fn exact_volumes_of_all_pairs_are_those_of_the_peers() {
    let mut compared = 0;
    for pair in pairs() {
        let [a, b] = &pair.solids;
        let scale = a.signed_volume() + b.signed_volume();
        for (name, operation) in OPERATIONS {
            let Some(expected) = agreed(&pair, name) else { continue };
            let found = exact::mass_properties(&[a, b], &Expression::of_inputs(operation, 2), FillRule::EvenOdd);
            let found = found.unwrap().mass;
            let error = (found.volume - expected).abs();
            eprintln!(
                "{:22}{name:14}{:20.12}{:10.1e}{:10.1e}",
                pair.name,
                found.volume,
                error / scale,
                found.volume_rounding / scale
            );
            assert!(
                is_within(found.volume, expected, ROUNDING * scale),
                "{}, {name}: {expected}, not {found:?}",
                pair.name
            );
            compared += 1;
        }
    }
    assert!(compared >= 30, "only {compared} values were compared");
}

/// Asserts that every triangle lies in the plane of the triangle that is named as its source. Returns the number of vertices that
/// are those of inputs, bit for bit.
fn has_sources(found: &exact::ExactMesh, inputs: [&ClosedMesh; 2], name: &str) -> usize {
    let mesh = &found.mesh;
    assert_eq!(found.sources.len(), mesh.triangles.len());
    let bits = |position: &DVec3| position.to_array().map(f64::to_bits);
    let given: HashSet<[u64; 3]> = inputs.iter().flat_map(|input| input.mesh().positions.iter().map(bits)).collect();
    let size = inputs.iter().map(|input| input.bounds().extent().max_element()).fold(0.0, f64::max);
    for (triangle, source) in mesh.triangles.iter().zip(&found.sources) {
        let input = inputs[source.input as usize].mesh();
        let [a, b, c] = input.triangles[source.triangle as usize].map(|index| input.positions[index as usize]);
        let normal = (b - a).cross(c - a).normalize();
        for corner in triangle.map(|index| mesh.positions[index as usize]) {
            let farthest = normal.dot(corner - a).abs();
            assert!(farthest < 1e-9 * size, "{name}: {farthest} from {source:?}");
        }
    }
    mesh.positions.iter().filter(|position| given.contains(&bits(position))).count()
}

#[test]
fn exact_meshes_of_all_pairs_are_manifolds_with_the_exact_volume_and_the_triangles_of_their_inputs() {
    let (mut written, mut kept) = (0, 0);
    for pair in pairs() {
        let [a, b] = &pair.solids;
        let scale = a.signed_volume() + b.signed_volume();
        for (operation_name, operation) in OPERATIONS {
            let name = format!("{}, {operation_name}", pair.name);
            let expression = Expression::of_inputs(operation, 2);
            let solution = exact::Solution::of(&[a, b], &expression, FillRule::EvenOdd).unwrap();
            let MassProperties { volume, area, .. } = solution.properties().mass;
            if volume <= 1e-9 * scale {
                continue;
            }
            for (precision, tolerance) in [(Precision::Double, 1e-12), (Precision::Single, 1e-5)] {
                let found = solution.mesh(Coordinates { precision, ..Coordinates::default() });
                let report = ManifoldReport::of(&found.mesh, precision);
                eprintln!(
                    "{name:34}{:>9} triangles{:>6} parts, genus {:>4} {:?}",
                    report.triangles,
                    report.components,
                    report.genus.unwrap_or(0),
                    found.apart
                );
                assert!(report.passed(), "{name}: {:?}", report.failures());
                assert!(is_within(report.signed_volume, volume, tolerance * scale), "{name}: {report:?} {volume}");
                if precision == Precision::Double && operation != BooleanOperation::Xor {
                    assert!(is_within(found.mesh.area(), area, 1e-9 * area), "{name}: {} {area}", found.mesh.area());
                }
                if precision == Precision::Double {
                    kept += has_sources(&found, [a, b], &name);
                }
                written += 1;
            }
        }
    }
    assert!(written >= 60, "only {written} meshes");
    assert!(kept >= 100_000, "only {kept} vertices of inputs");
}

#[test]
fn the_comparison_rejects_other_operations_other_operands_and_nan() {
    assert!(is_within(1.0, 1.5, 0.5) && !is_within(1.0, 1.6, 0.5) && !is_within(1.0, 0.4, 0.5));
    assert!(!is_within(f64::NAN, 1.0, 0.5) && !is_within(1.0, f64::NAN, 0.5));
    // The comparison rejects the volume of another operation and of other operands.
    let pair = pair(&root().join("data/reference/rotated_boxes.json"));
    let [a, b] = &pair.solids;
    let grid = Grid::with_resolution(a.bounds().union(b.bounds()), 128, 1024).unwrap();
    let tolerance = grid.pitch() * (a.mesh().area() + b.mesh().area()) / 50.0;
    let of = |solids: [&ClosedMesh; 2], operation| {
        let solids = solids.map(|mesh| grid.quantise(mesh).unwrap());
        let images = Axis::ALL.map(|axis| AxisVolume::of(&image(operation, &solids, axis, Mode::Exact)));
        VolumeEstimate::from_axes(&images).value
    };
    let expected = agreed(&pair, "intersection").unwrap();
    assert!(is_within(of([a, b], BooleanOperation::Intersection), expected, tolerance));
    assert!(!is_within(of([a, b], BooleanOperation::Union), expected, tolerance));
    assert!(!is_within(of([a, a], BooleanOperation::Intersection), expected, tolerance));
}

#[test]
fn answers_that_differ_by_more_than_a_billionth_are_not_the_same() {
    assert!(is_same(2.0 + 1e-9, 2.0, 1.0) && !is_same(2.0 + 3e-9, 2.0, 1.0));
    assert!(is_same(1e-12, 0.0, 1.0) && !is_same(2e-9, 0.0, 1.0));
    assert!(!is_same(f64::NAN, 1.0, 1.0) && !is_same(1.0, f64::NAN, 1.0));
}

#[test]
fn placement_steps_apply_from_left_to_right() {
    let place = |text| placement(text).transform_point3(DVec3::X);
    assert!((place("translate(1,0,0) scale(3)") - DVec3::new(6.0, 0.0, 0.0)).length() < 1e-12);
    assert!((place("scale(3) translate(1,0,0)") - DVec3::new(4.0, 0.0, 0.0)).length() < 1e-12);
    assert!((place("rotate(0,0,2,90)") - DVec3::Y).length() < 1e-12);
}
