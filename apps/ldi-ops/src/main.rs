//! The program `ldi-ops`.

use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: ldi_ops_cli::LargePages = ldi_ops_cli::LargePages;

fn main() -> ExitCode {
    choose_adapters_ourselves();
    ExitCode::from(ldi_ops_cli::run(std::env::args_os()))
}

/// Disables Mesa's device-select layer, which reorders adapters for desktops and prints errors on machines without one; ldi-ops
/// chooses the adapter.
fn choose_adapters_ourselves() {
    const SWITCH: &str = "NODEVICE_SELECT";
    if std::env::var_os(SWITCH).is_none() {
        // SAFETY: no other thread has started yet that could read the environment at the same time.
        unsafe { std::env::set_var(SWITCH, "1") };
    }
}
