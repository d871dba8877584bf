//! The command `sweep`.

use std::fs;
use std::path::Path;

use crate::Folder;

const PLAN: &str = "\
model = \"hollow-box\"
limits = \"limits.toml\"

[parameters]
size = [[3, 3, 3], [4, 4, 4]]
hollow = [\"1,1,1\", \"2000um,2,2\", \"9,9,9\"]

[settings]
resolution = 12
";

fn planned() -> Folder {
    let folder = Folder::new();
    fs::write(folder.path("plan.toml"), PLAN).unwrap();
    fs::write(folder.path("limits.toml"), "porosity = { max = 0.2 }").unwrap();
    folder
}

/// Returns the names of the rows and their contents, sorted.
fn rows(folder: &Path) -> Vec<(String, String)> {
    let entries = fs::read_dir(folder.join("rows")).unwrap().map(|entry| entry.unwrap());
    let mut rows: Vec<(String, String)> = entries
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read_to_string(entry.path()).unwrap()))
        .collect();
    rows.sort();
    rows
}

#[test]
fn a_sweep_is_a_table_a_page_and_a_row_for_each_design() {
    let folder = planned();
    let run = folder.run(&["sweep", "plan.toml", "-o", "runs"]).code(0);
    let text = run.stdout();
    assert!(text.starts_with("sweep       6 designs of hollow-box; 4 measured now\n"), "{text}");
    assert!(text.contains("2 failed") && text.contains("limits      3 of 4 designs keep them"), "{text}");
    run.warns(&["2 of 6 designs could not be measured; the first, size 3,3,3, hollow 9,9,9: "]);
    let table = fs::read_to_string(folder.path("runs/sweep.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines.len(), 7);
    assert!(
        lines[0].contains(
            "design,size,hollow,limits,front,not measured because,not resolved,warnings,volume.total [mm^3],"
        ),
        "{}",
        lines[0]
    );
    assert!(lines[2].contains(",\"3,3,3\",\"2000um,2,2\",broken,,,"), "{}", lines[2]);
    // (2/3)³ of the box is hollow.
    assert!(lines[2].contains(&(8.0f64 / 27.0).to_string()[..8]), "{}", lines[2]);
    let page = fs::read_to_string(folder.path("runs/index.html")).unwrap();
    for said in
        ["3 of 4 measured designs keep their limits", "Pareto front", "<polyline class=\"design", "Not measured"]
    {
        assert!(page.contains(said), "{said}");
    }
    let json = folder.json(&["sweep", "plan.toml", "-o", "runs"]);
    // Only failed designs are tried again.
    assert_eq!((&json["measured"], &json["failed"], &json["kept"]), (&0.into(), &2.into(), &3.into()));
    assert_eq!(json["failures"][0]["parameters"]["hollow"], "9,9,9");
    assert!(json["failures"][0]["error"].as_str().unwrap().contains("hollow"), "{}", json["failures"]);
    let best = &json["front"][0];
    assert_eq!(best["metrics"]["porosity"]["status"], "measured");
    assert_eq!((&best["plan"]["model"], &best["plan"]["settings"]["resolution"]), (&"hollow-box".into(), &12.into()));
}

#[test]
fn a_sweep_without_a_folder_has_one_named_after_its_plan() {
    let folder = planned();
    let run = folder.run(&["sweep", "plan.toml"]).code(0);
    assert!(run.stdout().contains("plan-sweep/index.html") && run.stdout().contains("plan-sweep/sweep.csv"));
    assert_eq!(rows(&folder.path("plan-sweep")).len(), 6);
    // A second run finds the rows.
    assert_eq!(folder.json(&["sweep", "plan.toml"])["measured"], 0);
}

#[test]
fn parts_in_one_folder_give_the_files_of_a_whole_run() {
    let folder = planned();
    folder.run(&["sweep", "plan.toml", "-o", "whole", "--threads", "1"]).code(0);
    let run = folder.run(&["sweep", "plan.toml", "-o", "parts", "--shard", "2/2"]).code(0);
    assert!(run.stdout().contains("3 of other parts are not measured yet"), "{}", run.stdout());
    assert!(!folder.path("parts/sweep.csv").exists());
    folder.run(&["sweep", "plan.toml", "-o", "parts", "--shard", "1/2"]).code(0);
    for name in ["sweep.csv", "index.html"] {
        let [a, b] = ["whole", "parts"].map(|of| fs::read(folder.path(of).join(name)).unwrap());
        assert!(a == b, "{name}");
    }
    assert_eq!(rows(&folder.path("whole")), rows(&folder.path("parts")));

    // A plan that has grown leaves the table of the former one until all parts have run.
    fs::write(folder.path("plan.toml"), PLAN.replace("[3, 3, 3],", "[3, 3, 3], [5, 5, 5],")).unwrap();
    let run = folder.run(&["sweep", "plan.toml", "-o", "parts", "--shard", "2/2"]).code(0);
    assert!(run.stdout().contains("the table in the folder is of an earlier run"), "{}", run.stdout());
}

#[test]
fn what_the_raster_does_not_resolve_is_named() {
    let folder = Folder::new();
    let plan = "model = \"gyroid\"\nregion = \"wrap:1mm\"\n[parameters]\ncells = 1\ncell-size = 4\n\
        wall = { from = \"400um\", to = 0.5, steps = 2 }\n[settings]\nresolution = 10\n";
    fs::write(folder.path("plan.toml"), plan).unwrap();
    let run = folder.run(&["sweep", "plan.toml", "-o", "runs"]).code(0);
    let text = run.stdout();
    assert!(text.contains("2 left out, whose values the raster does not resolve"), "{text}");
    assert!(text.contains("warnings    ") && text.contains("thin-walls in 2"), "{text}");
    let page = fs::read_to_string(folder.path("runs/index.html")).unwrap();
    for said in ["2 designs took no part", "region wrap:1mm · resolution 10"] {
        assert!(page.contains(said), "{said}");
    }
}

#[test]
fn plans_and_parts_that_cannot_be_run_are_refused() {
    let folder = planned();
    folder.run(&["sweep", "missing.toml", "-o", "runs"]).code(2).says(&["missing.toml: "]);
    folder.run(&["sweep", "plan.toml", "-o", "runs", "--shard", "3/2"]).code(2).says(&["--shard", "3/200"]);
    fs::write(folder.path("wrong.toml"), PLAN.replace("hollow =", "holow =")).unwrap();
    folder.run(&["sweep", "wrong.toml", "-o", "runs"]).code(2).says(&["wrong.toml: ", "holow", "size, hollow"]);
    for (parameters, said) in [
        ("[parameters]\nsize = [3, 3, 3]", "[[1, 1, 2]]"),
        ("[parameters]\nsize = nan", "size is not a finite number"),
        ("[parameters]\nsize = { from = \"3 lines\", to = 4, steps = 2 }", "3 lines is not a number"),
        ("[[design]]\nsize = 3\n[[design]]\nhollow = 1", "[[design]] 1 and 2 do not both have hollow"),
    ] {
        fs::write(folder.path("wrong.toml"), format!("model = \"hollow-box\"\n{parameters}\n")).unwrap();
        folder.run(&["sweep", "wrong.toml", "-o", "runs"]).code(2).says(&["wrong.toml: ", said]);
    }
    fs::write(folder.path("none.toml"), PLAN.replace("[\"1,1,1\", \"2000um,2,2\", \"9,9,9\"]", "\"9,9,9\"")).unwrap();
    folder.run(&["sweep", "none.toml", "-o", "none"]).code(2).warns(&["2 of 2 designs could not be measured"]);
    folder.run(&["sweep", "none.toml", "-o", "part", "--shard", "1/2"]).code(0).warns(&["1 of 1 designs could not be"]);
    let small = folder.run(&["sweep", "plan.toml", "-o", "small", "--memory", "1K"]).code(3);
    small.says(&["4 of 6 designs could not be measured on this machine"]);
    assert!(!folder.path("runs/rows").exists());
}
