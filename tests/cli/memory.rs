//! Jobs without enough memory: the program refuses them before it takes the memory, or ends with a message if an allocation
//! fails.

use std::process::Command;

use serde_json::Value;

use crate::{Folder, Run, Triangle, cuboid, warning_codes};

/// Plates that each ray along z crosses, in a cube of side 100.
fn plates(count: usize) -> Vec<Triangle> {
    let plate = |i: usize| {
        let z = 100.0 * i as f64 / count as f64;
        cuboid([0.0, 0.0, z], [100.0, 100.0, z + 50.0 / count as f64])
    };
    (0..count).flat_map(plate).collect()
}

/// Runs ldi-ops with an address space of this many kilobytes.
///
/// The allocator has one arena: each further one, which a thread takes or not as threads meet, reserves 64 MiB of the address
/// space, so that two runs would have different limits.
fn run_within(folder: &Folder, kilobytes: u32, arguments: &str) -> Run {
    let program = assert_cmd::cargo::cargo_bin!("ldi-ops").display().to_string();
    let script = format!("ulimit -v {kilobytes}; exec '{program}' {arguments} --threads 2");
    let mut command = Command::new("sh");
    command.current_dir(folder.folder.path()).args(["-c", &script]);
    command.envs([("RUST_BACKTRACE", "1"), ("MALLOC_ARENA_MAX", "1")]);
    Run { output: command.output().unwrap() }
}

#[test]
fn images_that_do_not_fit_are_refused_with_a_resolution_that_fits() {
    let folder = Folder::new();
    folder.stl("a.stl", &plates(100));
    for job in ["volume a.stl --estimate --axis z --resolution 20000", "sample a.stl --resolution 1500 -o a.npz"] {
        let run = run_within(&folder, 500_000, job).code(3).says(&["GB of memory", "--resolution", "would fit"]);
        let stderr = run.stderr();
        let proposed: u32 = stderr.split("--resolution ").nth(1).unwrap().split(',').next().unwrap().parse().unwrap();
        assert!((100..1500).contains(&proposed), "{stderr}");
        assert_eq!(folder.names(), ["a.stl"]);
        let (job, _) = job.split_once(" --resolution").unwrap();
        let output = if job.starts_with("sample") { "-o a.npz" } else { "" };
        run_within(&folder, 500_000, &format!("{job} --resolution {proposed} {output}")).code(0);
    }
    run_within(&folder, 500_000, "render a.stl -o a.png --size 8192x8192 --samples 4").code(3).says(&["--size"]);
}

#[test]
fn exact_volumes_that_do_not_fit_are_refused_or_estimated_with_a_warning() {
    let folder = Folder::new();
    folder.stl("a.stl", &plates(200));
    let across: Vec<Triangle> =
        plates(200).into_iter().map(|triangle| triangle.map(|[x, y, z]| [z + 0.03, x - 1.0, y + 1.0])).collect();
    folder.stl("b.stl", &across);
    // 40,000 pairs of plates meet, each in more than ten segments.
    let run = |arguments: &str| folder.run(&arguments.split(' ').collect::<Vec<_>>());
    let job = "intersect a.stl b.stl --unit mm --resolution 16 --axis z --memory";
    run(&format!("{job} 100M --exact")).code(3).says(&["exact volume needs about", "MB of memory", "without --exact"]);
    let estimate = run(&format!("{job} 100M --json out.json")).code(0);
    let estimate = estimate.warns(&["exact volume needs about", "--memory allows 100 MB, so it is estimated"]);
    assert!(!estimate.stdout().contains("(exact)"), "{}", estimate.stdout());
    let told: Value = serde_json::from_str(&std::fs::read_to_string(folder.path("out.json")).unwrap()).unwrap();
    assert_eq!(told["volume"]["method"], "estimate");
    assert!(warning_codes(&told).contains(&"exact-volume-memory"), "{told:#}");
    let exact = run(&format!("{job} 1G")).code(0);
    assert!(exact.stdout().contains("(exact)"), "{}", exact.stdout());
    // Between what the volume needs and what the mesh needs, only the mesh comes from images.
    let refused = run(&format!("{job} 100M --exact")).code(3).stderr();
    let needed = refused.split("needs about ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
    let between = 1.1 * needed.parse::<f64>().unwrap();
    let meshed = format!("intersect a.stl b.stl --unit mm --resolution 16 -o out.stl --memory {between:.0}M");
    run(&format!("{meshed} --json out.json")).warns(&["exact mesh needs about", "so the mesh is made from images"]);
    let told: Value = serde_json::from_str(&std::fs::read_to_string(folder.path("out.json")).unwrap()).unwrap();
    assert_eq!([&told["volume"]["method"], &told["surface"]["method"]], ["exact", "sampled"], "{told:#}");
    assert!(warning_codes(&told).contains(&"exact-mesh-memory"), "{told:#}");
    run(&format!("{meshed} --mesh exact")).code(3).says(&["exact mesh needs about", "without --mesh exact"]);
}

#[test]
fn pictures_that_do_not_fit_are_left_out_or_refused() {
    let folder = Folder::new();
    folder.stl("a.stl", &cuboid([0.0; 3], [1.0; 3]));
    folder.stl("b.stl", &cuboid([0.75; 3], [2.0; 3]));
    let clash = ["clash", "a.stl", "b.stl", "--unit", "mm", "-o", "out", "--memory"];
    folder
        .run(&[&clash[..], &["30M"]].concat())
        .code(1)
        .warns(&["a.stl and b.stl have no picture", "allows 30 MB; raise --memory"]);
    let page = |folder: &Folder| std::fs::read_to_string(folder.path("out/clash.html")).unwrap();
    assert!(!page(&folder).contains("data:image/png"));
    folder.run(&[&clash[..], &["1G"]].concat()).code(1);
    assert!(page(&folder).contains("data:image/png"));
    let report = ["report", "a.stl", "--unit", "mm", "--resolution", "16", "-o", "report", "--memory"];
    folder.run(&[&report[..], &["40M"]].concat()).code(3).says(&["the images of ", "allows 40 MB; raise --memory"]);
    assert!(!folder.path("report").exists());
    folder.run(&[&report[..], &["1G"]].concat()).code(0);
}

#[test]
fn common_volumes_of_parts_that_do_not_fit_are_estimated_with_a_warning() {
    let folder = Folder::new();
    folder.stl("a.stl", &plates(200));
    let across = plates(200).into_iter().map(|triangle| triangle.map(|[x, y, z]| [z + 0.03, x - 1.0, y + 1.0]));
    folder.stl("b.stl", &across.collect::<Vec<_>>());
    let run = |memory: f64| {
        let memory = format!("{memory:.0}M");
        let arguments = ["clash", "a.stl", "b.stl", "--unit", "mm", "--resolution", "64", "--threads", "2"];
        let run = folder.run(&[&arguments[..], &["--memory", &memory, "--json", "out.json"]].concat()).code(1);
        let told: Value = serde_json::from_str(&std::fs::read_to_string(folder.path("out.json")).unwrap()).unwrap();
        (run, told)
    };
    let (refused, told) = run(100.0);
    let stderr = refused.stderr();
    let needed: f64 =
        stderr.split("needs about ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap().parse().unwrap();
    refused.warns(&[
        "the exact common volume of a.stl and b.stl needs about",
        "--memory allows 100 MB, so it is estimated",
    ]);
    assert_eq!(told["pairs"][0]["overlap"]["volume"]["method"], "estimate", "{told:#}");
    assert!(warning_codes(&told).contains(&"exact-volume-memory"), "{told:#}");
    // Room for one such pair, and not for two at once.
    let (_, exact) = run(1.2 * needed);
    assert_eq!(exact["pairs"][0]["overlap"]["volume"]["method"], "exact", "{exact:#}");
    assert_eq!(warning_codes(&exact), Vec::<&str>::new());
    let volumes = [told, exact].map(|told| told["pairs"][0]["overlap"]["volume"]["value"].as_f64().unwrap());
    assert!((volumes[0] / volumes[1] - 1.0).abs() < 0.05, "{volumes:?}");
}

#[test]
fn failed_allocations_end_with_a_message_and_code_three() {
    let folder = Folder::new();
    let run = run_within(&folder, 150_000, "generate gyroid --cells 20 -o a.stl").code(3).says(&["out of memory"]);
    assert!(!run.stderr().contains("backtrace"), "{}", run.stderr());
    assert!(folder.names().is_empty());
}

#[test]
fn files_larger_than_the_limit_are_refused() {
    let folder = Folder::new();
    // The file is sparse: it takes no room on the disk.
    std::fs::File::create(folder.path("big.stl")).unwrap().set_len(1 << 30).unwrap();
    run_within(&folder, 800_000, "check big.stl").code(3).says(&["big.stl", "do not fit into memory"]);
}
