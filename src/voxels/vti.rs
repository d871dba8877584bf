//! Voxels as `.vti`, image data in VTK's XML format, which ParaView, PyVista and 3D Slicer open.
//!
//! Each voxel is a cell of the file with the value 0 or 1 of the array `inside`; the points of the file are the corners of the
//! cells, so that a picture has the true size. Node (i, j, k) is the centre of cell (i, j, k). Origin and spacing are in world
//! units, whose name is stored in the field `unit` where it is known.
//!
//! The values follow the XML as they are (`encoding="raw"`), in blocks of 1 MiB, each compressed by zlib. Before them come the
//! number of blocks, their length before compression, that of the last where it is shorter, and their compressed sizes:
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>. The writer seeks back once to fill these in.

use std::io::{self, Seek, SeekFrom, Write};

use crate::parallel::*;
use flate2::Compression;
use flate2::write::ZlibEncoder;

use super::{Written, each_plane};
use crate::ldi::NodePlanes;

/// Bytes of a block before compression.
const BLOCK: usize = 1 << 20;

/// Number of blocks compressed in parallel.
const WAVE: usize = 32;

/// Writes all voxels; `unit` is the name of the unit of length.
pub fn write_vti(nodes: &NodePlanes, unit: Option<&str>, mut to: impl Write + Seek) -> io::Result<Written> {
    to.write_all(head(nodes, unit).as_bytes())?;
    let values: u64 = nodes.grid().rays().map(u64::from).into_iter().product();
    let mut blocks = Blocks { sizes: Vec::new(), pending: Vec::new(), to };
    let start = blocks.to.stream_position()?;
    let count = values.div_ceil(BLOCK as u64);
    blocks.to.write_all(&vec![0; 8 * (3 + count as usize)])?;
    let written = each_plane(nodes, |plane| blocks.append(plane))?;
    blocks.compress(1)?;
    let Blocks { sizes, mut to, .. } = blocks;
    to.write_all(b"\n  </AppendedData>\n</VTKFile>\n")?;
    to.seek(SeekFrom::Start(start))?;
    let numbers = [count, BLOCK as u64, values % BLOCK as u64].into_iter().chain(sizes);
    to.write_all(&numbers.flat_map(u64::to_le_bytes).collect::<Vec<u8>>())?;
    to.seek(SeekFrom::End(0))?;
    to.flush()?;
    Ok(written)
}

/// Returns the file up to its values.
fn head(nodes: &NodePlanes, unit: Option<&str>) -> String {
    let grid = nodes.grid();
    let [x, y, z] = grid.rays();
    let extent = format!("0 {x} 0 {y} 0 {z}");
    // A node lies one lattice step behind the middle of its pixel.
    let origin = (grid.origin() + grid.step()).to_array().map(|position| format!("{position:?}")).join(" ");
    let spacing = [grid.pitch(); 3].map(|pitch| format!("{pitch:?}")).join(" ");
    let field = unit.map_or(String::new(), |unit| {
        // Text is stored as its byte values, with a terminating zero.
        let bytes: String = unit.bytes().map(|byte| format!("{byte} ")).collect();
        format!(
            "    <FieldData>\n      <Array type=\"String\" Name=\"unit\" NumberOfTuples=\"1\" format=\"ascii\">{bytes}0</Array>\n    \
             </FieldData>\n"
        )
    });
    format!(
        r#"<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64" compressor="vtkZLibDataCompressor">
  <ImageData WholeExtent="{extent}" Origin="{origin}" Spacing="{spacing}">
{field}    <Piece Extent="{extent}">
      <PointData/>
      <CellData Scalars="inside">
        <DataArray type="UInt8" Name="inside" RangeMin="0" RangeMax="1" format="appended" offset="0"/>
      </CellData>
    </Piece>
  </ImageData>
  <AppendedData encoding="raw">
   _"#
    )
}

/// Values being collected into compressed blocks.
struct Blocks<W: Write> {
    /// Compressed sizes of the blocks so far.
    sizes: Vec<u64>,
    /// Values not yet in a block.
    pending: Vec<u8>,
    to: W,
}

impl<W: Write> Blocks<W> {
    fn append(&mut self, mut values: &[u8]) -> io::Result<()> {
        while !values.is_empty() {
            let (now, later) = values.split_at(values.len().min(WAVE * BLOCK - self.pending.len()));
            self.pending.extend_from_slice(now);
            self.compress(WAVE * BLOCK)?;
            values = later;
        }
        Ok(())
    }

    /// Compresses and writes the pending values if there are at least `least` of them.
    fn compress(&mut self, least: usize) -> io::Result<()> {
        if self.pending.len() < least {
            return Ok(());
        }
        let blocks: Vec<io::Result<Vec<u8>>> = self.pending.par_chunks(BLOCK).map(compressed).collect();
        for block in blocks {
            let block = block?;
            self.sizes.push(block.len() as u64);
            self.to.write_all(&block)?;
        }
        self.pending.clear();
        Ok(())
    }
}

/// Compresses a block by zlib at its fastest level: bytes that are 0 or 1 shrink to a hundredth at any level.
fn compressed(block: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(block)?;
    encoder.finish()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::io::{Cursor, Read};

    use glam::DVec3;
    use quick_xml::events::Event;

    use super::super::testing::{torus, voxels};
    use super::*;
    use crate::grid::{Axis, Grid};
    use crate::ldi::Ldi;
    use crate::sampler::Mode;

    /// Parses a file: returns the attributes of each element, text within elements, and the bytes behind the mark `_`.
    fn parts(file: &[u8]) -> (BTreeMap<String, String>, String, &[u8]) {
        let (mut attributes, mut text) = (BTreeMap::new(), String::new());
        let mut reader = quick_xml::Reader::from_reader(file);
        loop {
            match reader.read_event().unwrap() {
                Event::Start(element) | Event::Empty(element) => {
                    let name = element.name().as_ref().to_owned();
                    for attribute in element.attributes().map(Result::unwrap) {
                        let key = attribute.key.as_ref();
                        attributes.insert(format!("{name}.{key}"), attribute.value.into_owned());
                    }
                    if name == "AppendedData" {
                        let rest = &file[reader.buffer_position() as usize..];
                        let mark = rest.iter().position(|&byte| byte == b'_').unwrap();
                        return (attributes, text, &rest[mark + 1..]);
                    }
                }
                Event::Text(found) => text += found.trim(),
                Event::Eof => panic!("no appended data"),
                _ => {}
            }
        }
    }

    fn number(bytes: &[u8], at: usize) -> u64 {
        u64::from_le_bytes(bytes[8 * at..8 * at + 8].try_into().unwrap())
    }

    /// Returns the values in the blocks, which the end of the file must follow.
    fn values(blocks: &[u8]) -> Vec<u8> {
        let (count, whole, last) = (number(blocks, 0) as usize, number(blocks, 1) as usize, number(blocks, 2) as usize);
        let mut rest = &blocks[8 * (3 + count)..];
        let mut values = Vec::new();
        for block in 0..count {
            let (compressed, next) = rest.split_at(number(blocks, 3 + block) as usize);
            let before = values.len();
            flate2::read::ZlibDecoder::new(compressed).read_to_end(&mut values).unwrap();
            let expected = if block + 1 == count && last > 0 { last } else { whole };
            assert_eq!(values.len() - before, expected, "block {block} of {count}");
            rest = next;
        }
        assert_eq!(rest, b"\n  </AppendedData>\n</VTKFile>\n");
        values
    }

    fn written(images: &[Ldi], unit: Option<&str>) -> (Vec<u8>, Written) {
        let mut file = Cursor::new(Vec::new());
        let written = write_vti(&NodePlanes::new(images, Mode::Exact).unwrap(), unit, &mut file).unwrap();
        assert_eq!(file.position(), file.get_ref().len() as u64);
        (file.into_inner(), written)
    }

    #[test]
    fn cells_equal_the_nodes() {
        // Several whole blocks and part of one.
        let images = torus(170, Mode::Exact);
        let grid = *images[0].grid();
        let (file, said) = written(&images, Some("µm"));
        let (attributes, text, blocks) = parts(&file);
        let expected = voxels(&images[2]);
        assert!(expected.len() > BLOCK && !expected.len().is_multiple_of(BLOCK));
        assert!(values(blocks) == expected);
        assert_eq!(said.inside, expected.iter().map(|&voxel| u64::from(voxel)).sum::<u64>());
        let [x, y, z] = grid.rays();
        assert_eq!(attributes["ImageData.WholeExtent"], format!("0 {x} 0 {y} 0 {z}"));
        assert_eq!(attributes["ImageData.WholeExtent"], attributes["Piece.Extent"]);
        let numbers = |key: &str| -> Vec<f64> { attributes[key].split(' ').map(|n| n.parse().unwrap()).collect() };
        assert_eq!(numbers("ImageData.Spacing"), [grid.pitch(); 3]);
        // The centre of cell (0, 0, 0) is node (0, 0, 0).
        for (i, origin) in numbers("ImageData.Origin").into_iter().enumerate() {
            let node = grid.origin()[i] + grid.step() * f64::from(grid.node(0));
            assert!((origin + 0.5 * grid.pitch() - node).abs() < 1e-12, "{origin}");
        }
        assert_eq!(text, "194 181 109 0");
        assert_eq!(attributes["DataArray.type"], "UInt8");
        assert_eq!(attributes["VTKFile.header_type"], "UInt64");
    }

    #[test]
    fn files_do_not_depend_on_the_thread_count_or_even_blocks() {
        let grid = Grid::from_parts(DVec3::ZERO, 1e-7, [64, 128, 256], 4, 64).unwrap();
        let rays = 64 * 128;
        let depths = [0, 2048].repeat(rays);
        let image = Ldi::from_parts(grid, Axis::Z, (0..=2 * rays as u32).step_by(2).collect(), depths, vec![]).unwrap();
        let write = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| written(std::slice::from_ref(&image), None).0)
        };
        let file = write(1);
        assert!(file == write(3));
        let (attributes, text, blocks) = parts(&file);
        assert_eq!([number(blocks, 0), number(blocks, 1), number(blocks, 2)], [2, BLOCK as u64, 0]);
        let values = values(blocks);
        assert_eq!(values.iter().position(|&value| value == 0), Some(rays * 128));
        assert_eq!((attributes["ImageData.Spacing"].as_str(), text.as_str()), ("1e-7 1e-7 1e-7", ""));
    }
}
