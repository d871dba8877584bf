//! The library gives the very numbers of the command line.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use ldi_ops::{Axes, Axis, Backend, Error, FillRule, Limits, Mode, Report, Settings, Shape, Solid, Unit, Verdict};
use serde_json::Value;

use crate::{Folder, assert_near, cube};

/// A gyroid and a ball of different units, and a brush.
fn models() -> Folder {
    let folder = Folder::new();
    let gyroid = ["generate", "gyroid", "--cells", "2", "--cell-size", "4", "--wall", "0.8", "--resolution", "12"];
    folder.run(&[&gyroid[..], &["-o", "a.3mf"]].concat()).code(0);
    folder.run(&["generate", "sphere", "--radius", "3", "-o", "b.stl"]).code(0);
    folder.run(&["generate", "cubic", "--cells", "2", "--radius", "0.5", "-o", "c.stl"]).code(0);
    folder
}

fn solid(folder: &Folder, name: &str) -> Solid {
    Solid::open(folder.path(name)).unwrap()
}

/// Holds an estimate to the `volume` of a JSON result.
fn assert_same(estimate: &ldi_ops::Estimate, json: &Value) {
    // The reader of JSON may be off by the last bit.
    let is_near = |json: &Value, value: f64| (json.as_f64().unwrap() - value).abs() <= f64::EPSILON * value.abs();
    let volume = &json["volume"];
    assert!(is_near(&volume["value"], estimate.value), "{volume} {estimate}");
    assert!(is_near(&volume["estimate_error"], estimate.error), "{volume} {estimate}");
}

#[test]
fn the_first_program_of_the_interface_prints_what_the_command_line_prints() {
    let folder = models();
    let common = solid(&folder, "a.3mf").intersect(solid(&folder, "b.stl")).sample(&Settings::rays(64)).unwrap();
    common.surface().unwrap().write(folder.path("common.stl")).unwrap();
    let job = ["intersect", "a.3mf", "b.stl", "--resolution", "64", "--mode", "exact", "--estimate", "-o", "same.stl"];
    let json = folder.json(&job);
    assert_same(&common.volume(), &json);
    let [ours, theirs] = ["common.stl", "same.stl"].map(|name| std::fs::read(folder.path(name)).unwrap());
    assert_eq!(ours, theirs);
    let printed = folder.run(&job[..8]).code(0).stdout();
    assert!(printed.contains(&common.volume().to_string()), "{printed} {}", common.volume());
}

#[test]
fn expressions_by_operators_methods_and_text_are_one() {
    let folder = models();
    let [a, b, c] = ["a.3mf", "b.stl", "c.stl"].map(|name| solid(&folder, name));
    let settings = Settings::rays(48);
    let part = (&a & &(&b | &c)) - &c.offset(-0.1);
    assert!(part.volume(&settings).unwrap().value > 0.0);
    let operators = (&a & &(&b | &c)) ^ &b;
    let methods = a.intersect(b.union(&c)).xor(&b);
    let text = Shape::parse("(a & (b | c)) ^ b", [("a", &a), ("b", &b), ("c", &c)]).unwrap();
    let json = folder.json(&[
        "csg",
        "(a & (b | c)) ^ b",
        "a=a.3mf",
        "b=b.stl",
        "c=c.stl",
        "--resolution",
        "48",
        "--mode",
        "exact",
    ]);
    for shape in [operators, methods, text] {
        assert_same(&shape.volume(&settings).unwrap(), &json);
    }
    let wrong = Shape::parse("a & & b", [("a", &a), ("b", &b)]).unwrap_err();
    assert!(wrong.to_string().contains("character 5"), "{wrong}");
}

#[test]
fn single_solids_have_exact_volumes_and_their_images_estimates() {
    let folder = models();
    let a = solid(&folder, "a.3mf");
    let json = folder.json(&["volume", "a.3mf", "--resolution", "40"]);
    let volume = a.volume(&Settings::rays(40)).unwrap();
    assert_same(&volume, &json);
    assert_eq!(volume.method, ldi_ops::Method::Exact);
    for (mode, word) in [(Mode::Exact, "exact"), (Mode::OVER, "over"), (Mode::UNDER, "under")] {
        let settings =
            Settings::pitch(0.2).mode(mode).axes(Axes::Z).fill(FillRule::NonZero).backend(Backend::Cpu).threads(2);
        let sampled = a.sample(&settings).unwrap();
        let job =
            ["sample", "a.3mf", "--pitch", "0.2", "--mode", word, "--axis", "z", "--fill", "nonzero", "-o", "a.npz"];
        assert_same(&sampled.volume(), &folder.json(&job));
        sampled.write(folder.path("b.npz")).unwrap();
        let [ours, theirs] = ["b.npz", "a.npz"].map(|name| std::fs::read(folder.path(name)).unwrap());
        assert!(ours == theirs, "{word}");
        assert!(sampled.image(Axis::Z).is_some() && sampled.image(Axis::X).is_none());
        assert!(sampled.surface().is_err());
    }
}

#[test]
fn sums_and_offsets_are_those_of_the_command_line() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    folder.stl("b.stl", &cube(0.0, 0.5));
    let [a, b] = ["a.stl", "b.stl"].map(|name| solid(&folder, name));
    let settings = Settings::rays(32).memory_limit(2 << 30);
    let cases: [(Shape, &[&str]); 5] = [
        (a.minkowski_sum(&b), &["minkowski", "a.stl", "b.stl"]),
        (a.minkowski_difference(&b), &["minkowski", "a.stl", "b.stl", "--difference"]),
        (a.offset(0.2), &["offset", "a.stl", "--distance", "0.2"]),
        (a.open(0.5), &["open", "a.stl", "--radius", "0.5"]),
        (a.close(0.5), &["close", "a.stl", "--radius", "0.5"]),
    ];
    for (shape, job) in cases {
        let json = folder.json(&[job, &["--resolution", "32", "--mode", "exact"]].concat());
        let sampled = shape.sample(&settings).unwrap();
        assert_same(&sampled.volume(), &json);
        assert_same(&shape.volume(&settings).unwrap(), &json);
    }
    assert!(matches!(a.offset(0.0).volume(&settings), Err(Error::Usage(_))));
    let refined = a.offset(0.1).volume(&Settings::tolerance(0.002).memory_limit(2 << 30)).unwrap();
    let json = folder.json(&["offset", "a.stl", "--distance", "0.1", "--mode", "exact", "--tolerance", "0.2%"]);
    assert_same(&refined, &json);
}

#[test]
fn bounds_are_those_of_the_command_line() {
    let folder = Folder::with_two_cubes();
    let [a, b] = ["a.stl", "b.stl"].map(|name| solid(&folder, name));
    let settings = Settings::rays(32).bounds(true);
    let cases: [(Shape, &[&str]); 4] = [
        (&a & &b, &["intersect", "a.stl", "b.stl"]),
        (&a ^ &b, &["xor", "a.stl", "b.stl"]),
        (a.minkowski_sum(&b), &["minkowski", "a.stl", "b.stl"]),
        (a.offset(0.2), &["offset", "a.stl", "--distance", "0.2"]),
    ];
    for (shape, job) in cases {
        let json = folder.json(&[job, &["--resolution", "32", "--bounds"]].concat());
        let volume = shape.volume(&settings).unwrap();
        let [lower, upper] = volume.bounds.unwrap();
        for (key, ours) in [("lower", lower), ("upper", upper)] {
            // JSON is read with an error of a unit in the last place.
            assert_near(ours, json["volume"][key].as_f64().unwrap(), 1e-14 * upper);
        }
        assert_eq!(
            (volume.is_below(upper + 1.0), volume.is_above(upper + 1.0)),
            (Verdict::Certain, Verdict::CertainlyNot)
        );
        assert_eq!(shape.volume(&Settings::rays(32)).unwrap().bounds, None);
    }
    assert!(matches!((&a.offset(0.1) & &b).volume(&settings), Err(Error::Usage(_))));
    assert!(a.close(0.1).volume(&settings).is_err());
}

#[test]
fn reports_are_those_of_the_command_line() {
    let folder = models();
    std::fs::write(folder.path("limits.toml"), "porosity = { min = \"1 %\" }\n").unwrap();
    let [a, b] = ["a.3mf", "b.stl"].map(|name| solid(&folder, name));
    let limits = Limits::open(folder.path("limits.toml")).unwrap();
    let report = Report::of(&a).region(&b).limits(&limits).measure(&Settings::rays(32)).unwrap();
    let job = ["report", "a.3mf", "--roi", "b.stl", "--limits", "limits.toml", "--resolution", "32", "-o", "report"];
    let json = folder.json(&job);
    for metric in json["metrics"].as_array().unwrap() {
        let ours = &report[metric["id"].as_str().unwrap()];
        let theirs = metric["value"].as_f64();
        let difference = ours.value.zip(theirs).map_or(0.0, |(a, b)| (a - b).abs() / b.abs().max(f64::MIN_POSITIVE));
        assert!(ours.value.is_some() == theirs.is_some() && difference <= f64::EPSILON, "{metric} {ours}");
    }
    assert_eq!(json["verdict"]["passed"].as_bool(), Some(report.verdict().unwrap().passed));
    // The last region counts.
    let hull = Report::of(&a).region(&b).within_hull().measure(&Settings::rays(32)).unwrap();
    let json = folder.json(&["report", "a.3mf", "--roi", "hull", "--resolution", "32", "-o", "hull"]);
    assert_eq!(hull.scaffold_report().provenance.region, json["provenance"]["region"]);
    let misspelt = Limits::parse("porosty = { min = \"1 %\" }").unwrap_err();
    assert!(misspelt.to_string().contains("porosity"), "{misspelt}");
    report.write(folder.path("ours")).unwrap();
    for name in ["report.html", "metrics.json", "metrics.csv", "methods.txt"] {
        assert!(folder.path("ours").join(name).is_file(), "{name}");
    }
    assert!(report["porosity"].to_string().contains('%'), "{}", report["porosity"]);
}

#[test]
fn meshes_that_are_open_are_an_error_with_all_their_defects() {
    let folder = Folder::new();
    let mut open = cube(0.0, 1.0);
    open.pop();
    folder.stl("open.stl", &open);
    match Solid::open(folder.path("open.stl")) {
        Err(Error::NotClosed(mesh)) => {
            assert_eq!(mesh.report.open_edges.count, 3);
            assert!(mesh.to_string().contains("open.stl: the mesh is not closed"), "{mesh}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn solids_from_triangles_take_units_and_placements() {
    let folder = models();
    let mesh = solid(&folder, "b.stl").mesh().clone();
    let ball = Solid::from_triangles(mesh.positions, mesh.triangles).unwrap().unit(Unit::Metre);
    let settings = Settings::rays(16);
    let volume = ball.volume(&settings).unwrap();
    let scaled = ball.clone().transformed(glam::DAffine3::from_scale(glam::DVec3::splat(2.0)));
    let twice = scaled.volume(&settings).unwrap();
    assert!((twice.value / volume.value - 8.0).abs() < 1e-12);
    assert!(volume.to_string().ends_with(" m³ (exact)"), "{volume}");
    // The first solid says the unit.
    let both = scaled.intersect(solid(&folder, "b.stl").unit(Unit::Millimetre)).volume(&settings).unwrap();
    assert!(both.value < 1e-6 * volume.value && both.unit == Some(Unit::Metre), "{both}");
}

#[test]
fn triangles_that_face_either_way_are_turned_for_the_even_odd_rule_alone() {
    let mesh = ldi_ops::solids::geodesic(3.0, 4).unwrap();
    let of =
        |triangles: &[[u32; 3]]| Solid::from_triangles(mesh.positions.iter().copied(), triangles.to_vec()).unwrap();
    let mut mixed = mesh.triangles.clone();
    mixed.iter_mut().step_by(3).for_each(|triangle| triangle.swap(0, 1));
    let volume = |solid: &Solid, fill: FillRule| solid.volume(&Settings::default().fill(fill));
    let (plain, mixed) =
        (of(&mesh.triangles), of(&mixed).transformed(glam::DAffine3::from_scale(glam::DVec3::splat(2.0))));
    let [expected, found] = [&plain, &mixed].map(|solid| volume(solid, FillRule::EvenOdd).unwrap());
    assert!(found.to_string().ends_with("(exact)"), "{found}");
    assert_near(found.value, 8.0 * expected.value, 1e-12 * found.value);
    let refused = volume(&mixed, FillRule::NonZero).unwrap_err().to_string();
    assert!(refused.contains("consistently oriented") && refused.contains("--fill even-odd"), "{refused}");
}

#[test]
fn a_listener_stops_any_operation() {
    struct Stop;
    impl ldi_ops::Progress for Stop {
        fn update(&self, _: &str, _: u64, _: u64) -> std::ops::ControlFlow<()> {
            std::ops::ControlFlow::Break(())
        }
    }
    let folder = models();
    let [a, b] = ["a.3mf", "b.stl"].map(|name| solid(&folder, name));
    let settings = Settings::rays(32).progress(&Stop);
    for shape in [a.intersect(&b), a.minkowski_sum(&b), a.offset(0.1), a.close(0.2), Shape::from(&a)] {
        assert_eq!(shape.sample(&settings).unwrap_err(), Error::Cancelled);
    }
    assert_eq!(Report::of(&a).measure(&settings).unwrap_err(), Error::Cancelled);
}

/// A listener that stops an operation at a moment.
struct StopAt(Instant);

impl ldi_ops::Progress for StopAt {
    fn update(&self, _: &str, _: u64, _: u64) -> ControlFlow<()> {
        if Instant::now() < self.0 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }
}

#[test]
fn operations_stopped_at_random_moments_leave_no_file_and_change_no_later_result() {
    // Smaller than the other models: a hundred operations of some tenths of a second.
    let folder = Folder::new();
    let gyroid = ["generate", "gyroid", "--cells", "1", "--cell-size", "4", "--wall", "0.8", "--resolution", "8"];
    folder.run(&[&gyroid[..], &["-o", "a.3mf"]].concat()).code(0);
    folder.run(&["generate", "sphere", "--radius", "3", "--segments", "12", "-o", "b.stl"]).code(0);
    let [a, b] = ["a.3mf", "b.stl"].map(|name| solid(&folder, name));
    type Operation<'o> = &'o dyn Fn(&StopAt) -> Result<(), Error>;
    let written = |shape: &Shape, rays: u32, progress: &StopAt| {
        let sampled = shape.sample(&Settings::rays(rays).progress(progress))?;
        sampled.surface()?.progress(progress).write(folder.path("result.stl")).map(drop)
    };
    let operations: [Operation; 4] = [
        &|progress| written(&a.intersect(&b), 64, progress),
        &|progress| written(&a.minkowski_sum(&b), 48, progress),
        &|progress| written(&a.close(0.4), 32, progress),
        &|progress| {
            Report::of(&a).measure(&Settings::rays(12).progress(progress))?.write(folder.path("report")).map(drop)
        },
    ];
    let before = folder.names();
    let result = |name: &str| std::fs::read(folder.path(name)).unwrap();
    for (operation, file) in
        operations.into_iter().zip(["result.stl", "result.stl", "result.stl", "report/metrics.csv"])
    {
        let start = Instant::now();
        operation(&StopAt(start + Duration::from_secs(3600))).unwrap();
        let (whole, expected) = (start.elapsed(), result(file));
        let remove = || {
            drop(std::fs::remove_file(folder.path("result.stl")));
            drop(std::fs::remove_dir_all(folder.path("report")));
        };
        remove();
        let mut stopped = 0;
        for round in 0..30 {
            // The fractional parts of multiples of the golden ratio fill the duration evenly.
            let moment = whole.mul_f64((0.618_033_988_749_895 * f64::from(round)).fract());
            match operation(&StopAt(Instant::now() + moment)) {
                Ok(()) => remove(),
                Err(error) => {
                    assert_eq!(error, Error::Cancelled);
                    stopped += 1;
                }
            }
            assert_eq!(folder.names(), before);
        }
        assert!(stopped > 0, "no round was stopped");
        operation(&StopAt(Instant::now() + Duration::from_secs(3600))).unwrap();
        assert!(result(file) == expected, "{file} has changed");
        remove();
    }
}

#[test]
fn voxels_are_the_nodes_that_the_images_have_inside() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    let voxels = solid(&folder, "a.stl").sample(&Settings::rays(8)).unwrap().voxels();
    assert_eq!((voxels.size, voxels.values.iter().map(|&v| u32::from(v)).sum::<u32>()), ([8; 3], 512));
    assert!((voxels.spacing - 0.25).abs() < 1e-12 && (voxels.origin.x - 0.125).abs() < 1e-6);
}

#[test]
fn solids_of_shapes_are_the_meshes_of_the_command_line() {
    let folder = models();
    let [a, b] = ["a.3mf", "b.stl"].map(|name| solid(&folder, name));
    let settings = Settings::rays(48);
    let common = (&a & &b).solid(&settings).unwrap();
    common.write(folder.path("ours.off")).unwrap();
    folder.run(&["intersect", "a.3mf", "b.stl", "-o", "theirs.off"]).code(0);
    let [ours, theirs] = ["ours.off", "theirs.off"].map(|name| std::fs::read_to_string(folder.path(name)).unwrap());
    assert_eq!(ours, theirs);
    assert_eq!(common.length_unit(), Some(Unit::Millimetre));

    let grown = b.offset(0.25).solid(&settings).unwrap();
    let radius = 3.25_f64;
    let ball = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    assert_near(grown.volume(&settings).unwrap().value, ball, 0.02 * ball);
    let nothing = (&b - &b).solid(&settings);
    assert!(matches!(nothing, Err(Error::Input(_))), "{nothing:?}");
    assert!(grown.picture(64, 48).unwrap().starts_with(b"\x89PNG"));
    assert!(matches!(grown.picture(8, 48), Err(Error::Usage(_))));
}

#[test]
fn thickness_and_coverage_are_those_of_a_plate() {
    let folder = Folder::new();
    folder.run(&["generate", "cuboid", "--min", "0,0,0", "--max", "4,4,1", "-o", "plate.stl"]).code(0);
    let plate = solid(&folder, "plate.stl").sample(&Settings::rays(40)).unwrap();
    let thickness = plate.thickness().unwrap();
    assert_eq!(thickness.len(), 40 * 40 * 10);
    // A ball that touches both sides reaches all but the edges.
    let whole = thickness.iter().filter(|&&thickness| (thickness - 1.0).abs() < 0.02).count();
    assert!(
        whole as f64 > 0.9 * 16000.0 && thickness.iter().all(|&thickness| (0.0..1.02).contains(&thickness)),
        "{whole}"
    );
    let inside: f32 = plate.coverage().unwrap().iter().sum();
    assert_near(f64::from(inside) * 0.1_f64.powi(3), 16.0, 1e-3);
    let along_z = solid(&folder, "plate.stl").sample(&Settings::rays(40).axes(Axes::Z)).unwrap();
    assert!(matches!(along_z.thickness(), Err(Error::Usage(_))));
}
