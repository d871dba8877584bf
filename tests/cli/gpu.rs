//! Runs the program on a GPU. The tests need an adapter, be it a software one, and fail without one.
//!
//! The adapter is the first that is found, or the one that `LDI_ADAPTER` names.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::clash::without_exact_volume;
use crate::sums::{ell, hollow};
use crate::{Folder, Run, cube, cuboid};

/// Returns the arguments that select the adapter of these tests.
fn on_gpu() -> Vec<String> {
    match std::env::var("LDI_ADAPTER") {
        Ok(name) => vec!["--adapter".to_owned(), name],
        Err(_) => vec!["--backend".to_owned(), "gpu".to_owned()],
    }
}

fn model(name: &str) -> String {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/models");
    models.join(name).into_os_string().into_string().unwrap()
}

/// Runs a command on the CPU and on the GPU and asserts that the output is the same, except for the device, the times and the
/// memory. Returns this output.
fn same_on_both(folder: &Folder, arguments: &[&str]) -> Value {
    let gpu_arguments = on_gpu();
    let gpu_arguments: Vec<&str> = gpu_arguments.iter().map(String::as_str).collect();
    let written = ["image.npz", "image.png", "mesh.ply"].map(|name| folder.path(name));
    let image = || written.each_ref().map(|path| if path.exists() { fs::read(path).unwrap() } else { Vec::new() });
    // An exact volume needs no device.
    let has_exact = ["intersect", "union", "difference", "csg", "volume"].contains(&arguments[0]);
    let arguments = &[arguments, if has_exact { &["--estimate"] } else { &[] }].concat()[..];
    let mut cpu = folder.json(&[arguments, &["--backend", "cpu"]].concat());
    let cpu_image = image();
    let mut gpu = folder.json(&[arguments, &gpu_arguments].concat());
    assert!(image() == cpu_image, "{arguments:?}: the images differ");
    assert_eq!((&cpu["backend"], &gpu["backend"]), (&"cpu".into(), &"gpu".into()));
    assert!(!gpu["device"].as_str().unwrap().is_empty() && gpu["device"] != cpu["device"]);
    assert!(gpu["auto"].is_null());
    for result in [&mut cpu, &mut gpu] {
        strip(result);
        // The results of `volume` are a whole object for each solid.
        result["results"].as_array_mut().into_iter().flatten().for_each(strip);
    }
    assert_eq!(cpu, gpu, "{arguments:?}");
    cpu
}

/// Removes the device, the times and the memory from a result.
fn strip(result: &mut Value) {
    for key in ["backend", "device", "auto", "seconds", "peak_memory_bytes"] {
        assert!(result.as_object_mut().unwrap().remove(key).is_some());
    }
    // Only sums have this key.
    result.as_object_mut().unwrap().remove("memory");
}

const MODES: [&str; 3] = ["over", "under", "exact"];
const FILLS: [&str; 2] = ["even-odd", "nonzero"];

#[test]
fn operations_are_equal_on_cpu_and_gpu() {
    let folder = Folder::new();
    let pairs =
        [["gyroid_sheet.stl", "bone.stl"], ["bcc_lattice.stl", "sphere.stl"], ["diamond_network.stl", "torus.stl"]];
    let mut turn = 0;
    for command in ["intersect", "union", "difference"] {
        for mode in MODES {
            for fill in FILLS {
                let [a, b] = pairs[turn % pairs.len()].map(model);
                turn += 1;
                same_on_both(&folder, &[command, &a, &b, "--mode", mode, "--fill", fill, "--resolution", "40"]);
            }
        }
        turn += 1;
    }
    let [a, b] = pairs[0].map(model);
    same_on_both(&folder, &["intersect", &a, &b, "--axis", "y", "--resolution", "150", "-o", "image.npz"]);
}

#[test]
fn clashes_are_equal_on_cpu_and_gpu() {
    let folder = Folder::new();
    folder.stl("a.stl", &without_exact_volume());
    for (name, x) in [("b.stl", -0.5), ("c.stl", 0.25), ("d.stl", 0.5)] {
        folder.stl(name, &cuboid([x, -1.0, -0.25], [x + 1.2, 1.2, 1.1]));
    }
    let clash = |device: &[&str]| {
        let words = ["clash", "a.stl", "b.stl", "c.stl", "d.stl", "--unit", "mm", "--json", "-"];
        let mut result = folder.run(&[&words[..], device].concat()).code(1).json();
        for key in ["seconds", "peak_memory_bytes"] {
            assert!(result.as_object_mut().unwrap().remove(key).is_some());
        }
        result
    };
    let gpu = on_gpu();
    let gpu: Vec<&str> = gpu.iter().map(String::as_str).collect();
    let cpu = clash(&["--backend", "cpu"]);
    let methods = cpu["pairs"].as_array().unwrap().iter().map(|pair| &pair["overlap"]["volume"]["method"]);
    // Those of the part without an exact volume are sampled.
    assert_eq!(methods.filter(|method| **method == "estimate").count(), 3, "{cpu:#}");
    assert_eq!(clash(&gpu), cpu);
}

#[test]
fn meshes_are_equal_on_cpu_and_gpu() {
    let folder = Folder::new();
    let [a, b, c] = ["gyroid_sheet.stl", "bone.stl", "sphere.stl"].map(model);
    for mode in MODES {
        let options = ["--mode", mode, "--resolution", "48", "-o", "mesh.ply"];
        same_on_both(&folder, &[&["difference", &a, &b][..], &options].concat());
        let named = ["a", "b", "c"].iter().zip([&a, &b, &c]).map(|(name, path)| format!("{name}={path}"));
        let named: Vec<String> = named.collect();
        let inputs: Vec<&str> = named.iter().map(String::as_str).collect();
        same_on_both(&folder, &[&["csg", "a & (b | c)"], &inputs[..], &options].concat());
    }
}

#[test]
fn volumes_are_equal_on_cpu_and_gpu() {
    let folder = Folder::new();
    for (solid, fill) in [("bone.stl", "even-odd"), ("bcc_lattice.stl", "even-odd"), ("bcc_lattice.stl", "nonzero")] {
        same_on_both(&folder, &["volume", &model(solid), "--fill", fill, "--resolution", "60"]);
    }
    same_on_both(&folder, &["volume", &model("torus.stl"), "--tolerance", "1%"]);
}

#[test]
fn images_are_equal_on_cpu_and_gpu() {
    let folder = Folder::new();
    for mode in MODES {
        for fill in FILLS {
            let solid = model("bcc_lattice.stl");
            let arguments = ["sample", &solid, "--mode", mode, "--fill", fill, "--resolution", "50", "-o", "image.npz"];
            same_on_both(&folder, &arguments);
        }
    }
}

#[test]
fn open_meshes_are_equal_on_cpu_and_gpu() {
    let folder = Folder::new();
    folder.stl("open.stl", &cube(0.0, 2.0)[1..]);
    same_on_both(&folder, &["volume", "open.stl", "--allow-open", "--resolution", "30"]);
}

#[test]
fn pictures_are_equal_on_cpu_and_gpu() {
    let folder = Folder::new();
    let [gyroid, bone] = ["gyroid_sheet.stl", "bone.stl"].map(model);
    for more in [&["--view", "iso"][..], &["--slice", "x=40%"], &["--fill", "nonzero", "--csg", "b - a"]] {
        let arguments = ["render", &gyroid, &bone, "--size", "120x90", "-o", "image.png"];
        same_on_both(&folder, &[&arguments, more].concat());
    }
    // The picture shows a small part of the first solid.
    let small = cuboid([1.0, 2.0, 3.0], [2.0, 2.5, 3.5]);
    folder.stl("small.stl", &small);
    folder.stl("open.stl", &small[1..]);
    for more in [&["small.stl"][..], &["open.stl", "--allow-open"]] {
        let arguments = ["render", "--csg", "a & b", "--size", "120x90", "-o", "image.png", &gyroid];
        same_on_both(&folder, &[&arguments, more].concat());
    }
}

#[test]
fn sums_are_equal_on_cpu_and_gpu() {
    let folder = Folder::new();
    folder.stl("ell.stl", &ell(1.0));
    folder.stl("hollow.stl", &hollow(4.0, 2.0));
    folder.stl("small.stl", &cuboid([0.0; 3], [0.5, 0.25, 1.0]));
    let turned = ["--transform-b", "rotate(1,2,3,25)"];
    // Over- and under-estimates are summed without primitives; images and meshes have the primitive of every sample.
    for more in [&["--mode", "under"][..], &["--mode", "exact", "-o", "image.npz"], &["-o", "mesh.ply", "--reflect"]] {
        let arguments = [&["minkowski", "ell.stl", "ell.stl", "--resolution", "70"], &turned[..], more].concat();
        assert!(same_on_both(&folder, &arguments)["volume"]["value"].as_f64().unwrap() > 0.0);
    }
    let hollow = [&["minkowski", "hollow.stl", "small.stl", "--resolution", "65"], &turned[..]].concat();
    let sum = same_on_both(&folder, &[&hollow[..], &["-o", "image.npz"]].concat());
    assert_eq!(sum["steps"][0]["components"]["cavities"], 1, "{sum:#}");
    let difference = same_on_both(&folder, &[&hollow[..], &["--difference", "-o", "mesh.ply"]].concat());
    assert!(difference["volume"]["value"].as_f64().unwrap() > 0.0);
}

#[test]
fn offsets_are_equal_on_cpu_and_gpu() {
    let folder = Folder::new();
    folder.stl("ell.stl", &ell(4.0));
    for [command, flag, distance] in
        [["offset", "--distance", "0.5"], ["offset", "--distance", "-0.3"], ["close", "--radius", "0.4"]]
    {
        same_on_both(&folder, &[command, "ell.stl", flag, distance, "--resolution", "60", "-o", "image.npz"]);
    }
}

#[test]
fn sums_beyond_the_limits_of_a_gpu_are_refused() {
    let folder = Folder::new();
    folder.stl("needle.stl", &cuboid([0.0; 3], [0.01, 1.0, 0.01]));
    let name = adapters(&folder)[0]["name"].as_str().unwrap().to_owned();
    folder
        .run(&["minkowski", "absent.stl", "needle.stl", "--adapter", "nonsense"])
        .code(3)
        .says(&["`nonsense`", &name]);
    if adapters(&folder)[0]["kind"] == "software" {
        let long = ["minkowski", "needle.stl", "needle.stl", "--resolution", "2500"];
        folder.run(&[&long[..], &["--adapter", &name]].concat()).code(3).says(&[&name, "rounds", "2500"]);
    }
}

/// Returns the adapters that `devices` lists.
fn adapters(folder: &Folder) -> Vec<Value> {
    folder.json(&["devices"])["devices"].as_array().unwrap()[1..].to_vec()
}

#[test]
fn devices_describes_every_adapter() {
    let folder = Folder::new();
    let adapters = adapters(&folder);
    assert!(!adapters.is_empty(), "these tests need an adapter");
    let text = folder.run(&["devices"]).code(0).stdout();
    for adapter in &adapters {
        assert_eq!(adapter["backend"], "gpu");
        for key in ["name", "kind", "api", "driver"] {
            let value = adapter[key].as_str().unwrap();
            assert!(text.contains(value), "no `{value}` in\n{text}");
        }
        for key in ["buffer_bytes", "binding_bytes", "bindings", "workgroup_invocations", "workgroup_memory_bytes"] {
            assert!(adapter["limits"][key].as_u64().unwrap() > 0, "{key}");
        }
        assert!(adapter["int64"].is_boolean() && adapter["timestamps"].is_boolean());
    }
    for words in ["largest buffer", "largest binding", "64-bit integers", "timestamps"] {
        assert!(text.contains(words), "no `{words}` in\n{text}");
    }
}

#[test]
fn auto_never_chooses_a_software_adapter() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    let adapters = adapters(&folder);
    let hardware = adapters.iter().any(|a| ["discrete", "integrated", "virtual"].iter().any(|kind| a["kind"] == *kind));
    let backend = if hardware { "gpu" } else { "cpu" };
    assert_eq!(folder.json(&["devices"])["auto"]["backend"], backend);
    // Eighteen million crossings, enough that one thread looks for adapters.
    let large = ["volume", "a.stl", "--estimate", "--axis", "z", "--resolution", "3000", "--threads", "1"];
    let result = folder.json(&large);
    let reason = result["auto"]["reason"].as_str().unwrap();
    assert_eq!((&result["backend"], &result["auto"]["backend"]), (&backend.into(), &backend.into()), "{reason}");
    assert!(!reason.contains("too few"), "{reason}");
    if !hardware {
        assert!(reason.contains(adapters[0]["name"].as_str().unwrap()), "{reason}");
    }
    let small = folder.json(&["volume", "a.stl", "--estimate", "--resolution", "300"]);
    assert_eq!(small["backend"], "cpu");
}

#[test]
fn adapters_are_selected_by_part_of_their_name() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    let adapters = adapters(&folder);
    let name = adapters[0]["name"].as_str().unwrap();
    let result =
        folder.json(&["volume", "a.stl", "--estimate", "--resolution", "8", "--adapter", &name.to_uppercase()]);
    assert_eq!(result["backend"], "gpu");
    assert!(result["device"].as_str().unwrap().starts_with(name));
    // The refusal comes before a file is read, so that nobody waits for it.
    folder.run(&["volume", "absent.stl", "--adapter", "nonsense"]).code(3).says(&["`nonsense`", name]);
    folder.run(&["volume", "a.stl", "--backend", "gpu", "--adapter", "nonsense"]).code(3).says(&["`nonsense`", name]);
}

/// Runs a command on a machine whose Vulkan loader finds no driver.
fn without_drivers(folder: &Folder, arguments: &[&str]) -> Run {
    let mut command = folder.command(arguments);
    command.envs([("VK_ICD_FILENAMES", "/nonexistent"), ("VK_DRIVER_FILES", "/nonexistent")]);
    command.env("VK_LOADER_DRIVERS_DISABLE", "*");
    Run { output: command.output().unwrap() }
}

#[test]
#[cfg(target_os = "linux")]
fn machines_without_a_driver_refuse_a_gpu_and_nothing_else() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    let none = ["no GPU was found", "no graphics driver", "the CPU gives the same bits"];
    without_drivers(&folder, &["volume", "a.stl", "--estimate", "--backend", "gpu"]).code(3).says(&none);
    without_drivers(&folder, &["volume", "a.stl", "--estimate", "--adapter", "nonsense"]).code(3).says(&none);
    for backend in ["auto", "cpu"] {
        let large =
            ["volume", "a.stl", "--estimate", "--axis", "z", "--resolution", "3000", "--threads", "1", "--unit", "mm"];
        let run = without_drivers(&folder, &[&large[..], &["--backend", backend]].concat()).code(0);
        assert_eq!(run.stderr(), "");
        let run = without_drivers(&folder, &[&large[..], &["--backend", backend, "-v"]].concat()).code(0);
        assert_eq!(run.stderr().contains("(auto: no GPU was found)"), backend == "auto", "{}", run.stderr());
    }
    let run = without_drivers(&folder, &["devices"]).code(0);
    assert_eq!(run.stderr(), "");
    assert!(
        run.stdout().contains("gpu         none: no GPU was found: there is no graphics driver"),
        "{}",
        run.stdout()
    );
}

#[test]
fn drivers_print_nothing_on_stderr() {
    let folder = Folder::new();
    // As on machines without a desktop.
    let mut command = folder.command(&["devices"]);
    command.env_remove("XDG_RUNTIME_DIR").env_remove("NODEVICE_SELECT");
    assert_eq!(String::from_utf8(command.output().unwrap().stderr).unwrap(), "");
}

#[test]
fn help_texts_explain_how_to_select_a_gpu() {
    let folder = Folder::new();
    assert!(folder.run(&["--help"]).code(0).stdout().contains("--backend gpu"));
    let text = folder.run(&["intersect", "--help"]).code(0).stdout();
    for words in ["--backend gpu", "--adapter <NAME>", "implies --backend gpu", "ldi-ops devices"] {
        assert!(text.contains(words), "no `{words}` in\n{text}");
    }
}
