//! The program `ldi-ops`.

use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: ldi_ops_cli::LargePages = ldi_ops_cli::LargePages;

fn main() -> ExitCode {
    ExitCode::from(ldi_ops_cli::run(std::env::args_os()))
}
