//! 3MF: the objects that a package's build places, in the unit that its model names.
//!
//! Only build items count, with the components below them, each in its place. The production extension, by which items and
//! components may lie in other parts of the package, is followed.
//!
//! The package is read with `zip` and its XML with `quick-xml`. The `threemf2` crate was the first choice, but a coordinate
//! or an index that is no number becomes 0 there, and a vertex that cannot be read is dropped, which renumbers all that
//! follow it: both without an error.
//!
//! A few bytes of a ZIP file can inflate to very many, so there is a limit to how many, in proportion to the file's size.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Cursor, Read};

use glam::{DAffine3, DMat3, DVec3};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use zip::ZipArchive;

use super::MeshFile;
use super::error::{Fault, Place, Problem};
use super::note::ReadNote;
use super::placement::{PLACEMENTS_MAX, Placement, assemble};
use super::text::{decode, number, quote};
use crate::mesh::{LengthUnit, TriangleMesh};

/// Bytes that a package of `length` may inflate to. Models of lattices, full of the same words, reach a fiftieth of it.
fn inflated_limit(length: usize) -> u64 {
    (16 << 20) + 200 * length as u64
}

pub(super) fn parse(bytes: &[u8]) -> Result<MeshFile, Fault> {
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
    /// Every part's name in the archive by its name in lower case, since package names ignore case.
    names: BTreeMap<String, String>,
    limit: u64,
    /// Bytes that may still be inflated.
    left: u64,
}

impl<'a> Package<'a> {
    fn open(bytes: &'a [u8]) -> Result<Package<'a>, Fault> {
        let archive = ZipArchive::new(Cursor::new(bytes))
            .map_err(|error| Fault::invalid(Place::File, format!("the file is no sound ZIP package: {error}")))?;
        let names = archive.file_names_raw().filter_map(|name| std::str::from_utf8(name).ok());
        let names = names.map(|name| (normal_name(name), name.to_owned())).collect();
        let limit = inflated_limit(bytes.len());
        Ok(Package { archive, names, limit, left: limit })
    }

    /// The text of a part, which `normal_name` has named.
    fn read(&mut self, part: &str) -> Result<String, Fault> {
        let place = || Place::Part { part: part.to_owned(), line: 1 };
        let Some(name) = self.names.get(part) else {
            return Err(Fault::invalid(Place::File, format!("the package has no part `{}`", quote(part.as_bytes()))));
        };
        let failed = |error: &dyn std::fmt::Display| {
            Fault::invalid(Place::File, format!("part `{}` cannot be unpacked: {error}", quote(part.as_bytes())))
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
        // Names may be in a wrong encoding; what matters here is ASCII.
        Ok(String::from_utf8(text).unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned()))
    }

    /// The name of the part that the package's relationships call the model.
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

/// A part's name as the key of [`Package::names`].
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
                    "Target" => target = Some(value.to_owned()),
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
}

impl<'a> Xml<'a> {
    fn new(text: &'a str, part: &'a str) -> Xml<'a> {
        Xml { reader: Reader::from_str(text), text, part }
    }

    /// The next event, or `None` at the end.
    fn next(&mut self) -> Result<Option<Event<'a>>, Fault> {
        match self.reader.read_event() {
            Ok(Event::Eof) => Ok(None),
            Ok(event) => Ok(Some(event)),
            Err(error) => Err(self.invalid(format!("the XML is wrong: {error}"))),
        }
    }

    /// Hands each attribute of an element to `each`, by its name without a prefix.
    fn attributes(
        &self,
        element: &BytesStart<'_>,
        mut each: impl FnMut(&str, &str) -> Result<(), Fault>,
    ) -> Result<(), Fault> {
        for attribute in element.attributes().with_checks(false) {
            let attribute = attribute.map_err(|error| self.invalid(format!("the XML is wrong: {error}")))?;
            each(attribute.key.local_name().as_ref(), &attribute.value)?;
        }
        Ok(())
    }

    fn line(&self) -> usize {
        let at = usize::try_from(self.reader.buffer_position()).unwrap_or(usize::MAX).min(self.text.len());
        1 + memchr::memchr_iter(b'\n', &self.text.as_bytes()[..at]).count()
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

    fn integer(&self, text: &str) -> Result<i64, Fault> {
        text.trim_ascii()
            .parse()
            .map_err(|_| self.fault(Problem::NotANumber { expected: "a whole number", found: quote(text.as_bytes()) }))
    }
}

/// An item of the build or a component of an object: another object, and where it stands.
struct Reference {
    /// The part that has the object, where it is not the one that refers to it.
    part: Option<String>,
    object: i64,
    outer_from_object: DAffine3,
    line: usize,
}

#[derive(Default)]
struct Object {
    is_support: bool,
    mesh: TriangleMesh,
    beams: usize,
    components: Vec<Reference>,
    /// A kind of shape that is not known here, and its line.
    other_shape: Option<(String, usize)>,
}

struct Model {
    unit: LengthUnit,
    objects: BTreeMap<i64, Object>,
    items: Vec<Reference>,
}

/// The elements whose content matters.
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
            // The two that fill a file come first.
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
                object.beams += 1;
                Tag::Other
            }
            (None, "model") => {
                xml.attributes(element, |name, value| {
                    if name == "unit" {
                        self.unit = unit(value)
                            .ok_or_else(|| xml.invalid(format!("`{}` is no unit of 3MF", quote(value.as_bytes()))))?;
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
            (Some(Tag::Mesh), "beamlattice") => Tag::BeamLattice,
            (Some(Tag::BeamLattice), "beams") => Tag::Beams,
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
            return Err(xml.invalid(format!("there are two objects {id}")));
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
            let index = xml.integer(value)?;
            // The vertices stand before the triangles, as the schema has it.
            let count = mesh.positions.len();
            if !(0..count.min(u32::MAX as usize) as i64).contains(&index) {
                return Err(xml.fault(Problem::IndexOutOfRange { what: "vertex", index, count, first: 0 }));
            }
            triangle[corner] = Some(index as u32);
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
            "path" => part = Some(normal_name(value)),
            "transform" => outer_from_object = transform(xml, value)?,
            _ => {}
        }
        Ok(())
    })?;
    let object = object.ok_or_else(|| xml.invalid("an item or component has no `objectid`"))?;
    Ok(Reference { part, object, outer_from_object, line: xml.line() })
}

/// A 3MF matrix has four rows of three, and points are rows that stand before it; so its rows are our columns.
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
        return Err(xml.invalid(format!("a transform has 12 numbers, and this one has {count}")));
    }
    let row = |k: usize| DVec3::new(numbers[3 * k], numbers[3 * k + 1], numbers[3 * k + 2]);
    Ok(DAffine3::from_mat3_translation(DMat3::from_cols(row(0), row(1), row(2)), row(3)))
}

fn unit(name: &str) -> Option<LengthUnit> {
    Some(match name {
        "micron" => LengthUnit::Micrometre,
        "millimeter" => LengthUnit::Millimetre,
        "centimeter" => LengthUnit::Centimetre,
        "inch" => LengthUnit::Inch,
        "foot" => LengthUnit::Foot,
        "meter" => LengthUnit::Metre,
        _ => return None,
    })
}

/// Walks from the root model's items down to meshes.
fn build(mut models: BTreeMap<String, Model>, root: &str) -> Result<MeshFile, Fault> {
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
    let mut placed: Vec<(&str, i64, DAffine3)> = Vec::new();
    let (mut supports, mut beams) = (0, 0);
    while let Some((part, reference, world_from_outer, depth)) = walk.stack.pop() {
        let part = reference.part.as_deref().unwrap_or(part);
        let place = || Place::Part { part: part.to_owned(), line: reference.line };
        // A chain of components longer than there are objects comes round to one of them again.
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
        beams += object.beams;
        let world_from_object = world_from_outer * reference.outer_from_object;
        if !object.mesh.triangles.is_empty() {
            placed.push((part, reference.object, world_from_object));
        }
        walk.push(part, &object.components, world_from_object, depth + 1)?;
    }
    if placed.is_empty() && beams > 0 {
        let feature = format!("the file has {beams} beams and no triangles, and beam lattices are not meshed yet");
        return Err(Fault::Unsupported(Place::File, feature));
    }

    let mut notes = Vec::new();
    if placed.len() > 1 {
        notes.push(ReadNote::ObjectsMerged { count: placed.len() });
    }
    if supports > 0 {
        notes.push(ReadNote::SupportsSkipped { count: supports });
    }
    if beams > 0 {
        notes.push(ReadNote::BeamsLeftOut { count: beams });
    }
    let keys: BTreeSet<(String, i64)> = placed.iter().map(|&(part, object, _)| (part.to_owned(), object)).collect();
    let keys: Vec<(String, i64)> = keys.into_iter().collect();
    let part_index = |part: &str, object: i64| {
        keys.binary_search_by(|key| (key.0.as_str(), key.1).cmp(&(part, object))).unwrap_or_default()
    };
    let placements: Vec<Placement> = placed
        .iter()
        .map(|&(part, object, world_from_part)| Placement { part: part_index(part, object), world_from_part })
        .collect();
    drop((placed, walk));
    let take = |(part, id): &(String, i64)| {
        let object = models.get_mut(part).and_then(|model| model.objects.get_mut(id));
        object.map(|object| std::mem::take(&mut object.mesh)).unwrap_or_default()
    };
    let parts: Vec<TriangleMesh> = keys.iter().map(take).collect();
    let mesh = assemble(&parts, &placements)?;
    Ok(MeshFile { mesh, unit: Some(unit), notes })
}

/// References that have not been followed: the part each stands in, where that part's space is, and how deep.
struct Walk<'a> {
    stack: Vec<(&'a str, &'a Reference, DAffine3, usize)>,
    reached: usize,
}

impl<'a> Walk<'a> {
    /// Adds references, to be followed in their order before all that was added earlier.
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
            let what = "items and components in all places".into();
            return Err(Fault::Malformed(Place::File, Problem::TooMany { what, found, limit }));
        }
        self.stack.extend(references.iter().rev().map(|reference| (part, reference, world_from_outer, depth)));
        Ok(())
    }
}
