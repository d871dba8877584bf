//! Tables of the GPU benchmark.

use ldi_ops::gpu::{Adapter, AdapterKind, Costs};
use serde_json::{Value, json};

use super::{Case, LOD, Moved, Plan, READ_BACK, Stage, WAYS};
use crate::table::{Table, count, number};

/// Stages that share a column of the table by model; the others are the rest.
const GROUPS: [(&str, &[&str]); 5] = [
    ("clear", &["clear"]),
    ("masks / cover", &["masks", "cover"]),
    ("classify / sort, resolve", &["classify", "sort", "resolve"]),
    ("scan", &["scan"]),
    ("retrieve / place", &["retrieve", "place"]),
];

/// Prints the command, the device and its bandwidth.
pub fn print_head(plan: &Plan, adapter: &Adapter, copies: &[(u64, f64)]) {
    let mut command = format!("ldi-bench gpu --rounds {} --resolution {}", plan.rounds, plan.resolution);
    if let Some(name) = &plan.adapter {
        command += &format!(" --adapter '{name}'");
    }
    if !plan.models.is_empty() {
        command += &format!(" --models '{}'", plan.models.join(","));
    }
    println!("### The GPU's sampler\n\n`{command}`\n");
    let (limits, has) = (&adapter.limits, |has: bool| if has { "yes" } else { "no" });
    println!("- adapter: {} ({}, {}), driver {}", adapter.name, adapter.kind.name(), adapter.api, adapter.driver);
    println!(
        "- limits: {} bytes a buffer, {} bytes a binding, {} bindings, {} invocations and {} bytes a workgroup; 64-bit \
         integers: {}, timestamps: {}",
        count(limits.buffer),
        count(limits.binding),
        limits.bindings,
        limits.workgroup,
        count(limits.workgroup_memory.into()),
        has(adapter.int64),
        has(adapter.timestamps),
    );
    let copy = |(bytes, bandwidth): &(u64, f64)| format!("{} MiB: {}", bytes >> 20, number(1e-9 * bandwidth));
    let copies: Vec<String> = copies.iter().map(copy).collect();
    println!("- copies from buffer to buffer, GB/s, read and write counted: {}\n", copies.join(", "));
    if adapter.kind == AdapterKind::Software {
        println!(
            "**This adapter is software and runs on the processor: its figures say nothing about GPUs.** They only show \
             that the benchmark runs.\n"
        );
    }
    if !adapter.timestamps {
        println!(
            "**This adapter cannot time its stages:** `whole` is the wall time of three calls of `sample`, with all that \
             the host does for them, and so are the ratios made of it.\n"
        );
    }
}

/// Prints what single operations take.
pub fn print_costs(costs: &Costs) {
    let mut table = Table::new(&["operation", "time"]);
    let mut row = |operation: &str, seconds: f64| {
        let time = match seconds {
            seconds if seconds >= 1e-6 => format!("{} µs", number(1e6 * seconds)),
            seconds => format!("{} ns", number(1e9 * seconds)),
        };
        table.row(vec![operation.to_owned(), time]);
    };
    row("submission of an empty dispatch, waited for", costs.submission);
    row("one more empty dispatch", costs.dispatch);
    row("atomic addition, scattered", costs.scattered_addition);
    row("atomic addition to one word", costs.shared_addition);
    if let Some(seconds) = costs.native_product {
        row("64-bit product, native", seconds);
    }
    row("64-bit product, of pairs", costs.paired_product);
    println!("{}", table.markdown());
}

/// Returns what single operations take, in seconds.
pub fn costs_as_json(costs: &Costs) -> Value {
    json!({
        "submission": costs.submission,
        "dispatch": costs.dispatch,
        "scattered_addition": costs.scattered_addition,
        "shared_addition": costs.shared_addition,
        "native_product": costs.native_product,
        "paired_product": costs.paired_product,
    })
}

/// Prints the table by model.
pub fn print_wholes(cases: &[Case], bandwidth: f64) {
    let heads = ["model", "image", "triangles", "crossings", "layers x", "y", "z"].into_iter();
    let heads = heads.chain(GROUPS.map(|(name, _)| name)).chain([
        "rest",
        "whole ms",
        READ_BACK,
        "span",
        "wall",
        "wall of sums",
        "GTX 580 (2013)",
        "that / whole",
        "MB",
        "M atomics",
        "of copying",
        "whole / its bytes copied",
    ]);
    let mut table = Table::new(&heads.collect::<Vec<_>>());
    for case in cases {
        let milliseconds = |is_in: &dyn Fn(&Stage) -> bool| {
            let stages: Vec<&Stage> = case.stages.iter().filter(|stage| stage.is_timed() && is_in(stage)).collect();
            match stages.is_empty() {
                true => number(f64::NAN),
                false => number(1e3 * stages.into_iter().map(Stage::seconds).sum::<f64>()),
            }
        };
        let (whole, moved) = (case.whole(), case.moved());
        let [x, y, z] = case.layers.map(|layers| count(layers.into()));
        let crossings = case.sizes.iter().map(|size| size.crossings).sum();
        let mut cells =
            vec![case.model.to_owned(), case.way.to_owned(), count(case.sizes[0].triangles), count(crossings), x, y, z];
        cells.extend(GROUPS.iter().map(|(_, names)| milliseconds(&|stage| names.contains(&stage.name))));
        let is_grouped = |stage: &Stage| GROUPS.iter().any(|(_, names)| names.contains(&stage.name));
        cells.extend([
            milliseconds(&|stage| !is_grouped(stage) && stage.name != READ_BACK),
            number(1e3 * whole),
            milliseconds(&|stage| stage.name == READ_BACK),
            if case.span > 0.0 { number(1e3 * case.span) } else { number(f64::NAN) },
            number(1e3 * case.wall),
            number(1e3 * case.sums_wall),
            number(case.published_milliseconds),
            format!("{} ×", number(1e-3 * case.published_milliseconds / whole)),
            number(1e-6 * moved.bytes as f64),
            number(1e-6 * (moved.atomics + moved.contended) as f64),
            share(moved, whole, bandwidth),
            times(moved, whole, bandwidth),
        ]);
        table.row(cells);
    }
    println!("#### By model\n\n{}", table.markdown());
    println!(
        "Three directions, LOD-C {LOD}; milliseconds are medians by the device's own clock. The whole is all stages but \
         what is read back to the host; the span is from the beginning of the first to the end of the last. Wall times, of \
         the images and of the sums over them, are those of a program that times no stage. Solids are of the kinds and sizes of those that Leung and Wang timed, not the same; \
         their GTX 580 had 192 GB/s. MB and M atomics are those that must be moved (`gpu/account.rs`), at least; of copying \
         is their rate over that of copies.\n"
    );
    let untimed = |case: &Case| case.stages.iter().filter(|stage| !stage.is_timed()).map(|stage| stage.name).collect();
    let untimed: Vec<&str> = cases.first().map(untimed).unwrap_or_default();
    if !untimed.is_empty() {
        println!("Not timed by this adapter: {}.\n", untimed.join(", "));
    }
}

/// Prints what the device was given to do, by model.
pub fn print_work(cases: &[Case]) {
    let heads =
        ["model", "image", "result", "dispatches", "submissions", "MB uploaded", "MB read back", "MB of the result"];
    let mut table = Table::new(&heads);
    for case in cases {
        let read_back = case.stages.iter().find(|stage| stage.name == READ_BACK);
        let of_images = read_back.map_or(0, |stage| stage.moved.bytes);
        for (result, work, bytes) in [("images", case.images, of_images), ("sums", case.sums, case.sums.read_back)] {
            table.row(vec![
                case.model.to_owned(),
                case.way.to_owned(),
                result.to_owned(),
                count(work.dispatches),
                count(work.submissions),
                number(1e-6 * work.uploaded as f64),
                number(1e-6 * work.read_back as f64),
                number(1e-6 * bytes as f64),
            ]);
        }
    }
    println!("#### Work of three directions\n\n{}", table.markdown());
    println!("The host waits once for each submission. The geometry is on the device after the first call.\n");
}

/// Prints the table by stage, over all models.
pub fn print_stages(cases: &[Case], bandwidth: f64) {
    let heads =
        ["image", "stage", "ms", "rows of larger triangles ms", "of the whole", "MB", "M atomics", "M on few words"];
    let heads = heads.into_iter().chain(["GB/s", "of copying", "time / its bytes copied"]);
    let mut table = Table::new(&heads.collect::<Vec<_>>());
    for way in WAYS {
        let cases: Vec<&Case> = cases.iter().filter(|case| case.way == way.name).collect();
        let whole: f64 = cases.iter().map(|case| case.whole()).sum();
        let mut names: Vec<&str> = Vec::new();
        for stage in cases.iter().flat_map(|case| &case.stages).filter(|stage| stage.is_timed()) {
            if !names.contains(&stage.name) {
                names.push(stage.name);
            }
        }
        for name in names {
            let (mut seconds, mut large, mut moved) = (0.0, 0.0, Moved::default());
            for stage in cases.iter().flat_map(|case| &case.stages).filter(|stage| stage.name == name) {
                seconds += stage.seconds();
                let is_large = |dispatch: &&(&str, f64)| dispatch.0.ends_with("(rows)");
                large += stage.dispatches.iter().filter(is_large).map(|(_, seconds)| seconds).sum::<f64>();
                moved += stage.moved;
            }
            table.row(vec![
                way.name.to_owned(),
                name.to_owned(),
                number(1e3 * seconds),
                if large > 0.0 { number(1e3 * large) } else { number(f64::NAN) },
                if name == READ_BACK { number(f64::NAN) } else { format!("{} %", number(100.0 * seconds / whole)) },
                number(1e-6 * moved.bytes as f64),
                number(1e-6 * moved.atomics as f64),
                number(1e-6 * moved.contended as f64),
                if moved.bytes > 0 { number(1e-9 * moved.bytes as f64 / seconds) } else { number(f64::NAN) },
                share(moved, seconds, bandwidth),
                times(moved, seconds, bandwidth),
            ]);
        }
    }
    println!("#### By stage, all models together\n\n{}", table.markdown());
}

/// Returns the cases with their derived ratios.
pub fn with_ratios(cases: &[Case], bandwidth: f64) -> Vec<Value> {
    let of = |moved: Moved, seconds: f64| {
        json!({
            "seconds": seconds, "bytes": moved.bytes, "atomics": moved.atomics, "contended": moved.contended,
            "share_of_copying": 1.0 / ratio(moved, seconds, bandwidth),
            "times_compulsory": ratio(moved, seconds, bandwidth),
        })
    };
    let with_ratios = |case: &Case| {
        let stages = case.stages.iter().filter(|stage| stage.is_timed());
        let stages: serde_json::Map<String, Value> =
            stages.map(|stage| (stage.name.to_owned(), of(stage.moved, stage.seconds()))).collect();
        json!({"measured": case, "whole": of(case.moved(), case.whole()), "by_stage": stages})
    };
    cases.iter().map(with_ratios).collect()
}

/// Returns the time divided by that of copying the compulsory bytes; infinite if there are none.
fn ratio(moved: Moved, seconds: f64, bandwidth: f64) -> f64 {
    seconds * bandwidth / moved.bytes as f64
}

/// Formats the ratio as a cell; a dash if there are no compulsory bytes.
fn times(moved: Moved, seconds: f64, bandwidth: f64) -> String {
    match moved.bytes {
        0 => number(f64::NAN),
        _ => format!("{} ×", number(ratio(moved, seconds, bandwidth))),
    }
}

/// Formats the rate of compulsory bytes, relative to that of copies, as a cell; a dash if there are none.
fn share(moved: Moved, seconds: f64, bandwidth: f64) -> String {
    match moved.bytes {
        0 => number(f64::NAN),
        _ => format!("{} %", number(100.0 / ratio(moved, seconds, bandwidth))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_to_the_time_of_copies() {
        let moved = Moved { bytes: 200, ..Moved::default() };
        // At 100 bytes per second, 200 bytes take two seconds.
        assert_eq!(ratio(moved, 8.0, 100.0), 4.0);
        assert_eq!((times(moved, 8.0, 100.0), share(moved, 8.0, 100.0)), ("4.00 ×".into(), "25.0 %".into()));
        assert_eq!([times, share].map(|cell| cell(Moved::default(), 8.0, 100.0)), ["–", "–"]);
    }
}
