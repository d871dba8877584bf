//! 3MF as it is written: one object and one item of the build, in the unit that the model names.
//!
//! The model is text that is formatted in pieces and compressed as it comes, so that memory does not grow with the mesh.
//! Coordinates are the shortest decimals that give back the same `f64`; lib3mf takes them and keeps 32 bits of each.
//! Compression is the fastest: the usual level takes four times as long for a file that is a fifth smaller.

use std::io::{self, Seek, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::super::formatted::write_each;
use super::super::text::{push_integers, push_numbers};
use super::unit_name;
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

/// Bytes that the line of a position or a triangle has at most.
const LONGEST_LINE: u64 = 112;

/// Whether a triangle has three different corners, as 3MF demands.
pub(in super::super) fn has_three_corners(&[a, b, c]: &[u32; 3]) -> bool {
    a != b && b != c && c != a
}

/// Writes a package. Coordinates have been checked to be finite. Triangles that name a position twice, which have no area
/// and whose edges cancel, are left out.
pub(in super::super) fn write(
    out: &mut (impl Write + Seek + Send),
    mesh: &TriangleMesh,
    unit: LengthUnit,
) -> io::Result<()> {
    let mut zip = ZipWriter::new(out);
    // Nothing in a file tells when it was made, so that the same mesh makes the same bytes.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .compression_level(Some(1))
        .last_modified_time(zip::DateTime::default());
    for (part, text) in [("[Content_Types].xml", CONTENT_TYPES), ("_rels/.rels", RELATIONSHIPS)] {
        zip.start_file(part, options)?;
        zip.write_all(text.as_bytes())?;
    }
    let most_bytes = LONGEST_LINE * (mesh.positions.len() + mesh.triangles.len() + 16) as u64;
    zip.start_file("3D/3dmodel.model", options.large_file(most_bytes > u64::from(u32::MAX)))?;
    write_model(&mut zip, mesh, unit)?;
    zip.finish()?;
    Ok(())
}

fn write_model(out: &mut (impl Write + Send), mesh: &TriangleMesh, unit: LengthUnit) -> io::Result<()> {
    write!(
        out,
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"{}\" xml:lang=\"en-US\" \
         xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n\
         <metadata name=\"Application\">ldi-ops</metadata>\n<resources>\n",
        unit_name(unit)
    )?;
    // An object has at least one triangle.
    let has_object = mesh.triangles.iter().any(has_three_corners);
    if has_object {
        out.write_all(b"<object id=\"1\" type=\"model\">\n<mesh>\n<vertices>\n")?;
        let before: [&[u8]; 3] = [b"<vertex x=\"", b"\" y=\"", b"\" z=\""];
        write_each(out, &mesh.positions, |position, line| push_numbers(line, before, position, b"\"/>\n"))?;
        out.write_all(b"</vertices>\n<triangles>\n")?;
        let before: [&[u8]; 3] = [b"<triangle v1=\"", b"\" v2=\"", b"\" v3=\""];
        write_each(out, &mesh.triangles, |triangle, line| {
            if has_three_corners(triangle) {
                push_integers(line, before, triangle.map(u64::from), b"\"/>\n");
            }
        })?;
        out.write_all(b"</triangles>\n</mesh>\n</object>\n")?;
    }
    let item = if has_object { "<item objectid=\"1\"/>\n" } else { "" };
    write!(out, "</resources>\n<build>\n{item}</build>\n</model>\n")
}
