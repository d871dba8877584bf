//! STL: triangle soup, in binary or text.
//!
//! The reader tells the two forms apart by size first, since binary files that begin with `solid` are common: a file of
//! 84 + 50 n bytes with n at byte 80 is binary. Of the others, a file is text if it begins with `solid` or `facet` and
//! has no byte 0 near its start; otherwise it is binary with too many or too few bytes.
//!
//! Normals and attribute bytes are not read. Corners with the same bits may share a position; in text none do.

use std::convert::Infallible;
#[cfg(unix)]
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use crate::parallel::*;
use glam::DVec3;

use super::error::{Fault, Place, Problem, WriteError};
use super::formatted::write_each;
use super::note::ReadNote;
use super::text::{Words, decode};
use super::{Format, MeshFile};
use crate::allocation::{vec_with_room, zeroed};
use crate::cancel::checkpoint;
use crate::mesh::closed::BLOCK;
use crate::mesh::hash::Hash;
use crate::mesh::{Fold, LengthUnit, TriangleMesh};

const HEADER_BYTES: usize = 84;
const TRIANGLE_BYTES: usize = 50;

/// Number of triangles that one task converts: enough to outweigh the overhead, few enough to balance the load.
const TRIANGLES_PER_TASK: usize = 1 << 14;

/// Number of triangles that one call reads: their bytes then stay in the cache until they are parsed.
const TRIANGLES_PER_READ: usize = 1 << 10;

/// Parses a file, and folds the triangles of a binary one for the mesh check.
pub(super) fn parse(bytes: &[u8]) -> Result<(MeshFile, Option<Fold>), Fault> {
    let promised = promised(bytes);
    if promised.is_none_or(|count| length_of(count) != bytes.len() as u64) {
        let text = decode(bytes);
        if is_text(&text) {
            return Ok((parse_text(&text)?, None));
        }
    }
    let Some(promised) = promised else {
        let found = format!("{} bytes that are neither text nor a binary header of 84", bytes.len());
        return Err(Fault::Malformed(Place::Byte(0), Problem::Expected { expected: "an STL file".into(), found }));
    };
    let (file, fold) = parse_binary(bytes, promised)?;
    Ok((file, Some(fold)))
}

/// Reads a binary file of as many bytes as its header counts, piece by piece, and folds its triangles for the mesh check. Returns
/// `None` for all other files, which [`parse`] reads or refuses.
#[cfg(unix)]
pub(super) fn stream(file: &File, length: u64) -> io::Result<Option<(MeshFile, Fold)>> {
    use std::os::unix::fs::FileExt;

    let mut header = [0; HEADER_BYTES];
    if length <= HEADER_BYTES as u64 {
        return Ok(None);
    }
    file.read_exact_at(&mut header, 0)?;
    let count = promised(&header).filter(|&count| length_of(count) == length).map_or(0, |count| count as usize);
    if count == 0 || check_count(count).is_err() {
        return Ok(None);
    }
    let read = |bytes: &mut [u8], at: usize| file.read_exact_at(bytes, (HEADER_BYTES + at) as u64);
    let (mesh, fold) = weld_recent(count, read)?;
    Ok(Some((MeshFile::unitless(mesh, Vec::new()), fold)))
}

/// Returns the number of triangles by the header of a binary file.
fn promised(start: &[u8]) -> Option<u32> {
    let count = start.get(80..84)?;
    Some(u32::from_le_bytes([count[0], count[1], count[2], count[3]]))
}

/// Returns the length in bytes of a binary file of some triangles.
fn length_of(count: u32) -> u64 {
    HEADER_BYTES as u64 + TRIANGLE_BYTES as u64 * u64::from(count)
}

/// Returns whether the file begins as text does: with `solid` or `facet`, and without a byte 0.
///
/// In a binary file the last byte of the count is 0, unless it counts more than 16 million triangles.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    let start = &bytes[..bytes.len().min(1024)];
    let word = Words::new(start).next().unwrap_or_default();
    !start.contains(&0) && ["solid", "facet"].iter().any(|keyword| word.eq_ignore_ascii_case(keyword.as_bytes()))
}

/// Returns the length in bytes of a binary file by the count in its header, or `None` where that is 0 or the file is
/// text.
pub(super) fn binary_length(start: &[u8]) -> Option<u64> {
    promised(start).filter(|&count| count > 0 && !is_text(start)).map(length_of)
}

fn parse_binary(bytes: &[u8], promised: u32) -> Result<(MeshFile, Fold), Fault> {
    let body = &bytes[HEADER_BYTES..];
    let count = promised as usize;
    let found = body.len() / TRIANGLE_BYTES;
    if found < count {
        let problem = Problem::Short { what: "triangles".into(), promised: promised.into(), found: found as u64 };
        return Err(Fault::Malformed(Place::Byte(80), problem));
    }
    if count == 0 {
        return Err(Fault::Empty(format!("the binary header counts 0, and {} bytes follow it", body.len())));
    }
    // An index is 32 bits, and a triangle of a soup has three vertices of its own.
    check_count(count)?;
    let (records, rest) = body.split_at(count * TRIANGLE_BYTES);
    let Ok((mesh, fold)) = weld_recent(count, |bytes, at| {
        bytes.copy_from_slice(&records[at..at + bytes.len()]);
        Ok::<_, Infallible>(())
    });
    let mut notes = Vec::new();
    if !rest.is_empty() {
        notes.push(ReadNote::TrailingBytes { count: rest.len() });
    }
    Ok((MeshFile::unitless(mesh, notes), fold))
}

fn check_count(triangles: usize) -> Result<(), Fault> {
    let limit = u64::from(u32::MAX) / 3;
    if triangles as u64 <= limit {
        return Ok(());
    }
    Err(Fault::Malformed(Place::File, Problem::TooMany { what: "triangles".into(), found: triangles as u64, limit }))
}

/// Builds the mesh of `count` binary records, and folds its triangles for the mesh check. A corner shares the position of one
/// with the same bits shortly before. `read` fills a buffer with the bytes at an offset behind the header.
///
/// Neighbours mostly stand close together in a file, so a small table per task finds most corners that occur again.
/// Every later stage then processes about a fifth of the positions, which saves more than the table costs; finding all
/// repetitions would not. Tasks are of a fixed size, so that the result does not depend on the thread count.
fn weld_recent<E: Send>(
    count: usize,
    read: impl Fn(&mut [u8], usize) -> Result<(), E> + Sync,
) -> Result<(TriangleMesh, Fold), E> {
    let mut triangles: Vec<[u32; 3]> = zeroed(count);
    // One table for each thread: new ones for all that the pool splits off would cost a seventh of the time.
    let tables: Mutex<Vec<RecentCorners>> = Mutex::default();
    let unused = || tables.lock().unwrap_or_else(PoisonError::into_inner);
    let pieces: Vec<(Vec<[u32; 3]>, Fold)> = triangles
        .par_chunks_mut(TRIANGLES_PER_TASK)
        .enumerate()
        .map(|(task, triangles)| {
            checkpoint();
            let taken = unused().pop();
            let mut recent = taken.unwrap_or_default();
            let offset = task * TRIANGLES_PER_TASK * TRIANGLE_BYTES;
            let piece = recent.weld(triangles, |bytes, at| read(bytes, offset + at))?;
            unused().push(recent);
            Ok(piece)
        })
        .collect::<Result<_, E>>()?;
    let fold = pieces.iter().fold(Fold::EMPTY, |all, (_, fold)| all.join(*fold));
    let mut positions = zeroed(pieces.iter().map(|(corners, _)| corners.len()).sum());
    let (mut rest, mut first) = (&mut positions[..], 0);
    let places: Vec<(&mut [DVec3], u32)> = pieces
        .iter()
        .map(|(corners, _)| {
            let place = (rest.split_off_mut(..corners.len()).expect("there is room for all"), first);
            first += corners.len() as u32;
            place
        })
        .collect();
    let parts = triangles.par_chunks_mut(TRIANGLES_PER_TASK).zip(&pieces).zip(places);
    parts.for_each(|((triangles, (corners, _)), (positions, first))| {
        positions.iter_mut().zip(corners).for_each(|(place, corner)| *place = position(*corner));
        triangles.as_flattened_mut().iter_mut().for_each(|vertex| *vertex += first);
    });
    Ok((TriangleMesh { positions, triangles }, fold))
}

/// Returns the position of a corner, given the bits of its coordinates.
fn position(corner: [u32; 3]) -> DVec3 {
    DVec3::from_array(corner.map(|bits| f64::from(f32::from_bits(bits))))
}

/// The distinct corners of a task, and a hash table of those seen recently: each slot keeps the last corner.
struct RecentCorners {
    /// x and y, z, and the index of the corner.
    table: Vec<(u64, u32, u32)>,
    /// Room for all corners of a task, of which `count` are taken, and for one more.
    corners: Vec<[u32; 3]>,
    hashes: Vec<Hash>,
    count: u32,
    /// Records that have been read.
    bytes: Vec<u8>,
}

impl Default for RecentCorners {
    fn default() -> RecentCorners {
        RecentCorners {
            table: vec![RecentCorners::EMPTY; 1 << RecentCorners::LOG],
            corners: vec![[0; 3]; 3 * TRIANGLES_PER_TASK + 1],
            hashes: vec![[0; 2]; 3 * TRIANGLES_PER_TASK],
            count: 0,
            bytes: vec![0; TRIANGLES_PER_READ * TRIANGLE_BYTES],
        }
    }
}

impl RecentCorners {
    /// The table then fits the L2 cache of most processors, and holds a layer of a mesh that was made in layers.
    const LOG: u32 = 13;

    /// Marks an empty slot of the table. A task has far fewer corners.
    const NONE: u32 = u32::MAX;

    const EMPTY: (u64, u32, u32) = (0, 0, RecentCorners::NONE);

    /// Reads the triangles of a task, and returns its distinct corners and the fold of its triangles.
    fn weld<E>(
        &mut self,
        triangles: &mut [[u32; 3]],
        read: impl Fn(&mut [u8], usize) -> Result<(), E>,
    ) -> Result<(Vec<[u32; 3]>, Fold), E> {
        self.table.fill(RecentCorners::EMPTY);
        self.count = 0;
        let mut fold = Fold::EMPTY;
        let mut hashes = [[[0; 2]; 3]; BLOCK];
        for (index, triangles) in triangles.chunks_mut(TRIANGLES_PER_READ).enumerate() {
            read(&mut self.bytes[..triangles.len() * TRIANGLE_BYTES], index * TRIANGLES_PER_READ * TRIANGLE_BYTES)?;
            for (index, triangles) in triangles.chunks_mut(BLOCK).enumerate() {
                let known = self.count as usize;
                self.place(index * BLOCK, triangles);
                let new = known..self.count as usize;
                fold.include(&mut self.hashes[new.clone()], self.corners[new].iter().copied().map(position));
                for (hashes, triangle) in hashes.iter_mut().zip(&*triangles) {
                    *hashes = triangle.map(|corner| self.hashes[corner as usize]);
                }
                fold.add(&hashes[..triangles.len()]);
            }
        }
        Ok((self.corners[..self.count as usize].to_vec(), fold))
    }

    /// Sets triangles to the indices of their corners, new ones unless they are known, from record `first` on.
    fn place(&mut self, first: usize, triangles: &mut [[u32; 3]]) {
        let RecentCorners { table, corners, bytes, .. } = self;
        let table: &mut [_; 1 << RecentCorners::LOG] =
            table.as_mut_slice().try_into().expect("the table has this size");
        let mut count = self.count;
        for (record, triangle) in bytes.as_chunks::<TRIANGLE_BYTES>().0[first..].iter().zip(triangles) {
            // The normal takes the first 12 bytes.
            for (vertex, corner) in triangle.iter_mut().zip(record[12..48].as_chunks::<12>().0) {
                let bits = corner.as_chunks::<4>().0;
                let [x, y, z] = [u32::from_le_bytes(bits[0]), u32::from_le_bytes(bits[1]), u32::from_le_bytes(bits[2])];
                let xy = u64::from(x) | u64::from(y) << 32;
                // Odd constants that spread all bits into the high ones: the fractions of the golden ratio and of π.
                let mixed = xy.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ u64::from(z).wrapping_mul(0x243f_6a88_85a3_08d3);
                let mixed = (mixed ^ mixed >> 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                let slot = &mut table[(mixed >> (64 - RecentCorners::LOG)) as usize];
                let (known_xy, known_z, known) = *slot;
                let differing = (known_xy ^ xy) | u64::from(known_z ^ z);
                let is_new = (differing != 0) | (known == RecentCorners::NONE);
                // Whether a corner is known is hard to predict, so everything is written either way.
                *vertex = if is_new { count } else { known };
                corners[count as usize] = [x, y, z];
                count += u32::from(is_new);
                *slot = (xy, z, *vertex);
            }
        }
        self.count = count;
    }
}

fn soup(corners: Vec<[DVec3; 3]>) -> TriangleMesh {
    let mut triangles = vec_with_room(corners.len());
    (0..corners.len() as u32)
        .into_par_iter()
        .with_min_len(TRIANGLES_PER_TASK)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect_into_vec(&mut triangles);
    TriangleMesh { positions: corners.into_flattened(), triangles }
}

/// Parses text word by word, so that lines and spaces may stand anywhere; only names, which follow `solid` and
/// `endsolid` and may be anything, end with their line. Other words after `endloop` and `endfacet` are skipped too.
fn parse_text(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let mut words = Words::new(bytes);
    let mut corners: Vec<[DVec3; 3]> = Vec::new();
    let (mut solids, mut facets_before, mut is_within) = (0, 0, false);
    while let Some(word) = words.next() {
        match Keyword::of(word) {
            Some(keyword @ (Keyword::Solid | Keyword::EndSolid)) => {
                is_within = keyword == Keyword::Solid;
                solids += usize::from(corners.len() > facets_before);
                facets_before = corners.len();
                skip_name(&mut words);
            }
            Some(Keyword::Facet) => corners.push(facet(&mut words, corners.len())?),
            _ => return Err(words.expected("`facet`, `endsolid` or `solid`", Some(word))),
        }
    }
    solids += usize::from(corners.len() > facets_before);
    if corners.is_empty() {
        return Err(Fault::Empty("the text has no facet".to_owned()));
    }
    // A file may have been cut off between two facets.
    if is_within {
        return Err(words.expected("`facet` or `endsolid`", None));
    }
    check_count(corners.len())?;
    let mut notes = Vec::new();
    if solids > 1 {
        notes.push(ReadNote::SolidsMerged { count: solids });
    }
    Ok(MeshFile::unitless(soup(corners), notes))
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Keyword {
    Solid,
    Facet,
    Outer,
    Loop,
    Vertex,
    EndLoop,
    EndFacet,
    EndSolid,
}

impl Keyword {
    fn of(word: &[u8]) -> Option<Keyword> {
        let keywords: [(&str, Keyword); 8] = [
            ("vertex", Keyword::Vertex),
            ("facet", Keyword::Facet),
            ("outer", Keyword::Outer),
            ("loop", Keyword::Loop),
            ("endloop", Keyword::EndLoop),
            ("endfacet", Keyword::EndFacet),
            ("solid", Keyword::Solid),
            ("endsolid", Keyword::EndSolid),
        ];
        keywords.iter().find(|(name, _)| word.eq_ignore_ascii_case(name.as_bytes())).map(|&(_, keyword)| keyword)
    }
}

/// Skips a solid's name: the rest of the line, or what precedes `facet normal` where a file is all one line.
fn skip_name(words: &mut Words<'_>) {
    let mut start = words.rest();
    while let Some(word) = words.next_on_line() {
        if Keyword::of(word) == Some(Keyword::Facet) {
            let next = words.next_on_line().unwrap_or_default();
            if next.eq_ignore_ascii_case(b"normal") {
                words.back_to(start);
                return;
            }
        }
        start = words.rest();
    }
}

/// Skips the rest of the line, up to a keyword.
fn skip_remark(words: &mut Words<'_>) {
    loop {
        let before = words.rest();
        let Some(word) = words.next_on_line() else { return };
        if Keyword::of(word).is_some() {
            return words.back_to(before);
        }
    }
}

/// Reads the three corners of facet number `index`, whose first word has been read.
fn facet(words: &mut Words<'_>, index: usize) -> Result<[DVec3; 3], Fault> {
    // Nothing depends on the normal, so it may be missing, or anything but a keyword.
    let mut word = loop {
        let word = words.next();
        match word.map(Keyword::of) {
            Some(None) => continue,
            Some(Some(Keyword::Outer | Keyword::Loop)) => continue,
            Some(Some(Keyword::Vertex | Keyword::EndLoop | Keyword::EndFacet)) => break word,
            _ => return Err(words.expected("`outer loop`", word)),
        }
    };
    let mut corners = [DVec3::ZERO; 3];
    let mut count = 0;
    while let Some(Keyword::Vertex) = word.and_then(Keyword::of) {
        let mut corner = [0.0; 3];
        for coordinate in &mut corner {
            let word = words.next().ok_or_else(|| words.expected("a coordinate", None))?;
            *coordinate = words.number(word)?;
        }
        if let Some(place) = corners.get_mut(count) {
            *place = DVec3::from(corner);
        }
        count += 1;
        word = words.next();
    }
    if word.and_then(Keyword::of) != Some(Keyword::EndLoop) && word.and_then(Keyword::of) != Some(Keyword::EndFacet) {
        return Err(words.expected("`vertex` or `endloop`", word));
    }
    if count != 3 {
        let place = Place::ElementOnLine { element: "facet", index, line: words.line() };
        return Err(Fault::invalid(place, format!("a facet needs 3 vertices, but this one has {count}")));
    }
    if word.and_then(Keyword::of) == Some(Keyword::EndLoop) {
        skip_remark(words);
        let end = words.next();
        if end.and_then(Keyword::of) != Some(Keyword::EndFacet) {
            return Err(words.expected("`endfacet`", end));
        }
    }
    skip_remark(words);
    Ok(corners)
}

/// Checks that binary STL can hold the mesh.
pub(super) fn check(path: &Path, mesh: &TriangleMesh) -> Result<(), WriteError> {
    if mesh.triangles.len() > u32::MAX as usize {
        let (path, format) = (path.to_path_buf(), Format::Stl);
        return Err(WriteError::TooManyTriangles { path, format, triangles: mesh.triangles.len(), limit: u32::MAX });
    }
    Ok(())
}

/// Writes binary STL. The mesh has been checked; the normals are those of the corners before rounding, and zero for
/// triangles without area.
pub(super) fn write(out: &mut (impl Write + Send), mesh: &TriangleMesh, unit: Option<LengthUnit>) -> io::Result<()> {
    let mut header = [b' '; 80];
    let title = match unit {
        Some(unit) => format!("binary STL by ldi-ops, unit {}", unit.symbol()),
        None => "binary STL by ldi-ops".to_owned(),
    };
    header[..title.len()].copy_from_slice(title.as_bytes());
    out.write_all(&header)?;
    out.write_all(&(mesh.triangles.len() as u32).to_le_bytes())?;
    write_each(out, &mesh.triangles, |triangle, bytes| {
        let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let mut record = [0; TRIANGLE_BYTES];
        let numbers = [normal, a, b, c].map(|v| v.as_vec3().to_array().map(f32::to_le_bytes));
        record[..TRIANGLE_BYTES - 2].copy_from_slice(numbers.as_flattened().as_flattened());
        bytes.extend_from_slice(&record);
    })
}

#[cfg(all(test, feature = "cpu"))]
mod tests {
    use super::*;
    use crate::mesh::io::tests::{error, parsed, points};

    const FORMAT: Format = Format::Stl;

    fn binary(header: &[u8], promised: u32, triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes[..header.len()].copy_from_slice(header);
        bytes.extend(promised.to_le_bytes());
        for triangle in triangles {
            bytes.extend([0; 12]);
            bytes.extend(triangle.iter().flatten().flat_map(|value| value.to_le_bytes()));
            bytes.extend([0xAB; 2]);
        }
        bytes
    }

    const TRIANGLE: [[f32; 3]; 3] = [[0.0, -0.0, 1.0], [2.0, 0.1, 3.0], [4.0, 5.0, f32::NAN]];

    #[test]
    fn binary_files_are_recognised_by_size_even_after_solid() {
        let file = parsed(&binary(b"solid facet", 2, &[TRIANGLE; 2]), FORMAT);
        // Corners with the same bits become one position, NaNs included.
        assert_eq!(file.mesh.triangles, [[0, 1, 2]; 2]);
        assert_eq!(file.mesh.positions.len(), 3);
        assert_eq!(file.mesh.positions[0], DVec3::new(0.0, 0.0, 1.0));
        assert!(file.mesh.positions[0].y.is_sign_negative());
        assert_eq!(file.mesh.positions[1].y, f64::from(0.1f32));
        assert!(file.mesh.positions[2].z.is_nan());
        assert_eq!((file.notes, file.unit), (vec![], None));
    }

    #[test]
    fn trailing_bytes_of_binary_files_are_noted() {
        let mut bytes = binary(b"solid", 1, &[TRIANGLE]);
        bytes.extend([7; 3]);
        assert_eq!(parsed(&bytes, FORMAT).notes, [ReadNote::TrailingBytes { count: 3 }]);
    }

    #[test]
    fn truncated_binary_files_are_refused() {
        let bytes = binary(b"", 3, &[TRIANGLE; 2]);
        assert_eq!(error(&bytes, FORMAT), "sample.stl, byte 80: 3 triangles declared, 2 found");
        let bytes = binary(b"", u32::MAX, &[TRIANGLE; 2]);
        assert_eq!(error(&bytes, FORMAT), "sample.stl, byte 80: 4294967295 triangles declared, 2 found");
        let neither =
            "sample.stl, byte 0: expected an STL file, found 3 bytes that are neither text nor a binary header of 84";
        assert_eq!(error(b"abc", FORMAT), neither);
    }

    #[test]
    fn files_without_triangles_are_refused() {
        assert_eq!(error(b"", FORMAT), "sample.stl: the file has no triangles: the file has no bytes");
        assert_eq!(
            error(b"solid a\nendsolid a\n", FORMAT),
            "sample.stl: the file has no triangles: the text has no facet"
        );
        let counted = "sample.stl: the file has no triangles: the binary header counts 0, and 0 bytes follow it";
        assert_eq!(error(&binary(b"x", 0, &[]), FORMAT), counted);
    }

    const FACET: &str =
        "facet normal 0 0 1\n outer loop\n  vertex 0 -0 1\n  vertex 2 0.1 3\n  vertex 4 5 nan\n endloop\nendfacet\n";

    #[test]
    fn text_is_read_in_all_line_ends_cases_and_spaces() {
        let plain = format!("solid a\n{FACET}endsolid a\n");
        let texts = [
            plain.clone(),
            plain.replace('\n', "\r"),
            plain.replace('\n', "\r\n"),
            plain.to_uppercase(),
            plain.replace(' ', "\t \t").replace('\n', " \n\n \t"),
            plain.replace("solid a\n", "solid\n"),
            plain.replace("solid a\n", "solid facet outer vertex 1 2\n"),
            plain.replace('\n', " "),
            plain.replace("normal 0 0 1", "normal nan -nan(ind) 1.#QNAN"),
            plain.replace("normal 0 0 1", ""),
            FACET.to_owned(),
            format!("\u{feff}{plain}"),
            plain.replace("endloop", "endloop foo 1").replace("endfacet", "endfacet bar"),
        ];
        for text in &texts {
            let file = parsed(text.as_bytes(), FORMAT);
            assert_eq!(file.mesh.triangles, [[0, 1, 2]], "{text:?}");
            assert_eq!(file.mesh.positions[1], DVec3::new(2.0, 0.1, 3.0), "{text:?}");
            assert!(file.mesh.positions[0].y.is_sign_negative(), "{text:?}");
            assert!(file.mesh.positions[2].z.is_nan(), "{text:?}");
            assert_eq!(file.notes, [], "{text:?}");
        }
    }

    #[test]
    fn text_with_several_solids_is_read_as_one_mesh() {
        let text =
            format!("solid a\n{FACET}endsolid a\nsolid nothing\nendsolid\nsolid b c\n{FACET}{FACET}endsolid b c\n");
        let file = parsed(text.as_bytes(), FORMAT);
        assert_eq!(file.mesh.triangles, [[0, 1, 2], [3, 4, 5], [6, 7, 8]]);
        assert_eq!(file.notes, [ReadNote::SolidsMerged { count: 2 }]);
    }

    #[test]
    fn errors_in_text_name_the_line() {
        let text = |from: &str, to: &str| format!("solid a\n{}", FACET.replacen(from, to, 1));
        assert_eq!(error(text("0.1", "0,1").as_bytes(), FORMAT), "sample.stl, line 5: `0,1` is not a number");
        let many = text("vertex 0", "vertex 9 9 9 vertex 0");
        let four = "sample.stl, line 7, facet 0: a facet needs 3 vertices, but this one has 4";
        assert_eq!(error(many.as_bytes(), FORMAT), four);
        let extra = text("5 nan", "5 nan 6");
        assert_eq!(error(extra.as_bytes(), FORMAT), "sample.stl, line 6: expected `vertex` or `endloop`, found `6`");
        let cut = text("nan\n endloop\nendfacet\n", "");
        assert_eq!(
            error(cut.as_bytes(), FORMAT),
            "sample.stl, line 6: expected a coordinate, found the end of the file"
        );
        let control = text("4 5", "\x10 5");
        assert_eq!(error(control.as_bytes(), FORMAT), "sample.stl, line 6: `\\u{10}` is not a number");
        let odd = text("endfacet", "endfact");
        assert_eq!(error(odd.as_bytes(), FORMAT), "sample.stl, line 8: expected `endfacet`, found `endfact`");
        let between = text("", "") + FACET;
        assert_eq!(
            error(between.as_bytes(), FORMAT),
            "sample.stl, line 16: expected `facet` or `endsolid`, found the end of the file"
        );
    }

    #[test]
    fn written_meshes_are_read_back() {
        let mesh = TriangleMesh {
            positions: points(&[[0., 0., 0.], [1., 0., 0.], [0., 0.1, 0.], [-0., 0., 1e-30]]),
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 1, 1]],
        };
        let mut bytes = Vec::new();
        write(&mut bytes, &mesh, Some(LengthUnit::Millimetre)).unwrap();
        assert_eq!(bytes.len(), 84 + 3 * 50);
        assert!(bytes.starts_with(b"binary STL by ldi-ops, unit mm "));
        assert_eq!(&bytes[84..96], [[0; 4], [0; 4], (-1f32).to_le_bytes()].concat());
        let read = parsed(&bytes, FORMAT).mesh;
        let rounded = |index: u32| mesh.positions[index as usize].as_vec3().as_dvec3();
        let corners: Vec<DVec3> = mesh.triangles.iter().flatten().map(|&index| rounded(index)).collect();
        let read_corners: Vec<DVec3> = read.triangles.iter().flatten().map(|&i| read.positions[i as usize]).collect();
        assert_eq!(read_corners, corners);
        assert!(read_corners[5].x.is_sign_negative());
    }

    #[cfg(unix)]
    #[test]
    fn streamed_files_are_parsed_files() {
        let path = tempfile::NamedTempFile::new().unwrap().into_temp_path();
        let streamed = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            stream(&File::open(&path).unwrap(), bytes.len() as u64)
        };
        let mesh = crate::solids::geodesic(1.0, 60).unwrap();
        let mut bytes = Vec::new();
        write(&mut bytes, &mesh, None).unwrap();
        let (file, fold) = streamed(&bytes).unwrap().unwrap();
        assert!((file.clone(), Some(fold)) == parse(&bytes).unwrap());
        assert_eq!(fold, Fold::of_mesh(&file.mesh));
        assert!(stream(&File::open(&path).unwrap(), bytes.len() as u64 + 50).unwrap().is_none());
        for other in
            [&bytes[..bytes.len() - 1], &[bytes.as_slice(), b"x"].concat(), &binary(b"x", 0, &[]), FACET.as_bytes()]
        {
            assert!(streamed(other).unwrap().is_none());
        }
        // A file that became shorter after its length was taken.
        let length = bytes.len() as u64;
        bytes.truncate(100_000);
        std::fs::write(&path, &bytes).unwrap();
        let error = stream(&File::open(&path).unwrap(), length).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::UnexpectedEof);
    }

    #[test]
    fn large_files_keep_all_corners_and_share_most() {
        // More than three tasks, the last of them short, with 0 and −0 among the coordinates.
        let mesh = crate::solids::geodesic(1.0, 60).unwrap();
        assert!(
            mesh.triangles.len() > 4 * TRIANGLES_PER_TASK && !mesh.triangles.len().is_multiple_of(TRIANGLES_PER_TASK)
        );
        let mut bytes = Vec::new();
        write(&mut bytes, &mesh, None).unwrap();
        let read = parsed(&bytes, FORMAT).mesh;
        let bits = |mesh: &TriangleMesh| -> Vec<[u32; 3]> {
            let corners = mesh.triangles.iter().flatten().map(|&i| mesh.positions[i as usize].as_vec3());
            corners.map(|corner| corner.to_array().map(f32::to_bits)).collect()
        };
        assert!(bits(&read) == bits(&mesh));
        assert!(read.positions.len() < mesh.triangles.len(), "{} positions", read.positions.len());
        let mut used = vec![false; read.positions.len()];
        read.triangles.as_flattened().iter().for_each(|&vertex| used[vertex as usize] = true);
        assert!(used.iter().all(|&used| used));
    }
}
