//! sweep.csv: a row for each design, with its parameters and the values of its metrics, for spreadsheets.

use csv::WriterBuilder;

use super::row::{Row, length_unit, shown};
use crate::report::id;
use crate::report::write::{BYTE_ORDER_MARK, table};

/// Returns the table, with the front by the places of its rows; a cell is empty if there is no value. Bounds are in the files of the rows.
pub fn csv(rows: &[Row], front: &[usize]) -> String {
    let unit = length_unit(rows);
    let parameters = rows.iter().take(1).flat_map(|row| row.parameters.keys().cloned());
    let header = ["design".to_owned()].into_iter().chain(parameters);
    let header =
        header.chain(["limits", "front", "not measured because", "not resolved", "warnings"].map(str::to_owned));
    let header = header.chain(id::all().map(|metric| format!("{} [{}]", metric.id, metric.quantity.of(unit))));
    let rows = table(&mut WriterBuilder::new(), |writer| {
        writer.write_record(header)?;
        for (i, row) in rows.iter().enumerate() {
            let limits = row.passed.map_or("", |passed| if passed { "kept" } else { "broken" });
            let unresolved = id::all().filter(|metric| row.value(metric.id).is_some() && !row.is_resolved(metric.id));
            let unresolved: Vec<&str> = unresolved.map(|metric| metric.id).collect();
            let front = if front.binary_search(&i).is_ok() { "front" } else { "" };
            let error = row.error.clone().unwrap_or_default();
            let facts =
                [limits.to_owned(), front.to_owned(), error, unresolved.join(" "), row.warning_codes().join(" ")];
            let values =
                id::all().map(|metric| row.value(metric.id).map(|value| value.to_string()).unwrap_or_default());
            let first = [row.design.clone()].into_iter().chain(row.parameters.values().map(shown));
            writer.write_record(first.chain(facts).chain(values))?;
        }
        Ok(())
    });
    BYTE_ORDER_MARK.to_owned() + &rows
}
