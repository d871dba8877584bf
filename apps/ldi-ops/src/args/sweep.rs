//! Arguments of `sweep`.

use std::path::PathBuf;

use clap::Args;
use ldi_ops::report::sweep::Shard;

use super::{CommonArguments, DeviceArguments};

#[derive(Debug, Args)]
#[command(after_help = SWEEP_EXAMPLES)]
pub struct SweepArguments {
    /// The plan: a model solid and the values of its parameters, .toml
    pub plan: PathBuf,
    /// Output folder for index.html, sweep.csv and the rows of the designs; created if missing. Designs that have a row in it are
    /// not measured again [default: a folder here with the name of the plan, and -sweep in place of its extension]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Measure only one of N equal parts of the designs, such as 3/200: for several processes or machines with one folder. The
    /// part that ends last writes table and page
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    #[command(flatten)]
    pub device: DeviceArguments,
    #[command(flatten)]
    pub common: CommonArguments,
}

const SWEEP_EXAMPLES: &str = "\
Examples:
  ldi-ops sweep plan.toml                                            into plan-sweep
  ldi-ops sweep plan.toml -o runs
  ldi-ops sweep plan.toml -o runs --shard 3/200                      one of 200 jobs
  ldi-ops sweep plan.toml -o runs --shard $SLURM_ARRAY_TASK_ID/200   the jobs of an array

plan.toml names a model of `ldi-ops generate` and the values of its parameters. All combinations are
designs, or each [[design]] of a list:

  model = \"gyroid\"
  limits = \"limits.toml\"                                # as for `ldi-ops report`; optional
  region = \"bone.stl\"                                   # or \"hull\", \"wrap:2mm\"; optional
  unit = \"mm\"                                           # of a region that states none

  [parameters]
  wall = { from = 0.4, to = 1.2, steps = 5 }
  cells = [1, 2, \"2,2,4\"]
  cell-size = 4

  [settings]                                             # optional, as for `ldi-ops report`
  resolution = 128                                       # or pitch = \"0.05mm\"

  [pareto]                                               # what is better; optional
  porosity = \"max\"
  \"wall.thinnest\" = \"max\"

[settings] takes resolution, pitch, tortuosity-resolution, edges, fill, build, overhang-angle and
kozeny. A design that fails is a row with its message, and is tried again by the next run. A sweep
that was stopped or killed goes on where it was. The rows, JSON files in DIR/rows, depend on nothing
but plan and version. The exit code is 2 if no design could be measured; broken limits are in the
table.

JSON: {\"schema\", \"command\", \"title\", \"designs\", \"measured\", \"missing\", \"failed\", \"kept\",
\"unresolved\", \"front\", \"failures\", \"warnings\", \"written\"}; \"front\" has the rows of the designs
that no other dominates, \"failures\" parameters and error of each that failed, and \"warnings\" each code
with the number of its designs.";
