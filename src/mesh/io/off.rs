//! OFF: the text form of Geomview's object file format, in its common variants.
//!
//! The first word lists the other attributes of a vertex (`STCNOFF`: texture coordinates, colour, normal, each
//! optional), which the reader skips with the rest of the vertex's line; it skips what follows a face's corners too.
//! The word itself may be missing, or touch the first count, and the counts may follow it on its line. `4OFF` and
//! `nOFF` have other numbers of coordinates and are refused, as is the binary form.

use std::io::{self, Write};

use glam::DVec3;

use super::MeshFile;
use super::error::{Fault, Place, Problem};
use super::formatted::write_each;
use super::note::ReadNote;
use super::polygon::Polygons;
use super::text::{Words, decode, push_integers, push_numbers, quote};
use crate::mesh::{LengthUnit, TriangleMesh};

pub(super) fn parse(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let text = decode(bytes);
    let mut words = Words::with_comments(&text, b'#');
    skip_header(&mut words)?;
    let vertices = count(&mut words, "a count of vertices")?;
    let faces = count(&mut words, "a count of faces")?;
    // The shortest vertex is `0 0 0` with its line's end, and the shortest face `0`.
    fits(&words, "vertices", vertices, 6)?;
    fits(&words, "faces", faces, 2)?;
    // A third number counts edges; few programs write it correctly.
    words.skip_line();

    let mut positions = Vec::with_capacity(vertices as usize);
    for index in 0..vertices {
        let mut position = [0.0; 3];
        for coordinate in &mut position {
            let word = words.next().ok_or_else(|| short("vertices", vertices, index))?;
            *coordinate = words.number(word)?;
        }
        positions.push(DVec3::from(position));
        words.skip_line();
    }
    let mut polygons = Polygons::default();
    for index in 0..faces {
        let word = words.next().ok_or_else(|| short("faces", faces, index))?;
        for _ in 0..words.count(word)? {
            let word = words.next().ok_or_else(|| short("faces", faces, index))?;
            let vertex = words.integer(word)?;
            if !(0..positions.len() as i64).contains(&vertex) {
                let place = Place::ElementOnLine { element: "face", index: index as usize, line: words.line() };
                let count = positions.len();
                let problem = Problem::IndexOutOfRange { what: "vertex", index: vertex, count, first: 0 };
                return Err(Fault::Malformed(place, problem));
            }
            polygons.push_corner(vertex as u32);
        }
        polygons.end_face();
        words.skip_line();
    }
    let mut notes = Vec::new();
    let rest = words.rest().trim_ascii();
    if !rest.is_empty() && words.next().is_some() {
        notes.push(ReadNote::TrailingBytes { count: rest.len() });
    }
    let triangles = polygons.triangles(&positions, &mut notes);
    Ok(MeshFile::unitless(TriangleMesh { positions, triangles }, notes))
}

fn skip_header(words: &mut Words<'_>) -> Result<(), Fault> {
    let start = words.rest();
    let word = words.next().ok_or_else(|| words.expected("`OFF`", None))?;
    if word.iter().all(u8::is_ascii_digit) {
        words.back_to(start);
        return Ok(());
    }
    let (four, name) = match word {
        [b'4', name @ ..] => (true, name),
        _ => (false, word),
    };
    let letters = name.iter().take_while(|byte| byte.is_ascii_alphabetic()).count();
    let (name, glued) = name.split_at(letters);
    let upper = name.to_ascii_uppercase();
    let extras = upper.strip_suffix(b"OFF").ok_or_else(|| words.expected("`OFF`", Some(word)))?;
    let extras = extras.strip_prefix(b"ST").unwrap_or(extras);
    let extras = extras.strip_prefix(b"C").unwrap_or(extras);
    let extras = extras.strip_prefix(b"N").unwrap_or(extras);
    if !extras.is_empty() || !glued.iter().all(u8::is_ascii_digit) {
        return Err(words.expected("`OFF`", Some(word)));
    }
    // A lower-case n means n dimensions and a capital one normals; the other letters come in either case.
    if four || name.ends_with(b"nOFF") {
        let kind = quote(word);
        let feature = format!("`{kind}` has coordinates of other than three dimensions, which is not supported");
        return Err(Fault::Unsupported(Place::Line(words.line()), feature));
    }
    let after = words.rest();
    if !glued.is_empty() {
        // The first count touches the keyword, as in `OFF8 6 0`.
        words.back_to(&start[start.len() - after.len() - glued.len()..]);
        return Ok(());
    }
    if words.next_on_line().is_some_and(|word| word.eq_ignore_ascii_case(b"BINARY")) {
        let feature = "the binary form of OFF is not supported; write it as text".to_owned();
        return Err(Fault::Unsupported(Place::Line(words.line()), feature));
    }
    words.back_to(after);
    Ok(())
}

fn count(words: &mut Words<'_>, expected: &'static str) -> Result<u64, Fault> {
    let word = words.next().ok_or_else(|| words.expected(expected, None))?;
    words.count(word)
}

/// Refuses a count of elements of at least `shortest` bytes each if they cannot fit; the last may lack its line's end.
fn fits(words: &Words<'_>, what: &'static str, promised: u64, shortest: u64) -> Result<(), Fault> {
    let bytes = words.rest().len() as u64;
    if promised <= (bytes + 1) / shortest {
        return Ok(());
    }
    Err(words.fault(Problem::Impossible { what: what.into(), promised, bytes }))
}

fn short(what: &'static str, promised: u64, found: u64) -> Fault {
    Fault::Malformed(Place::File, Problem::Short { what: what.into(), promised, found })
}

/// Writes positions, in the shortest decimals that read back as the same numbers, and triangles.
pub(super) fn write(out: &mut (impl Write + Send), mesh: &TriangleMesh, unit: Option<LengthUnit>) -> io::Result<()> {
    writeln!(out, "OFF\n# OFF by ldi-ops")?;
    if let Some(unit) = unit {
        writeln!(out, "# unit {}", unit.symbol())?;
    }
    // Readers ignore the count of edges.
    writeln!(out, "{} {} 0", mesh.positions.len(), mesh.triangles.len())?;
    write_each(out, &mesh.positions, |position, line| push_numbers(line, [b"", b" ", b" "], position, b"\n"))?;
    write_each(out, &mesh.triangles, |triangle, line| {
        push_integers(line, [b"3 ", b" ", b" "], triangle.map(u64::from), b"\n");
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::io::Format;
    use crate::mesh::io::tests::{error, parsed, points, utf_16};

    const FORMAT: Format = Format::Off;
    const BODY: &str = "0 0 0\n1 0.1 0\n1 1 -0\n0 1 0\n3 0 1 2\n4 0 1 2 3\n";

    #[test]
    fn headers_of_every_form_are_read() {
        let headers = [
            "OFF\n4 2 0\n",
            "OFF 4 2 0\n",
            "OFF\n4 2\n",
            "4 2 0\n",
            "off\n\n# a comment\n 4 2 0 # more\n\n",
            "OFF4 2 0\n",
            "# first\nOFF\n4 2 0\n",
            "OFF # comment\n4 2 0\n",
        ];
        for header in headers {
            for end in ["\n", "\r", "\r\n"] {
                let file = parsed(format!("{header}{BODY}").replace('\n', end).as_bytes(), FORMAT);
                let square = points(&[[0., 0., 0.], [1., 0.1, 0.], [1., 1., -0.], [0., 1., 0.]]);
                assert_eq!(file.mesh.positions, square, "{header:?}");
                assert!(file.mesh.positions[2].z.is_sign_negative());
                assert_eq!(file.mesh.triangles, [[0, 1, 2], [0, 1, 2], [0, 2, 3]], "{header:?}");
                assert_eq!(file.notes, [ReadNote::PolygonsTriangulated { count: 1 }], "{header:?}");
            }
        }
        let file = parsed(&utf_16(&format!("OFF\n4 2 0\n{BODY}"), u16::to_le_bytes), FORMAT);
        assert_eq!(file.mesh.triangles.len(), 3);
    }

    #[test]
    fn extra_values_at_vertices_and_faces_are_ignored() {
        let headers = [("COFF", "255 0 0 255"), ("NOFF", "0 0 1"), ("CNOFF", "0 0 1 1 0 0 0 1"), ("STOFF", "0.5 0.5")];
        for (header, extra) in headers {
            let text = format!("{header}\n3 1 0\n0 0 0 {extra}\n1 0 0 {extra}\n0 1 0 {extra}\n3 0 1 2 0.5 0.5 0.5 1\n");
            let file = parsed(text.as_bytes(), FORMAT);
            assert_eq!(file.mesh.positions, points(&[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]), "{header}");
            assert_eq!((file.mesh.triangles, file.notes), (vec![[0, 1, 2]], vec![]), "{header}");
        }
    }

    #[test]
    fn points_lines_and_trailing_text_are_noted() {
        let text = "OFF 3 4 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n2 0 1\n1 0\n0\nmore 1\n";
        let notes = [ReadNote::TrailingBytes { count: 6 }, ReadNote::PointsOrLinesIgnored { count: 3 }];
        assert_eq!(parsed(text.as_bytes(), FORMAT).notes, notes);
    }

    #[test]
    fn errors_name_line_face_and_value() {
        let cases = [
            (
                "OFF\n353535235358 6 0\n0 0 0\n",
                "line 2: 353535235358 vertices declared, which cannot fit in the 9 bytes that follow",
            ),
            ("OFF\n1 9999 0\n0 0 0\n", "line 2: 9999 faces declared, which cannot fit in the 9 bytes that follow"),
            ("OFF\n1 99999999999999999999 0\n0 0 0\n", "line 2: `99999999999999999999` is not a count"),
            ("OFF\n-1 0 0\n", "line 2: `-1` is not a count"),
            (
                "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n",
                "line 6, face 0: vertex 3 is out of range: there are 3, counted from 0",
            ),
            (
                "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n",
                "line 6, face 0: vertex -1 is out of range: there are 3, counted from 0",
            ),
            ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 zero\n3 0 1 2\n", "line 5: `zero` is not a number"),
            ("OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n3       ", " 4 vertices declared, 3 found"),
            ("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", " 2 faces declared, 1 found"),
            ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n999999999999 0 1 2\n", " 1 faces declared, 0 found"),
            ("PLY\n", "line 1: expected `OFF`, found `PLY`"),
            ("OFF\n", "line 2: expected a count of vertices, found the end of the file"),
            ("4OFF\n1 1 1", "line 1: `4OFF` has coordinates of other than three dimensions, which is not supported"),
            ("nOFF\n1 1 1", "line 1: `nOFF` has coordinates of other than three dimensions, which is not supported"),
            ("OFF BINARY\n", "line 1: the binary form of OFF is not supported; write it as text"),
            ("OFF\n1 0 0\n0 0 0", " the file has no triangles: the file has 1 vertices and no faces"),
        ];
        for (text, message) in cases {
            let found = error(text.as_bytes(), FORMAT);
            let message = match message.strip_prefix(' ') {
                Some(rest) => format!("sample.off: {rest}"),
                None => format!("sample.off, {message}"),
            };
            assert_eq!(found, message, "{text:?}");
        }
    }
}
