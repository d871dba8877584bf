//! The 3MF writer: one object and one item of the build, in the unit that the model names.
//!
//! The model is text, formatted in pieces and compressed in passing; memory grows only by two words a position.
//! Coordinates are the shortest decimals that read back as the same `f64`; lib3mf accepts them and keeps 32 bits of
//! each. The fastest compression level is used, since compression takes longer than everything else.

use std::io::{self, Seek, Write};

use glam::DVec3;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::super::formatted::write_each;
use super::super::text::{push_integers, push_numbers};
use super::unit_name;
use crate::mesh::weld::Weld;
use crate::mesh::{LengthUnit, TriangleMesh};

const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"#;

const RELATIONSHIPS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"#;

/// Largest length in bytes of the line of a position or a triangle.
const LONGEST_LINE: u64 = 112;

/// Largest coordinate that lib3mf reads.
pub(in super::super) const FARTHEST: f64 = 1e9;

/// A mesh as 3MF requires it: readers go by indices, so positions with the same coordinates must be one, and no
/// triangle may name a position twice. Such triangles have no area, and leaving them out changes no edge's excess of
/// uses in one direction over the other.
pub(in super::super) struct Object<'m> {
    mesh: &'m TriangleMesh,
    weld: Weld,
    /// Number of triangles that are left out.
    pub(in super::super) collapsed: usize,
}

impl<'m> Object<'m> {
    pub(in super::super) fn new(mesh: &'m TriangleMesh) -> Object<'m> {
        let mut object = Object { mesh, weld: Weld::of(&mesh.positions), collapsed: 0 };
        object.collapsed = mesh.triangles.iter().filter(|&triangle| object.corners(triangle).is_none()).count();
        object
    }

    /// Returns the three different corners of a triangle.
    fn corners(&self, triangle: &[u32; 3]) -> Option<[u32; 3]> {
        let [a, b, c] = triangle.map(|index| self.weld.new_index[index as usize]);
        (a != b && b != c && c != a).then_some([a, b, c])
    }
}

/// Writes a package, its one item moved to `place`. Coordinates have been checked to be finite.
pub(in super::super) fn write(
    out: &mut (impl Write + Seek + Send),
    object: &Object<'_>,
    unit: LengthUnit,
    place: DVec3,
) -> io::Result<()> {
    let mut zip = ZipWriter::new(out);
    // The file holds no time stamp, so that the same mesh gives the same bytes.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .compression_level(Some(1))
        .last_modified_time(zip::DateTime::default());
    for (part, text) in [("[Content_Types].xml", CONTENT_TYPES), ("_rels/.rels", RELATIONSHIPS)] {
        zip.start_file(part, options)?;
        zip.write_all(text.as_bytes())?;
    }
    let most_bytes = LONGEST_LINE * (object.weld.kept.len() + object.mesh.triangles.len() + 16) as u64;
    zip.start_file("3D/3dmodel.model", options.large_file(most_bytes > u64::from(u32::MAX)))?;
    write_model(&mut zip, object, unit, place)?;
    zip.finish()?;
    Ok(())
}

fn write_model(out: &mut (impl Write + Send), object: &Object<'_>, unit: LengthUnit, place: DVec3) -> io::Result<()> {
    write!(
        out,
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"{}\" xml:lang=\"en-US\" \
         xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n\
         <metadata name=\"Application\">ldi-ops</metadata>\n<resources>\n",
        unit_name(unit)
    )?;
    // An object must have at least one triangle.
    let Object { mesh, weld, collapsed } = object;
    let has_object = mesh.triangles.len() > *collapsed;
    if has_object {
        out.write_all(b"<object id=\"1\" type=\"model\">\n<mesh>\n<vertices>\n")?;
        let before: [&[u8]; 3] = [b"<vertex x=\"", b"\" y=\"", b"\" z=\""];
        write_each(out, &weld.kept, |&kept, line| {
            push_numbers(line, before, &mesh.positions[kept as usize], b"\"/>\n");
        })?;
        out.write_all(b"</vertices>\n<triangles>\n")?;
        let before: [&[u8]; 3] = [b"<triangle v1=\"", b"\" v2=\"", b"\" v3=\""];
        write_each(out, &mesh.triangles, |triangle, line| {
            if let Some(corners) = object.corners(triangle) {
                push_integers(line, before, corners.map(u64::from), b"\"/>\n");
            }
        })?;
        out.write_all(b"</triangles>\n</mesh>\n</object>\n")?;
    }
    out.write_all(b"</resources>\n<build>\n")?;
    if has_object {
        let DVec3 { x, y, z } = place;
        match place == DVec3::ZERO {
            true => out.write_all(b"<item objectid=\"1\"/>\n")?,
            false => writeln!(out, "<item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 {x} {y} {z}\"/>")?,
        }
    }
    out.write_all(b"</build>\n</model>\n")
}
