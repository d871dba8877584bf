//! The scaffold report: what is measured of a solid and its pores, and the files that say so.
//!
//! `measure` (images, fields, metrics) → [`sheet`] (everything that is known, in world units, ready to be
//! said) → [`write`] (metrics.json, metrics.csv, methods.txt) and [`page`] (report.html). Nothing behind the sheet computes, and
//! nothing before it formats.

#[cfg(test)]
mod fixture;
pub mod id;
pub mod limits;
pub mod measure;
pub mod page;
pub mod quantity;
pub mod sheet;
pub mod write;
