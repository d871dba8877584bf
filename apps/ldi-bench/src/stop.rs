//! Measures the time from a request to stop, at a random moment, to the end of the operation.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use glam::{DAffine3, DVec3};
use ldi_ops::{Error, Mode, Progress, Report, Settings, Shape, Solid};
use serde_json::{Value, json};

use crate::BenchError;
use crate::clock::median;
use crate::machine::Machine;
use crate::models;
use crate::process::write_json;
use crate::table::{Table, number};

/// A listener that stops an operation at a moment, and remembers the stage it was in.
struct Stopper {
    at: Instant,
    stage: Mutex<String>,
}

impl Progress for Stopper {
    fn update(&self, stage: &str, _: u64, _: u64) -> ControlFlow<()> {
        if Instant::now() < self.at {
            stage.clone_into(&mut self.stage.lock().expect("no listener panics"));
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    }
}

/// The solids that operations are tried on.
struct Models {
    gyroid: Solid,
    shifted: Solid,
    lattice: Solid,
    organic: Solid,
    ball: Solid,
}

impl Models {
    fn build() -> Result<Models, BenchError> {
        let solid = |kind: &str, parameters: &[(&str, &str)]| {
            let mesh = models::build(kind, parameters)?;
            Solid::from_triangles(mesh.positions, mesh.triangles).map_err(|error| BenchError::model(kind, error))
        };
        let gyroid = solid("gyroid", &[("resolution", "26")])?;
        Ok(Models {
            shifted: gyroid.clone().transformed(DAffine3::from_translation(DVec3::new(3.1, 2.3, 1.7))),
            gyroid,
            lattice: solid("bcc", &[("cells", "8")])?,
            organic: solid("organic", &[])?,
            ball: solid("geodesic", &[("radius", "2"), ("frequency", "5")])?,
        })
    }
}

/// An operation that takes seconds, into a folder.
struct Operation {
    name: &'static str,
    run: fn(&Models, &dyn Progress, &Path) -> Result<(), Error>,
}

/// Writes the surface of a shape.
fn written(shape: &Shape, settings: &Settings, progress: &dyn Progress, path: &Path) -> Result<(), Error> {
    shape.sample(settings)?.surface()?.progress(progress).write(path).map(drop)
}

const OPERATIONS: [Operation; 10] = [
    Operation {
        name: "volume",
        run: |models, progress, _| models.gyroid.volume(&Settings::rays(1024).progress(progress)).map(drop),
    },
    Operation {
        name: "tolerance",
        run: |models, progress, _| {
            models.lattice.intersect(&models.gyroid).volume(&Settings::tolerance(1e-4).progress(progress)).map(drop)
        },
    },
    Operation {
        name: "intersect",
        run: |models, progress, _| {
            models.gyroid.intersect(&models.shifted).sample(&Settings::rays(1024).progress(progress)).map(drop)
        },
    },
    Operation {
        name: "csg-over",
        run: |models, progress, _| {
            let shape = (&*models.gyroid ^ &*models.shifted) - &*models.lattice;
            shape.volume(&Settings::rays(768).mode(Mode::OVER).progress(progress)).map(drop)
        },
    },
    Operation {
        name: "mesh",
        run: |models, progress, folder| {
            let shape = models.gyroid.intersect(&models.shifted);
            written(&shape, &Settings::rays(512).progress(progress), progress, &folder.join("mesh.stl"))
        },
    },
    Operation {
        name: "simplify",
        run: |models, progress, folder| {
            let sampled = models.organic.intersect(&models.gyroid).sample(&Settings::rays(256).progress(progress))?;
            let surface = sampled.surface()?.simplified(0.02).progress(progress);
            surface.write(folder.join("simple.obj")).map(drop)
        },
    },
    Operation {
        name: "minkowski",
        run: |models, progress, folder| {
            let sum = models.organic.minkowski_sum(&models.ball);
            written(&sum, &Settings::rays(512).progress(progress), progress, &folder.join("sum.stl"))
        },
    },
    Operation {
        name: "offset",
        run: |models, progress, _| models.gyroid.offset(0.2).volume(&Settings::rays(768).progress(progress)).map(drop),
    },
    Operation {
        name: "close",
        run: |models, progress, _| models.gyroid.close(0.4).volume(&Settings::rays(256).progress(progress)).map(drop),
    },
    Operation {
        name: "report",
        run: |models, progress, folder| {
            let report = Report::of(&models.gyroid).measure(&Settings::rays(192).progress(progress))?;
            report.write(folder.join("report"))
        },
    },
];

/// Seconds between the request to stop and the end, and the stage that ran.
struct Stop {
    seconds: f64,
    stage: String,
}

/// Stops each operation at random moments and prints how long it went on.
pub fn run(only: &[String], rounds: usize, json: Option<&Path>) -> Result<(), BenchError> {
    let names = || OPERATIONS.iter().map(|operation| operation.name).collect::<Vec<_>>().join(", ");
    if let Some(wrong) = only.iter().find(|name| OPERATIONS.iter().all(|operation| operation.name != **name)) {
        return Err(BenchError::model(wrong, format!("there is no such operation; the operations are {}", names())));
    }
    let models = Models::build()?;
    let machine = Machine::ask();
    let mut table = Table::new(&["operation", "whole s", "stopped", "median ms", "longest ms", "in stage"]);
    let mut results = Vec::new();
    for operation in OPERATIONS.iter().filter(|operation| only.is_empty() || only.iter().any(|n| n == operation.name)) {
        let (whole, stops) = measure(operation, &models, rounds)?;
        let longest = stops.iter().max_by(|a, b| a.seconds.total_cmp(&b.seconds));
        let (longest, stage) = longest.map_or((f64::NAN, ""), |stop| (stop.seconds, stop.stage.as_str()));
        let middle = median(stops.iter().map(|stop| stop.seconds).collect());
        table.row(vec![
            operation.name.to_owned(),
            number(whole),
            stops.len().to_string(),
            number(1e3 * middle),
            number(1e3 * longest),
            stage.to_owned(),
        ]);
        results.push(json!({
            "operation": operation.name,
            "whole_seconds": whole,
            "stops": stops.iter().map(|stop| json!({"seconds": stop.seconds, "stage": stop.stage})).collect::<Vec<Value>>(),
        }));
    }
    println!(
        "### Stopping\n\n`ldi-bench stop --rounds {rounds}`: from the moment at which the listener begins to answer that it"
    );
    println!("wants to stop, until the call has returned; the listener is asked every 50 ms\n");
    println!("{}", table.markdown());
    println!("{}", machine.describe());
    write_json(json, &json!({"rounds": rounds, "machine": machine, "operations": results}))
}

/// Returns the time of the whole operation, and its stops.
fn measure(operation: &Operation, models: &Models, rounds: usize) -> Result<(f64, Vec<Stop>), BenchError> {
    let folder = tempfile::tempdir().map_err(BenchError::io("a folder for results"))?;
    let failed = |error: Error| BenchError::model(operation.name, error);
    let far = Stopper { at: Instant::now() + Duration::from_secs(3600), stage: Mutex::default() };
    let start = Instant::now();
    (operation.run)(models, &far, folder.path()).map_err(failed)?;
    let whole = start.elapsed().as_secs_f64();
    let mut stops = Vec::new();
    for round in 0..rounds {
        let folder = tempfile::tempdir().map_err(BenchError::io("a folder for results"))?;
        // The fractional parts of multiples of the golden ratio fill the duration evenly.
        let share = (0.5 + 0.618_033_988_749_895 * round as f64).fract();
        let stopper =
            Stopper { at: Instant::now() + Duration::from_secs_f64(0.97 * share * whole), stage: Mutex::default() };
        match (operation.run)(models, &stopper, folder.path()) {
            // It was done before it could be stopped.
            Ok(()) => continue,
            Err(Error::Cancelled) => {}
            Err(error) => return Err(failed(error)),
        }
        let seconds = stopper.at.elapsed().as_secs_f64();
        let left = fs::read_dir(folder.path()).map_err(BenchError::io("the folder of results"))?.count();
        if left > 0 {
            return Err(BenchError::model(operation.name, format!("{left} files are left behind")));
        }
        stops.push(Stop { seconds, stage: stopper.stage.into_inner().expect("no listener panics") });
    }
    Ok((whole, stops))
}
