//! The `.npz` reader. The input is untrusted.
//!
//! The memory of an array follows from its header; the reader compares it with the size that the images need and with
//! the file before it reads any of the elements.

use std::io::{self, Read, Seek, SeekFrom};

use glam::DVec3;
use zip::ZipArchive;
use zip::read::ZipFile;
use zip::result::ZipError;

use super::normals::turned_inwards;
use super::npy::{Class, Field, Header, Kind, Order, Scalar};
use super::{Extras, Images, Normals, NpzError, UNIT_LETTERS, is_unit, not_normal};
use crate::allocation::{handled, try_vec_with_room};
use crate::cancel::checkpoint;
use crate::grid::{Axis, Grid};
use crate::ldi::{Ldi, Mode, NodePlanes};

/// Memory that compressed arrays may always take, in bytes.
const COMPRESSED_BYTES: u64 = 256 << 20;

/// Memory that they may take as a multiple of the file's size, where that is more.
const COMPRESSED_RATIO: u64 = 64;

/// Reads files of [`write`](super::write), also after numpy has rewritten them.
///
/// Uncompressed arrays take as much memory as in the file, or four times as much if numpy narrowed them; compressed
/// ones are refused where they take more than 256 MiB and 64 times the size of the file. The arrays of a single image
/// may or may not carry its axis in their names. `step` and `unclosed` may be absent, the latter for images without
/// unclosed rays.
pub fn read(mut from: impl Read + Seek) -> Result<Images, NpzError> {
    let file_bytes = from.seek(SeekFrom::End(0))?;
    from.rewind()?;
    let zip = ZipArchive::new(from).map_err(|error| match error {
        source @ ZipError::InvalidArchive(_) => NpzError::NoArchive { source },
        other => other.into(),
    })?;
    if zip.has_duplicate_names() {
        return Err(NpzError::Twice { entries: zip.len() });
    }
    let unread = zip.file_names().map(|name| Ok(array_name(&name?).to_owned())).collect::<Result<_, ZipError>>()?;
    let allowed = COMPRESSED_BYTES.max(file_bytes.saturating_mul(COMPRESSED_RATIO));
    let mut archive = Archive { zip, file_bytes, compressed: 0, allowed, unread };

    let axes = archive.axes()?;
    let grid = archive.grid()?;
    let unit = archive.unit()?;
    let mode = archive.mode()?;
    let (mut images, mut normals) = (Vec::new(), Vec::new());
    for &axis in &axes {
        let (image, of_image) = archive.image(grid, axis, axes.len())?;
        images.push(image);
        normals.push(of_image);
    }
    // An unclosed ray is empty, whatever the other images give for its nodes.
    if mode == Some(Mode::Exact) && images.iter().all(|image| image.unclosed().is_empty()) {
        let nodes = NodePlanes::new(&images, Mode::Exact).expect("they share a grid and differ in their axes");
        if let Some((count, node)) = nodes.disagreements() {
            return Err(NpzError::NodesDisagree { count, node });
        }
    }
    Ok(Images { images, extras: Extras { normals, unit, mode }, ignored: archive.unread })
}

/// Returns the name under which numpy lists an entry.
fn array_name(entry: &str) -> &str {
    entry.strip_suffix(".npy").unwrap_or(entry)
}

/// An archive from which arrays are read.
struct Archive<R: Read + Seek> {
    zip: ZipArchive<R>,
    file_bytes: u64,
    /// Total size in bytes of the compressed arrays so far, decompressed.
    compressed: u64,
    /// The limit of that size.
    allowed: u64,
    /// Names of arrays that have not been read.
    unread: Vec<String>,
}

impl<R: Read + Seek> Archive<R> {
    fn has(&self, name: &str) -> bool {
        self.zip.index_for_name(&format!("{name}.npy")).is_some()
    }

    /// Returns the name of an array of an image.
    fn name(&self, name: &str, axis: Axis, images: usize) -> String {
        let of_axis = format!("{name}_{}", axis.name());
        if images == 1 && !self.has(&of_axis) { name.to_owned() } else { of_axis }
    }

    /// Opens an array and reads its header.
    fn open(&mut self, name: &str) -> Result<Array<'_, R>, NpzError> {
        let name = name.to_owned();
        self.unread.retain(|unread| *unread != name);
        let mut entry = match self.zip.by_name(&format!("{name}.npy")) {
            Err(ZipError::FileNotFound) => return Err(NpzError::Missing { array: name }),
            entry => entry?,
        };
        let is_stored = entry.compression() == zip::CompressionMethod::Stored;
        if !is_stored {
            self.compressed = self.compressed.saturating_add(entry.size());
            if self.compressed > self.allowed {
                return Err(NpzError::Compressed { array: name, needed: self.compressed, allowed: self.allowed });
            }
        }
        let stored_bytes = if is_stored { self.file_bytes } else { 0 };
        match Header::read(&mut entry) {
            Ok(header) => Ok(Array { name, header, entry, stored_bytes }),
            Err(source) => Err(NpzError::Header { array: name, source }),
        }
    }

    fn axes(&mut self) -> Result<Vec<Axis>, NpzError> {
        let array = self.open("axis")?;
        if !matches!(array.header.shape[..], [] | [1..=3]) {
            return Err(array.wrong_shape("() or (n,) with n from 1 to 3"));
        }
        let mut axes = Vec::new();
        for text in array.texts()? {
            let axis = Axis::ALL.into_iter().find(|axis| axis.name() == text);
            let axis = axis.ok_or(NpzError::Axis { text })?;
            if axes.contains(&axis) {
                return Err(NpzError::AxisTwice { axis: axis.name() });
            }
            axes.push(axis);
        }
        Ok(axes)
    }

    fn unit(&mut self) -> Result<Option<String>, NpzError> {
        if !self.has("unit") {
            return Ok(None);
        }
        let text = self.text("unit")?;
        if is_unit(&text) { Ok(Some(text)) } else { Err(NpzError::Unit { text }) }
    }

    fn mode(&mut self) -> Result<Option<Mode>, NpzError> {
        if !self.has("mode") {
            return Ok(None);
        }
        let text = self.text("mode")?;
        let mode = Mode::ALL.into_iter().find(|mode| mode.name() == text);
        mode.map(Some).ok_or(NpzError::Mode { text })
    }

    fn text(&mut self, name: &str) -> Result<String, NpzError> {
        let array = self.open(name)?;
        if !array.header.shape.is_empty() {
            return Err(array.wrong_shape("()"));
        }
        Ok(array.texts()?.concat())
    }

    fn grid(&mut self) -> Result<Grid, NpzError> {
        let array = self.open("grid")?;
        if !matches!(array.header.shape[..], [] | [1]) {
            return Err(array.wrong_shape("()"));
        }
        let record = array.record()?;
        let [x, y, z] = record.floats::<3>("origin", "three floats")?;
        let [pitch] = record.floats("pitch", "one float")?;
        let rays = record.integers::<3>("rays", "three integers")?;
        let [shift] = record.integers("shift", "one integer")?;
        let [lod] = record.integers("lod", "one integer")?;
        let grid = Grid::from_parts(DVec3::new(x, y, z), pitch, rays, shift, lod)?;
        if record.has("step") {
            let ([found], expected) = (record.floats("step", "one float")?, grid.step());
            // The reader uses its own step; another program may have rounded it differently.
            if !(expected * (1.0 - 1e-9)..=expected * (1.0 + 1e-9)).contains(&found) {
                return Err(NpzError::Step { found, expected });
            }
        }
        Ok(grid)
    }

    /// Reads the image along an axis, and its normals if it has them.
    fn image(&mut self, grid: Grid, axis: Axis, images: usize) -> Result<(Ldi, Option<Normals>), NpzError> {
        let (columns, rows) = grid.image_size(axis);
        let rays = u64::from(columns) * u64::from(rows);
        let [offsets, depths, normals, unclosed] =
            ["offsets", "depths", "normals", "unclosed"].map(|name| self.name(name, axis, images));

        let array = self.open(&offsets)?;
        if array.header.shape != [rays + 1] {
            return Err(array.wrong_shape(&format!("({},), one more than the rays,", rays + 1)));
        }
        let offsets = array.integers()?;

        let array = self.open(&depths)?;
        let samples = u64::from(*offsets.last().expect("a grid has rays"));
        if array.header.shape != [samples] {
            return Err(array.wrong_shape(&format!("({samples},), the last of the offsets,")));
        }
        let depths = array.integers()?;

        let mut found_normals = None;
        if self.has(&normals) {
            let array = self.open(&normals)?;
            if array.header.shape != [samples, 3] {
                return Err(array.wrong_shape(&format!("({samples}, 3)")));
            }
            let found = array.vectors()?;
            if let Some((sample, length)) = not_normal(&found) {
                return Err(NpzError::NormalLength { array: normals, sample, length });
            }
            found_normals = Some(found);
        }

        let mut unclosed_rays = Vec::new();
        if self.has(&unclosed) {
            let array = self.open(&unclosed)?;
            if !matches!(array.header.shape[..], [count] if count <= rays) {
                return Err(array.wrong_shape(&format!("(k,) with k up to the {rays} rays")));
            }
            unclosed_rays = array.integers()?;
        }
        let image = Ldi::from_parts(grid, axis, offsets, depths, unclosed_rays);
        let image = image.map_err(|source| NpzError::Image { axis: axis.name(), source })?;
        let inwards = found_normals.as_ref().and_then(|found| turned_inwards(&image, found));
        match inwards {
            Some((count, sample)) => Err(NpzError::NormalSide { array: normals, count, sample }),
            None => Ok((image, found_normals)),
        }
    }
}

/// An array whose header was read, with its elements to follow.
struct Array<'z, R: Read + ?Sized> {
    name: String,
    header: Header,
    entry: ZipFile<'z, R>,
    /// The size of the file if the elements are stored uncompressed; 0 where they are compressed.
    stored_bytes: u64,
}

impl<R: Read + ?Sized> Array<'_, R> {
    fn wrong_shape(self, wanted: &str) -> NpzError {
        NpzError::Shape { array: self.name, found: self.header.shape, wanted: wanted.to_owned() }
    }

    fn wrong_kind(&self, wanted: &'static str) -> NpzError {
        NpzError::Kind { array: self.name.clone(), found: self.header.kind.to_string(), wanted }
    }

    fn scalar(&self, wanted: &'static str) -> Result<Scalar, NpzError> {
        match self.header.kind {
            Kind::Plain(scalar) => Ok(scalar),
            Kind::Record(_) => Err(self.wrong_kind(wanted)),
        }
    }

    /// Returns the number of elements, after checking that the entry has exactly the bytes of so many.
    fn count(&self) -> Result<usize, NpzError> {
        let count = self.header.shape.iter().try_fold(1u64, |product, &side| product.checked_mul(side));
        let bytes = count.zip(self.header.kind.bytes()).and_then(|(count, bytes)| count.checked_mul(bytes));
        let found = self.entry.size().saturating_sub(self.header.bytes);
        match (count, bytes) {
            (Some(count), Some(bytes)) if bytes == found => Ok(count as usize),
            (_, wanted) => Err(NpzError::Size { array: self.name.clone(), found, wanted: wanted.unwrap_or(u64::MAX) }),
        }
    }

    /// Reads all elements, of `size` bytes each, in order, and checks that nothing follows them and that the checksum
    /// is right.
    fn elements(
        &mut self,
        size: usize,
        mut each: impl FnMut(usize, &[u8]) -> Result<(), NpzError>,
    ) -> Result<(), NpzError> {
        let wanted = self.entry.size().saturating_sub(self.header.bytes);
        let mut piece = vec![0; (1 << 16) / size.max(1) * size];
        let mut read = 0u64;
        while read < wanted {
            checkpoint();
            let bytes = piece.len().min(usize::try_from(wanted - read).unwrap_or(usize::MAX));
            self.fill(&mut piece[..bytes])?;
            let first = (read / size as u64) as usize;
            for (i, element) in piece[..bytes].chunks_exact(size).enumerate() {
                each(first + i, element)?;
            }
            read += bytes as u64;
        }
        let damaged = |source| NpzError::Damaged { array: self.name.clone(), source };
        // Only reading beyond the end compares the checksum.
        match self.entry.read(&mut [0]).map_err(damaged)? {
            0 => Ok(()),
            _ => Err(NpzError::Size { array: self.name.clone(), found: wanted + 1, wanted }),
        }
    }

    fn fill(&mut self, piece: &mut [u8]) -> Result<(), NpzError> {
        self.entry.read_exact(piece).map_err(|source| NpzError::Damaged { array: self.name.clone(), source })
    }

    /// Returns a vector with room for the elements, as far as the size of the file makes their number plausible.
    fn room<T>(&self, count: usize) -> Result<Vec<T>, NpzError> {
        // The count matches the bytes of the entry, and those of the file if it is not compressed.
        let is_credible = self.entry.size() <= self.stored_bytes;
        let room = try_vec_with_room(if is_credible { count } else { count.min(1 << 16) });
        room.map_err(|_| self.no_memory::<T>(count))
    }

    fn no_memory<T>(&self, count: usize) -> NpzError {
        NpzError::Memory { array: self.name.clone(), bytes: (count as u64).saturating_mul(size_of::<T>() as u64) }
    }

    /// Reads integers of any width, each checked to fit.
    fn integers<T: Integer>(mut self) -> Result<Vec<T>, NpzError> {
        const WANTED: &str = "integers";
        let scalar = self.scalar(WANTED)?;
        let decode = integer(scalar).ok_or_else(|| self.wrong_kind(WANTED))?;
        let count = self.count()?;
        let mut values = self.room(count)?;
        let (name, memory) = (self.name.clone(), self.no_memory::<T>(count));
        let mut memory = Some(memory);
        self.elements(scalar.bytes, |index, bytes| {
            let value = decode(bytes);
            let value = T::try_from(value).map_err(|_| out_of_range::<T>(&name, index, value))?;
            push(&mut values, value, &mut memory)
        })?;
        Ok(values)
    }

    /// Reads vectors of three floats; those of 64 bits are rounded.
    fn vectors(mut self) -> Result<Normals, NpzError> {
        const WANTED: &str = "floats";
        let scalar = self.scalar(WANTED)?;
        let decode = float(scalar).ok_or_else(|| self.wrong_kind(WANTED))?;
        if self.header.order == Order::Fortran {
            return Err(NpzError::Order { array: self.name });
        }
        let count = self.count()? / 3;
        let mut vectors = self.room(count)?;
        let mut memory = Some(self.no_memory::<[f32; 3]>(count));
        self.elements(3 * scalar.bytes, |_, bytes| {
            let mut numbers = bytes.chunks_exact(scalar.bytes).map(|bytes| decode(bytes) as f32);
            push(&mut vectors, std::array::from_fn(|_| numbers.next().unwrap_or(f32::NAN)), &mut memory)
        })?;
        Ok(vectors)
    }

    /// Reads short texts.
    fn texts(mut self) -> Result<Vec<String>, NpzError> {
        const WANTED: &str = "texts of up to 16 letters";
        let scalar = self.scalar(WANTED)?;
        let width = match scalar.class {
            Class::Text => 4,
            Class::Bytes => 1,
            _ => return Err(self.wrong_kind(WANTED)),
        };
        if scalar.bytes == 0 || scalar.bytes > width * UNIT_LETTERS {
            return Err(self.wrong_kind(WANTED));
        }
        self.count()?;
        let mut texts = Vec::new();
        self.elements(scalar.bytes, |_, bytes| {
            let points = bytes.chunks_exact(width).map(|point| unsigned(point) as u32);
            let letters = points.map(|point| char::from_u32(point).unwrap_or(char::REPLACEMENT_CHARACTER));
            texts.push(letters.collect::<String>().trim_end_matches('\0').to_owned());
            Ok(())
        })?;
        Ok(texts)
    }

    /// Reads the one record of an array.
    fn record(mut self) -> Result<Record, NpzError> {
        let fields = match &self.header.kind {
            Kind::Record(fields) => fields.clone(),
            Kind::Plain(_) => return Err(self.wrong_kind("records")),
        };
        self.count()?;
        let size = self.header.kind.bytes().map_or(0, |bytes| bytes as usize);
        const LARGEST: usize = 4096;
        if size == 0 || size > LARGEST {
            return Err(self.wrong_kind("small records"));
        }
        let mut record = Vec::new();
        self.elements(size, |_, bytes| {
            record.extend_from_slice(bytes);
            Ok(())
        })?;
        Ok(Record { name: self.name, fields, bytes: record })
    }
}

/// Appends a value, or returns the prepared error where there is no memory.
fn push<T>(values: &mut Vec<T>, value: T, failure: &mut Option<NpzError>) -> Result<(), NpzError> {
    if values.len() == values.capacity() && handled(|| values.try_reserve(values.len().max(1))).is_err() {
        return Err(failure.take().unwrap_or_else(|| io::Error::from(io::ErrorKind::OutOfMemory).into()));
    }
    values.push(value);
    Ok(())
}

/// A record as read.
struct Record {
    name: String,
    fields: Vec<Field>,
    bytes: Vec<u8>,
}

impl Record {
    fn has(&self, field: &str) -> bool {
        self.fields.iter().any(|known| known.name == field)
    }

    /// Returns the type of a field's values, and their bytes.
    fn field<const N: usize>(&self, field: &'static str) -> Option<(Scalar, Vec<&[u8]>)> {
        let mut start = 0;
        for known in &self.fields {
            let end = start + known.scalar.bytes * known.count;
            if known.name == field && known.count == N {
                let values = self.bytes[start..end].chunks_exact(known.scalar.bytes.max(1)).collect();
                return Some((known.scalar, values));
            }
            start = end;
        }
        None
    }

    fn floats<const N: usize>(&self, field: &'static str, wanted: &'static str) -> Result<[f64; N], NpzError> {
        let found = self.field::<N>(field).and_then(|(scalar, values)| Some((float(scalar)?, values)));
        let (decode, values) = found.ok_or_else(|| NpzError::Field { array: self.name.clone(), field, wanted })?;
        Ok(std::array::from_fn(|i| decode(values[i])))
    }

    fn integers<const N: usize>(&self, field: &'static str, wanted: &'static str) -> Result<[u32; N], NpzError> {
        let found = self.field::<N>(field).and_then(|(scalar, values)| Some((integer(scalar)?, values)));
        let (decode, values) = found.ok_or_else(|| NpzError::Field { array: self.name.clone(), field, wanted })?;
        let mut integers = [0; N];
        for (index, bytes) in values.into_iter().enumerate() {
            let value = decode(bytes);
            let name = format!("{}[{field:?}]", self.name);
            integers[index] = u32::try_from(value).map_err(|_| out_of_range::<u32>(&name, index, value))?;
        }
        Ok(integers)
    }
}

/// An integer type of the elements of read arrays.
trait Integer: TryFrom<i128> + Into<i128> + Copy {
    const LEAST: Self;
    const MOST: Self;
}

impl Integer for u32 {
    const LEAST: u32 = u32::MIN;
    const MOST: u32 = u32::MAX;
}

impl Integer for i32 {
    const LEAST: i32 = i32::MIN;
    const MOST: i32 = i32::MAX;
}

fn out_of_range<T: Integer>(array: &str, index: usize, value: i128) -> NpzError {
    NpzError::Range { array: array.to_owned(), index, value, least: T::LEAST.into(), most: T::MOST.into() }
}

/// Returns the decoder of an integer type, or `None` for another type.
fn integer(scalar: Scalar) -> Option<fn(&[u8]) -> i128> {
    match (scalar.class, scalar.bytes) {
        (Class::Unsigned, _) => Some(|bytes| i128::from(unsigned(bytes))),
        (Class::Signed, 1) => Some(|bytes| i128::from(unsigned(bytes) as i8)),
        (Class::Signed, 2) => Some(|bytes| i128::from(unsigned(bytes) as i16)),
        (Class::Signed, 4) => Some(|bytes| i128::from(unsigned(bytes) as i32)),
        (Class::Signed, 8) => Some(|bytes| i128::from(unsigned(bytes) as i64)),
        _ => None,
    }
}

/// Returns the decoder of a float type, or `None` for another type.
fn float(scalar: Scalar) -> Option<fn(&[u8]) -> f64> {
    match (scalar.class, scalar.bytes) {
        (Class::Float, 4) => Some(|bytes| f64::from(f32::from_bits(unsigned(bytes) as u32))),
        (Class::Float, 8) => Some(|bytes| f64::from_bits(unsigned(bytes))),
        _ => None,
    }
}

/// Returns the value of up to eight bytes, the least significant first.
fn unsigned(bytes: &[u8]) -> u64 {
    match *bytes {
        // The width that the writer uses is the fast path.
        [a, b, c, d] => u64::from(u32::from_le_bytes([a, b, c, d])),
        _ => bytes.iter().rev().fold(0, |value, &byte| value << 8 | u64::from(byte)),
    }
}
