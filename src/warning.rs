//! Warnings of operations.

use std::fmt;

/// A remark on a result that did not stop the operation. `Display` is the message.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "report", derive(serde::Serialize))]
pub struct Warning {
    /// A name that does not change, for programs: `thinner-than-pitch`.
    pub code: &'static str,
    /// One sentence or more, with the size of the effect and the file where there is one.
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
