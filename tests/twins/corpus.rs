//! Real meshes in the folder that `LDI_CORPUS` names: the closed ones as solids, the others as open meshes.

use ldi_ops::grid::{Axis, Grid, LatticeSolid};
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::mesh::io::{self, ReadNote};
use ldi_ops::sampler::{Estimate, FillRule, Mode};

use crate::manifest;
use crate::twin::{self, compare_image};

#[test]
#[ignore = "needs LDI_CORPUS"]
fn corpus_solids_have_equal_images() {
    let (mut closed, mut open) = (0, 0);
    for entry in manifest::entries() {
        // The manifest lists a scaffold of beams alone without a volume.
        let sound = entry.class != "nasty" && entry.volume.is_some();
        let mesh = match io::read(&entry.path) {
            Ok(file) if file.notes.iter().any(|note| matches!(note, ReadNote::BeamsMeshed { .. })) => continue,
            Ok(file) => file.mesh,
            Err(error) if sound => panic!("{error}"),
            Err(_) => continue,
        };
        let Some(Ok(grid)) = mesh.bounds().map(|bounds| Grid::with_resolution(bounds, 256, 1024)) else { continue };
        let compare = |solid: &LatticeSolid| {
            for axis in Axis::ALL {
                for mode in [Mode::Exact, Mode::Estimate(Estimate::Over)] {
                    compare_image(&entry.name, twin::plain(), solid, axis, mode, FillRule::EvenOdd);
                }
                if solid.closure().is_oriented() {
                    compare_image(&entry.name, twin::plain(), solid, axis, Mode::Exact, FillRule::NonZero);
                }
            }
        };
        match ClosedMesh::check(mesh) {
            Ok(mesh) => {
                compare(&grid.quantise(&mesh).unwrap());
                closed += 1;
            }
            Err(error) if sound => panic!("{}: {error}", entry.name),
            Err(error) => {
                let Ok(solid) = grid.quantise_open(&error.mesh) else { continue };
                compare(&solid);
                open += 1;
            }
        }
    }
    assert!(closed >= 33 && open >= 5, "only {closed} closed meshes and {open} open ones");
}
