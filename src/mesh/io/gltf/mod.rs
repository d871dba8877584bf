//! glTF 2.0 and GLB: the triangles of the default scene, in metres.
//!
//! The scene is the default one, the first where none is named, and all root nodes where there is no scene. Each node's
//! mesh is placed by the transforms above it, so a mesh that several nodes name occurs several times.
//!
//! The `gltf` crate parses the document (`gltf::json`). This module interprets it without the crate's accessor reader,
//! which panics on counts of zero, on sparse values that run out and on sums that overflow; without its importer, which
//! requires decoders for images; and without its validation, which refuses files without a bounding box. Node
//! transforms are read from the JSON a second time, because the crate rounds them to 32 bits.
//!
//! Draco and meshopt compression are refused by name where the data has no other form.

mod write;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};
use serde::Deserialize;

use super::error::{Fault, Place, Problem};
use super::note::ReadNote;
use super::placement::{Placement, Scene, TRIANGLES_MAX, drop_unused};
use super::polygon::Strip;
use super::text::{decode, quote, sentence};
use super::{Format, checkpoint_at};
use crate::input;
use crate::mesh::{LengthUnit, TriangleMesh};
pub(super) use write::Glb;

/// The prefix of URIs that hold their data.
const DATA: &str = "data:";

const DRACO: &str = "KHR_draco_mesh_compression";
const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Largest number of positions, per replaced sparse value, of an accessor without data of its own.
const ZEROS_PER_VALUE: u64 = 16;

/// Largest number of positions of a mesh, and of triangles of a file, beyond one for each byte of the buffers.
/// Accessors and primitives may share their bytes, so that little data could describe any number of either.
const SHARED_MAX: u64 = 1 << 21;

pub(super) fn parse(bytes: &[u8], format: Format, path: &Path) -> Result<Scene, Fault> {
    if format == Format::Glb || bytes.starts_with(b"glTF") {
        return parse_binary(bytes, path);
    }
    parse_document(&decode(bytes), None, path)
}

fn parse_binary(bytes: &[u8], path: &Path) -> Result<Scene, Fault> {
    let Chunks { json, blob, end } = chunks(bytes)?;
    let mut file = parse_document(json, blob, path)?;
    if bytes.len() > end {
        file.notes.push(ReadNote::TrailingBytes { count: bytes.len() - end });
    }
    Ok(file)
}

/// Returns the length in bytes of a GLB file by its header.
pub(super) fn binary_length(start: &[u8]) -> Option<u64> {
    let length = start.get(8..12).filter(|_| start.starts_with(b"glTF"))?;
    Some(u32::from_le_bytes([length[0], length[1], length[2], length[3]]).into())
}

/// The chunks of a GLB file.
struct Chunks<'b> {
    json: &'b [u8],
    blob: Option<&'b [u8]>,
    /// The end of the last chunk.
    end: usize,
}

fn chunks(bytes: &[u8]) -> Result<Chunks<'_>, Fault> {
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let truncated = |at: usize| {
        Fault::Malformed(
            Place::Byte(at),
            Problem::Expected { expected: "a GLB header".into(), found: "the end of the file".to_owned() },
        )
    };
    if !bytes.starts_with(b"glTF") {
        let found = format!("`{}`", quote(&bytes[..bytes.len().min(4)]));
        return Err(Fault::Malformed(Place::Byte(0), Problem::Expected { expected: "`glTF`".into(), found }));
    }
    let version = word(4).ok_or_else(|| truncated(4))?;
    if version != 2 {
        return Err(Fault::Unsupported(Place::Byte(4), format!("glTF version {version} is not supported; 2 is")));
    }
    let promised = word(8).ok_or_else(|| truncated(8))? as usize;
    if promised > bytes.len() {
        let problem = Problem::Short { what: "bytes".into(), promised: promised as u64, found: bytes.len() as u64 };
        return Err(Fault::Malformed(Place::Byte(8), problem));
    }
    let mut json = None;
    let mut blob = None;
    let mut at = 12;
    // Chunks of unknown kinds must be skipped.
    while at < promised {
        let length = word(at).ok_or_else(|| truncated(at))? as usize;
        let kind = bytes.get(at + 4..at + 8).ok_or_else(|| truncated(at))?;
        let chunk = bytes.get(at + 8..).and_then(|rest| rest.get(..length)).ok_or_else(|| {
            let found = bytes.len().saturating_sub(at + 8) as u64;
            let problem = Problem::Short { what: "bytes of a chunk".into(), promised: length as u64, found };
            Fault::Malformed(Place::Byte(at), problem)
        })?;
        match kind {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if blob.is_none() => blob = Some(chunk),
            _ => {}
        }
        at += 8 + length;
    }
    let json = json.ok_or_else(|| Fault::invalid(Place::Byte(12), "there is no chunk `JSON`"))?;
    Ok(Chunks { json, blob, end: at })
}

/// Returns the files that a document refers to, buffers and images, as far as it can be read.
pub(super) fn side_files(bytes: &[u8], path: &Path) -> Vec<PathBuf> {
    #[derive(Deserialize)]
    struct Referring<'b> {
        #[serde(borrow)]
        uri: Option<Cow<'b, str>>,
    }
    #[derive(Default, Deserialize)]
    struct References<'b> {
        #[serde(borrow, default)]
        buffers: Vec<Referring<'b>>,
        #[serde(borrow, default)]
        images: Vec<Referring<'b>>,
    }
    let text = if bytes.starts_with(b"glTF") {
        Cow::Borrowed(chunks(bytes).map_or(&[][..], |c| c.json))
    } else {
        decode(bytes)
    };
    let References { buffers, images } = serde_json::from_slice(&text).unwrap_or_default();
    let uris = buffers.into_iter().chain(images).filter_map(|referring| referring.uri);
    uris.filter(|uri| !uri.starts_with(DATA)).map(|uri| beside(path, &file_name(&uri))).collect()
}

fn parse_document(json: &[u8], blob: Option<&[u8]>, path: &Path) -> Result<Scene, Fault> {
    let not_json = |error: serde_json::Error| {
        Fault::invalid(Place::Line(error.line()), format!("the glTF document is invalid: {}", sentence(&error)))
    };
    let root = Root::from_slice(json).map_err(not_json)?;
    let NamesAndTransforms { nodes: transforms, meshes } = serde_json::from_slice(json).map_err(not_json)?;
    if let Some(name) = root.extensions_required.iter().find(|name| is_compression(name)) {
        return Err(Fault::Unsupported(Place::File, compressed(name)));
    }
    let mut document = Document { buffers: vec![None; root.buffers.len()], blob, root: &root, path };

    let placed = placements(&root, &transforms)?;
    // Meshes outside the scene need not be readable.
    let mut parts = Vec::new();
    let mut part_of_mesh = BTreeMap::new();
    let mut placements = Vec::with_capacity(placed.len());
    let (mut lines, mut deformed) = (0, 0);
    let mut triangles = 0;
    for (node, mesh, world_from_part) in placed {
        let part = match part_of_mesh.get(&mesh) {
            Some(&part) => part,
            None => {
                let read = document.mesh(mesh, &mut triangles)?;
                lines += read.points_or_lines;
                deformed += usize::from(read.has_targets);
                parts.push(read.mesh);
                part_of_mesh.insert(mesh, parts.len() - 1);
                parts.len() - 1
            }
        };
        let names = [transforms.get(node).map(|node| &node.name), meshes.get(mesh).map(|mesh| &mesh.name)];
        let name = names.into_iter().flatten().flatten().find(|name| !name.is_empty()).cloned();
        placements.push(Placement { part, world_from_part, name: name.unwrap_or_else(|| format!("node {node}")) });
    }
    let mut notes = Vec::new();
    if lines > 0 {
        notes.push(ReadNote::PointsOrLinesIgnored { count: lines });
    }
    deformed += root.nodes.iter().filter(|node| node.mesh.is_some() && node.skin.is_some()).count();
    if deformed > 0 {
        notes.push(ReadNote::DeformationIgnored { count: deformed });
    }
    Ok(Scene { parts, placements, unit: LengthUnit::Metre, notes })
}

fn is_compression(extension: &str) -> bool {
    extension == DRACO || MESHOPT.contains(&extension)
}

fn compressed(extension: &str) -> String {
    format!("the mesh is compressed with {extension}, which is not supported; write it without compression")
}

/// The transforms of the nodes of a document, in full precision, and the names of nodes and meshes.
#[derive(Deserialize)]
struct NamesAndTransforms {
    #[serde(default)]
    nodes: Vec<NodeTransform>,
    #[serde(default)]
    meshes: Vec<MeshName>,
}

#[derive(Deserialize)]
struct MeshName {
    name: Option<String>,
}

#[derive(Deserialize)]
struct NodeTransform {
    name: Option<String>,
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

impl NodeTransform {
    fn parent_from_node(&self) -> DAffine3 {
        if let Some(columns) = &self.matrix {
            return DAffine3::from_mat4(DMat4::from_cols_array(columns));
        }
        // Files round quaternions to a few digits; one that is not of unit length would scale.
        let rotation = DQuat::from_array(self.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
        let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
        let scale = DVec3::from(self.scale.unwrap_or([1.0; 3]));
        let translation = DVec3::from(self.translation.unwrap_or([0.0; 3]));
        DAffine3::from_scale_rotation_translation(scale, rotation, translation)
    }
}

/// Returns the node, the mesh and the place of each instance in the scene, in depth-first order of the nodes.
fn placements(root: &Root, transforms: &[NodeTransform]) -> Result<Vec<(usize, usize, DAffine3)>, Fault> {
    let scene = match root.scene {
        Some(scene) => Some(get(&root.scenes, scene, "scene", || Place::File)?),
        None => root.scenes.first(),
    };
    let mut stack: Vec<(usize, DAffine3)> = match scene {
        Some(scene) => scene.nodes.iter().map(|node| (node.value(), DAffine3::IDENTITY)).collect(),
        None => {
            let mut is_child = vec![false; root.nodes.len()];
            for child in root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
                if let Some(flag) = is_child.get_mut(child.value()) {
                    *flag = true;
                }
            }
            (0..root.nodes.len()).filter(|&node| !is_child[node]).map(|node| (node, DAffine3::IDENTITY)).collect()
        }
    };
    stack.reverse();
    let mut placed = Vec::new();
    let mut seen = vec![false; root.nodes.len()];
    while let Some((index, world_from_parent)) = stack.pop() {
        let node = get(&root.nodes, Index::new(index as u32), "node", || Place::File)?;
        // Nodes form trees. One that is reached twice may be its own ancestor, or duplicate its subtree.
        if std::mem::replace(&mut seen[index], true) {
            return Err(Fault::invalid(Place::element("node", index), "the scene reaches this node twice"));
        }
        let parent_from_node = transforms.get(index).map_or(DAffine3::IDENTITY, NodeTransform::parent_from_node);
        let world_from_node = world_from_parent * parent_from_node;
        if let Some(mesh) = node.mesh {
            get(&root.meshes, mesh, "mesh", || Place::element("node", index))?;
            placed.push((index, mesh.value(), world_from_node));
        }
        let children = node.children.iter().flatten().rev();
        stack.extend(children.map(|child| (child.value(), world_from_node)));
    }
    Ok(placed)
}

fn get<'a, T>(items: &'a [T], index: Index<T>, what: &'static str, place: impl Fn() -> Place) -> Result<&'a T, Fault> {
    items.get(index.value()).ok_or_else(|| {
        let problem = Problem::IndexOutOfRange { what, index: index.value() as i64, count: items.len(), first: 0 };
        Fault::Malformed(place(), problem)
    })
}

struct Document<'a> {
    root: &'a Root,
    path: &'a Path,
    blob: Option<&'a [u8]>,
    /// Buffers that have been loaded so far.
    buffers: Vec<Option<Cow<'a, [u8]>>>,
}

struct Part {
    mesh: TriangleMesh,
    points_or_lines: usize,
    has_targets: bool,
}

/// The bytes of an accessor: `count` values, `stride` bytes apart.
struct Values<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl<'a> Values<'a> {
    fn get(&self, index: usize) -> &'a [u8] {
        &self.bytes[index * self.stride..]
    }
}

impl Document<'_> {
    /// Reads one mesh in its own space. Positions that several primitives share occur once.
    fn mesh(&mut self, index: usize, triangles: &mut u64) -> Result<Part, Fault> {
        let root = self.root;
        let mut part = Part { mesh: TriangleMesh::default(), points_or_lines: 0, has_targets: false };
        let mut first_of_accessor = BTreeMap::new();
        for (number, primitive) in root.meshes[index].primitives.iter().enumerate() {
            let place = || Place::element(format!("mesh {index}, primitive"), number);
            let mode = match primitive.mode {
                Checked::Valid(mode) => mode,
                Checked::Invalid => return Err(Fault::invalid(place(), "the primitive's mode is not one of glTF")),
            };
            if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
                part.points_or_lines += 1;
                continue;
            }
            part.has_targets |= primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty());
            let Some(&accessor) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else {
                return Err(Fault::invalid(place(), "the primitive has no POSITION"));
            };
            self.refuse_compression(primitive, accessor, &place)?;
            let first = match first_of_accessor.get(&accessor.value()) {
                Some(&first) => first,
                None => {
                    let first = part.mesh.positions.len();
                    self.positions(accessor, &mut part.mesh.positions)?;
                    if part.mesh.positions.len() > u32::MAX as usize {
                        let found = part.mesh.positions.len() as u64;
                        let problem = Problem::TooMany { what: "vertices".into(), found, limit: u32::MAX.into() };
                        return Err(Fault::Malformed(place(), problem));
                    }
                    first_of_accessor.insert(accessor.value(), first);
                    first
                }
            };
            let count = root.accessors[accessor.value()].count.0 as usize;
            let corners = match primitive.indices {
                Some(indices) => self.indices(indices, count)?,
                None => (0..count as u32).collect(),
            };
            *triangles += corners.len() as u64 / if mode == Mode::Triangles { 3 } else { 1 };
            let limit = TRIANGLES_MAX.min(self.shared_limit());
            if *triangles > limit {
                let problem = Problem::TooMany { what: "triangles".into(), found: *triangles, limit };
                return Err(Fault::Malformed(place(), problem));
            }
            add_triangles(mode, &corners, first as u32, &mut part.mesh.triangles);
        }
        drop_unused(&mut part.mesh);
        Ok(part)
    }

    /// Returns the largest plausible number of positions or triangles for the buffers read so far, with some sharing of
    /// bytes.
    fn shared_limit(&self) -> u64 {
        SHARED_MAX + self.buffers.iter().flatten().map(|buffer| buffer.len() as u64).sum::<u64>()
    }

    fn refuse_compression(
        &self,
        primitive: &Primitive,
        positions: Index<Accessor>,
        place: &impl Fn() -> Place,
    ) -> Result<(), Fault> {
        let is_draco = primitive.extensions.as_ref().is_some_and(|extensions| extensions.others.contains_key(DRACO));
        let accessor = get(&self.root.accessors, positions, "accessor", place)?;
        if is_draco && accessor.buffer_view.is_none() {
            return Err(Fault::Unsupported(place(), compressed(DRACO)));
        }
        Ok(())
    }

    fn positions(&mut self, index: Index<Accessor>, positions: &mut Vec<DVec3>) -> Result<(), Fault> {
        let accessor = get(&self.root.accessors, index, "accessor", || Place::File)?;
        let place = || Place::element("accessor", index.value());
        if accessor.type_ != Checked::Valid(Type::Vec3) {
            return Err(Fault::invalid(place(), "positions must be of type VEC3"));
        }
        let Checked::Valid(component) = accessor.component_type else {
            return Err(Fault::invalid(place(), "the component type is not one of glTF"));
        };
        let (component, is_normalized) = (component.0, accessor.normalized);
        let count = accessor.count.0 as usize;
        let size = 3 * component.size();
        let read = |bytes: &[u8]| {
            let at = |axis: usize| coordinate(component, is_normalized, &bytes[axis * component.size()..]);
            DVec3::new(at(0), at(1), at(2))
        };
        // The sparse part comes first, since it limits the count where there is no other data.
        let replaced = match &accessor.sparse {
            Some(sparse) => {
                let Checked::Valid(index_type) = sparse.indices.component_type else {
                    return Err(Fault::invalid(place(), "the type of the sparse indices is not one of glTF"));
                };
                let (view, offset) = (sparse.indices.buffer_view.value(), sparse.indices.byte_offset.0);
                let values = self.values(view, offset, sparse.count.0, index_type.0.size(), &place)?;
                (0..sparse.count.0 as usize).map(|k| index_value(index_type.0, values.get(k))).collect()
            }
            None => Vec::new(),
        };
        let first = positions.len();
        let offset = accessor.byte_offset.unwrap_or_default().0;
        if let Some(view) = accessor.buffer_view {
            // This reads the buffer, so that its bytes count.
            self.values(view.value(), offset, accessor.count.0, size, &place)?;
        }
        let (found, limit) = ((first as u64).saturating_add(accessor.count.0), self.shared_limit());
        if found > limit {
            return Err(Fault::Malformed(place(), Problem::TooMany { what: "positions".into(), found, limit }));
        }
        match accessor.buffer_view {
            Some(view) => {
                let values = self.values(view.value(), offset, accessor.count.0, size, &place)?;
                positions.extend((0..count).inspect(|&k| checkpoint_at(k)).map(|k| read(values.get(k))));
            }
            None => {
                // Without data all values are zero, and no bytes limit the count; some of them must be replaced.
                let limit = ZEROS_PER_VALUE * replaced.len() as u64;
                if accessor.count.0 > limit {
                    let what = "positions without data".into();
                    return Err(Fault::Malformed(place(), Problem::TooMany { what, found: accessor.count.0, limit }));
                }
                positions.resize(first + count, DVec3::ZERO);
            }
        }
        let Some(sparse) = &accessor.sparse else { return Ok(()) };
        let (view, offset) = (sparse.values.buffer_view.value(), sparse.values.byte_offset.0);
        let values = self.values(view, offset, sparse.count.0, size, &place)?;
        for (k, vertex) in replaced.into_iter().enumerate() {
            let Some(position) = positions[first..].get_mut(vertex as usize) else {
                let problem = Problem::IndexOutOfRange { what: "sparse value", index: vertex.into(), count, first: 0 };
                return Err(Fault::Malformed(place(), problem));
            };
            *position = read(values.get(k));
        }
        Ok(())
    }

    /// Reads the indices of an accessor, which are all less than `vertices`.
    fn indices(&mut self, index: Index<Accessor>, vertices: usize) -> Result<Vec<u32>, Fault> {
        let accessor = get(&self.root.accessors, index, "accessor", || Place::File)?;
        let place = || Place::element("accessor", index.value());
        let component = match accessor.component_type {
            Checked::Valid(component) => component.0,
            Checked::Invalid => return Err(Fault::invalid(place(), "the component type is not one of glTF")),
        };
        if accessor.type_ != Checked::Valid(Type::Scalar)
            || !matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
        {
            return Err(Fault::invalid(place(), "indices must be unsigned scalars"));
        }
        let Some(view) = accessor.buffer_view else {
            return Err(Fault::invalid(place(), "indices must have a buffer view"));
        };
        if accessor.sparse.is_some() {
            return Err(Fault::Unsupported(place(), "sparse indices are not supported".to_owned()));
        }
        let offset = accessor.byte_offset.unwrap_or_default().0;
        let values = self.values(view.value(), offset, accessor.count.0, component.size(), &place)?;
        let mut indices = Vec::with_capacity(accessor.count.0 as usize);
        for k in 0..accessor.count.0 as usize {
            checkpoint_at(k);
            let vertex = index_value(component, values.get(k));
            if vertex as usize >= vertices {
                let problem =
                    Problem::IndexOutOfRange { what: "vertex", index: vertex.into(), count: vertices, first: 0 };
                let place = Place::element(format!("accessor {}, index", index.value()), k);
                return Err(Fault::Malformed(place, problem));
            }
            indices.push(vertex);
        }
        Ok(indices)
    }

    /// Returns the bytes of `count` values of `size` bytes each, after checking that they exist.
    fn values(
        &mut self,
        view: usize,
        offset: u64,
        count: u64,
        size: usize,
        place: &impl Fn() -> Place,
    ) -> Result<Values<'_>, Fault> {
        let root = self.root;
        let view = get(&root.buffer_views, Index::new(view as u32), "buffer view", place)?;
        let extensions = view.extensions.iter().flat_map(|extensions| extensions.others.keys());
        if let Some(name) = extensions.into_iter().find(|name| MESHOPT.contains(&name.as_str())) {
            // The buffer that the view names may hold the data uncompressed, or nothing.
            let fallback = root.buffers.get(view.buffer.value());
            if fallback.is_none_or(|buffer| buffer.uri.is_none() && (view.buffer.value() > 0 || self.blob.is_none())) {
                return Err(Fault::Unsupported(place(), compressed(name)));
            }
        }
        let stride = view.byte_stride.map_or(size, |stride| if stride.0 == 0 { size } else { stride.0 });
        if stride < size {
            let sentence = format!("values of {size} bytes are {stride} bytes apart");
            return Err(Fault::invalid(place(), sentence));
        }
        let (start, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        let buffer = self.buffer(view.buffer.value(), place)?;
        let range = start.checked_add(length).and_then(|end| buffer.get(start as usize..end as usize));
        let Some(bytes) = range else {
            let sentence = format!(
                "bytes {start} to {} of a buffer are referenced, but it has {}",
                start.saturating_add(length),
                buffer.len()
            );
            return Err(Fault::invalid(place(), sentence));
        };
        let bytes = bytes.get(usize::try_from(offset).unwrap_or(usize::MAX)..).unwrap_or_default();
        let fitting = if bytes.len() < size { 0 } else { ((bytes.len() - size) / stride + 1) as u64 };
        if count > fitting {
            return Err(Fault::Malformed(
                place(),
                Problem::Short { what: "values".into(), promised: count, found: fitting },
            ));
        }
        Ok(Values { bytes, stride })
    }

    fn buffer(&mut self, index: usize, place: &impl Fn() -> Place) -> Result<&[u8], Fault> {
        let buffer = get(&self.root.buffers, Index::new(index as u32), "buffer", place)?;
        if self.buffers[index].is_none() {
            let place = Place::element("buffer", index);
            let bytes = match (&buffer.uri, self.blob) {
                (Some(uri), _) => Cow::Owned(load(uri, self.path, buffer.byte_length.0, &place)?),
                (None, Some(blob)) if index == 0 => Cow::Borrowed(blob),
                _ => return Err(Fault::invalid(place, "the buffer has neither a URI nor a chunk `BIN`")),
            };
            if (bytes.len() as u64) < buffer.byte_length.0 {
                let (promised, found) = (buffer.byte_length.0, bytes.len() as u64);
                return Err(Fault::Malformed(place, Problem::Short { what: "bytes".into(), promised, found }));
            }
            self.buffers[index] = Some(bytes);
        }
        Ok(self.buffers[index].as_deref().unwrap_or_default())
    }
}

/// Adds the triangles of a primitive whose vertex 0 is vertex `first` of the mesh.
fn add_triangles(mode: Mode, corners: &[u32], first: u32, triangles: &mut Vec<[u32; 3]>) {
    match mode {
        Mode::TriangleStrip => {
            let mut strip = Strip::default();
            triangles.extend(corners.iter().filter_map(|corner| strip.triangle(corner + first)));
        }
        Mode::TriangleFan => {
            let rims = corners.windows(2).skip(1);
            triangles.extend(rims.map(|rim| [corners[0], rim[0], rim[1]].map(|corner| corner + first)));
        }
        // Corners after the last triple form no triangle.
        _ => triangles.extend(corners.chunks_exact(3).map(|t| [t[0] + first, t[1] + first, t[2] + first])),
    }
}

fn index_value(component: ComponentType, bytes: &[u8]) -> u32 {
    match component {
        ComponentType::U8 => bytes[0].into(),
        ComponentType::U16 => u16::from_le_bytes([bytes[0], bytes[1]]).into(),
        _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}

/// Reads a coordinate of any type: floats in the core format, integers by `KHR_mesh_quantization`.
fn coordinate(component: ComponentType, is_normalized: bool, bytes: &[u8]) -> f64 {
    let (value, greatest) = match component {
        ComponentType::I8 => (f64::from(bytes[0] as i8), f64::from(i8::MAX)),
        ComponentType::U8 => (f64::from(bytes[0]), f64::from(u8::MAX)),
        ComponentType::I16 => (f64::from(i16::from_le_bytes([bytes[0], bytes[1]])), f64::from(i16::MAX)),
        ComponentType::U16 => (f64::from(u16::from_le_bytes([bytes[0], bytes[1]])), f64::from(u16::MAX)),
        ComponentType::U32 => {
            (f64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])), f64::from(u32::MAX))
        }
        ComponentType::F32 => return f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]).into(),
    };
    if is_normalized { (value / greatest).max(-1.0) } else { value }
}

/// Returns the bytes of a buffer's URI: decoded from it, or at most `length` bytes of a file beside the document.
fn load(uri: &str, path: &Path, length: u64, place: &Place) -> Result<Vec<u8>, Fault> {
    if let Some(data) = uri.strip_prefix(DATA) {
        let (media_type, data) =
            data.split_once(',').ok_or_else(|| Fault::invalid(place.clone(), "the data URI has no comma"))?;
        let decoded = percent_decode(data);
        return match media_type.ends_with(";base64") {
            true => {
                base64_decode(&decoded).ok_or_else(|| Fault::invalid(place.clone(), "the data URI is not valid base64"))
            }
            false => Ok(decoded),
        };
    }
    let name = file_name(uri);
    let refused = |why| Fault::Unsupported(place.clone(), format!("the buffer `{}` {why}", quote(name.as_bytes())));
    if Path::new(&name).is_absolute() || name.contains("://") {
        return Err(refused("is not a relative path of a file"));
    }
    let side = beside(path, &name);
    let stays = |part| matches!(part, Component::Normal(_) | Component::CurDir);
    // Links are followed, since one may lead elsewhere.
    let folder = std::fs::canonicalize(folder(path));
    let is_linked_out =
        || folder.is_ok_and(|folder| std::fs::canonicalize(&side).is_ok_and(|side| !side.starts_with(folder)));
    if !Path::new(&name).components().all(stays) || is_linked_out() {
        return Err(refused("lies outside the folder of this file, from which buffers are read; copy it there"));
    }
    read_at_most(&side, length).map_err(|source| Fault::Io(side, source))
}

/// Returns the file name that a URI encodes.
fn file_name(uri: &str) -> String {
    String::from_utf8(percent_decode(uri)).unwrap_or_else(|_| uri.to_owned())
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Returns the path of a file relative to the folder of another.
fn beside(path: &Path, name: &str) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).join(name)
}

fn read_at_most(path: &Path, length: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    input::open(path)?.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Decodes `%20` and the like. A per cent sign without two hexadecimal digits stands for itself.
fn percent_decode(text: &str) -> Vec<u8> {
    let digit = |byte: Option<&u8>| byte.and_then(|&byte| char::from(byte).to_digit(16));
    let bytes = text.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        match (byte, digit(bytes.get(at + 1)), digit(bytes.get(at + 2))) {
            (b'%', Some(high), Some(low)) => {
                decoded.push((16 * high + low) as u8);
                at += 3;
            }
            _ => {
                decoded.push(byte);
                at += 1;
            }
        }
    }
    decoded
}

/// Decodes base64 in either alphabet, with or without padding; `None` where a character belongs to neither.
fn base64_decode(text: &[u8]) -> Option<Vec<u8>> {
    let mut decoded = Vec::with_capacity(text.len() / 4 * 3 + 3);
    let (mut bits, mut held) = (0u32, 0);
    for &byte in text.trim_ascii_end() {
        let digit = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' => break,
            _ => return None,
        };
        bits = bits << 6 | u32::from(digit);
        held += 6;
        if held >= 8 {
            held -= 8;
            decoded.push((bits >> held) as u8);
        }
    }
    Some(decoded)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::io::parse_parts;
    use crate::mesh::io::tests::{error, parsed, points};

    const FORMAT: Format = Format::Gltf;

    /// Returns four positions, then six indices of 16 bits.
    fn blob() -> Vec<u8> {
        let floats = [0f32, -0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.5];
        let indices = [0u16, 1, 2, 0, 2, 3];
        floats.iter().flat_map(|v| v.to_le_bytes()).chain(indices.iter().flat_map(|v| v.to_le_bytes())).collect()
    }

    fn base64(bytes: &[u8]) -> String {
        const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let mut text = String::new();
        for chunk in bytes.chunks(3) {
            let bits = chunk.iter().fold(0u32, |bits, &byte| bits << 8 | u32::from(byte)) << (8 * (3 - chunk.len()));
            for k in 0..4 {
                let digit = DIGITS[(bits >> (18 - 6 * k) & 63) as usize];
                text.push(if k <= chunk.len() { digit.into() } else { '=' });
            }
        }
        text
    }

    /// Returns a document with one mesh over `blob`, and nodes and scenes as given.
    fn document(scenes: &str, primitive: &str, buffer: &str) -> String {
        format!(
            r#"{{"asset":{{"version":"2.0"}},{scenes},
            "meshes":[{{"primitives":[{primitive}]}}],
            "accessors":[
                {{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
                {{"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"}},
                {{"componentType":5126,"count":4,"type":"VEC3","sparse":{{"count":2,
                    "indices":{{"bufferView":2,"componentType":5123}},"values":{{"bufferView":0,"byteOffset":12}}}}}}],
            "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":12}},
                {{"buffer":0,"byteOffset":50,"byteLength":4}}],
            "images":[{{"uri":"missing.png"}}],
            "buffers":[{{"byteLength":60{buffer}}}]}}"#
        )
    }

    fn embedded(scenes: &str, primitive: &str) -> Vec<u8> {
        let uri = format!(r#","uri":"data:application/octet-stream;base64,{}""#, base64(&blob()));
        document(scenes, primitive, &uri).into_bytes()
    }

    fn glb(json: &str, blob: &[u8]) -> Vec<u8> {
        let mut bytes = b"glTF".to_vec();
        let length = 12 + 8 + json.len() + 8 + 8 + blob.len();
        bytes.extend(2u32.to_le_bytes());
        bytes.extend((length as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", json.as_bytes()), (b"ODD!", b""), (b"BIN\0", blob)] {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind);
            bytes.extend(chunk);
        }
        bytes
    }

    const INDEXED: &str = r#"{"attributes":{"POSITION":0},"indices":1}"#;
    const ONE: &str = r#""nodes":[{"mesh":0}]"#;

    #[test]
    fn nodes_are_read_apart_by_their_names() {
        let nodes = r#""nodes":[{"name":"left","mesh":0,"translation":[0,0,5]},{"mesh":0}]"#;
        let file = parse_parts(&embedded(nodes, INDEXED), FORMAT, Path::new("sample.gltf")).unwrap();
        let names: Vec<&str> = file.meshes.iter().map(|part| part.name.as_deref().unwrap()).collect();
        assert_eq!(names, ["left", "node 1"]);
        assert_eq!(
            [0, 1].map(|part| file.meshes[part].mesh.positions[1]),
            [[1., 0., 5.], [1., 0., 0.]].map(DVec3::from)
        );
        assert_eq!((file.unit, file.notes), (Some(LengthUnit::Metre), vec![]));
    }

    #[test]
    fn shared_buffers_do_not_multiply_without_limit() {
        const COUNT: usize = 120_000;
        let blob = vec![0; 3 * COUNT];
        let file = |primitives: &[String], accessors: &[String]| {
            let (primitives, accessors, length) = (primitives.join(","), accessors.join(","), blob.len());
            let json = format!(
                r#"{{"asset":{{"version":"2.0"}},{ONE},"meshes":[{{"primitives":[{primitives}]}}],
                "accessors":[{accessors}],"bufferViews":[{{"buffer":0,"byteLength":{length}}}],
                "buffers":[{{"byteLength":{length}}}]}}"#
            );
            error(&glb(&json, &blob), Format::Glb)
        };
        let positions = format!(r#"{{"bufferView":0,"componentType":5120,"count":{COUNT},"type":"VEC3"}}"#);
        let indices = format!(r#"{{"bufferView":0,"componentType":5121,"count":{},"type":"SCALAR"}}"#, 3 * COUNT);
        let message = file(&vec![INDEXED.to_owned(); 30], &[positions.clone(), indices]);
        assert!(message.ends_with(": 2520000 triangles; the limit is 2457152"), "{message}");

        let primitive = |k: usize| format!(r#"{{"attributes":{{"POSITION":{k}}}}}"#);
        let message = file(&(0..30).map(primitive).collect::<Vec<_>>(), &vec![positions; 30]);
        assert!(message.ends_with(": 2520000 positions; the limit is 2457152"), "{message}");
    }

    #[test]
    fn buffers_are_read_from_text_chunks_and_files() {
        let square = points(&[[0., -0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.5]]);
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("the buffer.bin"), blob()).unwrap();
        let beside = document(ONE, INDEXED, r#","uri":"the%20buffer.bin""#);
        let chunk = glb(&document(ONE, INDEXED, ""), &blob());
        let files = [
            parsed(&embedded(ONE, INDEXED), FORMAT),
            parsed(&chunk, Format::Glb),
            crate::mesh::io::parse(beside.as_bytes(), FORMAT, &folder.path().join("a.gltf")).unwrap(),
        ];
        for file in files {
            assert_eq!(file.mesh.positions, square);
            assert!(file.mesh.positions[0].y.is_sign_negative());
            assert_eq!(file.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
            assert_eq!((file.unit, file.notes), (Some(LengthUnit::Metre), vec![]));
        }
        let mut long = chunk.clone();
        long.extend([0; 6]);
        assert_eq!(parsed(&long, Format::Glb).notes, [ReadNote::TrailingBytes { count: 6 }]);
    }

    #[test]
    fn buffers_stay_in_the_folder_of_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(at("inner/below")).unwrap();
        for name in ["a.bin", "inner/a.bin", "inner/below/a.bin"] {
            std::fs::write(at(name), blob()).unwrap();
        }
        let parse = |uri: &str| {
            let text = document(ONE, INDEXED, &format!(r#","uri":"{uri}""#));
            crate::mesh::io::parse(text.as_bytes(), FORMAT, &at("inner/a.gltf"))
        };
        for uri in ["a.bin", "./a.bin", "below/a.bin"] {
            assert!(parse(uri).is_ok(), "{uri}");
        }
        let refuses = |uri: &str, name: &str| {
            let message = parse(uri).unwrap_err().to_string();
            assert!(message.contains(&format!("buffer 0: the buffer `{name}` lies outside the folder")), "{message}");
        };
        for uri in ["../a.bin", "%2e%2e/a.bin", "..%2Fa.bin", "%2E%2E%2fa.bin"] {
            refuses(uri, "../a.bin");
        }
        refuses("below/../../a.bin", "below/../../a.bin");
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("../a.bin", at("inner/out.bin")).unwrap();
            std::os::unix::fs::symlink("..", at("inner/up")).unwrap();
            std::os::unix::fs::symlink("a.bin", at("inner/in.bin")).unwrap();
            refuses("out.bin", "out.bin");
            refuses("up/a.bin", "up/a.bin");
            assert!(parse("in.bin").is_ok());
        }
        let message = parse("%2Fetc%2Fhosts").unwrap_err().to_string();
        assert!(message.ends_with("the buffer `/etc/hosts` is not a relative path of a file"), "{message}");
    }

    #[test]
    fn instances_are_placed_in_f64_and_mirrored_ones_face_outwards() {
        let nodes = r#""nodes":[{"children":[1,2],"translation":[10.1,0,0]},{"mesh":0,"scale":[-1,1,1]},
            {"mesh":0,"matrix":[0,1,0,0,-1,0,0,0,0,0,1,0,0,0,5,1]},{"mesh":0}],
            "scenes":[{"nodes":[3]},{"nodes":[0]}],"scene":1"#;
        let file = parsed(&embedded(nodes, INDEXED), FORMAT);
        assert_eq!(file.mesh.positions[1], DVec3::new(10.1 - 1.0, 0.0, 0.0));
        assert_eq!(file.mesh.positions[5], DVec3::new(10.1, 1.0, 5.0));
        assert_eq!(file.mesh.triangles, [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]]);
        assert_eq!(file.notes, [ReadNote::ObjectsMerged { count: 2 }]);
        let turned = r#""nodes":[{"mesh":0,"rotation":[0,0,1,1]}]"#;
        let p = parsed(&embedded(turned, INDEXED), FORMAT).mesh.positions[1];
        assert!((p - DVec3::Y).length() < 1e-15, "{p}");
    }

    #[test]
    fn the_default_scene_the_first_or_all_roots_are_read() {
        let count = |scenes: &str| parsed(&embedded(scenes, INDEXED), FORMAT).mesh.triangles.len();
        let nodes = r#""nodes":[{"mesh":0,"children":[1]},{"mesh":0},{"mesh":0},{"mesh":0}]"#;
        assert_eq!(count(nodes), 8);
        assert_eq!(count(&format!(r#"{nodes},"scenes":[{{"nodes":[2]}},{{"nodes":[0]}}]"#)), 2);
        assert_eq!(count(&format!(r#"{nodes},"scenes":[{{"nodes":[2]}},{{"nodes":[0]}}],"scene":1"#)), 4);
    }

    #[test]
    fn strips_fans_soups_and_sparse_values_are_read() {
        let triangles = |primitive: &str| parsed(&embedded(ONE, primitive), FORMAT).mesh.triangles;
        assert_eq!(triangles(r#"{"attributes":{"POSITION":0},"mode":5}"#), [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(triangles(r#"{"attributes":{"POSITION":0},"mode":6}"#), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(triangles(r#"{"attributes":{"POSITION":0}}"#), [[0, 1, 2]]);
        let mixed = format!(r#"{{"attributes":{{"POSITION":0}},"mode":1}},{INDEXED},{INDEXED}"#);
        let file = parsed(&embedded(ONE, &mixed), FORMAT);
        assert_eq!((file.mesh.positions.len(), file.mesh.triangles.len()), (4, 4));
        assert_eq!(file.notes, [ReadNote::PointsOrLinesIgnored { count: 1 }]);
        let sparse = parsed(&embedded(ONE, r#"{"attributes":{"POSITION":2},"indices":1}"#), FORMAT);
        assert_eq!(sparse.mesh.positions, points(&[[0.; 3], [1., 0., 0.], [1., 1., 0.], [0.; 3]]));
    }

    #[test]
    fn morph_targets_are_ignored_with_a_note() {
        let targets = r#"{"attributes":{"POSITION":0},"indices":1,"targets":[{"POSITION":0}]}"#;
        assert_eq!(parsed(&embedded(ONE, targets), FORMAT).notes, [ReadNote::DeformationIgnored { count: 1 }]);
    }

    #[test]
    fn integer_positions_are_read() {
        assert_eq!(coordinate(ComponentType::I8, true, &[0x80]), -1.0);
        assert_eq!(coordinate(ComponentType::U16, true, &[0xFF, 0xFF]), 1.0);
        assert_eq!(coordinate(ComponentType::I16, false, &[0xFE, 0xFF]), -2.0);
    }

    #[test]
    fn errors_name_the_element_and_the_value() {
        let check = |primitive: &str, cases: &[[&str; 3]]| {
            let text = String::from_utf8(embedded(ONE, primitive)).unwrap();
            for [from, to, message] in cases {
                assert!(text.contains(from), "{from}");
                let said = error(text.replacen(from, to, 1).as_bytes(), FORMAT);
                assert_eq!(said, format!("sample.gltf{message}"), "{to}");
            }
        };
        let indexed = [
            [
                r#""count":4"#,
                r#""count":3"#,
                ", accessor 1, index 5: vertex 3 is out of range: there are 3, counted from 0",
            ],
            [r#""count":4"#, r#""count":5"#, ", accessor 0: 5 values declared, 4 found"],
            [
                r#""count":6"#,
                r#""count":18446744073709551615"#,
                ", accessor 1: 18446744073709551615 values declared, 6 found",
            ],
            [r#""mesh":0"#, r#""mesh":7"#, ", node 0: mesh 7 is out of range: there are 1, counted from 0"],
            [
                r#""POSITION":0"#,
                r#""POSITION":9"#,
                ", mesh 0, primitive 0: accessor 9 is out of range: there are 3, counted from 0",
            ],
            [r#""POSITION":0"#, r#""NORMAL":0"#, ", mesh 0, primitive 0: the primitive has no POSITION"],
            [
                r#""indices":1"#,
                r#""indices":1,"mode":9"#,
                ", mesh 0, primitive 0: the primitive's mode is not one of glTF",
            ],
            [r#""indices":1"#, r#""indices":0"#, ", accessor 0: indices must be unsigned scalars"],
            [
                r#""byteLength":48"#,
                r#""byteLength":61"#,
                ", accessor 0: bytes 0 to 61 of a buffer are referenced, but it has 60",
            ],
            [r#""byteLength":60"#, r#""byteLength":64"#, ", buffer 0: 64 bytes declared, 60 found"],
            ["base64,", "base64,*", ", buffer 0: the data URI is not valid base64"],
            [
                r#""mesh":0"#,
                r#""mesh":0,"children":[0]"#,
                ": the file has no triangles: the file has 0 vertices and no faces",
            ],
        ];
        check(INDEXED, &indexed);
        let sparse = r#"{"attributes":{"POSITION":2},"indices":1}"#;
        let values = [
            [
                r#""count":2"#,
                r#""count":18446744073709551615"#,
                ", accessor 2: 18446744073709551615 values declared, 2 found",
            ],
            [
                r#""count":4,"type":"VEC3","sparse""#,
                r#""count":99,"type":"VEC3","sparse""#,
                ", accessor 2: 99 positions without data; the limit is 32",
            ],
            [
                r#""count":4,"type":"VEC3","sparse""#,
                r#""count":1,"type":"VEC3","sparse""#,
                ", accessor 2: sparse value 1 is out of range: there are 1, counted from 0",
            ],
        ];
        check(sparse, &values);
        let twice = embedded(r#""nodes":[{"children":[1,1]},{"mesh":0}]"#, INDEXED);
        assert_eq!(error(&twice, FORMAT), "sample.gltf, node 1: the scene reaches this node twice");
        let missing = document(ONE, INDEXED, r#","uri":"no such.bin""#);
        assert!(error(missing.as_bytes(), FORMAT).starts_with("no such.bin: "));
        for uri in ["/etc/hosts", "https://example.org/a.bin"] {
            let message = error(document(ONE, INDEXED, &format!(r#","uri":"{uri}""#)).as_bytes(), FORMAT);
            assert_eq!(message, format!("sample.gltf, buffer 0: the buffer `{uri}` is not a relative path of a file"));
        }
        assert!(error(b"{}", FORMAT).starts_with("sample.gltf, line 1: the glTF document is invalid: missing field"));
    }

    #[test]
    fn compression_is_refused_by_name() {
        let advice = "which is not supported; write it without compression";
        let required = embedded(r#""extensionsRequired":["EXT_meshopt_compression"],"nodes":[{"mesh":0}]"#, INDEXED);
        let message = format!("sample.gltf: the mesh is compressed with EXT_meshopt_compression, {advice}");
        assert_eq!(error(&required, FORMAT), message);
        let draco = r#"{"attributes":{"POSITION":2},"extensions":{"KHR_draco_mesh_compression":{"bufferView":0}}}"#;
        let message = format!("sample.gltf, mesh 0, primitive 0: the mesh is compressed with {DRACO}, {advice}");
        assert_eq!(error(&embedded(ONE, draco), FORMAT), message);
    }

    #[test]
    fn truncated_containers_are_refused() {
        let whole = glb(&document(ONE, INDEXED, ""), &blob());
        let length = whole.len();
        let short = format!("sample.glb, byte 8: {length} bytes declared, {} found", length - 1);
        assert_eq!(error(&whole[..length - 1], Format::Glb), short);
        assert_eq!(error(b"glTF\x01\0\0\0", Format::Glb), "sample.glb, byte 4: glTF version 1 is not supported; 2 is");
        assert_eq!(error(b"glTX", Format::Glb), "sample.glb, byte 0: expected `glTF`, found `glTX`");
        assert_eq!(error(b"glTF\x02\0\0\0\x0C\0\0\0", Format::Glb), "sample.glb, byte 12: there is no chunk `JSON`");
    }
}
