//! The files beside a page: for programs (metrics.json), for spreadsheets (metrics.csv) and for papers (methods.txt).

mod csv;
mod designs;
mod json;
mod methods;

pub use csv::csv;
pub use designs::designs;
pub use json::json;
pub use methods::methods;
