//! What is said beside a result.

/// Something the user should hear of that did not stop the job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// A name that does not change, for programs.
    pub code: &'static str,
    /// One sentence or more, naming the file where there is one.
    pub message: String,
}

impl Warning {
    pub fn new(code: &'static str, message: String) -> Warning {
        Warning { code, message }
    }
}
