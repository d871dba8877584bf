//! HTML pages from a [`ScaffoldReport`], with styles, drawings and pictures embedded, so that a page can be mailed, archived and
//! printed, and makes no network requests; a policy in its head forbids them.
//!
//! Pages work without scripts; the only script makes tables sortable. Templates escape their inputs; drawings escape their own
//! texts and are inserted as they are.

mod colour;
pub mod compare;
pub mod plot;
mod report;
mod slices;
pub mod sortable;
pub mod summary;
mod table;
mod verdict;
pub mod words;

use askama::Template;

use super::scaffold_report::ScaffoldReport;

/// The style of all pages.
pub const STYLE: &str = include_str!("../templates/style.css");
/// The script that makes tables sortable.
pub const SORT: &str = include_str!("../templates/sort.js");
/// The footer of all pages.
pub const FOOT: &str = concat!("Made by ldi-ops ", env!("CARGO_PKG_VERSION"));

/// Returns the report on one solid, as a self-contained page.
pub fn html(report: &ScaffoldReport) -> String {
    report::html(report)
}

/// Returns the text of a page.
pub fn rendered(page: &impl Template) -> String {
    page.render().expect("a template that compiles fails only where writing to memory does")
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::compare;
    use super::summary::{self, Entry};
    use crate::report::fixture;

    /// Returns the pages of both fixtures, the summary and the comparison.
    fn pages() -> Vec<(&'static str, String)> {
        let (rich, poor) = (fixture::rich(), fixture::poor());
        let entry = |report, link: &str| Entry { report, link: link.to_owned() };
        let entries = || [entry(&rich, "rich.html"), entry(&poor, "poor.html")];
        let [a, b] = entries();
        let mut other = rich.clone();
        other.title = "gyroid-dense.stl".to_owned();
        other.metrics.iter_mut().for_each(|metric| {
            [&mut metric.value, &mut metric.lower, &mut metric.upper]
                .into_iter()
                .flatten()
                .for_each(|value| *value *= 1.05)
        });
        other.histograms.iter_mut().for_each(|plot| plot.range[1] *= 1.2);
        vec![
            ("rich.html", super::html(&rich)),
            ("poor.html", super::html(&poor)),
            ("summary.html", summary::html(&entries(), &[])),
            ("compare.html", compare::html(&entry(&rich, "rich.html"), &entry(&other, "rich.html"))),
            ("compare-poor.html", compare::html(&a, &b)),
        ]
    }

    /// If LDI_OPS_PAGES names a folder, the test writes the pages there for inspection.
    #[test]
    fn pages_hold_no_raw_text_and_no_missing_numbers() {
        for (name, page) in pages() {
            if let Some(folder) = std::env::var_os("LDI_OPS_PAGES") {
                std::fs::write(PathBuf::from(folder).join(name), &page).unwrap();
            }
            for bad in ["NaN", "<script>alert", "& is <not>", "inf ", "Some("] {
                assert!(!page.contains(bad), "{name} holds {bad}: {:.200}", &page[page.find(bad).unwrap()..]);
            }
        }
    }
}
