//! Tables by model: sampling beside the published times, and the rivals.

use ldi_ops::grid::Axis;
use ldi_ops::sampler::Mode;
use serde_json::json;

use super::{LOD, OVER, Part, Plan, Pools, images, timed};
use crate::BenchError;
use crate::models::{SeedModel, grid_around, quantise};
use crate::rivals::{self, Comparison};
use crate::table::{Table, count, number};

/// Times sampling along three axes, beside the published times.
pub fn sampling(plan: &Plan, models: &[SeedModel], pools: &Pools) -> Result<Part, BenchError> {
    let mut table = Table::new(&[
        "model",
        "triangles",
        "published",
        "layers x",
        "y",
        "z",
        "published",
        "exact ms, 1 thread",
        "2 threads",
        "over ms, 1 thread",
        "2 threads",
        "GTX 580 ms",
        "GTX 580 / over, 2 threads",
    ]);
    let mut rows = Vec::new();
    for SeedModel { solid: named, triangles, layers, milliseconds: published } in models {
        let name = named.name;
        let solid = quantise(name, &named.mesh, &grid_around(name, &named.mesh, plan.resolution, LOD)?)?;
        let own_triangles = solid.triangles().len() as u64;
        let time = |mode| [&pools.one, &pools.two].map(|pool| timed(plan, pool, || images(&solid, mode)));
        let [(exact_images, exact), (_, exact_2)] = time(Mode::Exact);
        let (exact, over) = ([exact, exact_2], time(OVER).map(|(_, ms)| ms));
        let own_layers: Vec<u32> = exact_images.iter().map(|image| image.layers()).collect();
        let mut cells = vec![name.to_owned(), count(own_triangles), count((*triangles).into())];
        cells.extend(own_layers.iter().map(|&most| count(most.into())));
        cells.push(count((*layers).into()));
        cells.extend(exact.into_iter().chain(over).chain([*published]).map(number));
        // The published time is that of 512 rays.
        cells.push(if plan.resolution == 512 { number(published / over[1]) } else { "–".to_owned() });
        table.row(cells);
        rows.push(json!({
            "model": name, "triangles": own_triangles, "published_triangles": triangles, "layers": own_layers,
            "published_layers": layers, "exact_ms": exact, "over_ms": over, "published_ms": published,
        }));
    }
    Ok(Part {
        name: "sampling",
        title: "Sampling along three axes".to_owned(),
        markdown: table.markdown(),
        text: "Meshes are generated, checked and quantised before the clock starts. Over is the published kind of image. The \
               last column is the published time over ours, at 512 rays; the solids are alike, not the same."
            .to_owned(),
        rows: json!(rows),
        plots: Vec::new(),
    })
}

/// Times all rivals on one thread along three axes, and compares their layers with the exact images.
pub fn rivals(plan: &Plan, models: &[SeedModel], pools: &Pools) -> Result<Part, BenchError> {
    let mut markdown = Vec::new();
    let mut rows = Vec::new();
    for SeedModel { solid: named, .. } in models {
        let name = named.name;
        let solid = quantise(name, &named.mesh, &grid_around(name, &named.mesh, plan.resolution, LOD)?)?;
        let (exact, own) = timed(plan, &pools.one, || images(&solid, Mode::Exact));
        let samples: usize = exact.iter().map(|image| image.depths().len()).sum();
        let mut table = Table::new(&[
            name,
            "ms",
            "/ ours",
            "passes",
            "layers lost",
            "share",
            "extra",
            "rays unclosed",
            "rays that differ",
            "volume",
        ]);
        let ours = ["ours, exact (the reference)", &number(own), "1", "3", "0", "0 %", "0", "0", "0", "0 %"];
        table.row(ours.map(str::to_owned).into());
        for rival in rivals::all() {
            let (layers, ms) = timed(plan, &pools.one, || Axis::ALL.map(|axis| rival.sample(&solid, axis)));
            let found = exact
                .iter()
                .zip(&layers)
                .map(|(exact, layers)| Comparison::new(exact, layers, rival.tolerance(&solid, exact.axis())));
            let found = found.fold(Comparison::default(), Comparison::plus);
            let volume = found.length as f64 / found.exact_length as f64;
            table.row(vec![
                rival.name().to_owned(),
                number(ms),
                number(ms / own),
                count(found.passes.into()),
                count(found.lost),
                format!("{} %", number(100.0 * found.lost as f64 / samples as f64)),
                count(found.extra),
                count(found.unclosed),
                count(found.differing),
                format!("{} %", number(100.0 * (volume - 1.0))),
            ]);
            rows.push(json!({
                "model": name, "rival": rival.name(), "ms": ms, "own_ms": own, "samples": samples, "difference": found,
            }));
        }
        markdown.push(table.markdown());
    }
    Ok(Part {
        name: "rivals",
        title: "Earlier methods beside ours".to_owned(),
        markdown: markdown.join("\n"),
        text: "One thread, three axes: times, passes and losses are sums over the three images. The earlier methods run on \
               the CPU, too, and draw with the scalar form of the library's rasteriser once a pass, where ours covers small \
               triangles eight side by side; they allocate their buffers within the time. A GPU would draw faster, in as \
               many passes. A layer is lost where the exact image has a sample and the method has none; voxels lose those that they \
               merge, and their other depths count as found within one voxel. Volume is the difference from the exact volume on \
               the rays that close."
            .to_owned(),
        rows: json!(rows),
        plots: Vec::new(),
    })
}
