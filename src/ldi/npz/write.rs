//! The `.npz` writer.

use std::io::{Seek, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::normals::turned_inwards;
use super::npy::{self, Order};
use super::{Extras, NpzError, is_unit, key, not_normal};
use crate::grid::Grid;
use crate::ldi::Ldi;

/// Writes images of one solid on one grid along different axes, with their further known properties.
pub fn write(images: &[Ldi], extras: &Extras, to: impl Write + Seek) -> Result<(), NpzError> {
    let Some(first) = images.first() else { return Err(NpzError::NoImage) };
    belong_together(images)?;
    check_extras(images, extras)?;
    let mut archive = Archive { zip: ZipWriter::new(to) };
    let axes: String = images.iter().map(|image| image.axis().name()).collect();
    match images {
        [_] => archive.text("axis", 1, &[], &axes)?,
        _ => archive.text("axis", 1, &[images.len()], &axes)?,
    }
    archive.array("grid", GRID_RECORD, &[], &grid_record(first.grid()))?;
    if let Some(unit) = &extras.unit {
        archive.text("unit", unit.chars().count(), &[], unit)?;
    }
    if let Some(mode) = extras.mode {
        archive.text("mode", mode.name().len(), &[], mode.name())?;
    }
    for (i, image) in images.iter().enumerate() {
        let key = |name| key(name, image.axis().name(), images.len());
        let samples = image.depths().len();
        archive.elements(&key("offsets"), "'<u4'", &[image.offsets().len()], image.offsets(), u32::to_le_bytes)?;
        archive.elements(&key("depths"), "'<i4'", &[samples], image.depths(), i32::to_le_bytes)?;
        if let Some(normals) = extras.normals.get(i).and_then(Option::as_ref) {
            archive.elements(&key("normals"), "'<f4'", &[samples, 3], normals.as_flattened(), f32::to_le_bytes)?;
        }
        archive.elements(&key("unclosed"), "'<u4'", &[image.unclosed().len()], image.unclosed(), u32::to_le_bytes)?;
    }
    archive.zip.finish()?.flush()?;
    Ok(())
}

fn belong_together(images: &[Ldi]) -> Result<(), NpzError> {
    for second in 1..images.len() {
        let odd = images[..second]
            .iter()
            .position(|i| i.grid() != images[second].grid() || i.axis() == images[second].axis());
        if let Some(first) = odd {
            return Err(NpzError::Mismatch { first, second });
        }
    }
    Ok(())
}

fn check_extras(images: &[Ldi], extras: &Extras) -> Result<(), NpzError> {
    if let Some(unit) = extras.unit.as_ref().filter(|unit| !is_unit(unit)) {
        return Err(NpzError::Unit { text: unit.clone() });
    }
    if !(extras.normals.is_empty() || extras.normals.len() == images.len()) {
        return Err(NpzError::NormalLists { found: extras.normals.len(), images: images.len() });
    }
    for (image, normals) in images.iter().zip(&extras.normals) {
        let Some(normals) = normals else { continue };
        let array = || key("normals", image.axis().name(), images.len());
        let samples = image.depths().len();
        if normals.len() != samples {
            return Err(NpzError::NormalCount { array: array(), found: normals.len(), samples });
        }
        if let Some((sample, length)) = not_normal(normals) {
            return Err(NpzError::NormalLength { array: array(), sample, length });
        }
        if let Some((count, sample)) = turned_inwards(image, normals) {
            return Err(NpzError::NormalSide { array: array(), count, sample });
        }
    }
    Ok(())
}

/// The type of a grid record, in numpy's notation.
const GRID_RECORD: &str = "[('origin', '<f8', (3,)), ('pitch', '<f8'), ('step', '<f8'), ('rays', '<u4', (3,)), \
                           ('shift', '<u4'), ('lod', '<u4')]";

fn grid_record(grid: &Grid) -> Vec<u8> {
    let [x, y, z] = grid.origin().to_array();
    let lengths = [x, y, z, grid.pitch(), grid.step()].map(f64::to_le_bytes).concat();
    let [x, y, z] = grid.rays();
    [lengths, [x, y, z, grid.shift(), grid.lod()].map(u32::to_le_bytes).concat()].concat()
}

/// An archive to which arrays are added.
struct Archive<W: Write + Seek> {
    zip: ZipWriter<W>,
}

impl<W: Write + Seek> Archive<W> {
    /// Begins the entry of an array and writes its header.
    fn begin(&mut self, key: &str, descr: &str, shape: &[usize], bytes: usize) -> Result<(), NpzError> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(zip::DateTime::default())
            .large_file(bytes > 0xf000_0000);
        self.zip.start_file(format!("{key}.npy"), options)?;
        Ok(npy::write_header(&mut self.zip, descr, Order::C, shape)?)
    }

    /// Adds an array from its bytes.
    fn array(&mut self, key: &str, descr: &str, shape: &[usize], bytes: &[u8]) -> Result<(), NpzError> {
        self.begin(key, descr, shape, bytes.len())?;
        Ok(self.zip.write_all(bytes)?)
    }

    /// Adds an array of texts that have `letters` letters each.
    fn text(&mut self, key: &str, letters: usize, shape: &[usize], text: &str) -> Result<(), NpzError> {
        let points: Vec<u8> = text.chars().flat_map(|letter| u32::from(letter).to_le_bytes()).collect();
        self.array(key, &format!("'<U{letters}'"), shape, &points)
    }

    /// Adds an array of elements of four bytes, piece by piece, so that no second copy of it is made.
    fn elements<T: Copy>(
        &mut self,
        key: &str,
        descr: &str,
        shape: &[usize],
        elements: &[T],
        to_le: fn(T) -> [u8; 4],
    ) -> Result<(), NpzError> {
        self.begin(key, descr, shape, 4 * elements.len())?;
        let mut bytes = Vec::with_capacity(1 << 16);
        for elements in elements.chunks(1 << 14) {
            bytes.clear();
            bytes.extend(elements.iter().flat_map(|&element| to_le(element)));
            self.zip.write_all(&bytes)?;
        }
        Ok(())
    }
}
