//! Warnings of operations.

use std::fmt;

/// A remark on a result of an operation that succeeded. `Display` is the message.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "report", derive(serde::Serialize))]
pub struct Warning {
    /// A stable name for programs: `thinner-than-pitch`.
    pub code: &'static str,
    /// The fact, the size of its effect, the option that changes it, and the file if there is one.
    pub message: String,
}

impl Warning {
    /// Returns a warning.
    pub fn new(code: &'static str, message: String) -> Warning {
        Warning { code, message }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}
