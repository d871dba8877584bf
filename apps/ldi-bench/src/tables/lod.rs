//! Time and volume against LOD-C.

use ldi_ops::grid::LatticeSolid;
use ldi_ops::integrate::volume;
use ldi_ops::ldi::Ldi;
use ldi_ops::sampler::Mode;
use serde_json::json;

use super::plot::Plot;
use super::{OVER, Part, Plan, Pools, UNDER, images, timed};
use crate::BenchError;
use crate::models::{NamedSolid, grid_around, quantise};
use crate::table::{Table, count, number};

/// Returns the mean volume of the images along three axes.
pub fn mean_volume(images: &[Ldi]) -> f64 {
    images.iter().map(volume).sum::<f64>() / images.len() as f64
}

/// Samples a model along three axes on one thread at growing LOD-C.
pub fn sweep(plan: &Plan, NamedSolid { name, mesh, .. }: &NamedSolid, pools: &Pools) -> Result<Part, BenchError> {
    let mut table =
        Table::new(&["LOD-C", "under mm³", "exact mm³", "over mm³", "(over − under) / exact", "under ms", "over ms"]);
    let mut rows = Vec::new();
    let mut differences = vec![("over".to_owned(), Vec::new()), ("under".to_owned(), Vec::new())];
    let mut times = vec![("over".to_owned(), Vec::new()), ("under".to_owned(), Vec::new())];
    let solid = quantise(name, mesh, &grid_around(name, mesh, plan.resolution, plan.lods[0])?)?;
    let measure = |solid: &LatticeSolid, mode| {
        let (images, ms) = timed(plan, &pools.one, || images(solid, mode));
        (mean_volume(&images), ms)
    };
    let (exact, exact_ms) = measure(&solid, Mode::Exact);
    for &lod in &plan.lods {
        let solid = quantise(name, mesh, &grid_around(name, mesh, plan.resolution, lod)?)?;
        let [(over, over_ms), (under, under_ms)] = [OVER, UNDER].map(|mode| measure(&solid, mode));
        for (i, (volume, ms)) in [(over, over_ms), (under, under_ms)].into_iter().enumerate() {
            differences[i].1.push((f64::from(lod), 100.0 * (volume / exact - 1.0).abs()));
            times[i].1.push((f64::from(lod), ms));
        }
        let mut cells = vec![count(lod.into())];
        cells.extend([under, exact, over].map(|volume| format!("{volume:.3}")));
        cells.push(format!("{} %", number(100.0 * (over - under) / exact)));
        cells.extend([under_ms, over_ms].map(number));
        table.row(cells);
        rows.push(json!({
            "lod": lod, "volume": {"under": under, "exact": exact, "over": over},
            "ms": {"under": under_ms, "exact": exact_ms, "over": over_ms},
        }));
    }
    times.push(("exact".to_owned(), plan.lods.iter().map(|&lod| (f64::from(lod), exact_ms)).collect()));
    Ok(Part {
        name: "lod",
        title: format!("LOD-C: {name}"),
        markdown: table.markdown(),
        text: format!(
            "Sums of the times, and means of the volumes, of three images on one thread. The exact image does not depend on \
             LOD-C and takes {} ms.",
            number(exact_ms)
        ),
        rows: json!(rows),
        plots: vec![
            Plot {
                name: "lod-volume",
                title: "Volume of the estimates, difference from exact",
                x: "LOD-C",
                y: "%",
                series: differences,
            },
            Plot {
                name: "lod-time",
                title: "Sampling time of three images, one thread",
                x: "LOD-C",
                y: "ms",
                series: times,
            },
        ],
    })
}
