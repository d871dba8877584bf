//! The runner of the open Boolean benchmark (solidean/boolean-benchmark-runners, "Runner I/O Contract"): reads a request, computes the
//! meshes of its Booleans, and writes the result with the time of each step.
//!
//! Loading reads a file and proves that its mesh is closed (`io_ms`); the step from indexed triangles to the solid is timed by itself,
//! too (`import_ms`). A Boolean (`operation_ms`) gives the exact mesh where there is one, else the mesh of images of the given number
//! of rays; or always the latter. Results are the meshes that the next operations take, so that there is no time of export.

use std::fs;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

use ldi_ops::{Bound, Settings, Shape, Solid, Unit};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::BenchError;
use crate::process::write_json;

/// How Booleans are computed.
#[derive(Clone, Copy)]
pub struct Plan {
    /// Rays along the longest side where a mesh is made from images.
    pub rays: u32,
    /// Whether every mesh is made from images.
    pub sampled: bool,
}

#[derive(Deserialize)]
struct Request {
    kind: Value,
    version: Value,
    id: Value,
    runs: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    case_id: Value,
    out_dir: PathBuf,
    operations: Vec<Operation>,
}

#[derive(Deserialize)]
struct Operation {
    op: String,
    #[serde(default)]
    path: PathBuf,
    #[serde(default)]
    args: Vec<usize>,
}

/// Why an operation has no result: its status in the contract, and the error.
type Failure = (&'static str, String);

/// Seconds between partial results.
const FLUSH: f64 = 10.0;

/// Runs the cases of a request. The result is written again and again, so that what is done survives the end of the program.
pub fn run(plan: Plan, request: &Path, result: &Path) -> Result<(), BenchError> {
    let text = fs::read_to_string(request).map_err(BenchError::io(request.display().to_string()))?;
    let request: Request = serde_json::from_str(&text).map_err(|error| BenchError::Program {
        program: "boolean-runner".to_owned(),
        said: format!("{}: {error}", request.display()),
    })?;
    let mut runs = Vec::new();
    let mut flushed = Instant::now();
    let write = |runs: &[Value]| {
        let partial = result.with_extension("tmp");
        let document = json!({"kind": request.kind, "version": request.version, "id": request.id, "runs": runs,
            "rays": plan.rays, "sampled": plan.sampled});
        write_json(Some(&partial), &document)?;
        fs::rename(&partial, result).map_err(BenchError::io(result.display().to_string()))
    };
    for case in &request.runs {
        runs.push(plan.run(case));
        if flushed.elapsed().as_secs_f64() > FLUSH {
            write(&runs)?;
            flushed = Instant::now();
        }
    }
    write(&runs)
}

impl Plan {
    /// Runs the operations of a case up to the first that fails.
    fn run(self, case: &Case) -> Value {
        let start = Instant::now();
        let mut solids: Vec<Option<Solid>> = Vec::new();
        let mut operations = Vec::new();
        let mut status = "success";
        for (slot, operation) in case.operations.iter().enumerate() {
            let begin = Instant::now();
            let computed = self.compute(operation, &solids);
            let worked = milliseconds(begin);
            let file = case.out_dir.join(format!("op_{slot}.obj"));
            let written = computed.and_then(|solid| {
                write(solid.as_ref(), &file).map_err(|error| ("invalid_output", error))?;
                Ok(solid)
            });
            let is_load = operation.op == "load-mesh";
            let time = if is_load { "io_ms" } else { "operation_ms" };
            match written {
                Ok(solid) => {
                    let warnings: Vec<String> =
                        solid.iter().flat_map(|solid| solid.warnings()).map(ToString::to_string).collect();
                    let mut row = json!({"status": "success", "debug_total_ms": milliseconds(begin), time: worked,
                        "file": file, "warnings": warnings});
                    if let (true, Some(solid)) = (is_load, &solid) {
                        row["import_ms"] = json!(import_milliseconds(solid));
                    }
                    operations.push(row);
                    solids.push(solid);
                }
                Err((failed, error)) => {
                    operations.push(json!({"status": failed, "debug_total_ms": milliseconds(begin), time: worked,
                        "error": error}));
                    status = failed;
                    break;
                }
            }
        }
        json!({"case_id": case.case_id, "status": status, "duration_ms": milliseconds(start), "ops": operations})
    }

    /// Computes one operation from the solids before it; `None` is the empty solid.
    fn compute(self, operation: &Operation, solids: &[Option<Solid>]) -> Result<Option<Solid>, Failure> {
        if operation.op == "load-mesh" {
            // Requests state no unit. With one, results do not repeat a warning about the unit of every operand so far.
            let solid = Solid::open(&operation.path).map(|solid| solid.unit(Unit::Millimetre));
            return solid.map(Some).map_err(|error| ("invalid_input", error.to_string()));
        }
        let operands: Option<Vec<Option<Shape>>> =
            operation.args.iter().map(|&slot| solids.get(slot).map(|solid| solid.clone().map(Shape::from))).collect();
        let operands = operands.filter(|operands| !operands.is_empty());
        let operands = operands.ok_or(("invalid_input", format!("no such operands: {:?}", operation.args)))?;
        let combine: fn(&Shape, Shape) -> Shape = match operation.op.as_str() {
            "boolean-union" => Shape::union,
            "boolean-intersection" => Shape::intersect,
            "boolean-difference" => Shape::difference,
            other => return Err(("unsupported", format!("no operation {other}"))),
        };
        let is_empty = match operation.op.as_str() {
            "boolean-intersection" => operands.iter().any(Option::is_none),
            "boolean-difference" => operands[0].is_none(),
            _ => false,
        };
        let shape = operands.into_iter().flatten().reduce(|a, b| combine(&a, b)).filter(|_| !is_empty);
        let Some(shape) = shape else { return Ok(None) };
        let settings = Settings::rays(self.rays).fill(ldi_ops::FillRule::NonZero);
        let solid = match self.sampled {
            false => shape.solid(&settings),
            true => shape.sample(&settings).and_then(|sampled| {
                let mesh = sampled.surface()?.within(Bound::ZERO).mesh()?;
                Solid::from_triangles(mesh.positions, mesh.triangles).map(|solid| solid.unit(Unit::Millimetre))
            }),
        };
        match solid {
            Ok(solid) => Ok(Some(solid)),
            // There is no mesh of an empty result, which is a valid one.
            Err(_) if shape.volume(&settings).is_ok_and(|volume| volume.value == 0.0) => Ok(None),
            Err(error) => Err(("invalid_output", error.to_string())),
        }
    }
}

/// Writes a solid, the empty one as a file without triangles, to a folder that may be missing.
fn write(solid: Option<&Solid>, file: &Path) -> Result<(), String> {
    if let Some(folder) = file.parent() {
        fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    match solid {
        Some(solid) => solid.write(file).map_err(|error| error.to_string()),
        None => fs::write(file, "# empty\n").map_err(|error| format!("{}: {error}", file.display())),
    }
}

/// Returns the time from indexed triangles to a solid: copying them, welding equal positions, and the proof that the mesh is closed.
fn import_milliseconds(solid: &Solid) -> f64 {
    let begin = Instant::now();
    let mesh = solid.mesh();
    let imported = Solid::from_triangles(mesh.positions.iter().copied(), mesh.triangles.iter().copied());
    // Freeing it is not part of the import.
    let _imported = black_box(imported);
    milliseconds(begin)
}

fn milliseconds(since: Instant) -> f64 {
    1e3 * since.elapsed().as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_answered_case_by_case() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let cube = |name: &str, x: f64| {
            let corner = |i: u32| [x + f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)];
            let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
            let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
            Solid::from_triangles((0..8).map(corner), triangles).unwrap().write(at(name)).unwrap();
        };
        cube("a.obj", 0.0);
        cube("b.obj", 0.75);
        let load = |name: &str| json!({"op": "load-mesh", "path": at(name), "name": name});
        let boolean = |operation: &str, args: &[usize]| json!({"op": format!("boolean-{operation}"), "args": args});
        let case = |id: &str, operations: &[Value]| json!({"case_id": id, "out_dir": at(id), "bounding_box": {}, "operations": operations});
        let (a, b) = (load("a.obj"), load("b.obj"));
        let runs = [
            case("chain", &[a.clone(), b.clone(), boolean("union", &[0, 1]), boolean("difference", &[2, 0, 0])]),
            case("common", &[a.clone(), b, boolean("intersection", &[0, 1])]),
            case(
                "empty",
                &[a.clone(), boolean("difference", &[0, 0]), boolean("union", &[1, 0]), boolean("difference", &[1, 0])],
            ),
            case("missing", &[load("none.obj"), boolean("union", &[0])]),
            case("strange", &[a.clone(), boolean("xor", &[0])]),
            case("unbound", &[a, boolean("union", &[0, 7])]),
        ];
        let request =
            json!({"kind": "boolean-benchmark", "version": 1, "id": "x-1", "system_snapshot": {}, "runs": runs});
        fs::write(at("request.json"), request.to_string()).unwrap();
        for sampled in [false, true] {
            run(Plan { rays: 64, sampled }, &at("request.json"), &at("result.json")).unwrap();
            let result: Value = serde_json::from_str(&fs::read_to_string(at("result.json")).unwrap()).unwrap();
            assert_eq!((&result["id"], &result["version"]), (&json!("x-1"), &json!(1)));
            let statuses: Vec<&str> =
                result["runs"].as_array().unwrap().iter().map(|run| run["status"].as_str().unwrap()).collect();
            assert_eq!(statuses, ["success", "success", "success", "invalid_input", "unsupported", "invalid_input"]);
            let operations = &result["runs"][2]["ops"];
            let is_empty = |slot: usize| {
                let text = fs::read_to_string(operations[slot]["file"].as_str().unwrap()).unwrap();
                !text.lines().any(|line| line.starts_with("f "))
            };
            assert_eq!([0, 1, 2, 3].map(is_empty), [false, true, false, true]);
            for (id, operations, volume) in [("chain", 4, 0.75), ("common", 3, 0.25)] {
                let run = &result["runs"][if id == "chain" { 0 } else { 1 }];
                let ops = run["ops"].as_array().unwrap();
                assert_eq!(ops.len(), operations);
                assert!(ops[0]["io_ms"].as_f64().unwrap() > 0.0);
                assert!(ops[0]["import_ms"].as_f64().unwrap() > 0.0);
                let last = &ops[operations - 1];
                assert!(last["operation_ms"].as_f64().unwrap() > 0.0);
                let solid = Solid::open(last["file"].as_str().unwrap()).unwrap();
                let found = Shape::from(solid).volume(&Settings::rays(64)).unwrap().value;
                // Exact meshes keep what touches apart, by less than the last bit of an `f32`.
                let tolerance = if sampled { 2e-2 } else { 1e-7 };
                assert!((found - volume).abs() < tolerance, "{id}, {sampled}: {found}");
            }
        }
    }
}
