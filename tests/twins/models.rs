//! The models of `data/models`.

use std::fs;
use std::path::Path;

use ldi_ops::grid::{Axis, Grid};
use ldi_ops::mesh::{ClosedMesh, io};
use ldi_ops::sampler::FillRule;

use crate::testing::random::Random;
use crate::twin::{self, MODES, compare_along, compare_image, compare_intersections};

fn models() -> Vec<(String, ClosedMesh)> {
    // From the working directory, which is the repository's root or a folder to which the program was taken.
    let mut paths: Vec<_> = fs::read_dir("data/models").unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let model = |path: &Path| {
        let mesh = io::read(path).unwrap_or_else(|error| panic!("{error}")).mesh;
        (path.display().to_string(), ClosedMesh::check(mesh).unwrap())
    };
    paths.iter().map(|path| model(path)).collect()
}

#[test]
fn models_have_equal_images() {
    let models = models();
    assert!(models.len() >= 11, "only {} models", models.len());
    let mut random = Random::new(0);
    for (name, mesh) in &models {
        for (resolution, lod) in [(128, 1024), (256, 256)] {
            let what = format!("{name} at {resolution}");
            let grid = Grid::with_resolution(mesh.bounds(), resolution, lod).unwrap();
            let solid = grid.quantise(mesh).unwrap();
            for axis in Axis::ALL {
                for mode in MODES {
                    compare_image(&what, twin::plain(), &solid, axis, mode, FillRule::EvenOdd);
                }
            }
            // One axis also under the other fill rule, and surfaces, too.
            if resolution == 128 {
                compare_along(&what, twin::plain(), &solid, random.choose(&Axis::ALL));
            }
        }
    }
}

#[test]
fn models_have_equal_intersections() {
    let models = models();
    for (i, (name, a)) in models.iter().enumerate() {
        let (other, b) = &models[(i + 1) % models.len()];
        let grid = Grid::with_resolution(a.bounds().union(b.bounds()), 128, 1024).unwrap();
        let (a, b) = (grid.quantise(a).unwrap(), grid.quantise(b).unwrap());
        compare_intersections(format_args!("{name} and {other}"), twin::plain(), &a, &b, Axis::ALL[i % 3]);
    }
}
