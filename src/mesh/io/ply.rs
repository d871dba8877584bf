//! PLY: the Stanford polygon format in text and in binary of either byte order.
//!
//! The reader is our own, because `ply-rs-bw` looks up each property of each element by name, so that the usual binary
//! file of a million triangles takes seconds. Here the usual layouts (vertices without lists, faces with one list, all
//! of them triangles) are converted in parallel straight into place, and everything else goes through one general
//! reader.
//!
//! Of a file's elements, `vertex`, `face` and `tristrips` are read, by their properties `x`, `y`, `z` and
//! `vertex_indices` or `vertex_index`, in any types; everything else is skipped. In triangle strips −1 starts a new
//! strip, every other triangle is reversed, and triangles that name a vertex twice are left out, since they only lead
//! from strip to strip. In text each element begins on a line of its own, so that a line with a value too few or too many
//! does not shift all others.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};

use crate::parallel::*;
use glam::DVec3;

use super::error::{Fault, Place, Problem};
use super::formatted::write_each;
use super::note::ReadNote;
use super::polygon::{Polygons, Strip};
use super::text::{Words, decode, quote};
use super::{MeshFile, checkpoint_at};
use crate::allocation::vec_with_room;
use crate::mesh::{LengthUnit, TriangleMesh};

/// Number of elements that one task converts: enough to outweigh the overhead, few enough to balance the load.
const ELEMENTS_PER_TASK: usize = 1 << 14;

/// Returns whether a file is in text, by its first bytes.
pub(super) fn is_text(start: &[u8]) -> bool {
    memchr::memmem::find(start, b"format ascii").is_some()
}

pub(super) fn parse(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let text = decode(bytes);
    let header = Header::parse(&text)?;
    let vertices = header.elements.iter().find(|element| element.name == "vertex").map_or(0, |element| element.count);
    if vertices > u64::from(u32::MAX) {
        let problem = Problem::TooMany { what: "vertices".into(), found: vertices, limit: u32::MAX.into() };
        return Err(Fault::Malformed(Place::File, problem));
    }
    let mut body = match header.encoding {
        Encoding::Text => {
            let of_text = header.elements.iter().filter(|element| !element.properties.is_empty());
            let left = of_text.fold(0u64, |sum, element| sum.saturating_add(element.count));
            Body::Text { words: Words::new(&text[header.bytes..]).starting_at(header.lines + 1), left }
        }
        Encoding::Binary(order) => Body::Binary { bytes: &text, at: header.bytes, order },
    };
    let mut content = Content { vertices: vertices as usize, ..Content::default() };
    for element in &header.elements {
        content.element(element, &mut body)?;
    }
    content.finish(body)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ByteOrder {
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Encoding {
    Text,
    Binary(ByteOrder),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &[u8]) -> Option<Scalar> {
        Some(match name {
            b"char" | b"int8" => Scalar::I8,
            b"uchar" | b"uint8" => Scalar::U8,
            b"short" | b"int16" => Scalar::I16,
            b"ushort" | b"uint16" => Scalar::U16,
            b"int" | b"int32" => Scalar::I32,
            b"uint" | b"uint32" => Scalar::U32,
            b"float" | b"float32" => Scalar::F32,
            b"double" | b"float64" => Scalar::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// Returns the value at the beginning of `bytes`, which must be long enough. An `f64` holds the values of every
    /// type.
    #[inline]
    fn load(self, bytes: &[u8], order: ByteOrder) -> f64 {
        macro_rules! load {
            ($type:ty) => {{
                let (bytes, _) = bytes.split_first_chunk().expect("the caller has counted the bytes");
                f64::from(match order {
                    ByteOrder::Little => <$type>::from_le_bytes(*bytes),
                    ByteOrder::Big => <$type>::from_be_bytes(*bytes),
                })
            }};
        }
        match self {
            Scalar::I8 => load!(i8),
            Scalar::U8 => load!(u8),
            Scalar::I16 => load!(i16),
            Scalar::U16 => load!(u16),
            Scalar::I32 => load!(i32),
            Scalar::U32 => load!(u32),
            Scalar::F32 => load!(f32),
            Scalar::F64 => load!(f64),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

impl Kind {
    /// Returns the least number of bytes of a value.
    fn least_size(self) -> usize {
        match self {
            Kind::Scalar(scalar) => scalar.size(),
            Kind::List { count, .. } => count.size(),
        }
    }
}

struct Property {
    name: String,
    kind: Kind,
}

struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

impl Element {
    fn property(&self, names: &[&str]) -> Option<usize> {
        self.properties.iter().position(|property| names.contains(&property.name.as_str()))
    }

    /// Returns the offset of each property in a binary element, and the element's length in bytes; `None` if some
    /// property is a list.
    fn layout(&self) -> Option<(Vec<usize>, usize)> {
        let mut offsets = Vec::with_capacity(self.properties.len());
        let mut stride = 0;
        for property in &self.properties {
            let Kind::Scalar(scalar) = property.kind else { return None };
            offsets.push(stride);
            stride += scalar.size();
        }
        Some((offsets, stride))
    }

    fn vertex_list(&self) -> Result<usize, Fault> {
        let index = self.property(&["vertex_indices", "vertex_index"]);
        index.filter(|&index| matches!(self.properties[index].kind, Kind::List { .. })).ok_or_else(|| {
            let sentence = format!("element {} has no list `vertex_indices` or `vertex_index`", self.name);
            Fault::invalid(Place::File, sentence)
        })
    }

    fn short(&self, found: u64) -> Fault {
        let what = format!("elements `{}`", self.name).into();
        Fault::Malformed(Place::File, Problem::Short { what, promised: self.count, found })
    }
}

struct Header {
    encoding: Encoding,
    elements: Vec<Element>,
    /// The length of the header in bytes, with the end of its last line.
    bytes: usize,
    lines: usize,
}

impl Header {
    fn parse(text: &[u8]) -> Result<Header, Fault> {
        let mut words = Words::new(text);
        let magic = words.next();
        if magic != Some(b"ply") {
            return Err(words.expected("`ply`", magic));
        }
        // Where lines end in CR alone, a LF after the header's last line is data.
        let ends_in_crlf = words.rest().starts_with(b"\r\n");
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        loop {
            if !words.skip_line().1 {
                return Err(words.expected("`end_header`", None));
            }
            match words.next_on_line() {
                Some(b"format") => {
                    let name = words.next_on_line();
                    encoding = Some(match name {
                        Some(b"ascii") => Encoding::Text,
                        Some(b"binary_little_endian") => Encoding::Binary(ByteOrder::Little),
                        Some(b"binary_big_endian") => Encoding::Binary(ByteOrder::Big),
                        _ => return Err(words.expected("`ascii` or `binary_…_endian`", name)),
                    });
                }
                Some(b"element") => {
                    let name = words.next_on_line().ok_or_else(|| words.expected("an element's name", None))?;
                    let count = words.next_on_line().ok_or_else(|| words.expected("a count", None))?;
                    elements.push(Element { name: quote(name), count: words.count(count)?, properties: Vec::new() });
                }
                Some(b"property") => {
                    let property = property(&mut words)?;
                    let Some(element) = elements.last_mut() else {
                        return Err(words.expected("`element`", Some(b"property")));
                    };
                    element.properties.push(property);
                }
                Some(b"comment" | b"obj_info") | None => {}
                Some(b"end_header") => break,
                Some(word) => return Err(words.expected("a line of a PLY header", Some(word))),
            }
        }
        let Some(encoding) = encoding else {
            return Err(words.expected("a line `format`", Some(b"end_header")));
        };
        let lines = words.line();
        let before = words.rest();
        words.skip_line();
        let mut bytes = text.len() - words.rest().len();
        let is_binary = matches!(encoding, Encoding::Binary(_));
        if is_binary && !ends_in_crlf && before.starts_with(b"\r\n") {
            bytes -= 1;
        }
        Ok(Header { encoding, elements, bytes, lines })
    }
}

fn property(words: &mut Words<'_>) -> Result<Property, Fault> {
    let scalar = |words: &Words<'_>, word: Option<&[u8]>| {
        word.and_then(Scalar::named).ok_or_else(|| words.expected("a PLY type", word))
    };
    let word = words.next_on_line();
    let kind = if word == Some(b"list") {
        let (count, item) = (words.next_on_line(), words.next_on_line());
        Kind::List { count: scalar(words, count)?, item: scalar(words, item)? }
    } else {
        Kind::Scalar(scalar(words, word)?)
    };
    let name = words.next_on_line().ok_or_else(|| words.expected("a property's name", None))?;
    Ok(Property { name: quote(name), kind })
}

/// The bytes of the elements, and how far they have been read.
enum Body<'a> {
    /// The words, and the number of elements that have not ended.
    Text {
        words: Words<'a>,
        left: u64,
    },
    Binary {
        bytes: &'a [u8],
        at: usize,
        order: ByteOrder,
    },
}

impl<'a> Body<'a> {
    /// Returns the next value, or `None` where the file ends before it.
    #[inline]
    fn value(&mut self, scalar: Scalar) -> Result<Option<f64>, Fault> {
        match self {
            Body::Text { words, .. } => words.next().map(|word| words.number(word)).transpose(),
            Body::Binary { bytes, at, order } => {
                let rest = &bytes[*at..];
                if rest.len() < scalar.size() {
                    return Ok(None);
                }
                *at += scalar.size();
                Ok(Some(scalar.load(rest, *order)))
            }
        }
    }

    /// Returns the unread bytes.
    fn rest(&self) -> &'a [u8] {
        match self {
            Body::Text { words, .. } => words.rest(),
            Body::Binary { bytes, at, .. } => &bytes[*at..],
        }
    }

    /// Ends an element, after which no value may be left on its line, in text; what follows the last is no value.
    fn end_element(&mut self, element: &Element, index: u64) -> Result<(), Fault> {
        let Body::Text { words, left } = self else { return Ok(()) };
        *left -= 1;
        let Some(word) = (*left > 0).then(|| words.next_on_line()).flatten() else { return Ok(()) };
        let sentence = format!(
            "element {} {index} ends before `{}`, but each begins on a line of its own: this line, or one before it, has a value too \
             many or too few",
            element.name,
            quote(word)
        );
        Err(Fault::invalid(Place::Line(words.line()), sentence))
    }

    /// Returns the line of the last value, in text.
    fn line(&self) -> Option<usize> {
        match self {
            Body::Text { words, .. } => Some(words.line()),
            Body::Binary { .. } => None,
        }
    }
}

#[derive(Default)]
struct Content {
    /// Number of vertices by the header; indices are checked against it wherever the vertices stand.
    vertices: usize,
    positions: Vec<DVec3>,
    /// Faces of files with other polygons than triangles, or with another layout than the usual.
    polygons: Polygons,
    /// Faces of the usual layout, and the triangles of strips.
    triangles: Vec<[u32; 3]>,
}

impl Content {
    fn element(&mut self, element: &Element, body: &mut Body<'_>) -> Result<(), Fault> {
        // Elements without properties take no bytes, so that any count of them is valid.
        if element.properties.is_empty() {
            return match element.name.as_str() {
                "vertex" | "face" | "tristrips" if element.count > 0 => {
                    Err(Fault::invalid(Place::File, format!("element {} has no properties", element.name)))
                }
                _ => Ok(()),
            };
        }
        let least = match body {
            // A digit and the separator after it.
            Body::Text { .. } => 2 * element.properties.len() as u64,
            Body::Binary { .. } => element.properties.iter().map(|p| p.kind.least_size() as u64).sum(),
        };
        let room = match body {
            Body::Text { .. } => body.rest().len() as u64 + 1,
            Body::Binary { .. } => body.rest().len() as u64,
        };
        if element.count > room / least {
            return Err(element.short(room / least));
        }
        match element.name.as_str() {
            "vertex" => self.vertex_element(element, body),
            "face" => self.face_element(element, body),
            "tristrips" => self.strip_element(element, body),
            _ => skip_element(element, body),
        }
    }

    fn vertex_element(&mut self, element: &Element, body: &mut Body<'_>) -> Result<(), Fault> {
        let mut axes = [(0, Scalar::F32); 3];
        for (axis, name) in axes.iter_mut().zip(["x", "y", "z"]) {
            *axis = match element.property(&[name]).map(|index| (index, element.properties[index].kind)) {
                Some((index, Kind::Scalar(scalar))) => (index, scalar),
                _ => {
                    return Err(Fault::invalid(
                        Place::File,
                        format!("element vertex has no numeric property `{name}`"),
                    ));
                }
            };
        }
        if let (Body::Binary { bytes, at, order }, Some((offsets, stride))) = (&mut *body, element.layout()) {
            // The caller has checked that this many bytes are there.
            let length = element.count as usize * stride;
            let axes = axes.map(|(index, scalar)| (offsets[index], scalar));
            self.positions = positions(&bytes[*at..*at + length], stride, axes, *order);
            *at += length;
            return Ok(());
        }
        self.positions = Vec::with_capacity(element.count as usize);
        for index in 0..element.count {
            let mut position = DVec3::ZERO;
            for (number, property) in element.properties.iter().enumerate() {
                let each = |value, _| {
                    for (axis, &(axis_number, _)) in axes.iter().enumerate() {
                        if axis_number == number {
                            position[axis] = value;
                        }
                    }
                    Ok(())
                };
                read_property(property, element, index, body, each)?;
            }
            body.end_element(element, index)?;
            self.positions.push(position);
        }
        Ok(())
    }

    fn face_element(&mut self, element: &Element, body: &mut Body<'_>) -> Result<(), Fault> {
        let list = element.vertex_list()?;
        if let Body::Binary { bytes, at, order } = body {
            let rest = &bytes[*at..];
            if let Some((triangles, length)) = plain_triangles(element, list, rest, *order, self.vertices) {
                match self.triangles.is_empty() {
                    true => self.triangles = triangles,
                    false => self.triangles.extend(triangles),
                }
                *at += length;
                return Ok(());
            }
        }
        for index in 0..element.count {
            for (number, property) in element.properties.iter().enumerate() {
                if number != list {
                    read_property(property, element, index, body, |_, _| Ok(()))?;
                    continue;
                }
                read_property(property, element, index, body, |vertex, line| {
                    let vertex = self.vertex_index(vertex, "face", index, line)?;
                    self.polygons.push_corner(vertex);
                    Ok(())
                })?;
            }
            body.end_element(element, index)?;
            self.polygons.end_face();
        }
        Ok(())
    }

    fn strip_element(&mut self, element: &Element, body: &mut Body<'_>) -> Result<(), Fault> {
        let list = element.vertex_list()?;
        for index in 0..element.count {
            for (number, property) in element.properties.iter().enumerate() {
                let mut strip = Strip::default();
                read_property(property, element, index, body, |vertex, line| {
                    if number != list {
                        return Ok(());
                    }
                    if vertex == -1.0 {
                        strip = Strip::default();
                        return Ok(());
                    }
                    let vertex = self.vertex_index(vertex, "tristrips", index, line)?;
                    self.triangles.extend(strip.triangle(vertex));
                    Ok(())
                })?;
            }
            body.end_element(element, index)?;
        }
        Ok(())
    }

    fn vertex_index(&self, value: f64, element: &'static str, index: u64, line: Option<usize>) -> Result<u32, Fault> {
        // A cast from a float saturates, so that the comparison detects everything that is not a whole number in range.
        let vertex = value as u32;
        if f64::from(vertex) == value && (vertex as usize) < self.vertices {
            return Ok(vertex);
        }
        let index = index as usize;
        let place = match line {
            Some(line) => Place::ElementOnLine { element, index, line },
            None => Place::element(element, index),
        };
        let problem = Problem::IndexOutOfRange { what: "vertex", index: value as i64, count: self.vertices, first: 0 };
        Err(Fault::Malformed(place, problem))
    }

    fn finish(self, body: Body<'_>) -> Result<MeshFile, Fault> {
        let mut notes = Vec::new();
        let rest = match body {
            Body::Text { words, .. } => words.rest().trim_ascii().len(),
            Body::Binary { .. } => body.rest().len(),
        };
        if rest > 0 {
            notes.push(ReadNote::TrailingBytes { count: rest });
        }
        let mut triangles = self.triangles;
        let polygons = self.polygons.triangles(&self.positions, &mut notes);
        if triangles.is_empty() {
            triangles = polygons;
        } else {
            triangles.extend(polygons);
        }
        Ok(MeshFile::unitless(TriangleMesh { positions: self.positions, triangles }, notes))
    }
}

fn skip_element(element: &Element, body: &mut Body<'_>) -> Result<(), Fault> {
    if let (Body::Binary { at, .. }, Some((_, stride))) = (&mut *body, element.layout()) {
        *at += element.count as usize * stride;
        return Ok(());
    }
    for index in 0..element.count {
        for property in &element.properties {
            read_property(property, element, index, body, |_, _| Ok(()))?;
        }
        body.end_element(element, index)?;
    }
    Ok(())
}

/// Reads one property of element number `index` and passes its value, or each of its values, with its line in text, to
/// `each`.
#[inline]
fn read_property(
    property: &Property,
    element: &Element,
    index: u64,
    body: &mut Body<'_>,
    mut each: impl FnMut(f64, Option<usize>) -> Result<(), Fault>,
) -> Result<(), Fault> {
    checkpoint_at(index as usize);
    let (count, item) = match property.kind {
        Kind::Scalar(scalar) => (1.0, scalar),
        Kind::List { count, item } => (body.value(count)?.ok_or_else(|| element.short(index))?, item),
    };
    if count < 0.0 || count.fract() != 0.0 || count > f64::from(u32::MAX) {
        let sentence = format!("`{}` counts {count} values, which is not a valid length of a list", property.name);
        let place = body.line().map_or_else(|| Place::element(element.name.clone(), index as usize), Place::Line);
        return Err(Fault::invalid(place, sentence));
    }
    for _ in 0..count as u32 {
        let value = body.value(item)?.ok_or_else(|| element.short(index))?;
        each(value, body.line())?;
    }
    Ok(())
}

/// Reads the positions of vertices that all take `stride` bytes.
fn positions(bytes: &[u8], stride: usize, axes: [(usize, Scalar); 3], order: ByteOrder) -> Vec<DVec3> {
    let [x, y, z] = axes;
    let mut positions = vec_with_room(bytes.len() / stride);
    let vertices = bytes.par_chunks_exact(stride).with_min_len(ELEMENTS_PER_TASK);
    // The types are tested once here, so that the usual one has a loop of its own.
    if axes.iter().all(|&(_, scalar)| scalar == Scalar::F32) && order == ByteOrder::Little {
        let load = |vertex: &[u8], at: usize| Scalar::F32.load(&vertex[at..at + 4], ByteOrder::Little);
        let position = |v: &[u8]| DVec3::new(load(v, x.0), load(v, y.0), load(v, z.0));
        vertices.map(position).collect_into_vec(&mut positions);
    } else {
        let load = |vertex: &[u8], (at, scalar): (usize, Scalar)| scalar.load(&vertex[at..], order);
        vertices.map(|v| DVec3::new(load(v, x), load(v, y), load(v, z))).collect_into_vec(&mut positions);
    }
    positions
}

/// Reads the faces of an element whose only list is its vertices, if all of them are triangles with indices in range.
/// Returns them and their length in bytes, or `None` where the general reader must take over.
fn plain_triangles(
    element: &Element,
    list: usize,
    bytes: &[u8],
    order: ByteOrder,
    vertices: usize,
) -> Option<(Vec<[u32; 3]>, usize)> {
    let Kind::List { count, item } = element.properties[list].kind else { return None };
    if matches!(item, Scalar::F32 | Scalar::F64) {
        return None;
    }
    let mut start = 0;
    let mut stride = count.size() + 3 * item.size();
    for (number, property) in element.properties.iter().enumerate() {
        if number != list {
            let Kind::Scalar(scalar) = property.kind else { return None };
            stride += scalar.size();
            start += if number < list { scalar.size() } else { 0 };
        }
    }
    let length = usize::try_from(element.count).ok()?.checked_mul(stride)?;
    let bytes = bytes.get(..length)?;
    let is_plain = AtomicBool::new(true);
    let first = start + count.size();
    let limit = vertices as f64;
    let usual = order == ByteOrder::Little && count == Scalar::U8 && matches!(item, Scalar::I32 | Scalar::U32);
    let faces = bytes.par_chunks_exact(stride).with_min_len(ELEMENTS_PER_TASK);
    let mut triangles = vec_with_room(bytes.len() / stride);
    if usual {
        faces
            .map(|face| {
                let list = &face[start..start + 13];
                let corner =
                    |k: usize| u32::from_le_bytes([list[4 * k + 1], list[4 * k + 2], list[4 * k + 3], list[4 * k + 4]]);
                let corners = [corner(0), corner(1), corner(2)];
                if list[0] != 3 || corners.iter().any(|&corner| corner as usize >= vertices) {
                    is_plain.store(false, Ordering::Relaxed);
                }
                corners
            })
            .collect_into_vec(&mut triangles);
    } else {
        faces
            .map(|face| {
                let corner = |k: usize| item.load(&face[first + k * item.size()..], order);
                let corners = [corner(0), corner(1), corner(2)];
                if count.load(&face[start..], order) != 3.0 || !corners.iter().all(|c| (0.0..limit).contains(c)) {
                    is_plain.store(false, Ordering::Relaxed);
                }
                corners.map(|corner| corner as u32)
            })
            .collect_into_vec(&mut triangles);
    }
    is_plain.into_inner().then_some((triangles, length))
}

/// Writes the little-endian form, with coordinates as `double`, so that nothing is rounded.
///
/// trimesh, MeshLab, Blender, VTK and Open3D read `double`. Lists are of `int` with `uchar` counts, the layout of
/// nearly all existing files; with more vertices than an `int` can number they are of `uint`, the same bytes.
pub(super) fn write(out: &mut (impl Write + Send), mesh: &TriangleMesh, unit: Option<LengthUnit>) -> io::Result<()> {
    let unit = unit.map_or(String::new(), |unit| format!("comment unit {}\n", unit.symbol()));
    let index = if mesh.positions.len() <= 1 << 31 { "int" } else { "uint" };
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment PLY by ldi-ops\n{unit}element vertex {}\nproperty double x\n\
         property double y\nproperty double z\nelement face {}\nproperty list uchar {index} vertex_indices\nend_header\n",
        mesh.positions.len(),
        mesh.triangles.len()
    )?;
    write_each(out, &mesh.positions, |position, bytes| {
        bytes.extend_from_slice(position.to_array().map(f64::to_le_bytes).as_flattened());
    })?;
    write_each(out, &mesh.triangles, |triangle, bytes| {
        let mut record = [3; 13];
        record[1..].copy_from_slice(triangle.map(u32::to_le_bytes).as_flattened());
        bytes.extend_from_slice(&record);
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::io::Format;
    use crate::mesh::io::tests::{error, parsed, points};

    const FORMAT: Format = Format::Ply;
    const SQUARE: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.5], [1., 1., -0.], [0., 1., 0.25]];

    fn header(format: &str, lines: &str) -> String {
        format!("ply\nformat {format} 1.0\ncomment made for a test\n{lines}end_header\n")
    }

    fn put(bytes: &mut Vec<u8>, scalar: &str, value: f64, big: bool) {
        let mut little = match scalar {
            "char" => (value as i8).to_le_bytes().to_vec(),
            "uchar" => (value as u8).to_le_bytes().to_vec(),
            "short" => (value as i16).to_le_bytes().to_vec(),
            "ushort" => (value as u16).to_le_bytes().to_vec(),
            "int" => (value as i32).to_le_bytes().to_vec(),
            "uint" => (value as u32).to_le_bytes().to_vec(),
            "float" => (value as f32).to_le_bytes().to_vec(),
            "double" => value.to_le_bytes().to_vec(),
            other => panic!("{other} is no PLY type"),
        };
        if big {
            little.reverse();
        }
        bytes.extend(little);
    }

    /// Returns a square of four vertices with a colour between its coordinates, and `faces` with a number before and
    /// after.
    fn binary(format: &str, types: [&str; 3], name: &str, faces: &[&[f64]]) -> Vec<u8> {
        let [coordinate, count, item] = types;
        let big = format == "binary_big_endian";
        let lines = format!(
            "element vertex 4\nproperty {coordinate} x\nproperty uchar red\nproperty {coordinate} y\nproperty {coordinate} z\n\
             element face {}\nproperty short flag\nproperty list {count} {item} {name}\nproperty double weight\n",
            faces.len()
        );
        let mut bytes = header(format, &lines).into_bytes();
        for p in SQUARE {
            put(&mut bytes, coordinate, p[0], big);
            put(&mut bytes, "uchar", 200.0, big);
            put(&mut bytes, coordinate, p[1], big);
            put(&mut bytes, coordinate, p[2], big);
        }
        for face in faces {
            put(&mut bytes, "short", 1.0, big);
            put(&mut bytes, count, face.len() as f64, big);
            face.iter().for_each(|&vertex| put(&mut bytes, item, vertex, big));
            put(&mut bytes, "double", 1.0, big);
        }
        bytes
    }

    #[test]
    fn binary_files_of_every_type_and_byte_order_are_read() {
        for format in ["binary_little_endian", "binary_big_endian"] {
            for coordinate in ["float", "double"] {
                for count in ["char", "uchar", "short", "ushort", "int", "uint", "float"] {
                    for item in ["char", "uchar", "short", "ushort", "int", "uint", "double"] {
                        let types = [coordinate, count, item];
                        let triangles: [&[f64]; 2] = [&[0., 1., 2.], &[0., 2., 3.]];
                        let file = parsed(&binary(format, types, "vertex_indices", &triangles), FORMAT);
                        assert_eq!(file.mesh.positions, points(&SQUARE), "{format} {types:?}");
                        assert!(file.mesh.positions[2].z.is_sign_negative());
                        assert_eq!(file.mesh.triangles, [[0, 1, 2], [0, 2, 3]], "{format} {types:?}");
                        assert_eq!(file.notes, []);
                        let mixed: [&[f64]; 3] = [&[0., 1., 2.], &[0., 1., 2., 3.], &[1., 2.]];
                        let file = parsed(&binary(format, types, "vertex_index", &mixed), FORMAT);
                        assert_eq!(file.mesh.triangles, [[0, 1, 2], [0, 1, 2], [0, 2, 3]], "{format} {types:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn integer_coordinates_are_read() {
        for coordinate in ["char", "uchar", "short", "ushort", "int", "uint"] {
            let bytes = binary("binary_big_endian", [coordinate, "uchar", "int"], "vertex_index", &[&[0., 1., 3.]]);
            assert_eq!(parsed(&bytes, FORMAT).mesh.positions[3], DVec3::new(0., 1., 0.), "{coordinate}");
        }
    }

    #[test]
    fn other_elements_and_properties_are_skipped() {
        let lines = "element material 1\nproperty list uchar float values\nproperty int id\nelement vertex 4\n\
                     property double y\nproperty double x\nproperty uchar red\nproperty double z\nelement face 2\n\
                     property list uchar int vertex_indices\nproperty list uchar float texcoord\nelement edge 1\n\
                     property int a\nelement nothing 4000000000\n";
        let body = "2 0.5 0.5 1\n0.1 0 9 0\n0 1 9 nan\n1 1 9 -0\n1 0 9 inf\n3 0 1 2 2 5 6\n4 0 1 2 3 0\n7\n";
        for end in ["\n", "\r", "\r\n"] {
            let text = format!("{}{body}", header("ascii", lines)).replace('\n', end);
            let file = parsed(text.as_bytes(), FORMAT);
            assert_eq!(file.mesh.positions[0], DVec3::new(0.0, 0.1, 0.0));
            assert!(file.mesh.positions[1].z.is_nan() && file.mesh.positions[2].z.is_sign_negative());
            assert_eq!(file.mesh.triangles.len(), 3);
            assert_eq!(file.notes[0], ReadNote::PolygonsTriangulated { count: 1 });
        }
    }

    /// A value too few or too many would shift all that follow.
    #[test]
    fn lines_of_text_with_other_counts_of_values_are_named() {
        let lines = |vertices: u32| {
            format!(
                "element vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
                 property list uchar int vertex_index\n"
            )
        };
        let at = |vertices: u32, body: &str| {
            let message = error(format!("{}{body}", header("ascii", &lines(vertices))).as_bytes(), FORMAT);
            assert!(message.contains("a value too many or too few"), "{message}");
            message.split(" ends before").next().unwrap().to_owned()
        };
        assert_eq!(at(3, "0 0 0\n1 0\n0 1 0\n3 0 1 2\n"), "sample.ply, line 13: element vertex 1");
        assert_eq!(at(3, "0 0 0\n1 0 0 5\n0 1 0\n3 0 1 2\n"), "sample.ply, line 12: element vertex 1");
        assert_eq!(at(4, "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), "sample.ply, line 14: element vertex 3");
        let after = format!("{}0 0 0\n1 0 0\n0 1 0\n3 0 1 2 # end\n", header("ascii", &lines(3)));
        assert_eq!(parsed(after.as_bytes(), FORMAT).notes, [ReadNote::TrailingBytes { count: 5 }]);
        // An element may take several lines.
        let spread = format!("{}0 0\n0\n1 0 0\n\n0 1 0\n3\n0 1 2", header("ascii", &lines(3)));
        assert_eq!(parsed(spread.as_bytes(), FORMAT).mesh.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn line_feeds_after_a_header_of_carriage_returns_are_data() {
        let lines = "element vertex 3\nproperty char x\nproperty char y\nproperty char z\nelement face 1\n\
                     property list char char vertex_index\n";
        let data = [10, 0, 0, 1, 0, 0, 0, 1, 0, 3, 0, 1, 2];
        for end in ["\n", "\r", "\r\n"] {
            let mut bytes = header("binary_little_endian", lines).replace('\n', end).into_bytes();
            bytes.extend(data);
            let file = parsed(&bytes, FORMAT);
            assert_eq!(file.mesh.positions[0], DVec3::new(10.0, 0.0, 0.0), "{end:?}");
            assert_eq!(file.notes, [], "{end:?}");
        }
    }

    #[test]
    fn strips_reverse_every_other_triangle_and_restart() {
        let lines = "element vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement tristrips 2\n\
                     property list int int vertex_indices\n";
        let body = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 2 0\n9 0 1 2 3 -1 2 3 4 4\n3 0 1 2\n";
        let file = parsed(format!("{}{body}", header("ascii", lines)).as_bytes(), FORMAT);
        assert_eq!(file.mesh.triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4], [0, 1, 2]]);
    }

    #[test]
    fn faces_before_vertices_are_read() {
        let lines = "element face 1\nproperty list uchar int vertex_index\nelement vertex 4\nproperty int x\n\
                     property int y\nproperty int z\n";
        let text = format!("{}4 0 1 2 3\n0 0 0\n4 1 0\n1 1 0\n1 4 0\n", header("ascii", lines));
        // A dart, whose inner diagonal runs from corner 2 to corner 0.
        assert_eq!(parsed(text.as_bytes(), FORMAT).mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn errors_name_element_counts_and_values() {
        let little = "binary_little_endian";
        let types = ["float", "uchar", "int"];
        let bytes = binary(little, types, "vertex_index", &[&[0., 1., 2.], &[0., 1., 4.]]);
        let beyond = "sample.ply, face 1: vertex 4 is out of range: there are 4, counted from 0";
        assert_eq!(error(&bytes, FORMAT), beyond);
        let bytes = binary(little, types, "vertex_index", &[&[0., 1., -1.]]);
        assert_eq!(error(&bytes, FORMAT), "sample.ply, face 0: vertex -1 is out of range: there are 4, counted from 0");
        let bytes = binary(little, types, "vertex_index", &[&[0., 1., 2.], &[0., 1., 3.]]);
        let cut = &bytes[..bytes.len() - 10];
        assert_eq!(error(cut, FORMAT), "sample.ply: 2 elements `face` declared, 1 found");
        let mut long = bytes.clone();
        long.extend([0; 5]);
        assert_eq!(parsed(&long, FORMAT).notes, [ReadNote::TrailingBytes { count: 5 }]);
        let bytes = binary(little, ["float", "char", "int"], "corners", &[&[0., 1., 2.]]);
        assert_eq!(error(&bytes, FORMAT), "sample.ply: element face has no list `vertex_indices` or `vertex_index`");

        let vertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
        let face = "element face 1\nproperty list uchar int vertex_index\n";
        let ascii = |lines: &str, body: &str| format!("{}{body}", header("ascii", lines));
        let both = format!("{vertex}{face}");
        let cases = [
            (
                ascii(&both, "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
                ", line 14, face 0: vertex 3 is out of range: there are 3, counted from 0",
            ),
            (
                ascii(&both, "0 0 0\n1 0 0\n0 1 0\n3 0 1 .5\n"),
                ", line 14, face 0: vertex 0 is out of range: there are 3, counted from 0",
            ),
            (ascii(&both, "0 0 0\n1 0 0\n0 one 0\n3 0 1 3\n"), ", line 13: `one` is not a number"),
            (
                ascii(&both, "0 0 0\n1 0 0\n0 1 0\n-3 0 1 2\n"),
                ", line 14: `vertex_index` counts -3 values, which is not a valid length of a list",
            ),
            (ascii(&both, "0 0 0\n1 0 0\n0 1 0\n3 0 1"), ": 1 elements `face` declared, 0 found"),
            (ascii(&both, "0 0 0\n1 0 0\n0      "), ": 3 elements `vertex` declared, 2 found"),
            (
                ascii(vertex, "0 0 0\n1 0 0\n0 1 0\n"),
                ": the file has no triangles: the file has 3 vertices and no faces",
            ),
            (
                ascii("element vertex 99999999\nproperty float x\n", "0 0"),
                ": 99999999 elements `vertex` declared, 2 found",
            ),
            (ascii("element vertex 1\nproperty float x\n", "0 0"), ": element vertex has no numeric property `y`"),
            ("ply\nformat ascii 1.0\n".to_owned(), ", line 3: expected `end_header`, found the end of the file"),
            ("ply\nformat html\n".to_owned(), ", line 2: expected `ascii` or `binary_…_endian`, found `html`"),
            ("ply\nelement vertex x\n".to_owned(), ", line 2: `x` is not a count"),
            ("ply\nproperty int x\n".to_owned(), ", line 2: expected `element`, found `property`"),
            ("ply\nend_header\n".to_owned(), ", line 2: expected a line `format`, found `end_header`"),
            ("plyx\n".to_owned(), ", line 1: expected `ply`, found `plyx`"),
        ];
        for (text, message) in cases {
            assert_eq!(error(text.as_bytes(), FORMAT), format!("sample.ply{message}"), "{text:?}");
        }
    }
}
