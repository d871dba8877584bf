//! Wavefront OBJ: positions and faces; everything about appearance is left out.
//!
//! The reader is our own. The `tobj` crate was the first choice, and the tests still compare with it, but it gives each
//! object only the vertices that its faces use, renumbered, so that objects no longer share vertices; it reads a
//! polyline (`l`) of three points as a triangle and one of four as a quad; it divides positions by their weights; it
//! does not report the line of an error; it refuses a name or a comment that is not UTF-8; and a relative index that
//! lies far out of range makes it overflow.
//!
//! Positions are kept in the order of the file, including those that no face uses. A face may refer to a vertex that
//! comes later. Objects and groups are ignored; all faces are read.

use std::io::{self, Write};

use glam::DVec3;

use super::MeshFile;
use super::error::{Fault, Place, Problem};
use super::formatted::write_each;
use super::note::ReadNote;
use super::polygon::Polygons;
use super::text::{Words, decode, push_integers, push_numbers};
use crate::mesh::{LengthUnit, TriangleMesh};

pub(super) fn parse(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let text = decode(bytes);
    let mut reader = Reader { words: Words::with_comments(&text, b'#'), ..Reader::new() };
    reader.run()?;
    let Reader { positions, faces, lines, mut notes, .. } = reader;
    for (index, (face, &line)) in faces.iter().zip(&lines).enumerate() {
        if let Some(&vertex) = face.iter().find(|&&vertex| vertex as usize >= positions.len()) {
            return Err(out_of_range(index, line, i64::from(vertex) + 1, positions.len()));
        }
    }
    let triangles = faces.triangles(&positions, &mut notes);
    Ok(MeshFile::unitless(TriangleMesh { positions, triangles }, notes))
}

fn out_of_range(face: usize, line: usize, index: i64, count: usize) -> Fault {
    let place = Place::ElementOnLine { element: "face", index: face, line };
    Fault::Malformed(place, Problem::IndexOutOfRange { what: "vertex", index, count, first: 1 })
}

struct Reader<'a> {
    words: Words<'a>,
    positions: Vec<DVec3>,
    faces: Polygons,
    /// The line of each face, for errors that are detected only at the end of the file.
    lines: Vec<usize>,
    notes: Vec<ReadNote>,
}

impl<'a> Reader<'a> {
    fn new() -> Reader<'a> {
        Reader {
            words: Words::new(&[]),
            positions: Vec::new(),
            faces: Polygons::default(),
            lines: Vec::new(),
            notes: Vec::new(),
        }
    }

    fn run(&mut self) -> Result<(), Fault> {
        let (mut objects, mut faces_before) = (0, 0);
        let (mut points_or_lines, mut free_forms, mut weights) = (0, 0, 0);
        loop {
            match self.next_word() {
                Some(b"v") => weights += usize::from(self.vertex()?),
                Some(b"f" | b"fo") => self.face()?,
                Some(b"o") => {
                    objects += usize::from(self.faces.faces() > faces_before);
                    faces_before = self.faces.faces();
                }
                Some(b"p" | b"l") => points_or_lines += 1,
                Some(b"curv" | b"curv2" | b"surf") => free_forms += 1,
                _ => {}
            }
            if !self.skip_statement() {
                break;
            }
        }
        objects += usize::from(self.faces.faces() > faces_before);
        if objects > 1 {
            self.notes.push(ReadNote::ObjectsMerged { count: objects });
        }
        if weights > 0 {
            self.notes.push(ReadNote::WeightsIgnored { count: weights });
        }
        if free_forms > 0 {
            self.notes.push(ReadNote::FreeFormIgnored { count: free_forms });
        }
        if points_or_lines > 0 {
            self.notes.push(ReadNote::PointsOrLinesIgnored { count: points_or_lines });
        }
        Ok(())
    }

    /// Returns the next word of this statement, which continues after a backslash at the end of a line.
    fn next_word(&mut self) -> Option<&'a [u8]> {
        loop {
            match self.words.next_on_line()? {
                b"\\" => {
                    if !self.words.skip_line().1 {
                        return None;
                    }
                }
                word => return Some(word),
            }
        }
    }

    /// Skips to the line after this statement; returns whether there is one.
    fn skip_statement(&mut self) -> bool {
        loop {
            let (rest, more) = self.words.skip_line();
            if !more || rest.last() != Some(&b'\\') {
                return more;
            }
        }
    }

    /// Reads a position; returns whether it has a weight other than 1. Colours of three or four numbers may follow.
    fn vertex(&mut self) -> Result<bool, Fault> {
        let mut position = [0.0; 3];
        for coordinate in &mut position {
            let word = self.next_word().ok_or_else(|| self.end_of_line("a coordinate"))?;
            *coordinate = self.words.number(word)?;
        }
        let mut extra = 0;
        let mut weight = 1.0;
        while let Some(word) = self.next_word() {
            let value = self.words.number(word)?;
            if extra == 0 {
                weight = value;
            }
            extra += 1;
        }
        if self.positions.len() >= u32::MAX as usize {
            let found = self.positions.len() as u64 + 1;
            return Err(self.words.fault(Problem::TooMany { what: "vertices".into(), found, limit: u32::MAX.into() }));
        }
        self.positions.push(DVec3::from(position));
        Ok(extra == 1 && weight != 1.0)
    }

    fn face(&mut self) -> Result<(), Fault> {
        let (index, line) = (self.faces.faces(), self.words.line());
        while let Some(word) = self.next_word() {
            // A corner is v, v/vt, v//vn or v/vt/vn.
            let vertex = word.split(|&byte| byte == b'/').next().unwrap_or_default();
            let written = self.words.integer(vertex)?;
            let count = self.positions.len();
            let vertex = if written < 0 { count as i64 + written } else { written - 1 };
            let vertex = u32::try_from(vertex).map_err(|_| out_of_range(index, line, written, count))?;
            self.faces.push_corner(vertex);
        }
        self.faces.end_face();
        self.lines.push(line);
        Ok(())
    }

    fn end_of_line(&self, expected: &'static str) -> Fault {
        self.words.fault(Problem::Expected { expected: expected.into(), found: "the end of the line".to_owned() })
    }
}

/// Writes positions, in the shortest decimals that read back as the same numbers, and triangles.
pub(super) fn write(out: &mut (impl Write + Send), mesh: &TriangleMesh, unit: Option<LengthUnit>) -> io::Result<()> {
    writeln!(out, "# OBJ by ldi-ops")?;
    if let Some(unit) = unit {
        writeln!(out, "# unit {}", unit.symbol())?;
    }
    write_each(out, &mesh.positions, |position, line| push_numbers(line, [b"v ", b" ", b" "], position, b"\n"))?;
    write_each(out, &mesh.triangles, |triangle, line| {
        push_integers(line, [b"f ", b" ", b" "], triangle.map(|index| u64::from(index) + 1), b"\n");
    })
}

#[cfg(all(test, feature = "cpu"))]
mod tests {
    use super::*;
    use crate::mesh::io::Format;
    use crate::mesh::io::tests::{error, parsed, points, utf_16};

    const FORMAT: Format = Format::Obj;
    const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn face_corners_of_every_form_are_read() {
        for face in ["f 1 2 3", "f 1/1 2/2 3/3", "f 1//1 2//2 3//3", "f 1/1/1 2/2/2 3/3/3", "f -4 -3 -2", "f 1 \\\n2 3"]
        {
            let file = parsed(format!("{CORNERS}{face}\n").as_bytes(), FORMAT);
            assert_eq!(file.mesh.triangles, [[0, 1, 2]], "{face}");
            assert_eq!(file.mesh.positions.len(), 4, "{face}");
            assert_eq!(file.notes, [], "{face}");
        }
    }

    #[test]
    fn positions_are_read_as_f64_and_not_welded() {
        let text = "v 0.1 -0 1e-300\nv 0.1 -0 1e-300\nv 1 nan -inf\nf 1 2 3";
        let mesh = parsed(text.as_bytes(), FORMAT).mesh;
        assert_eq!(mesh.positions[..2], points(&[[0.1, -0.0, 1e-300], [0.1, -0.0, 1e-300]]));
        assert!(mesh.positions[0].y.is_sign_negative() && mesh.positions[2].y.is_nan());
        assert_eq!(mesh.positions[2].z, f64::NEG_INFINITY);
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn relative_indices_count_back_from_their_line() {
        let text = format!("{CORNERS}f -4 -3 -2\nv 9 9 9\nf -5 -4 -1\n");
        assert_eq!(parsed(text.as_bytes(), FORMAT).mesh.triangles, [[0, 1, 2], [0, 1, 4]]);
    }

    #[test]
    fn objects_share_vertices_and_materials_are_ignored() {
        let text = format!("mtllib none.mtl\no a\n{CORNERS}usemtl x\nf 1 2 3\ng b\no b\nf 1 3 4\no empty\n");
        let file = parsed(text.as_bytes(), FORMAT);
        assert_eq!(file.mesh.positions, points(&[[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]));
        assert_eq!(file.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(file.notes, [ReadNote::ObjectsMerged { count: 2 }]);
    }

    #[test]
    fn polygons_points_lines_and_free_forms_are_noted() {
        let text = format!("{CORNERS}f 1 2 3 4\nl 1 2 3\np 1\nf 1 2\nsurf 0 1 0 1 1 2 3\nf 1 2 3\n");
        let file = parsed(text.as_bytes(), FORMAT);
        assert_eq!(file.mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
        let notes = [
            ReadNote::FreeFormIgnored { count: 1 },
            ReadNote::PointsOrLinesIgnored { count: 2 },
            ReadNote::PolygonsTriangulated { count: 1 },
            ReadNote::PointsOrLinesIgnored { count: 1 },
        ];
        assert_eq!(file.notes, notes);
    }

    #[test]
    fn weights_and_colours_after_positions_are_ignored() {
        let text = "v 2 4 6 2\nv 1 0 0 1\nv 0 1 0 0.5 0.5 0.5\nv 0 1 0 0.5 0.5 0.5 1\nf 1 2 3\n";
        let file = parsed(text.as_bytes(), FORMAT);
        assert_eq!(file.mesh.positions[0], DVec3::new(2.0, 4.0, 6.0));
        assert_eq!(file.notes, [ReadNote::WeightsIgnored { count: 1 }]);
    }

    #[test]
    fn utf_16_latin_1_and_all_line_ends_are_read() {
        let text = format!("# n\u{e9}\n{CORNERS}f 1 2 3\n");
        let latin_1: Vec<u8> = text.chars().map(|c| c as u8).collect();
        let samples = [
            utf_16(&text, u16::to_le_bytes),
            utf_16(&text, u16::to_be_bytes),
            latin_1,
            text.replace('\n', "\r").into_bytes(),
            text.replace('\n', "\r\n").into_bytes(),
        ];
        for sample in samples {
            let mesh = parsed(&sample, FORMAT).mesh;
            assert_eq!((mesh.positions.len(), mesh.triangles), (4, vec![[0, 1, 2]]));
        }
    }

    #[test]
    fn errors_name_line_face_and_value() {
        let cases = [
            ("v 0 0 x\n", "sample.obj, line 1: `x` is not a number"),
            ("\nv 0 0\nf 1 1 1", "sample.obj, line 2: expected a coordinate, found the end of the line"),
            ("v 0 0 0 red\n", "sample.obj, line 1: `red` is not a number"),
            ("v 0 0 0\nf 1 1 2", "sample.obj, line 2, face 0: vertex 2 is out of range: there are 1, counted from 1"),
            (
                "v 0 0 0\nf 1 1 1\nf 1 0 1",
                "sample.obj, line 3, face 1: vertex 0 is out of range: there are 1, counted from 1",
            ),
            ("v 0 0 0\nf 1 1 -2", "sample.obj, line 2, face 0: vertex -2 is out of range: there are 1, counted from 1"),
            ("v 0 0 0\nf 1 1 a", "sample.obj, line 2: `a` is not a whole number"),
            ("v 0 0 0\nf 1 1 /1", "sample.obj, line 2: `` is not a whole number"),
            ("v 0 0 0\n", "sample.obj: the file has no triangles: the file has 1 vertices and no faces"),
            ("v 0 0 0\nf 1 1 99999999999999999999", "sample.obj, line 2: `99999999999999999999` is not a whole number"),
        ];
        for (text, message) in cases {
            assert_eq!(error(text.as_bytes(), FORMAT), message, "{text:?}");
        }
        let far =
            "sample.obj, line 2, face 0: vertex -9223372036854775808 is out of range: there are 1, counted from 1";
        assert_eq!(error(b"v 0 0 0\nf -9223372036854775808 1 1", FORMAT), far);
        // A face may stand before its vertices.
        assert_eq!(parsed(b"f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0", FORMAT).mesh.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn written_meshes_are_read_back() {
        let mesh = TriangleMesh {
            positions: points(&[[0.1, -0.0, 1e-300], [1e300, 1.0 / 3.0, -2.5], [f64::MIN_POSITIVE, 0., 7.]]),
            triangles: vec![[0, 2, 1], [1, 1, 2]],
        };
        let mut bytes = Vec::new();
        write(&mut bytes, &mesh, Some(LengthUnit::Micrometre)).unwrap();
        assert!(bytes.starts_with(b"# OBJ by ldi-ops\n# unit um\nv 0.1 -0.0 1e-300\n"));
        let read = parsed(&bytes, FORMAT).mesh;
        assert_eq!(read, mesh);
        assert!(read.positions[0].y.is_sign_negative());
    }
}
