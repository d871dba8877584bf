//! Images as `.npz`: a zip archive of `.npy` arrays, which `numpy.load` opens.
//!
//! | key | type | shape | meaning |
//! |---|---|---|---|
//! | `axis` | text | () or (n,) | direction of the rays of each image |
//! | `offsets` | uint32 | (rays + 1,) | samples of ray `row · columns + column` are `depths[offsets[r]:offsets[r + 1]]` |
//! | `depths` | int32 | (samples,) | lattice steps from the near end of the grid |
//! | `unclosed` | uint32 | (k,) | rays that did not close; they have no samples |
//! | `grid` | record | () | the raster and lattice: fields below |
//!
//! | field of `grid` | type | meaning |
//! |---|---|---|
//! | `origin` | float64 (3,) | world position of lattice position (0, 0, 0) |
//! | `pitch` | float64 | distance of neighbouring rays |
//! | `step` | float64 | length of one lattice step: `pitch / 2**shift` |
//! | `rays` | uint32 (3,) | pixels along x, y and z |
//! | `shift`, `lod` | uint32 | lattice steps in a pixel, as a power of two; LOD-C |
//!
//! So the depths of ray r in world units along z are `grid["origin"][2] + grid["step"] * depths[offsets[r]:offsets[r + 1]]`.
//!
//! Columns and rows run along the two other axes in increasing order: x → (y, z), y → (x, z), z → (x, y). Of several
//! images, `offsets`, `depths` and `unclosed` carry the axis: `offsets_x`. The grid stands once, as it is the same.
//!
//! Entries are stored without compression and without a time, so that equal images make equal files.

use std::io::{self, Seek, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::Ldi;
use crate::grid::Grid;

/// Why images could not be written.
#[derive(Debug, thiserror::Error)]
pub enum NpzError {
    /// There is no image.
    #[error("there is no image to write")]
    NoImage,
    /// The images of one file must share their grid and differ in their axis.
    #[error("images {first} and {second} do not belong together: their grids differ, or their axis is the same")]
    Mismatch {
        /// Index of one image.
        first: usize,
        /// Index of the other.
        second: usize,
    },
    /// The archive could not be written.
    #[error(transparent)]
    Zip(#[from] zip::result::ZipError),
    /// The file could not be written.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// What went wrong keeps its kind, so that a full disk is told from a wrong path.
impl From<NpzError> for io::Error {
    fn from(error: NpzError) -> io::Error {
        match error {
            NpzError::Io(error) | NpzError::Zip(zip::result::ZipError::Io(error)) => error,
            error => io::Error::other(error),
        }
    }
}

/// Writes images of one solid on one grid along different axes.
pub fn write(images: &[Ldi], to: impl Write + Seek) -> Result<(), NpzError> {
    let Some(first) = images.first() else { return Err(NpzError::NoImage) };
    for second in 1..images.len() {
        let odd = images[..second]
            .iter()
            .position(|i| i.grid() != images[second].grid() || i.axis() == images[second].axis());
        if let Some(first) = odd {
            return Err(NpzError::Mismatch { first, second });
        }
    }
    let mut archive = Archive { zip: ZipWriter::new(to) };
    let axes: Vec<u8> = images.iter().flat_map(|i| (i.axis().name().as_bytes()[0] as u32).to_le_bytes()).collect();
    match images {
        [_] => archive.array("axis", "'<U1'", &[], &axes)?,
        _ => archive.array("axis", "'<U1'", &[images.len()], &axes)?,
    }
    archive.array("grid", GRID_RECORD, &[], &grid_record(first.grid()))?;
    for image in images {
        let key = |name: &str| match images {
            [_] => name.to_owned(),
            _ => format!("{name}_{}", image.axis().name()),
        };
        archive.words(&key("offsets"), "'<u4'", image.offsets(), u32::to_le_bytes)?;
        archive.words(&key("depths"), "'<i4'", image.depths(), i32::to_le_bytes)?;
        archive.words(&key("unclosed"), "'<u4'", image.unclosed(), u32::to_le_bytes)?;
    }
    archive.zip.finish()?.flush()?;
    Ok(())
}

/// The type of a grid, in numpy's words.
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
    fn begin(&mut self, key: &str, kind: &str, shape: &[usize], bytes: usize) -> Result<(), NpzError> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(zip::DateTime::default())
            .large_file(bytes > 0xf000_0000);
        self.zip.start_file(format!("{key}.npy"), options)?;
        let sides: Vec<String> = shape.iter().map(|n| format!("{n},")).collect();
        let header = format!("{{'descr': {kind}, 'fortran_order': False, 'shape': ({}), }}", sides.concat());
        // Magic, version, length and header together are a multiple of 64 bytes; the header ends in a line feed.
        let padded = (10 + header.len() + 1).next_multiple_of(64) - 10;
        self.zip.write_all(b"\x93NUMPY\x01\x00")?;
        self.zip.write_all(&(padded as u16).to_le_bytes())?;
        self.zip.write_all(format!("{header:width$}\n", width = padded - 1).as_bytes())?;
        Ok(())
    }

    /// Adds an array from its bytes.
    fn array(&mut self, key: &str, kind: &str, shape: &[usize], bytes: &[u8]) -> Result<(), NpzError> {
        self.begin(key, kind, shape, bytes.len())?;
        Ok(self.zip.write_all(bytes)?)
    }

    /// Adds a flat array of 32-bit words, piece by piece, so that no second copy of it is made.
    fn words<T: Copy>(&mut self, key: &str, kind: &str, words: &[T], to_le: fn(T) -> [u8; 4]) -> Result<(), NpzError> {
        self.begin(key, kind, &[words.len()], 4 * words.len())?;
        let mut bytes = Vec::with_capacity(1 << 16);
        for words in words.chunks(1 << 14) {
            bytes.clear();
            bytes.extend(words.iter().flat_map(|&word| to_le(word)));
            self.zip.write_all(&bytes)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Read};

    use glam::DVec3;

    use super::*;
    use crate::grid::Axis;
    use crate::mesh::Aabb;

    fn image(axis: Axis) -> Ldi {
        let grid = Grid::with_resolution(Aabb { min: DVec3::ZERO, max: DVec3::new(2.0, 1.0, 1.0) }, 2, 64).unwrap();
        let (columns, rows) = grid.image_size(axis);
        let rays = (columns * rows) as usize;
        let mut offsets = vec![2; rays + 1];
        offsets[0] = 0;
        Ldi::from_parts(grid, axis, offsets, vec![4, 20], vec![]).unwrap()
    }

    fn entries(file: Vec<u8>) -> Vec<(String, Vec<u8>)> {
        let mut zip = zip::ZipArchive::new(Cursor::new(file)).unwrap();
        (0..zip.len())
            .map(|i| {
                let mut entry = zip.by_index(i).unwrap();
                let mut bytes = Vec::new();
                entry.read_to_end(&mut bytes).unwrap();
                (entry.name().unwrap().into_owned(), bytes)
            })
            .collect()
    }

    #[test]
    fn arrays_have_headers_of_whole_blocks_and_the_numbers_after_them() {
        let mut file = Cursor::new(Vec::new());
        write(&[image(Axis::Z)], &mut file).unwrap();
        let entries = entries(file.into_inner());
        let (_, depths) = entries.iter().find(|(name, _)| name == "depths.npy").unwrap();
        assert_eq!(&depths[..8], b"\x93NUMPY\x01\x00");
        let length = 10 + usize::from(u16::from_le_bytes([depths[8], depths[9]]));
        assert_eq!((length % 64, depths[length - 1]), (0, b'\n'));
        assert!(depths[10..].starts_with(b"{'descr': '<i4', 'fortran_order': False, 'shape': (2,), }"));
        assert_eq!(depths[length..], [4, 0, 0, 0, 20, 0, 0, 0]);
    }

    #[test]
    fn several_images_carry_their_axes() {
        let mut file = Cursor::new(Vec::new());
        write(&[image(Axis::X), image(Axis::Y)], &mut file).unwrap();
        let names: Vec<String> = entries(file.into_inner()).into_iter().map(|(name, _)| name).collect();
        assert!(
            ["offsets_x.npy", "depths_y.npy", "unclosed_x.npy", "grid.npy"]
                .iter()
                .all(|n| names.contains(&(*n).into()))
        );
    }

    #[test]
    fn a_full_disk_is_told_as_such() {
        /// A file that has room for some bytes.
        struct Disk(Cursor<Vec<u8>>, usize);
        impl Write for Disk {
            fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
                match self.0.get_ref().len() + bytes.len() > self.1 {
                    true => Err(io::ErrorKind::StorageFull.into()),
                    false => self.0.write(bytes),
                }
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        impl Seek for Disk {
            fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
                self.0.seek(to)
            }
        }
        for room in (0..1000).step_by(50) {
            let error = write(&[image(Axis::Z)], Disk(Cursor::new(Vec::new()), room)).unwrap_err();
            assert_eq!(io::Error::from(error).kind(), io::ErrorKind::StorageFull, "{room} bytes");
        }
    }

    #[test]
    fn images_that_do_not_belong_together_are_refused() {
        let write = |images: &[Ldi]| write(images, Cursor::new(Vec::new()));
        assert!(matches!(write(&[]), Err(NpzError::NoImage)));
        let twice = [image(Axis::X), image(Axis::X)];
        assert!(matches!(write(&twice), Err(NpzError::Mismatch { first: 0, second: 1 })));
    }
}
