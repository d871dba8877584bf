//! The files beside a page: for programs (metrics.json), for spreadsheets (metrics.csv) and for papers (methods.txt).

mod csv;
mod designs;
mod json;
mod methods;

use ::csv::{Terminator, Writer, WriterBuilder};

pub use self::csv::csv;
pub use designs::designs;
pub use json::json;
pub use methods::methods;

/// Returns a table as text, following RFC 4180.
pub fn table(
    builder: &mut WriterBuilder,
    fill: impl FnOnce(&mut Writer<Vec<u8>>) -> Result<(), ::csv::Error>,
) -> String {
    let mut writer = builder.terminator(Terminator::CRLF).from_writer(Vec::new());
    let filled = fill(&mut writer).and_then(|()| writer.into_inner().map_err(|error| error.into_error().into()));
    let bytes = filled.expect("memory takes all that is written, and all lines have the same fields");
    String::from_utf8(bytes).expect("what was written was text")
}

/// The mark by which spreadsheets recognise UTF-8.
pub const BYTE_ORDER_MARK: &str = "\u{feff}";
