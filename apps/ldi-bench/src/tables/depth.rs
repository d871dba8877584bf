//! Time against the number of layers, past the 255 of a stencil buffer.

use ldi_ops::grid::{Axis, Grid};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{FillRule, Mode, Sampler};
use serde_json::json;

use super::plot::Plot;
use super::{LOD, Part, Plan, Pools, timed};
use crate::BenchError;
use crate::models::{self, quantise};
use crate::rivals::{Comparison, DepthPeeling, FreePipe, Rival, StencilBuffer};
use crate::table::{Table, count, number};

/// Samples chains of growing length along themselves on one thread, beside methods whose passes grow with the layers.
pub fn chains(plan: &Plan, pools: &Pools) -> Result<Part, BenchError> {
    let timed_rivals: [&dyn Rival; 3] = [&StencilBuffer::UNCAPPED, &DepthPeeling, &FreePipe::COMPACT];
    let names = timed_rivals.map(|rival| format!("{} ms", rival.name()));
    let mut heads = vec!["flat rings", "triangles", "rays", "layers", "ours ms"];
    heads.extend(names.iter().map(String::as_str));
    heads.extend(["layers lost at 8 bits", "rays unclosed"]);
    let mut table = Table::new(&heads);
    let mut rows = Vec::new();
    let mut series = vec![Vec::new(); 1 + timed_rivals.len()];
    for &columns in &plan.columns {
        let parameters = [("columns", &*columns.to_string()), ("rows", "1"), ("around", "16"), ("across", "10")];
        let mesh = models::closed("chain", models::build("chain-mail", &parameters)?)?;
        let grid = Grid::with_pitch(mesh.bounds(), mesh.bounds().extent().y / f64::from(plan.across), LOD);
        let solid = quantise("chain", &mesh, &grid.map_err(|error| BenchError::model("chain", error))?)?;
        let sample = || CpuSampler::default().sample(&solid, Axis::X, Mode::Exact, FillRule::EvenOdd);
        let (exact, own) = timed(plan, &pools.one, sample);
        let exact = exact.map_err(|error| BenchError::model("chain", error))?;
        let rivals = timed_rivals.map(|rival| timed(plan, &pools.one, || rival.sample(&solid, Axis::X)).1);
        let ms: Vec<f64> = [own].into_iter().chain(rivals).collect();
        for (series, &ms) in series.iter_mut().zip(&ms) {
            series.push((f64::from(exact.layers()), ms));
        }
        let capped = Comparison::new(&exact, &StencilBuffer::AS_PUBLISHED.sample(&solid, Axis::X), 0);
        let [triangles, rays, layers] = [solid.triangles().len() as u64, exact.rays().into(), exact.layers().into()];
        let mut cells: Vec<String> = [columns.into(), triangles, rays, layers].map(count).into();
        cells.extend(ms.iter().map(|&ms| number(ms)));
        cells.extend([capped.lost, capped.unclosed].map(count));
        table.row(cells);
        rows.push(json!({
            "columns": columns, "triangles": triangles, "rays": rays, "layers": layers, "own_ms": ms[0],
            "rivals_ms": ms[1..], "lost_at_8_bits": capped.lost, "unclosed_at_8_bits": capped.unclosed,
        }));
    }
    let names = ["ours"].into_iter().chain(timed_rivals.map(|rival| rival.name()));
    Ok(Part {
        name: "chains",
        title: "Chains past 255 layers".to_owned(),
        markdown: table.markdown(),
        text: format!(
            "One row of the chain's rings, along itself (x), {} rays across, one thread. The stencil buffer of 8 bits, as \
             published, loses layers past 255 of a ray; ours has no such limit.",
            plan.across
        ),
        rows: json!(rows),
        plots: vec![Plot {
            name: "layers",
            title: "Sampling time of chains, one thread",
            x: "most layers of a ray",
            y: "ms",
            series: names.map(str::to_owned).zip(series).collect(),
        }],
    })
}
