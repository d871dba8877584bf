//! The device that the program reports and the reason for its choice, for any build and machine.

use crate::{Folder, cube};

fn with_cube() -> Folder {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    folder
}

#[test]
fn devices_states_the_choice_of_auto_and_its_reason() {
    let folder = Folder::new();
    let text = folder.run(&["devices", "--threads", "2"]).code(0).stdout();
    for words in ["cpu         ", "2 threads\n", "\ngpu         ", "\nauto        ", "the same bits"] {
        assert!(text.contains(words), "no `{words}` in\n{text}");
    }
    let result = folder.json(&["devices", "--threads", "2"]);
    assert_eq!(result["devices"][0]["threads"], 2);
    assert_eq!(result["gpu"]["built"], cfg!(feature = "gpu"));
    let gpus = result["devices"].as_array().unwrap().len() - 1;
    assert_eq!(result["gpu"]["message"].is_null(), gpus > 0);
    assert!(!result["auto"]["reason"].as_str().unwrap().is_empty());
}

#[test]
fn json_states_autos_choice_only_where_auto_chose() {
    let folder = with_cube();
    let small = folder.json(&["volume", "a.stl", "--estimate", "--resolution", "8"]);
    assert_eq!((&small["backend"], &small["auto"]["backend"]), (&"cpu".into(), &"cpu".into()));
    let reason = small["auto"]["reason"].as_str().unwrap();
    let expected =
        if cfg!(feature = "gpu") { "are too few to open a GPU for" } else { "this build has no GPU sampler" };
    assert!(reason.contains(expected), "{reason}");
    let asked = folder.json(&["volume", "a.stl", "--estimate", "--resolution", "8", "--backend", "cpu"]);
    assert_eq!((&asked["backend"], &asked["device"]), (&"cpu".into(), &small["device"]));
    assert!(asked["auto"].is_null());
    let arguments = ["volume", "a.stl", "--estimate", "--resolution", "8", "--backend", "cpu", "--threads", "2", "-v"];
    let text = folder.run(&arguments).stderr();
    assert!(text.contains("\nldi-ops: backend     cpu, 2 threads\n"), "{text}");
}

#[test]
#[cfg(not(feature = "gpu"))]
fn builds_without_a_gpu_sampler_refuse_a_gpu() {
    let folder = with_cube();
    let absent = "this build has no GPU sampler";
    // The refusal comes before a file is read, so that nobody waits for it.
    folder.run(&["volume", "absent.stl", "--backend", "gpu"]).code(3).says(&["--backend gpu", absent]);
    folder.run(&["minkowski", "absent.stl", "a.stl", "--backend", "gpu"]).code(3).says(&["--backend gpu", absent]);
    folder.run(&["volume", "a.stl", "--adapter", "Any"]).code(3).says(&["--adapter Any", absent]);
    let text = folder.run(&["devices"]).code(0).stdout();
    assert!(text.contains(&format!("gpu         none: {absent}\nauto        cpu: {absent}\n")), "{text}");
    assert_eq!(folder.json(&["devices"])["gpu"]["message"], absent);
}
