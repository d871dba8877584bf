//! 3MF: the objects that a package's build places, in the unit of its model.
//!
//! Only build items count, with the components below them, each in its place. The reader follows the production
//! extension, by which items and components may lie in other parts of the package, and meshes beam lattices
//! (`lattice`).
//!
//! The package is read with `zip` and its XML with `quick-xml`. The `threemf2` crate was the first choice, but it turns
//! an invalid coordinate or index into 0, and drops a vertex that cannot be read, which renumbers all that follow it:
//! both without an error.
//!
//! A few bytes of a ZIP file can inflate to very many, so there is a limit on the inflated bytes, in proportion to the
//! file's size.

mod lattice;
mod write;

use std::borrow::Cow;
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{Cursor, Read};

use glam::{DAffine3, DMat3, DVec3};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use zip::ZipArchive;

use super::error::{Fault, Place, Problem};
use super::note::ReadNote;
use super::placement::{PLACEMENTS_MAX, Placement, Scene};
use super::text::{decode, number, quote, sentence};
use crate::cancel::checkpoint;
use crate::mesh::{LengthUnit, TriangleMesh};
use lattice::{Lattice, Meshed};
pub(super) use write::{FARTHEST, Object as WrittenObject, write};

/// Returns the largest inflated size in bytes of a package of `length` bytes. Highly repetitive models of lattices
/// reach a fiftieth of it.
fn inflated_limit(length: usize) -> u64 {
    (16 << 20) + 200 * length as u64
}

pub(super) fn parse(bytes: &[u8]) -> Result<Scene, Fault> {
    let mut package = Package::open(bytes)?;
    let root = package.root_model()?;
    let mut models = BTreeMap::new();
    let mut wanted = vec![root.clone()];
    while let Some(part) = wanted.pop() {
        if models.contains_key(&part) {
            continue;
        }
        let text = package.read(&part)?;
        let model = Model::parse(&text, &part)?;
        wanted.extend(model.references().filter_map(|reference| reference.part.clone()));
        models.insert(part, model);
    }
    build(models, &root)
}

struct Package<'a> {
    archive: ZipArchive<Cursor<&'a [u8]>>,
    /// The name in the archive of every part, by its name in lower case, since package names ignore case.
    names: BTreeMap<String, String>,
    limit: u64,
    /// Number of bytes that may still be inflated.
    left: u64,
}

impl<'a> Package<'a> {
    fn open(bytes: &'a [u8]) -> Result<Package<'a>, Fault> {
        let archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| {
            Fault::invalid(Place::File, format!("the file is not a valid ZIP package: {}", sentence(&error)))
        })?;
        let names = archive.file_names_raw().filter_map(|name| std::str::from_utf8(name).ok());
        let names = names.map(|name| (normal_name(name), name.to_owned())).collect();
        let limit = inflated_limit(bytes.len());
        Ok(Package { archive, names, limit, left: limit })
    }

    /// Reads the text of a part, whose name `normal_name` has returned.
    fn read(&mut self, part: &str) -> Result<String, Fault> {
        let place = || Place::Part { part: part.to_owned(), line: 1 };
        let Some(name) = self.names.get(part) else {
            return Err(Fault::invalid(Place::File, format!("the package has no part `{}`", quote(part.as_bytes()))));
        };
        let failed = |error: &dyn std::fmt::Display| {
            let (part, error) = (quote(part.as_bytes()), sentence(error));
            Fault::invalid(Place::File, format!("part `{part}` cannot be unpacked: {error}"))
        };
        let file = self.archive.by_name(name).map_err(|error| failed(&error))?;
        let mut inflated = Vec::new();
        file.take(self.left + 1).read_to_end(&mut inflated).map_err(|error| failed(&error))?;
        let Some(left) = self.left.checked_sub(inflated.len() as u64) else {
            let found = self.limit + 1;
            let what = "bytes or more when inflated".into();
            return Err(Fault::Malformed(place(), Problem::TooMany { what, found, limit: self.limit }));
        };
        self.left = left;
        let text = decode(&inflated).into_owned();
        // Names may be in a wrong encoding; only ASCII is interpreted.
        Ok(String::from_utf8(text).unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned()))
    }

    /// Returns the name of the part that the package's relationships declare as the model.
    fn root_model(&mut self) -> Result<String, Fault> {
        const RELATIONSHIPS: &str = "_rels/.rels";
        if self.names.contains_key(RELATIONSHIPS) {
            let text = self.read(RELATIONSHIPS)?;
            if let Some(target) = model_relationship(&text)? {
                return Ok(normal_name(&target));
            }
        }
        let models: Vec<&String> = self.names.keys().filter(|name| name.ends_with(".model")).collect();
        let usual = models.iter().find(|name| name.as_str() == "3d/3dmodel.model");
        match usual.or(models.first()) {
            Some(name) => Ok((*name).clone()),
            None => Err(Fault::invalid(Place::File, "the package has no 3MF model")),
        }
    }
}

/// Returns a part's name as the key of [`Package::names`].
fn normal_name(name: &str) -> String {
    name.trim_start_matches('/').to_ascii_lowercase()
}

fn model_relationship(text: &str) -> Result<Option<String>, Fault> {
    let mut xml = Xml::new(text, "_rels/.rels");
    while let Some(event) = xml.next()? {
        if let Event::Start(element) | Event::Empty(element) = event {
            let (mut is_model, mut target) = (false, None);
            xml.attributes(&element, |name, value| {
                match name {
                    "Type" => is_model = value.ends_with("/3dmodel"),
                    "Target" => target = Some(xml.name(value)?),
                    _ => {}
                }
                Ok(())
            })?;
            if is_model && target.is_some() {
                return Ok(target);
            }
        }
    }
    Ok(None)
}

/// XML events, and errors that name the part and the line.
struct Xml<'a> {
    reader: Reader<&'a [u8]>,
    text: &'a str,
    part: &'a str,
    /// The last offset whose line was asked for, and that line, so that frequent queries do not take quadratic time.
    known_line: Cell<(usize, usize)>,
}

impl<'a> Xml<'a> {
    fn new(text: &'a str, part: &'a str) -> Xml<'a> {
        Xml { reader: Reader::from_str(text), text, part, known_line: Cell::new((0, 1)) }
    }

    /// Returns the next event, or `None` at the end.
    fn next(&mut self) -> Result<Option<Event<'a>>, Fault> {
        match self.reader.read_event() {
            Ok(Event::Eof) => Ok(None),
            Ok(event) => Ok(Some(event)),
            Err(error) => Err(self.invalid(format!("the XML is invalid: {}", sentence(&error)))),
        }
    }

    /// Passes each attribute of an element to `each`, by its name without a prefix.
    fn attributes(
        &self,
        element: &BytesStart<'_>,
        mut each: impl FnMut(&str, &str) -> Result<(), Fault>,
    ) -> Result<(), Fault> {
        for attribute in element.attributes().with_checks(false) {
            let attribute =
                attribute.map_err(|error| self.invalid(format!("the XML is invalid: {}", sentence(&error))))?;
            each(attribute.key.local_name().as_ref(), &attribute.value)?;
        }
        Ok(())
    }

    fn line(&self) -> usize {
        let at = usize::try_from(self.reader.buffer_position()).unwrap_or(usize::MAX).min(self.text.len());
        let (known_at, known) = self.known_line.get();
        let line = known + memchr::memchr_iter(b'\n', &self.text.as_bytes()[known_at.min(at)..at]).count();
        self.known_line.set((at, line));
        line
    }

    /// Returns an attribute that is a name, with XML escapes resolved.
    fn name(&self, value: &str) -> Result<String, Fault> {
        let name = quick_xml::escape::unescape(value);
        name.map(Cow::into_owned).map_err(|error| self.invalid(format!("the XML is invalid: {}", sentence(&error))))
    }

    fn fault(&self, problem: Problem) -> Fault {
        Fault::Malformed(Place::Part { part: self.part.to_owned(), line: self.line() }, problem)
    }

    fn invalid(&self, sentence: impl Into<String>) -> Fault {
        self.fault(Problem::Invalid(sentence.into()))
    }

    fn number(&self, text: &str) -> Result<f64, Fault> {
        number(text.trim_ascii().as_bytes())
            .ok_or_else(|| self.fault(Problem::NotANumber { expected: "a number", found: quote(text.as_bytes()) }))
    }

    /// Parses the index of one of `count` vertices, all of which precede the reference, as the schema requires.
    fn vertex_index(&self, text: &str, count: usize) -> Result<u32, Fault> {
        let index = self.integer(text)?;
        if !(0..count.min(u32::MAX as usize) as i64).contains(&index) {
            return Err(self.fault(Problem::IndexOutOfRange { what: "vertex", index, count, first: 0 }));
        }
        Ok(index as u32)
    }

    fn integer(&self, text: &str) -> Result<i64, Fault> {
        text.trim_ascii()
            .parse()
            .map_err(|_| self.fault(Problem::NotANumber { expected: "a whole number", found: quote(text.as_bytes()) }))
    }
}

/// A reference to another object and its place: an item of the build or a component of an object.
struct Reference {
    /// The part that holds the object, where it is not the referring one.
    part: Option<String>,
    object: i64,
    outer_from_object: DAffine3,
    line: usize,
}

#[derive(Default)]
struct Object {
    /// The name, empty where there is none.
    name: String,
    is_support: bool,
    mesh: TriangleMesh,
    lattice: Option<Lattice>,
    components: Vec<Reference>,
    /// A kind of shape that is not supported, and its line.
    other_shape: Option<(String, usize)>,
}

impl Object {
    /// Returns whether the object has a shape of its own besides components.
    fn has_shape(&self) -> bool {
        !self.mesh.triangles.is_empty() || self.lattice.as_ref().is_some_and(|lattice| !lattice.is_empty())
    }

    /// Takes the mesh, with that of the lattice, whose triangles count against `room`.
    fn take_mesh(&mut self, room: &mut u64) -> Result<(TriangleMesh, Meshed), Fault> {
        let mut mesh = std::mem::take(&mut self.mesh);
        let meshed = match self.lattice.take() {
            Some(lattice) => lattice.mesh(&mut mesh, room)?,
            None => Meshed::default(),
        };
        Ok((mesh, meshed))
    }
}

struct Model {
    unit: LengthUnit,
    objects: BTreeMap<i64, Object>,
    items: Vec<Reference>,
}

/// The elements whose content is read.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Tag {
    Model,
    Resources,
    Object,
    Mesh,
    Vertices,
    Triangles,
    BeamLattice,
    Beams,
    Balls,
    Components,
    Build,
    Other,
}

impl Model {
    fn references(&self) -> impl Iterator<Item = &Reference> {
        self.items.iter().chain(self.objects.values().flat_map(|object| &object.components))
    }

    fn parse(text: &str, part: &str) -> Result<Model, Fault> {
        let mut xml = Xml::new(text, part);
        let mut model = Model { unit: LengthUnit::Millimetre, objects: BTreeMap::new(), items: Vec::new() };
        let mut open: Vec<Tag> = Vec::new();
        let mut object = (0, Object::default());
        let mut has_model = false;
        while let Some(event) = xml.next()? {
            checkpoint();
            match event {
                Event::Start(element) => {
                    let tag = model.element(&xml, &element, open.last().copied(), &mut object)?;
                    has_model |= tag == Tag::Model;
                    open.push(tag);
                }
                Event::Empty(element) => {
                    let tag = model.element(&xml, &element, open.last().copied(), &mut object)?;
                    model.close(&xml, tag, &mut object)?;
                }
                Event::End(_) => {
                    if let Some(tag) = open.pop() {
                        model.close(&xml, tag, &mut object)?;
                    }
                }
                _ => {}
            }
        }
        if !open.is_empty() {
            let problem = Problem::Expected { expected: "`</model>`".into(), found: "the end of the part".to_owned() };
            return Err(xml.fault(problem));
        }
        if !has_model {
            return Err(xml.invalid("the part has no element `model`"));
        }
        Ok(model)
    }

    fn element(
        &mut self,
        xml: &Xml<'_>,
        element: &BytesStart<'_>,
        parent: Option<Tag>,
        (id, object): &mut (i64, Object),
    ) -> Result<Tag, Fault> {
        let name = element.local_name();
        Ok(match (parent, name.as_ref()) {
            // The two most frequent ones come first.
            (Some(Tag::Vertices), "vertex") => {
                object.mesh.positions.push(vertex(xml, element)?);
                Tag::Other
            }
            (Some(Tag::Triangles), "triangle") => {
                let triangle = triangle(xml, element, &object.mesh)?;
                object.mesh.triangles.push(triangle);
                Tag::Other
            }
            (Some(Tag::Beams), "beam") => {
                let count = object.mesh.positions.len();
                object.lattice.as_mut().map_or(Ok(()), |lattice| lattice.beam(xml, element, count))?;
                Tag::Other
            }
            (Some(Tag::Balls), "ball") => {
                let count = object.mesh.positions.len();
                object.lattice.as_mut().map_or(Ok(()), |lattice| lattice.ball(xml, element, count))?;
                Tag::Other
            }
            (None, "model") => {
                xml.attributes(element, |name, value| {
                    if name == "unit" {
                        self.unit = unit(value).ok_or_else(|| {
                            xml.invalid(format!("`{}` is not a unit of 3MF", quote(value.as_bytes())))
                        })?;
                    }
                    Ok(())
                })?;
                Tag::Model
            }
            (Some(Tag::Model), "resources") => Tag::Resources,
            (Some(Tag::Model), "build") => Tag::Build,
            (Some(Tag::Resources), "object") => {
                let mut found = None;
                *object = Object::default();
                xml.attributes(element, |name, value| {
                    match name {
                        "id" => found = Some(xml.integer(value)?),
                        "name" => object.name = xml.name(value)?,
                        "type" => object.is_support = matches!(value, "support" | "solidsupport"),
                        _ => {}
                    }
                    Ok(())
                })?;
                *id = found.ok_or_else(|| xml.invalid("an object has no `id`"))?;
                Tag::Object
            }
            (Some(Tag::Object), "mesh") => Tag::Mesh,
            (Some(Tag::Object), "components") => Tag::Components,
            (Some(Tag::Object), "metadatagroup") => Tag::Other,
            (Some(Tag::Object), other) => {
                object.other_shape = Some((quote(other.as_bytes()), xml.line()));
                Tag::Other
            }
            (Some(Tag::Mesh), "vertices") => Tag::Vertices,
            (Some(Tag::Mesh), "triangles") => Tag::Triangles,
            (Some(Tag::Mesh), "beamlattice") => {
                if object.lattice.replace(Lattice::parse(xml, element)?).is_some() {
                    return Err(xml.invalid("a mesh has two beam lattices"));
                }
                Tag::BeamLattice
            }
            (Some(Tag::BeamLattice), "beams") => Tag::Beams,
            (Some(Tag::BeamLattice), "balls") => Tag::Balls,
            (Some(Tag::Components), "component") => {
                object.components.push(reference(xml, element)?);
                Tag::Other
            }
            (Some(Tag::Build), "item") => {
                self.items.push(reference(xml, element)?);
                Tag::Other
            }
            _ => Tag::Other,
        })
    }

    fn close(&mut self, xml: &Xml<'_>, tag: Tag, (id, object): &mut (i64, Object)) -> Result<(), Fault> {
        if tag == Tag::Object && self.objects.insert(*id, std::mem::take(object)).is_some() {
            return Err(xml.invalid(format!("two objects have the id {id}")));
        }
        Ok(())
    }
}

fn vertex(xml: &Xml<'_>, element: &BytesStart<'_>) -> Result<DVec3, Fault> {
    let mut position = [None; 3];
    xml.attributes(element, |name, value| {
        if let Some(axis) = ["x", "y", "z"].iter().position(|&axis| axis == name) {
            position[axis] = Some(xml.number(value)?);
        }
        Ok(())
    })?;
    let [Some(x), Some(y), Some(z)] = position else {
        return Err(xml.invalid("a vertex lacks one of `x`, `y` and `z`"));
    };
    Ok(DVec3::new(x, y, z))
}

fn triangle(xml: &Xml<'_>, element: &BytesStart<'_>, mesh: &TriangleMesh) -> Result<[u32; 3], Fault> {
    let mut triangle = [None; 3];
    xml.attributes(element, |name, value| {
        if let Some(corner) = ["v1", "v2", "v3"].iter().position(|&corner| corner == name) {
            triangle[corner] = Some(xml.vertex_index(value, mesh.positions.len())?);
        }
        Ok(())
    })?;
    let [Some(a), Some(b), Some(c)] = triangle else {
        return Err(xml.invalid("a triangle lacks one of `v1`, `v2` and `v3`"));
    };
    Ok([a, b, c])
}

fn reference(xml: &Xml<'_>, element: &BytesStart<'_>) -> Result<Reference, Fault> {
    let (mut part, mut object, mut outer_from_object) = (None, None, DAffine3::IDENTITY);
    xml.attributes(element, |name, value| {
        match name {
            "objectid" => object = Some(xml.integer(value)?),
            "path" => part = Some(normal_name(&xml.name(value)?)),
            "transform" => outer_from_object = transform(xml, value)?,
            _ => {}
        }
        Ok(())
    })?;
    let object = object.ok_or_else(|| xml.invalid("an item or component has no `objectid`"))?;
    Ok(Reference { part, object, outer_from_object, line: xml.line() })
}

/// Parses a transform. A 3MF matrix has four rows of three, and points are row vectors to its left; so its rows are our
/// columns.
fn transform(xml: &Xml<'_>, text: &str) -> Result<DAffine3, Fault> {
    let mut numbers = [0.0; 12];
    let mut count = 0;
    for word in text.split_ascii_whitespace() {
        let value = xml.number(word)?;
        if let Some(place) = numbers.get_mut(count) {
            *place = value;
        }
        count += 1;
    }
    if count != 12 {
        return Err(xml.invalid(format!("a transform needs 12 numbers, but this one has {count}")));
    }
    let row = |k: usize| DVec3::new(numbers[3 * k], numbers[3 * k + 1], numbers[3 * k + 2]);
    Ok(DAffine3::from_mat3_translation(DMat3::from_cols(row(0), row(1), row(2)), row(3)))
}

fn unit(name: &str) -> Option<LengthUnit> {
    use LengthUnit::{Centimetre, Foot, Inch, Metre, Micrometre, Millimetre};
    [Micrometre, Millimetre, Centimetre, Inch, Foot, Metre].into_iter().find(|&unit| unit_name(unit) == name)
}

/// Returns the name of the unit in 3MF.
fn unit_name(unit: LengthUnit) -> &'static str {
    match unit {
        LengthUnit::Micrometre => "micron",
        LengthUnit::Millimetre => "millimeter",
        LengthUnit::Centimetre => "centimeter",
        LengthUnit::Inch => "inch",
        LengthUnit::Foot => "foot",
        LengthUnit::Metre => "meter",
    }
}

/// Walks from the root model's items down to meshes.
fn build(mut models: BTreeMap<String, Model>, root: &str) -> Result<Scene, Fault> {
    let Some(root_model) = models.get(root) else {
        return Err(Fault::invalid(Place::File, "the package has no model"));
    };
    if root_model.items.is_empty() {
        let found = format!("the build is empty, which leaves {} objects unused", root_model.objects.len());
        return Err(Fault::Empty(found));
    }
    let unit = root_model.unit;
    let objects_in_all = models.values().map(|model| model.objects.len()).sum::<usize>();

    let mut walk = Walk { stack: Vec::new(), reached: 0 };
    walk.push(root, &root_model.items, DAffine3::IDENTITY, 0)?;
    let mut placed: Vec<(&str, i64, DAffine3, String)> = Vec::new();
    let mut supports = 0;
    while let Some((part, reference, world_from_outer, depth)) = walk.stack.pop() {
        let part = reference.part.as_deref().unwrap_or(part);
        let place = || Place::Part { part: part.to_owned(), line: reference.line };
        // A chain of components longer than the number of objects contains one of them twice.
        if depth > objects_in_all {
            return Err(Fault::invalid(place(), format!("object {} is a component of itself", reference.object)));
        }
        let Some(object) = models.get(part).and_then(|model| model.objects.get(&reference.object)) else {
            let sentence = format!("there is no object {} in part `{}`", reference.object, quote(part.as_bytes()));
            return Err(Fault::invalid(place(), sentence));
        };
        if object.is_support {
            supports += 1;
            continue;
        }
        if let Some((shape, line)) = &object.other_shape {
            let place = Place::Part { part: part.to_owned(), line: *line };
            let feature = format!("object {} is made by `{shape}`, which is not supported", reference.object);
            return Err(Fault::Unsupported(place, feature));
        }
        object.lattice.as_ref().map_or(Ok(()), |lattice| refuse_clipping(lattice, part, reference.object))?;
        let world_from_object = world_from_outer * reference.outer_from_object;
        if object.has_shape() {
            let name = match object.name.as_str() {
                "" => format!("object {}", reference.object),
                name => name.to_owned(),
            };
            placed.push((part, reference.object, world_from_object, name));
        }
        walk.push(part, &object.components, world_from_object, depth + 1)?;
    }

    let mut notes = Vec::new();
    if supports > 0 {
        notes.push(ReadNote::SupportsSkipped { count: supports });
    }
    let keys: BTreeSet<(String, i64)> = placed.iter().map(|(part, object, ..)| ((*part).to_owned(), *object)).collect();
    let keys: Vec<(String, i64)> = keys.into_iter().collect();
    let part_index = |part: &str, object: i64| {
        keys.binary_search_by(|key| (key.0.as_str(), key.1).cmp(&(part, object))).unwrap_or_default()
    };
    let placements: Vec<Placement> = placed
        .into_iter()
        .map(|(part, object, world_from_part, name)| {
            let part = part_index(part, object);
            Placement { part, world_from_part, name }
        })
        .collect();
    drop(walk);
    let mut parts = Vec::with_capacity(keys.len());
    let mut lattices = Vec::with_capacity(keys.len());
    let mut room = lattice::TRIANGLES_MAX;
    for (part, id) in &keys {
        let object = models.get_mut(part).and_then(|model| model.objects.get_mut(id));
        let (mesh, meshed) = object.map(|object| object.take_mesh(&mut room)).transpose()?.unwrap_or_default();
        parts.push(mesh);
        lattices.push(meshed);
    }
    notes.extend(lattice_notes(placements.iter().map(|placement| lattices[placement.part])));
    Ok(Scene { parts, placements, unit, notes })
}

fn refuse_clipping(lattice: &Lattice, part: &str, object: i64) -> Result<(), Fault> {
    let Some((mode, line)) = &lattice.clipping else { return Ok(()) };
    let place = Place::Part { part: part.to_owned(), line: *line };
    let feature =
        format!("the beam lattice of object {object} is clipped (`{mode}`) by a mesh, which is not supported");
    Err(Fault::Unsupported(place, feature))
}

/// Returns the notes about the lattices of all instances.
fn lattice_notes(lattices: impl Iterator<Item = Meshed>) -> Vec<ReadNote> {
    let (mut meshed, mut short, mut representations) = (0, 0, 0);
    for lattice in lattices {
        meshed += lattice.meshed;
        short += lattice.too_short;
        representations += usize::from(lattice.has_representation);
    }
    let notes = [
        (meshed, ReadNote::BeamsMeshed { count: meshed }),
        (short, ReadNote::BeamsTooShort { count: short }),
        (representations, ReadNote::RepresentationsIgnored { count: representations }),
    ];
    notes.into_iter().filter(|&(count, _)| count > 0).map(|(_, note)| note).collect()
}

/// A stack of references to be followed: the part of each, the transform of that part's space, and the depth.
struct Walk<'a> {
    stack: Vec<(&'a str, &'a Reference, DAffine3, usize)>,
    reached: usize,
}

impl<'a> Walk<'a> {
    /// Adds references, to be followed in their order before all that were added earlier.
    fn push(
        &mut self,
        part: &'a str,
        references: &'a [Reference],
        world_from_outer: DAffine3,
        depth: usize,
    ) -> Result<(), Fault> {
        self.reached += references.len();
        if self.reached > PLACEMENTS_MAX {
            let (found, limit) = (self.reached as u64, PLACEMENTS_MAX as u64);
            let what = "items and components in all instances".into();
            return Err(Fault::Malformed(Place::File, Problem::TooMany { what, found, limit }));
        }
        self.stack.extend(references.iter().rev().map(|reference| (part, reference, world_from_outer, depth)));
        Ok(())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::io::Write;
    use std::path::Path;

    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    use super::*;
    use crate::mesh::io::tests::{error, parsed, points};
    use crate::mesh::io::{Format, parse_parts};

    const FORMAT: Format = Format::ThreeMf;
    const ROOT: &str = "3D/root.model";

    /// Returns a package of these parts, of which `ROOT` is the model.
    pub(in super::super) fn package(parts: &[(&str, &str)]) -> Vec<u8> {
        let relationships = format!(
            r#"<Relationships><Relationship Target="/{ROOT}" Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>"#
        );
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, text) in [("_rels/.rels", relationships.as_str())].iter().chain(parts) {
            zip.start_file(*name, SimpleFileOptions::default()).unwrap();
            zip.write_all(text.as_bytes()).unwrap();
        }
        zip.finish().unwrap().into_inner()
    }

    pub(in super::super) fn model(attributes: &str, objects: &str, items: &str) -> String {
        format!(
            "<?xml version=\"1.0\"?>\n<model {attributes} xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n\
             <resources>{objects}</resources>\n<build>{items}</build>\n</model>"
        )
    }

    fn single(attributes: &str, objects: &str, items: &str) -> Vec<u8> {
        package(&[(ROOT, &model(attributes, objects, items))])
    }

    pub(in super::super) const TRIANGLE: &str = r#"<object id="1" type="model"><mesh><vertices>
        <vertex x="0" y="-0" z="0.1"/><vertex x="1" y="0" z="0"/><vertex z="0" y="1e0" x=" 0 "/></vertices>
        <triangles><triangle v1="0" v2="1" v3="2" pid="1"/></triangles></mesh></object>"#;
    const ITEM: &str = r#"<item objectid="1"/>"#;

    #[test]
    fn objects_are_read_in_each_unit() {
        let units = [
            ("unit=\"micron\"", LengthUnit::Micrometre),
            ("unit=\"millimeter\"", LengthUnit::Millimetre),
            ("unit='centimeter'", LengthUnit::Centimetre),
            ("unit=\"inch\"", LengthUnit::Inch),
            ("unit=\"foot\"", LengthUnit::Foot),
            ("unit=\"meter\"", LengthUnit::Metre),
            ("", LengthUnit::Millimetre),
        ];
        for (attribute, unit) in units {
            let file = parsed(&single(attribute, TRIANGLE, ITEM), FORMAT);
            assert_eq!(file.mesh.positions, points(&[[0., -0., 0.1], [1., 0., 0.], [0., 1., 0.]]));
            assert!(file.mesh.positions[0].y.is_sign_negative());
            assert_eq!((file.mesh.triangles, file.unit, file.notes), (vec![[0, 1, 2]], Some(unit), vec![]));
        }
    }

    #[test]
    fn components_nest_and_mirrored_ones_face_outwards() {
        let objects = format!(
            r#"{TRIANGLE}<object id="2"><components><component objectid="1" transform="0 1 0 -1 0 0 0 0 1 0 0 5"/>
            <component objectid="1"/></components></object>"#
        );
        let items = r#"<item objectid="2" transform="1 0 0 0 1 0 0 0 1 10 0 0"/>
            <item objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>"#;
        let file = parsed(&single("", &objects, items), FORMAT);
        // The row vector (1, 0, 0) becomes the first row, (0, 1, 0).
        assert_eq!(file.mesh.positions[1], DVec3::new(10.0, 1.0, 5.0));
        assert_eq!(file.mesh.positions[4], DVec3::new(11.0, 0.0, 0.0));
        assert_eq!(file.mesh.positions[7], DVec3::new(-1.0, 0.0, 0.0));
        assert_eq!(file.mesh.triangles, [[0, 1, 2], [3, 4, 5], [6, 8, 7]]);
        assert_eq!(file.notes, [ReadNote::ObjectsMerged { count: 3 }]);
    }

    #[test]
    fn instances_are_read_apart_by_their_names() {
        let named = TRIANGLE.replace("id=\"1\"", "id=\"1\" name=\"a &amp; b\"");
        let other = TRIANGLE.replace("id=\"1\"", "id=\"2\"");
        let objects = format!(
            r#"{named}{other}<object id="3"><components><component objectid="1" transform="1 0 0 0 1 0 0 0 1 0 0 5"/>
            <component objectid="2"/></components></object>"#
        );
        let items = r#"<item objectid="3"/><item objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>"#;
        let bytes = single("unit=\"inch\"", &objects, items);
        let file = parse_parts(&bytes, FORMAT, Path::new("sample.3mf")).unwrap();
        let names: Vec<&str> = file.meshes.iter().map(|part| part.name.as_deref().unwrap()).collect();
        assert_eq!(names, ["a & b", "object 2", "a & b"]);
        let corner = |part: usize| file.meshes[part].mesh.positions[1];
        let corners = [0, 1, 2].map(corner);
        assert_eq!(corners, [DVec3::new(1.0, 0.0, 5.0), DVec3::new(1.0, 0.0, 0.0), DVec3::new(-1.0, 0.0, 0.0)]);
        assert_eq!(file.meshes[2].mesh.triangles, [[0, 2, 1]]);
        assert_eq!((file.unit, file.notes), (Some(LengthUnit::Inch), vec![]));
    }

    #[test]
    fn components_in_other_parts_are_read() {
        let other = model("", TRIANGLE, "");
        let objects = r#"<object id="1"><components><component p:path="/3D/Objects/Other.model" objectid="1"/></components></object>"#;
        let bytes = package(&[(ROOT, &model("", objects, ITEM)), ("3d/objects/other.model", &other)]);
        assert_eq!(parsed(&bytes, FORMAT).mesh.triangles, [[0, 1, 2]]);
        let bytes = package(&[(ROOT, &model("", objects, ITEM))]);
        assert_eq!(error(&bytes, FORMAT), "sample.3mf: the package has no part `3d/objects/other.model`");
    }

    #[test]
    fn supports_are_noted_and_unused_objects_are_ignored() {
        let support = TRIANGLE.replace("id=\"1\"", "id=\"3\"").replace("type=\"model\"", "type=\"support\"");
        let unused = TRIANGLE.replace("id=\"1\"", "id=\"4\"");
        let objects = format!("{TRIANGLE}{support}{unused}");
        let file = parsed(&single("", &objects, r#"<item objectid="1"/><item objectid="3"/>"#), FORMAT);
        assert_eq!(file.mesh.triangles.len(), 1);
        assert_eq!(file.notes, [ReadNote::SupportsSkipped { count: 1 }]);
    }

    /// Returns the triangle's object with this lattice in it.
    fn with_lattice(lattice: &str) -> String {
        TRIANGLE.replace("</mesh>", &format!("{lattice}</mesh>"))
    }

    /// Number of triangles of a tube, of a round cap, of a flat one and of a ball.
    const TUBE: usize = 48;
    const ROUND: usize = 96;
    const FLAT: usize = 22;
    const BALL: usize = 192;

    #[test]
    fn beams_are_meshed_beside_triangles_in_every_placement() {
        let lattice = r#"<b:beamlattice radius="0.1" minlength="0.001" cap="butt" representationmesh="9">
            <b:beams><b:beam v1="0" v2="1"/><b:beam v1="1" v2="2" r1="0.2" cap1="sphere" cap2="hemisphere"/>
            <b:beam v1="0" v2="2" r1="0.2" r2="0.1" cap1="sphere"/></b:beams>
            <b:beamsets><b:beamset><b:ref index="0"/></b:beamset></b:beamsets></b:beamlattice>"#;
        let items = r#"<item objectid="1"/><item objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>"#;
        let file = parsed(&single("", &with_lattice(lattice), items), FORMAT);
        let beams = 3 * TUBE + (2 * FLAT) + (2 * ROUND) + (ROUND + FLAT + BALL);
        assert_eq!(file.mesh.triangles.len(), 2 * (1 + beams));
        let notes = [
            ReadNote::ObjectsMerged { count: 2 },
            ReadNote::BeamsMeshed { count: 6 },
            ReadNote::RepresentationsIgnored { count: 2 },
        ];
        assert_eq!(file.notes, notes);
        // The mirror image is turned outwards again.
        let half = |triangles: &[[u32; 3]]| {
            TriangleMesh { positions: file.mesh.positions.clone(), triangles: triangles.to_vec() }.signed_volume()
        };
        let (one, other) = file.mesh.triangles.split_at(1 + beams);
        assert!((half(one) - half(other)).abs() < 1e-12 && half(&one[1..]) > 0.0);
    }

    #[test]
    fn lattices_alone_are_read_and_skipped_beams_and_balls_noted() {
        let lattice = r#"<b:beamlattice radius="0.1" minlength="1.2" b2:ballmode="mixed" b2:ballradius="0.3"><b:beams>
            <b:beam v1="0" v2="1"/><b:beam v1="1" v2="2"/></b:beams><b2:balls><b2:ball vindex="2"/></b2:balls></b:beamlattice>"#;
        let alone = with_lattice(lattice).replace(r#"<triangle v1="0" v2="1" v3="2" pid="1"/>"#, "");
        let file = parsed(&single("", &alone, ITEM), FORMAT);
        assert_eq!(file.mesh.triangles.len(), TUBE + 2 * ROUND + BALL);
        assert_eq!(file.notes, [ReadNote::BeamsMeshed { count: 2 }, ReadNote::BeamsTooShort { count: 1 }]);
    }

    #[test]
    fn impossible_lattices_are_refused() {
        let said = |attributes: &str, beam: &str| {
            let lattice = format!("<b:beamlattice {attributes}><b:beams><b:beam {beam}/></b:beams></b:beamlattice>");
            let error = error(&single("", &with_lattice(&lattice), ITEM), FORMAT);
            error.strip_prefix("sample.3mf, 3d/root.model line 5: ").map(str::to_owned).unwrap_or(error)
        };
        let beam = r#"v1="0" v2="1""#;
        for attribute in ["clippingmode", "clipping"] {
            let clipped = said(&format!(r#"radius="1" clippingmesh="7" {attribute}="inside""#), beam);
            let sentence = "the beam lattice of object 1 is clipped (`inside`) by a mesh, which is not supported";
            assert_eq!(clipped, sentence);
        }
        assert_eq!(said("", beam), "neither the beam nor its lattice has a radius");
        assert_eq!(said(r#"radius="0""#, beam), "the radius 0 is not above 0");
        assert_eq!(said(r#"radius="1" cap="round""#, beam), "`round` is not a beam cap");
        assert_eq!(said(r#"radius="1" ballmode="some""#, beam), "`some` is not a ball mode");
        assert_eq!(said(r#"radius="1""#, r#"v1="0""#), "a beam lacks one of `v1` and `v2`");
        assert_eq!(said(r#"radius="1""#, r#"v1="1" v2="1""#), "a beam begins and ends at vertex 1");
        let beyond = "vertex 3 is out of range: there are 3, counted from 0";
        assert_eq!(said(r#"radius="1""#, r#"v1="0" v2="3""#), beyond);
    }

    #[test]
    fn errors_name_the_line_and_the_value() {
        let triangle = |from: &str, to: &str| {
            assert!(TRIANGLE.contains(from), "{from}");
            error(&single("", &TRIANGLE.replacen(from, to, 1), ITEM), FORMAT)
        };
        let at = "sample.3mf, 3d/root.model line";
        assert_eq!(triangle("x=\"1\"", "x=\"one\""), format!("{at} 4: `one` is not a number"));
        assert_eq!(triangle("x=\"1\"", ""), format!("{at} 4: a vertex lacks one of `x`, `y` and `z`"));
        let beyond = "vertex 3 is out of range: there are 3, counted from 0";
        assert_eq!(triangle("v3=\"2\"", "v3=\"3\""), format!("{at} 5: {beyond}"));
        assert_eq!(triangle("v3=\"2\"", ""), format!("{at} 5: a triangle lacks one of `v1`, `v2` and `v3`"));
        assert_eq!(triangle("id=\"1\"", "id=\"7\""), format!("{at} 6: there is no object 1 in part `3d/root.model`"));
        let shape = triangle("<mesh>", "<bo:booleanshape/><mesh>");
        assert_eq!(shape, format!("{at} 3: object 1 is made by `booleanshape`, which is not supported"));
        let short = error(&single("", TRIANGLE, r#"<item objectid="1" transform="1 0 0"/>"#), FORMAT);
        assert_eq!(short, format!("{at} 6: a transform needs 12 numbers, but this one has 3"));
        let unit = error(&single("unit=\"parsec\"", TRIANGLE, ITEM), FORMAT);
        assert_eq!(unit, format!("{at} 2: `parsec` is not a unit of 3MF"));
        let empty = "sample.3mf: the file has no triangles: the build is empty, which leaves 1 objects unused";
        assert_eq!(error(&single("", TRIANGLE, ""), FORMAT), empty);
        assert!(error(b"PK no", FORMAT).starts_with("sample.3mf: the file is not a valid ZIP package: "));
    }

    #[test]
    fn recursive_and_multiplying_components_are_refused() {
        let own = r#"<object id="1"><components><component objectid="1"/></components></object>"#;
        let message = "sample.3mf, 3d/root.model line 3: object 1 is a component of itself";
        assert_eq!(error(&single("", own, ITEM), FORMAT), message);
        let mut objects = TRIANGLE.replace("id=\"1\"", "id=\"64\"");
        for id in (1..64).rev() {
            let twice = format!(r#"<component objectid="{}"/>"#, id + 1).repeat(2);
            objects += &format!(r#"<object id="{id}"><components>{twice}</components></object>"#);
        }
        let message = error(&single("", &objects, ITEM), FORMAT);
        let limit = "items and components in all instances; the limit is 1048576";
        assert!(message.ends_with(limit), "{message}");
    }

    #[test]
    fn instances_do_not_multiply_unused_vertices_and_their_triangles_are_limited() {
        let thousand = |id: u32| {
            let component = format!(r#"<component objectid="{}"/>"#, id + 1).repeat(1000);
            format!(r#"<object id="{id}"><components>{component}</components></object>"#)
        };
        let part = TRIANGLE.replace("id=\"1\"", "id=\"3\"");
        let unused = format!("{}</vertices>", r#"<vertex x="9" y="9" z="9"/>"#.repeat(4000));
        let objects = part.replace("</vertices>", &unused) + &thousand(2) + &thousand(1);
        let mesh = parsed(&single("", &objects, ITEM), FORMAT).mesh;
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (3_000_000, 1_000_000));

        let twenty = format!("{}</triangles>", r#"<triangle v1="0" v2="1" v3="2"/>"#.repeat(19));
        let objects = part.replace("</triangles>", &twenty) + &thousand(2) + &thousand(1);
        let message = "sample.3mf: 19999980 triangles in copies of parts; the limit is 16777216";
        assert_eq!(error(&single("", &objects, ITEM), FORMAT), message);
    }

    #[test]
    fn archives_that_inflate_beyond_the_limit_are_refused() {
        let model = model("", &format!("{TRIANGLE}{}", " ".repeat(40 << 20)), ITEM);
        let message = error(&package(&[(ROOT, &model)]), FORMAT);
        assert!(message.contains("bytes or more when inflated; the limit is"), "{message}");
    }
}
