//! Tests that the three exact images of a solid agree about every node of the lattice.

use ldi_ops::grid::{Axis, Grid};
use ldi_ops::integrate::AxisVolume;
use ldi_ops::ldi::{Ldi, Spans};
use ldi_ops::sampler::Mode;
use rayon::prelude::*;

use super::images::{FILLS, sample};
use super::material::{models, quantised, random_frame};
use super::on_lattice::{grid, mesh};
use super::soups::oriented;
use super::testing::images::{closed, grid_around};
use super::testing::random::Random;

/// Returns the state of every node, x fastest, by an image along one axis.
fn states(grid: &Grid, image: &Ldi) -> Vec<bool> {
    let rays = grid.rays();
    let axis = image.axis();
    let mut states = Vec::new();
    for z in 0..rays[2] {
        for y in 0..rays[1] {
            for x in 0..rays[0] {
                let index = [x, y, z];
                let ray = index[axis.row()] * image.size().0 + index[axis.column()];
                let depth = grid.node(index[axis.depth()]);
                states.push(Spans::new(image.samples(ray)).any(|(start, end)| start <= depth && depth < end));
            }
        }
    }
    states
}

#[test]
fn images_of_a_random_soup_agree_about_every_node() {
    let inside: usize = oriented()
        .into_par_iter()
        .map(|(name, generator)| {
            let mut inside = 0;
            for seed in 0..250 {
                let mut random = Random::new(50_000 + seed);
                let frame = random_frame(&mut random);
                let grid = grid(&frame, 1024);
                let mesh = closed(mesh(&generator(&mut random, &frame)));
                let solid = quantised(&grid, &mesh);
                for fill in FILLS {
                    let images = Axis::ALL.map(|axis| sample(&solid, axis, Mode::Exact, fill));
                    let [x, y, z] = images.each_ref().map(|image| states(&grid, image));
                    assert!(x == y && y == z, "{name}, seed {seed}, {frame:?}, {fill:?}");
                    inside += x.iter().filter(|&&state| state).count();
                    let nodes = images.each_ref().map(|image| AxisVolume::of(image).nodes);
                    let counted = x.iter().filter(|&&state| state).count() as f64 * grid.pitch().powi(3);
                    assert_eq!(nodes, [counted; 3], "{name}, seed {seed}, {fill:?}");
                }
            }
            inside
        })
        .sum();
    assert!(inside > 100_000, "only {inside} nodes were inside");
}

#[test]
fn images_of_a_model_agree_about_every_node() {
    for (name, mesh) in models() {
        let grid = grid_around(&[&mesh], 71, 1024);
        let solid = quantised(&grid, &mesh);
        for fill in FILLS {
            let [x, y, z] = Axis::ALL.map(|axis| states(&grid, &sample(&solid, axis, Mode::Exact, fill)));
            assert!(x == y && y == z, "{name}, {fill:?}");
        }
    }
}

#[test]
fn solids_with_other_nodes_have_other_states() {
    let frame = super::soups::Frame { shift: 4, rays: [8; 3] };
    let grid = grid(&frame, 64);
    let of = |to| {
        let mesh = closed(mesh(&super::soups::cuboid([8; 3], [40, 40, to])));
        states(&grid, &sample(&quantised(&grid, &mesh), Axis::X, Mode::Exact, FILLS[0]))
    };
    assert!(of(40) == of(38) && of(40) != of(60), "a pixel is 16 steps, and its node in the middle");
}
