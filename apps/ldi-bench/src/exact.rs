//! Exact volumes and meshes: from two mesh files to the exact volume of their intersection, or to its mesh in a third file, ldi-ops
//! beside programs that compute the mesh of the Boolean.
//!
//! The programs take turns and are timed as in [`process`]. Every volume is stated with its difference from that of
//! ldi-ops.

use std::path::Path;

use ldi_ops::boolean::{BooleanOperation, Expression};
use ldi_ops::exact;
use ldi_ops::mesh::{ClosedMesh, io};
use ldi_ops::sampler::FillRule;
use serde_json::{Map, Value, json};

use crate::BenchError;
use crate::machine::{self, Machine};
use crate::models;
use crate::process::{self, Entry, Plan, compete, number_at, write_json, write_models};
use crate::table::{Table, count, number};

/// The intersections, by title and files.
const CONTESTS: [(&str, [&str; 2]); 4] = [
    ("Gyroid scaffold ∩ bone", ["gyroid", "bone"]),
    ("Geodesic frame ∩ organic solid", ["geodesic", "organic"]),
    ("Brush ∩ chain mail", ["brush", "chain"]),
    ("Strut lattice ∩ the same lattice, shifted", ["lattice", "lattice-shifted"]),
];

/// The peers of this benchmark. trueform computes in the type of its points, so that its `f64` is as accurate as the others.
const PEERS: [&str; 4] = ["manifold3d", "trueform", "trueform-f64", "meshlib"];

/// Runs the benchmark of volumes and prints the tables.
pub fn run(plan: &Plan, json: Option<&Path>) -> Result<(), BenchError> {
    println!("### Exact volumes\n\n`ldi-bench exact --runs {} --peer-runs {}`\n", plan.runs, plan.peer_runs);
    contests(plan, json, None)
}

/// Runs the benchmark of meshes and prints the tables.
pub fn run_meshes(plan: &Plan, json: Option<&Path>) -> Result<(), BenchError> {
    println!("### Exact meshes\n\n`ldi-bench meshes --runs {} --peer-runs {}`\n", plan.runs, plan.peer_runs);
    contests(plan, json, Some("out.stl"))
}

/// Runs the contests, to the file of the given name or to the volume.
fn contests(plan: &Plan, json: Option<&Path>, out: Option<&str>) -> Result<(), BenchError> {
    let folder = tempfile::tempdir().map_err(BenchError::io("a folder for the models"))?;
    write_models(folder.path(), "exact-models")?;
    let load_before = machine::load();
    let flags = if out.is_some() { ["--mesh", "exact"].as_slice() } else { &["--exact"] };
    let path = out.map(|out| folder.path().join(out));
    let mut contests = Vec::new();
    for (title, [a, b]) in CONTESTS {
        let files = [a, b].map(|name| models::file(folder.path(), name));
        let (entries, told) = compete(plan, &files, (flags, path.as_deref()), &PEERS)?;
        let triangles = [0, 1].map(|input| number_at(&told, &format!("/inputs/{input}/triangles")) as u64);
        let to_file = out.map(|out| format!(" -o {out}")).unwrap_or_default();
        println!(
            "#### {title}\n\n`ldi-ops intersect {a}.stl {b}.stl {}{to_file}`, {} and {} triangles\n",
            flags.join(" "),
            count(triangles[0]),
            count(triangles[1])
        );
        println!("{}", table(&entries, out.is_some()).markdown());
        contests.push(
            json!({"a": a, "b": b, "triangles": triangles, "volume": told.pointer("/volume").unwrap_or(&Value::Null),
            "programs": entries}),
        );
    }
    println!(
        "ldi-ops: the whole process from its start to its end, reading included. Peers: steps within one process that has \
         imported all it needs; memory is that of the whole process. The difference is that of the volume, relative to ldi-ops.\n"
    );
    let machine = Machine::ask_after(load_before);
    println!("{}", machine.describe());
    write_json(json, &json!({"runs": plan.runs, "machine": machine, "contests": contests}))
}

fn table(entries: &[Entry], has_meshes: bool) -> Table {
    let own = &entries[0];
    let names: &[_] =
        if has_meshes { &["write ms", "triangles", "difference"] } else { &["volume mm³", "difference"] };
    process::table(entries, names, |entry| {
        let difference = match std::ptr::eq(entry, own) {
            true => "–".to_owned(),
            false => format!("{:.0e}", entry.volume / own.volume - 1.0),
        };
        match has_meshes {
            true => {
                let write = entry.write.map_or("–".to_owned(), |seconds| number(1e3 * seconds));
                vec![write, count(entry.triangles), difference]
            }
            false => vec![format!("{:.10}", entry.volume), difference],
        }
    })
}

/// Returns volume and area of the intersection, the union and the difference of two files under the non-zero rule, each with a bound
/// of its error, or the reason why they are not known.
pub fn properties(files: [&Path; 2]) -> Result<Value, BenchError> {
    let [a, b] = files.map(|file| {
        let name = file.display().to_string();
        let mesh = io::read(file).map_err(|error| BenchError::model(&name, error))?.mesh;
        ClosedMesh::check(mesh).map_err(|error| BenchError::model(&name, error))
    });
    let (a, b) = (a?, b?);
    let operations = [
        ("intersection", BooleanOperation::Intersection),
        ("union", BooleanOperation::Union),
        ("difference", BooleanOperation::Difference),
    ];
    let results: Map<String, Value> = operations
        .into_iter()
        .map(|(name, operation)| {
            let expression = Expression::of_inputs(operation, 2);
            let result = match exact::mass_properties(&[&a, &b], &expression, FillRule::NonZero) {
                Ok(found) => json!({"volume": found.mass.volume, "volume_error": found.mass.volume_rounding,
                    "area": found.mass.area, "area_error": found.area_error}),
                Err(reason) => json!({"not_exact": reason.to_string()}),
            };
            (name.to_owned(), result)
        })
        .collect();
    Ok(Value::Object(results))
}
