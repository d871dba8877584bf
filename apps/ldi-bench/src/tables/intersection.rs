//! Intersections of two detailed solids at three placements.

use glam::DVec3;
use ldi_ops::boolean::{BooleanOperation, merge};
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Estimate, FillRule, MaskIntersection, Mode};
use serde_json::json;

use super::lod::mean_volume;
use super::{LOD, Part, Plan, Pools, images, timed};
use crate::BenchError;
use crate::models::{self, quantise};
use crate::rivals::contact_volume;
use crate::table::{Table, number};

/// The distances between the centres of the two solids along x, as shares of the longest side.
const SHIFTS: [f64; 3] = [0.0, 0.25, 0.5];

/// Intersects a gyroid scaffold and an organic solid of the same size, by ours and by image-based contact, on one thread.
pub fn placements(plan: &Plan, pools: &Pools) -> Result<Part, BenchError> {
    let ways = ["exact", "over", "under", "contact"];
    let mut heads = vec!["shift"];
    let names = ways.map(|way| format!("{way} mm³"));
    heads.extend(names.iter().flat_map(|volume| [volume.as_str(), "ms"]));
    let mut table = Table::new(&heads);
    let mut rows = Vec::new();
    let [fineness, organic_fineness] = plan.intersected;
    let gyroid = models::build("gyroid", &[("wall", "2"), ("resolution", fineness)])?;
    let gyroid = models::closed("gyroid", gyroid)?;
    let organic = models::build("organic", &[("resolution", organic_fineness)])?;
    let organic_box = models::closed("organic", organic.clone())?.bounds();
    let longest = gyroid.bounds().extent().max_element();
    let scale = longest / organic_box.extent().max_element();
    for shift in SHIFTS {
        let centre = |bounds: ldi_ops::mesh::Aabb| 0.5 * (bounds.min + bounds.max);
        let place = centre(gyroid.bounds()) + DVec3::X * (shift * longest);
        let mut placed = organic.clone();
        placed.positions.iter_mut().for_each(|p| *p = place + scale * (*p - centre(organic_box)));
        let placed = models::closed("organic", placed)?;
        let grid = Grid::with_resolution(gyroid.bounds().union(placed.bounds()), plan.resolution, LOD);
        let grid = grid.map_err(|error| BenchError::model("gyroid and organic", error))?;
        let (a, b) = (quantise("gyroid", &gyroid, &grid)?, quantise("organic", &placed, &grid)?);
        let common = a.bounds().intersection(b.bounds());
        let (a, b) = (a.within(&common), b.within(&common));
        let exact = || {
            let merge = |(a, b)| merge(BooleanOperation::Intersection, a, b).expect("both images have the same grid");
            let (a, b) = (images(&a, Mode::Exact), images(&b, Mode::Exact));
            mean_volume(&a.iter().zip(&b).map(merge).collect::<Vec<_>>())
        };
        let estimate = |estimate: Estimate| {
            let sampler = CpuSampler::default();
            let image =
                |axis: Axis| sampler.sample_intersection([&a, &b], axis, estimate, FillRule::EvenOdd).expect("closed");
            mean_volume(&Axis::ALL.map(image))
        };
        let methods: [&(dyn Fn() -> f64 + Sync); 4] =
            [&exact, &|| estimate(Estimate::Over), &|| estimate(Estimate::Under), &|| contact_volume([&a, &b])];
        let results = methods.map(|method| timed(plan, &pools.one, method));
        let mut cells = vec![format!("{} %", number(100.0 * shift))];
        cells.extend(results.iter().flat_map(|&(volume, ms)| [format!("{volume:.3}"), number(ms)]));
        table.row(cells);
        let named = |value: fn((f64, f64)) -> f64| -> serde_json::Map<_, _> {
            ways.into_iter().zip(results).map(|(way, result)| (way.to_owned(), json!(value(result)))).collect()
        };
        rows.push(json!({
            "shift": shift, "triangles": [a.triangles().len(), b.triangles().len()],
            "volume": named(|result| result.0), "ms": named(|result| result.1),
        }));
    }
    Ok(Part {
        name: "intersections",
        title: "Intersection of a gyroid and an organic solid".to_owned(),
        markdown: table.markdown(),
        text: format!(
            "{} and {} triangles, one thread, three axes, from two quantised meshes to a volume. The organic solid is shifted \
             along x by a share of the longest side. Contact is the image-based volume contact of Faure and others (2008) with \
             layers from depth peeling. The published figures of intersections are not at hand.",
            rows[0]["triangles"][0], rows[0]["triangles"][1]
        ),
        rows: json!(rows),
        plots: Vec::new(),
    })
}
