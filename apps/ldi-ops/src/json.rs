//! JSON output: the schema `ldi-ops/1`.
//!
//! Non-finite numbers become null. Keys of the schema are always present.

use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;

use ldi_ops::driver::backend::Ran;
use ldi_ops::driver::certainty::Judged;
use ldi_ops::driver::device::GpuDevice;
use ldi_ops::driver::input::Solid;
use ldi_ops::driver::machine::{cpu_name, peak_memory_bytes};
use ldi_ops::driver::measured::{Measured, Method, StepReport};
use ldi_ops::driver::render::Rendered;
use ldi_ops::driver::sum::{BetweenRays, Detail};
use ldi_ops::driver::surface::{Made, SurfaceReport};
use ldi_ops::grid::Grid;
use ldi_ops::mesh::check::{Defect, Severity};
use ldi_ops::report::clash;
use ldi_ops::report::files::Reported;
use ldi_ops::report::sweep::Swept;
use ldi_ops::sampler::{Estimate, FillRule, Mode};
use ldi_ops::unit;
use ldi_ops::{Error, Warning};
use serde_json::{Value, json};

use crate::exit::Exit;
use crate::resolve::Report;
use crate::run::{Checked, Converted, Devices, Each, Generated, Outcome, Refused, Surfaced};
use crate::{output, report};

/// The name and version of the schema.
const SCHEMA: &str = "ldi-ops/1";

/// Returns the object of a result.
fn of(outcome: &Outcome) -> Value {
    match outcome {
        Outcome::Measured(results) => measured(results),
        Outcome::Surfaced(result) => surfaced(result),
        Outcome::Checked(results) => checked(results),
        Outcome::Converted(result) => converted(result),
        Outcome::Generated(result) => generated(result),
        Outcome::Devices(result) => devices(result),
        Outcome::Rendered(result) => rendered(result),
        Outcome::Reported(result) => reported(result),
        Outcome::Swept(result) => swept(result),
        Outcome::Compared(result) => json!(clash::record(&result.clashes)),
        Outcome::Text(text) => json!(text),
    }
}

/// Writes a result to the requested place; returns the text for stdout.
pub fn deliver(report: &Report, outcome: &Outcome) -> Result<String, Error> {
    let serialised = || format!("{:#}\n", of(outcome));
    match report {
        Report::Text => Ok(report::of(outcome)),
        Report::Json => Ok(serialised()),
        Report::TextAndJson(path) => {
            let json = serialised();
            output::replace(path, |file| file.write_all(json.as_bytes()))?;
            Ok(report::of(outcome))
        }
    }
}

/// Writes the object of a failed command if JSON was requested; returns the text for stdout.
pub fn deliver_failure(path: &Path, command: Option<&str>, kind: &str, failure: &Error) -> Result<String, Error> {
    let error = error(kind, failure);
    let object = json!({ "schema": SCHEMA, "command": command, "error": error, "warnings": Vec::<Warning>::new() });
    let text = format!("{object:#}\n");
    if path.as_os_str() == "-" {
        return Ok(text);
    }
    // The failure may be that the job must not overwrite this file.
    if !path.exists() || is_result(path) {
        output::replace(path, |file| file.write_all(text.as_bytes()))?;
    }
    Ok(String::new())
}

/// Returns whether a file holds a result of this program.
fn is_result(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(200).read_to_end(&mut start));
    read.is_ok() && String::from_utf8_lossy(&start).contains("\"schema\": \"ldi-ops/")
}

fn error(kind: &str, failure: &Error) -> Value {
    json!({ "kind": kind, "message": failure.to_string(), "exit_code": Exit::from(failure) as i32 })
}

/// Returns the object of a command that processes each input separately: `results` has an object for each input, also for those
/// that failed, and `inputs` and `warnings` cover all inputs.
fn of_each<T>(command: &str, results: &[Each<T>], input: fn(&T) -> Value, one: fn(&T) -> Value) -> Value {
    let inputs: Vec<Value> = results
        .iter()
        .map(|result| result.as_ref().map_or_else(|refused| json!({ "path": path(&refused.path) }), input))
        .collect();
    let objects: Vec<Value> = results
        .iter()
        .map(|result| {
            result.as_ref().map_or_else(
                |Refused { path: file, failure }| {
                    json!({ "path": path(file), "error": error(Exit::from(failure).kind(), failure) })
                },
                one,
            )
        })
        .collect();
    let warnings: Vec<Value> =
        objects.iter().filter_map(|object| object["warnings"].as_array()).flatten().cloned().collect();
    let mut whole = json!({ "schema": SCHEMA, "command": command, "inputs": inputs });
    // The failure of the only input is the failure of the command.
    if let [Err(Refused { failure, .. })] = results {
        whole["error"] = error(Exit::from(failure).kind(), failure);
    }
    whole["results"] = json!(objects);
    whole["warnings"] = json!(warnings);
    whole
}

/// Returns the content of metrics.json, or those of several solids in an envelope.
fn reported(result: &Reported) -> Value {
    let mut objects: Vec<Value> = result.reports.iter().map(|report| json!(report)).collect();
    match (objects.len(), result.failures.as_slice()) {
        (1, []) => objects.remove(0),
        (_, []) => json!({ "schema": SCHEMA, "command": "report", "results": objects }),
        (_, failures) => json!({ "schema": SCHEMA, "command": "report", "results": objects, "failures": failures }),
    }
}

fn swept(result: &Swept) -> Value {
    json!({
        "schema": SCHEMA,
        "command": "sweep",
        "title": result.title,
        "designs": result.rows.len() + result.missing,
        "measured": result.measured,
        "missing": result.missing,
        "failed": result.failed().count(),
        "kept": result.kept(),
        "unresolved": result.unresolved,
        "front": result.front.iter().map(|&i| &result.rows[i]).collect::<Vec<_>>(),
        "failures": result.failed().map(|row| json!({ "parameters": row.parameters, "error": row.error })).collect::<Vec<_>>(),
        "warnings": result.warnings().iter().map(|(code, count)| json!({ "code": code, "designs": count })).collect::<Vec<_>>(),
        "written": result.written.iter().map(|file| path(file)).collect::<Vec<_>>(),
    })
}

/// Returns the object of the results; `volume` lists those of all inputs, and that of a single input also at the top level.
fn measured(results: &[Each<Measured>]) -> Value {
    match results {
        [Ok(result)] if result.measures.is_none() => one_measured(result),
        [Ok(result)] => {
            let mut object = one_measured(result);
            object["results"] = json!([object.clone()]);
            object
        }
        _ => of_each("volume", results, |result| input(&result.solids[0]), one_measured),
    }
}

fn one_measured(result: &Measured) -> Value {
    let unit = result.unit.map(|unit| unit::symbol(unit, 3));
    let mut object = json!({
        "schema": SCHEMA,
        "command": result.command,
        "inputs": result.solids.iter().map(input).collect::<Vec<_>>(),
        "volume": volume(result, unit),
        "grid": grid(&result.grid),
        "layers_max": result.layers,
        "samples": result.samples,
        "unclosed_rays": result.unclosed,
        "backend": result.ran.as_ref().map(Ran::backend),
        "device": result.ran.as_ref().map(device),
        "auto": result.ran.as_ref().and_then(auto),
        "mode": mode(result.mode),
        "fill": fill(result.fill),
        "seconds": result.seconds,
        "peak_memory_bytes": peak_memory_bytes(),
        "warnings": result.warnings,
    });
    if let Some(expression) = &result.expression {
        object["expression"] = json!(expression);
    }
    if let Some(measures) = &result.measures {
        object["area"] = json!(measures.area);
        object["area_error"] = json!(measures.area_error);
        object["centroid"] = json!(measures.centroid.to_array());
        object["inertia"] = json!(measures.inertia.transpose().to_cols_array_2d());
    }
    if let Some(refinement) = &result.refinement {
        object["tolerance"] = json!(refinement);
    }
    if let Some(sum) = &result.sum {
        object["memory"] = json!({ "estimate_bytes": sum.memory_estimate(), "limit_bytes": sum.memory_limit });
        object["steps"] = sum.steps.iter().map(step).collect();
    }
    if let Some(output) = &result.output {
        object["output"] = json!(path(output));
    }
    if let Some(report) = &result.surface {
        object["surface"] = surface(report);
    }
    object
}

/// Returns a volume with its method and bounds.
fn volume(result: &Measured, unit: Option<String>) -> Value {
    let Measured { volume, certified, .. } = result;
    let (method, not_exact) = match volume.method {
        Method::Exact => ("exact", None),
        Method::Estimate(not_exact) => ("estimate", not_exact),
    };
    let [at_least, at_most] = volume.possible;
    let mut object = json!({
        "value": volume.value,
        "estimate_error": volume.error,
        "method": method,
        "exact": volume.exact.map(|[value, _]| value),
        "exact_error": volume.exact.map(|[_, error]| error),
        "not_exact": not_exact.map(|reason| reason.to_string()),
        "rays": volume.rays.map(|rays| json!({ "value": rays.value, "estimate_error": rays.error })),
        "at_least": at_least,
        "at_most": at_most,
        "lower": certified.bounds.map(|[lower, _]| lower),
        "upper": certified.bounds.map(|[_, upper]| upper),
        "unit": unit,
    });
    if !certified.judged.is_empty() {
        object["assertions"] = certified.judged.iter().map(judged).collect();
    }
    object
}

/// Returns the verdict on an assertion.
fn judged(judged: &Judged) -> Value {
    json!({ "kind": judged.side.name(), "value": judged.limit, "verdict": judged.to_string() })
}

/// Returns the statistics of a step of a sum.
fn step(report: &StepReport) -> Value {
    let StepReport { operation, distance, pairs, primitives, sampled, crossings, resolved, between_rays, .. } = report;
    json!({
        "operation": operation,
        "distance": distance,
        "pairs": pairs.map(|pairs| json!({
            "candidates": u64::try_from(pairs.candidates).unwrap_or(u64::MAX),
            "visited": pairs.visited,
            "kept": pairs.kept,
        })),
        "primitives": primitives,
        "sampled": sampled,
        "crossings": crossings,
        "components": { "tested": resolved.components, "cavities": resolved.cavities, "filled": resolved.filled },
        "gaps": { "found": resolved.gaps, "tested": resolved.gaps_tested, "kept": resolved.gaps_out },
        "between_rays": between_rays.as_ref().map(details),
    })
}

/// Returns the details of a step that no ray meets.
fn details(found: &BetweenRays) -> Value {
    let detail = |detail: &Detail| {
        json!({
            "kind": if detail.is_solid { "solid" } else { "cavity" },
            "place": detail.place.to_array(),
            "size": detail.size.to_array(),
            "volume": detail.volume,
        })
    };
    json!({
        "candidates": found.candidates,
        "searched_to": found.searched_to,
        "complete": found.is_complete,
        "details": found.details.iter().map(detail).collect::<Vec<Value>>(),
    })
}

/// Returns the data of a written mesh.
fn surface(report: &SurfaceReport) -> Value {
    let sampled = report.sampled();
    let apart = match report.made {
        Made::Exact(apart) => Some(apart),
        Made::Sampled(_) => None,
    };
    json!({
        "path": report.path.as_deref().map(path),
        "method": if sampled.is_some() { "sampled" } else { "exact" },
        "vertices": report.vertices,
        "triangles": report.triangles,
        "components": report.components,
        "genus": report.genus,
        "volume": report.volume,
        "vertices_merged": apart.map(|apart| apart.merged),
        "vertices_moved": apart.map(|apart| apart.moved),
        "sub_resolution": sampled.map(|report| json!({ "walls": report.walls, "gaps": report.gaps })),
        "finer_blocks": sampled.map(|report| json!({ "count": report.blocks.count, "finest": report.blocks.finest })),
        "disagreements": sampled.map(|report| report.disagreements),
        "largest_distance": sampled.map(|report| report.largest_distance),
        "blunted_vertices": sampled.map(|report| report.blunted),
        "crossing_pairs": sampled.map(|report| report.crossing_pairs),
        "largest_component_share": report.largest_share,
        "recentred": report.recentred.map(|offset| offset.to_array()),
        "dropped_parts": { "count": report.dropped.parts, "volume": report.dropped.volume },
        "simplified": sampled.and_then(|report| report.simplified).map(|simplified| json!({
            "bound": simplified.bound,
            "distance": simplified.distance,
            "triangles_before": simplified.triangles,
        })),
    })
}

fn input(solid: &Solid) -> Value {
    let mut object = json!({
        "path": path(&solid.path),
        "sha256": solid.sha256,
        "triangles": solid.mesh().triangles.len(),
        "closed": solid.is_closed(),
        "oriented": solid.was_oriented(),
        "volume": solid.volume,
    });
    if let Some(name) = &solid.operand {
        object["name"] = json!(name);
    }
    object
}

fn path(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// Returns the choice of `auto` and its reason.
fn auto(ran: &Ran) -> Option<Value> {
    ran.auto.as_ref().map(|auto| json!({ "backend": ran.backend(), "reason": auto.reason }))
}

/// Returns the name of the GPU, or of the processor with its number of threads.
fn device(ran: &Ran) -> String {
    let cpu = || {
        let threads = rayon::current_num_threads();
        format!("{}, {threads} threads", cpu_name().as_deref().unwrap_or("CPU"))
    };
    ran.gpu.clone().unwrap_or_else(cpu)
}

/// Returns the name of a mode, as in the flag.
pub fn mode(mode: Mode) -> &'static str {
    match mode {
        Mode::Exact => "exact",
        Mode::Estimate(Estimate::Over) => "over",
        Mode::Estimate(Estimate::Under) => "under",
    }
}

/// Returns the name of a fill rule, as in the flag.
pub fn fill(fill: FillRule) -> &'static str {
    match fill {
        FillRule::EvenOdd => "even-odd",
        FillRule::NonZero => "nonzero",
    }
}

/// Returns the object of `surface`.
fn surfaced(result: &Surfaced) -> Value {
    let [read, total] = result.seconds;
    let mut object = json!({
        "schema": SCHEMA,
        "command": "surface",
        "input": { "path": path(&result.from), "samples": result.samples },
        "grid": grid(&result.grid),
        "unit": result.unit.map(|unit| unit::symbol(unit, 1)),
        "output": result.output.as_deref().map(path),
        "seconds": { "read": read, "total": total },
        "peak_memory_bytes": result.peak_memory,
        "warnings": result.warnings,
    });
    if let Some(report) = &result.surface {
        object["surface"] = surface(report);
    }
    object
}

fn grid(grid: &Grid) -> Value {
    json!({
        "pitch": grid.pitch(),
        "rays": grid.rays(),
        "lod": grid.lod(),
        "quantisation": grid.quantisation(),
    })
}

/// Returns the object of `check`.
fn checked(results: &[Each<Checked>]) -> Value {
    let input = |result: &Checked| json!({ "path": path(&result.path), "sha256": result.sha256 });
    of_each("check", results, input, |result| {
        let report = &result.report;
        json!({
            "path": path(&result.path),
            "sha256": result.sha256,
            "solid": report.is_solid(),
            "closed": report.is_closed(),
            "oriented": report.is_oriented(),
            "triangles": report.triangles,
            "vertices": report.vertices,
            "edges": report.edges,
            "components": report.components,
            "shells": report.shells,
            "volume": report.signed_volume,
            "area": report.area,
            "unit": result.unit.map(|unit| unit::symbol(unit, 1)),
            "bounds": report.bounds.map(|bounds| json!({ "min": bounds.min.to_array(), "max": bounds.max.to_array() })),
            "euler_characteristic": report.euler_characteristic,
            "genus": report.genus,
            "defects": report.defects().iter().map(defect).collect::<Vec<_>>(),
            "warnings": result.warnings,
        })
    })
}

fn defect(defect: &Defect) -> Value {
    let severity = match defect.severity() {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Note => "note",
    };
    json!({ "code": defect.code(), "severity": severity, "count": defect.count(), "message": defect.to_string() })
}

/// Returns the object of `convert`.
fn converted(result: &Converted) -> Value {
    json!({
        "schema": SCHEMA,
        "command": "convert",
        "input": { "path": path(&result.from), "sha256": result.sha256 },
        "output": {
            "path": path(&result.to),
            "triangles": result.triangles,
            "recentred": result.recentred.map(|offset| offset.to_array()),
            "unit": result.unit.map(|unit| unit::symbol(unit, 1)),
        },
        "warnings": result.warnings,
    })
}

/// Returns the object of `generate`.
fn generated(result: &Generated) -> Value {
    json!({
        "schema": SCHEMA,
        "command": "generate",
        "kind": result.kind,
        "output": { "path": path(&result.to), "triangles": result.triangles, "unit": "mm" },
        "bounds": result.bounds.map(|bounds| json!({ "min": bounds.min.to_array(), "max": bounds.max.to_array() })),
        "volume": result.volume,
        "area": result.area,
        "warnings": result.warnings,
    })
}

/// Returns the object of `render`.
fn rendered(result: &Rendered) -> Value {
    let grid = &result.grid;
    json!({
        "schema": SCHEMA,
        "command": "render",
        "inputs": result.solids.iter().map(input).collect::<Vec<_>>(),
        "output": {
            "path": path(&result.to),
            "width": result.width,
            "height": result.height,
            "pixel": result.pixel,
            "scale_bar": result.scale_bar,
            "unit": result.unit.map(|unit| unit::symbol(unit, 1)),
        },
        "view": result.view.to_string(),
        "plane": result.plane.map(|(axis, at)| json!({ "axis": axis.name(), "at": at })),
        "grid": { "pitch": grid.pitch(), "rays": grid.rays(), "quantisation": grid.quantisation() },
        "samples": result.samples,
        "unclosed_rays": result.unclosed,
        "backend": result.ran.backend(),
        "device": device(&result.ran),
        "auto": auto(&result.ran),
        "fill": fill(result.fill),
        "seconds": result.seconds,
        "peak_memory_bytes": peak_memory_bytes(),
        "warnings": result.warnings,
    })
}

/// Returns the object of `devices`.
fn devices(devices: &Devices) -> Value {
    let mut each = vec![json!({ "backend": "cpu", "name": devices.cpu, "threads": devices.threads })];
    each.extend(devices.gpus.iter().map(gpu_device));
    json!({
        "schema": SCHEMA,
        "command": "devices",
        "devices": each,
        "gpu": { "built": devices.gpu_built, "message": devices.no_gpu },
        "auto": { "backend": devices.auto.backend, "reason": devices.auto.reason },
        "warnings": Vec::<Warning>::new(),
    })
}

fn gpu_device(gpu: &GpuDevice) -> Value {
    json!({
        "backend": "gpu",
        "name": gpu.name,
        "kind": gpu.kind,
        "api": gpu.api,
        "driver": gpu.driver,
        "limits": {
            "buffer_bytes": gpu.largest_buffer,
            "binding_bytes": gpu.largest_binding,
            "bindings": gpu.bindings,
            "workgroup_invocations": gpu.workgroup,
            "workgroup_memory_bytes": gpu.workgroup_memory,
        },
        "int64": gpu.int64,
        "timestamps": gpu.timestamps,
    })
}
