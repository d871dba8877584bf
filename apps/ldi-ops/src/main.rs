//! The command line of ldi-ops.
fn main() {}
