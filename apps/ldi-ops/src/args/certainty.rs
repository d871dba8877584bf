//! Arguments of certified bounds.

use clap::Args;
use ldi_ops::cubic::TypedVolume;
use ldi_ops::driver::certainty::{Assertion, Certainty, Side};

#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Certainty")]
pub struct CertaintyArguments {
    /// Add certified bounds, between which the volume is proved to lie. Their width falls with the square of the pitch for
    /// Booleans, and with the pitch for Minkowski sums; with --tolerance, those of Booleans are refined until they are as narrow
    #[arg(long)]
    pub bounds: bool,
    /// Exit with 1 unless the volume is certainly below V, in cubic file units or with a unit: 5mm3, 0.2ml; implies --bounds
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    pub assert_below: Option<TypedVolume>,
    /// Exit with 1 unless the volume is certainly above V
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    pub assert_above: Option<TypedVolume>,
}

impl From<CertaintyArguments> for Certainty {
    fn from(arguments: CertaintyArguments) -> Certainty {
        let CertaintyArguments { bounds, assert_below, assert_above } = arguments;
        let assertion = |side, limit: Option<TypedVolume>| limit.map(|limit| Assertion { side, limit });
        let assertions = [assertion(Side::Below, assert_below), assertion(Side::Above, assert_above)];
        Certainty { bounds, assertions: assertions.into_iter().flatten().collect() }
    }
}
