//! Plans of sweeps: a model solid, the values of its parameters, and how its designs are measured.
//!
//! ```toml
//! model = "gyroid"
//! limits = "limits.toml"
//!
//! [parameters]
//! wall = { from = 0.4, to = 1.2, steps = 5 }
//! cells = [1, 2]
//! cell-size = 4
//!
//! [settings]
//! resolution = 128
//! ```

use std::collections::{BTreeMap, HashSet};
use std::fmt;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::front::Objective;
use super::row::{named, shown};
use crate::driver::input::sha256;
use crate::driver::job::Backend;
use crate::length::Length;
use crate::mesh::LengthUnit;
use crate::metrics::BoundaryCondition;
use crate::report::{DIRECTIONS, ReportBuilder, Roi, Settings as Course};
use crate::solids::{Model, ModelKind, SolidError};
use crate::{Error, FillRule, Limits, Report, Settings, Solid, input, unit};

/// The most designs of a plan.
const MAX_DESIGNS: usize = 1_000_000;

/// Rays along the longest side by default.
const DEFAULT_RAYS: u32 = 128;

/// A design of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// A hash of the parameters, the settings and the version.
    pub key: String,
    /// The parameters, in the order of the plan.
    pub parameters: Map<String, Value>,
}

/// The parameters: `wall 0.4, cells 2`.
impl fmt::Display for Design {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&named(&self.parameters))
    }
}

/// A plan that was read: its designs, and what they are measured by.
pub struct Plan {
    kind: &'static ModelKind,
    title: String,
    facts: Map<String, Value>,
    designs: Vec<Design>,
    objectives: Vec<Objective>,
    measurement: Measurement,
    limits: Option<Limits>,
    region: Option<Roi<Solid>>,
}

/// The text of a plan.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    model: String,
    #[serde(default)]
    parameters: Map<String, Value>,
    #[serde(default)]
    design: Vec<Map<String, Value>>,
    limits: Option<PathBuf>,
    region: Option<String>,
    unit: Option<String>,
    #[serde(default)]
    pareto: Map<String, Value>,
    #[serde(default)]
    settings: SettingsText,
}

/// The settings of a plan: options of `report`.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct SettingsText {
    resolution: Option<u32>,
    pitch: Option<Value>,
    tortuosity_resolution: Option<u32>,
    edges: Option<String>,
    fill: Option<String>,
    build: Option<String>,
    overhang_angle: Option<f64>,
    kozeny: Option<f64>,
}

/// How a design is measured.
#[derive(Clone)]
struct Measurement {
    settings: Settings<'static>,
    course: Course,
}

impl Plan {
    /// Reads a plan. Paths in it are relative to its folder.
    ///
    /// # Errors
    /// A file that cannot be read or is no plan, a model or a parameter that does not exist, two designs of the same parameters,
    /// limits or a region that cannot be read.
    pub fn open(path: &Path) -> Result<Plan, Error> {
        let fault = |problem: String| Error::input(format!("{}: {problem}", path.display()));
        let text = input::open(path).and_then(std::io::read_to_string).map_err(|error| fault(error.to_string()))?;
        let file: File = toml::from_str(&text).map_err(|error| fault(error.to_string()))?;
        let beside = |name: &Path| path.parent().unwrap_or(Path::new("")).join(name);
        let limits = file.limits.as_deref().map(|name| Limits::open(beside(name))).transpose()?;
        let hash = |name: &Path| {
            let path = beside(name);
            std::fs::read(&path)
                .map(|bytes| sha256(&bytes))
                .map_err(|error| Error::input(format!("{}: {error}", path.display())))
        };
        let mut hashes: Vec<String> = file.limits.as_deref().map(hash).transpose()?.into_iter().collect();
        let stated = file.unit.as_deref().map(unit::parse).transpose();
        let stated = stated.map_err(|problem| fault(format!("unit: {problem}")))?;
        let following = Roi::following(file.region.as_deref().unwrap_or_default());
        let region = match (&file.region, following.map_err(|problem| fault(format!("region: {problem}")))?) {
            (Some(name), None) => {
                hashes.push(hash(Path::new(name))?);
                Some(Roi::Solid(with_unit(Solid::open(beside(Path::new(name)))?, stated).map_err(fault)?))
            }
            _ if stated.is_some() => {
                return Err(fault("unit is that of a file as region, and there is none".to_owned()));
            }
            (_, following) => following,
        };
        hashes.extend(file.unit.clone());
        file.plan(limits, region, hashes).map_err(fault)
    }

    /// Returns the designs, in the order of the file: the last parameter changes fastest.
    pub fn designs(&self) -> &[Design] {
        &self.designs
    }

    /// Returns the number of designs and the model in words.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Returns what all designs are measured by, as the file says it.
    pub fn facts(&self) -> &Map<String, Value> {
        &self.facts
    }

    /// Returns what designs are compared by.
    pub fn objectives(&self) -> &[Objective] {
        &self.objectives
    }

    /// Builds and measures a design.
    ///
    /// # Errors
    /// Parameters for which there is no solid, and the errors of [`ReportBuilder::measure`].
    pub fn measure(&self, design: &Design, backend: &Backend, memory: Option<u64>) -> Result<Report, Error> {
        let mesh = model(self.kind, &design.parameters).and_then(|model| model.build()).map_err(Error::input)?;
        let solid = Solid::from_triangles(mesh.positions, mesh.triangles)?.named(self.kind.name);
        let solid = solid.unit(LengthUnit::Millimetre);
        let mut builder = Report::of(&solid).course(self.measurement.course.clone());
        builder = self.region.iter().cloned().fold(builder, ReportBuilder::within);
        builder = self.limits.iter().fold(builder, ReportBuilder::limits);
        let settings = self.measurement.settings.clone().backend(backend.clone());
        builder.measure(&memory.into_iter().fold(settings, Settings::memory_limit))
    }
}

impl File {
    /// Returns the plan; `files` stands for the contents of limits and region.
    fn plan(self, limits: Option<Limits>, region: Option<Roi<Solid>>, files: Vec<String>) -> Result<Plan, String> {
        let measurement = self.settings.measurement()?;
        measurement.course.check(region.is_some()).map_err(|problem| format!("settings: {problem}"))?;
        let objectives = Objective::read(&self.pareto)?;
        let kind = Model::kinds().iter().find(|kind| kind.name == self.model).ok_or_else(|| {
            let known: Vec<&str> = Model::kinds().iter().map(|kind| kind.name).collect();
            format!("unknown model `{}`; the models are {}", self.model, known.join(", "))
        })?;
        let common = json!([
            env!("CARGO_PKG_VERSION"),
            kind.name,
            format!("{:?} {:?}", measurement.settings.spacing(), measurement.course),
            self.region.as_ref().filter(|_| !matches!(region, Some(Roi::Solid(_)))),
            files,
        ]);
        let lists = "; a list has several values, and a value of several numbers is a list in it: [[1, 1, 2]]";
        let has_list = self.parameters.values().any(Value::is_array);
        let hint = if has_list { lists } else { "" };
        let mut seen = HashSet::new();
        let mut designs = Vec::new();
        for parameters in self.designs(kind)? {
            // Neither the order of the parameters nor the way in which a number is written makes another design.
            let texts: BTreeMap<String, String> = texts(kind, &parameters).into_iter().collect();
            let key = sha256(json!([common, texts]).to_string().as_bytes())[..16].to_owned();
            let design = Design { key, parameters };
            if let Some((name, _)) = design.parameters.iter().find(|(_, value)| value.is_null()) {
                return Err(format!("{name} is not a finite number"));
            }
            model(kind, &design.parameters).map_err(|error| format!("{design}: {error}{hint}"))?;
            if !seen.insert(design.key.clone()) {
                return Err(format!("two designs have the parameters {design}{hint}"));
            }
            designs.push(design);
        }
        let facts = self.facts();
        let title = format!("{} design{} of {}", designs.len(), if designs.len() == 1 { "" } else { "s" }, kind.name);
        Ok(Plan { kind, title, facts, designs, objectives, measurement, limits, region })
    }

    fn facts(&self) -> Map<String, Value> {
        let File { model, limits, region, unit, settings, .. } = self;
        let settings = stated(json!(settings));
        stated(json!({ "model": model, "limits": limits, "region": region, "unit": unit, "settings": settings }))
    }

    /// Returns the parameters of all designs.
    fn designs(&self, kind: &ModelKind) -> Result<Vec<Map<String, Value>>, String> {
        match (self.parameters.is_empty(), self.design.is_empty()) {
            (true, true) => {
                Err("the plan has no designs; write [parameters] with the values of each, or a [[design]] for each"
                    .to_owned())
            }
            (false, false) => {
                Err("[parameters] and [[design]] are two ways to list designs; remove one of them".to_owned())
            }
            (false, true) => combinations(kind, &self.parameters),
            (true, false) => {
                let first = &self.design[0];
                // In the order of the first, whose parameters are the columns of the table.
                let ordered = |(i, design): (usize, &Map<String, Value>)| {
                    let other = design.keys().find(|name| !first.contains_key(*name));
                    let other = other.or_else(|| first.keys().find(|name| !design.contains_key(*name)));
                    match other {
                        Some(name) => Err(format!("[[design]] 1 and {} do not both have {name}", i + 1)),
                        None => Ok(first.keys().map(|name| (name.clone(), design[name].clone())).collect()),
                    }
                };
                self.design.iter().enumerate().map(ordered).collect()
            }
        }
    }
}

/// Returns the entries of an object that have a value.
fn stated(object: Value) -> Map<String, Value> {
    let Value::Object(mut entries) = object else { unreachable!("this is given objects alone") };
    entries.retain(|_, value| !value.is_null());
    entries
}

/// Returns all combinations of values; the last parameter changes fastest.
fn combinations(kind: &ModelKind, parameters: &Map<String, Value>) -> Result<Vec<Map<String, Value>>, String> {
    let mut designs = vec![Map::new()];
    for (name, value) in parameters {
        let values = values(kind, name, value).map_err(|problem| format!("{name}: {problem}"))?;
        let count = designs.len().saturating_mul(values.len());
        if count > MAX_DESIGNS {
            return Err(format!("the plan has more than {MAX_DESIGNS} designs; take fewer values of {name}"));
        }
        let with = |design: &Map<String, Value>, value: &Value| {
            let mut design = design.clone();
            design.insert(name.clone(), value.clone());
            design
        };
        designs = designs.iter().flat_map(|design| values.iter().map(move |value| with(design, value))).collect();
    }
    Ok(designs)
}

/// Evenly spaced values, both ends included.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Range {
    from: Value,
    to: Value,
    steps: u32,
}

/// Returns the values of a parameter: those of a list or of a range, or a single one.
fn values(kind: &ModelKind, name: &str, value: &Value) -> Result<Vec<Value>, String> {
    match value {
        Value::Array(values) if values.is_empty() => Err("the list has no values".to_owned()),
        Value::Array(values) => Ok(values.clone()),
        Value::Object(_) => {
            let range: Range = serde_json::from_value(value.clone())
                .map_err(|error| format!("{error}; write {{ from = 0.4, to = 1.2, steps = 5 }}, a value or a list"))?;
            if !(2..=10_000).contains(&range.steps) {
                return Err(format!("steps is {}, but must be 2 to 10000", range.steps));
            }
            let end = |end: &Value| {
                let number = kind.in_millimetres(name, &shown(end)).parse::<f64>();
                number.map_err(|_| format!("{} is not a number", shown(end)))
            };
            let (from, to) = (end(&range.from)?, end(&range.to)?);
            let at = |i: u32| from + (to - from) * f64::from(i) / f64::from(range.steps - 1);
            // Twelve digits: 0.6, not 0.6000000000000001.
            let round = |value: f64| format!("{value:.11e}").parse::<f64>().expect("a number as it is written");
            Ok((0..range.steps).map(|i| json!(round(at(i)))).collect())
        }
        single => Ok(vec![single.clone()]),
    }
}

/// Returns the texts of parameters: lengths in millimetres, each number in its shortest form.
fn texts(kind: &ModelKind, parameters: &Map<String, Value>) -> Vec<(String, String)> {
    let short = |part: &str| part.trim().parse().map_or(part.to_owned(), |number: f64| number.to_string());
    let text = |name: &str, value: &Value| kind.in_millimetres(name, &shown(value));
    let normal = |(name, value): (&String, &Value)| {
        (name.clone(), text(name, value).split(',').map(short).collect::<Vec<_>>().join(","))
    };
    parameters.iter().map(normal).collect()
}

/// Returns a model with parameters.
fn model(kind: &ModelKind, parameters: &Map<String, Value>) -> Result<Model, SolidError> {
    let texts = texts(kind, parameters);
    let texts: Vec<(&str, &str)> = texts.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
    Model::from_parameters(kind.name, &texts)
}

/// Returns the region of interest in its unit, stated by its file or by the plan.
fn with_unit(region: Solid, stated: Option<LengthUnit>) -> Result<Solid, String> {
    match (region.length_unit(), stated) {
        (None, Some(unit)) => Ok(region.unit(unit)),
        (None, None) => Err(format!("{} states no unit of length; add unit = \"mm\"", region.name())),
        (Some(own), Some(unit)) if own != unit => {
            Err(format!("unit is {}, but {} states {}; remove unit", unit.symbol(), region.name(), own.symbol()))
        }
        (Some(_), _) => Ok(region),
    }
}

impl SettingsText {
    fn measurement(&self) -> Result<Measurement, String> {
        let settings = match (self.resolution, &self.pitch) {
            (Some(_), Some(_)) => return Err("settings: resolution and pitch exclude one another".to_owned()),
            (rays, None) => Settings::rays(rays.unwrap_or(DEFAULT_RAYS)),
            (None, Some(pitch)) => {
                let length: Length = shown(pitch).parse().map_err(|problem| format!("settings.pitch: {problem}"))?;
                let length = length
                    .in_unit(Some(LengthUnit::Millimetre), "settings.pitch")
                    .map_err(|error| error.to_string())?;
                Settings::pitch(length)
            }
        };
        let fill = word(
            "fill",
            self.fill.as_deref().unwrap_or("even-odd"),
            [("even-odd", FillRule::EvenOdd), ("nonzero", FillRule::NonZero)],
        )?;
        let edges = BoundaryCondition::ALL.map(|edges| (edges.name(), edges));
        let edges = word("edges", self.edges.as_deref().unwrap_or("border"), edges)?;
        let up = word("build", self.build.as_deref().unwrap_or("z"), DIRECTIONS)?;
        let usual = Course::default();
        let course = Course {
            tortuosity_resolution: self.tortuosity_resolution.unwrap_or(usual.tortuosity_resolution),
            edges,
            fill,
            build: up,
            overhang_angle: self.overhang_angle.unwrap_or(usual.overhang_angle),
            kozeny: self.kozeny.unwrap_or(usual.kozeny),
            is_drawn: false,
            ..usual
        };
        settings.check().map_err(|error| format!("settings: {error}"))?;
        Ok(Measurement { settings: settings.fill(fill), course })
    }
}

/// Returns the value of a word.
fn word<T: Copy, const N: usize>(name: &str, given: &str, known: [(&str, T); N]) -> Result<T, String> {
    known.iter().find(|(word, _)| *word == given).map(|(_, value)| *value).ok_or_else(|| {
        format!("settings.{name} is `{given}`, but must be one of {}", known.map(|(word, _)| word).join(", "))
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn opened(text: &str) -> Result<Plan, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plan.toml");
        fs::write(&path, text).unwrap();
        fs::write(folder.path().join("limits.toml"), "porosity = { min = 0.5 }").unwrap();
        Plan::open(&path).map_err(|error| error.to_string().replace(&path.display().to_string(), "plan.toml"))
    }

    fn shown_designs(text: &str) -> Vec<String> {
        opened(text).unwrap().designs().iter().map(Design::to_string).collect()
    }

    #[test]
    fn designs_are_all_combinations_or_a_list() {
        let all = shown_designs(
            "model = \"gyroid\"\n[parameters]\nwall = { from = 0.4, to = 0.8, steps = 3 }\ncells = [1, [1, 2, 3]]\ncell-size = \"4mm\"",
        );
        assert_eq!(all[0], "wall 0.4, cells 1, cell-size 4mm");
        assert_eq!(all[3], "wall 0.6, cells 1,2,3, cell-size 4mm");
        assert_eq!(all.len(), 6);
        let listed = shown_designs("model = \"torus\"\n[[design]]\nmajor = 3\n[[design]]\nmajor = 4.5\n");
        assert_eq!(listed, ["major 3", "major 4.5"]);
    }

    #[test]
    fn keys_depend_on_all_that_the_metrics_depend_on() {
        let key = |text: &str| opened(text).unwrap().designs()[0].key.clone();
        let plan = "model = \"torus\"\n[parameters]\nmajor = 3\n";
        let others = [
            plan.replace("torus", "knot"),
            plan.replace('3', "4"),
            format!("limits = \"limits.toml\"\n{plan}"),
            format!("region = \"hull\"\n{plan}"),
            format!("{plan}[settings]\nresolution = 64\n"),
        ];
        for other in &others {
            assert_ne!(key(plan), key(other), "{other}");
        }
        // Values that are added leave the others as they are, and so do objectives.
        assert_eq!(key(plan), key(&plan.replace('3', "[3, 4]")));
        assert_eq!(key(plan), key(&plan.replace('3', "\"3.0\"")));
        assert_eq!(key(plan), key(&format!("{plan}[settings]\nresolution = 128\n")));
        let two = format!("{plan}minor = 1\n");
        assert_eq!(key(&two), key("model = \"torus\"\n[parameters]\nminor = 1\nmajor = 3\n"));
        assert_eq!(key(plan), key(&format!("{plan}[pareto]\nporosity = \"max\"\n")));
    }

    #[test]
    fn errors_name_the_plan_and_what_is_wrong() {
        for (text, said) in [
            ("model = \"gyroit\"\n[parameters]\nwall = 1", "unknown model `gyroit`; the models are "),
            ("model = \"gyroid\"", "the plan has no designs"),
            ("model = \"gyroid\"\n[parameters]\nwal = 1", "wal"),
            ("model = \"gyroid\"\n[parameters]\nwall = []", "wall: the list has no values"),
            ("model = \"gyroid\"\n[parameters]\nwall = { from = 1, to = 2 }", "missing field `steps`"),
            ("model = \"gyroid\"\n[parameters]\nwall = [1, 1]", "two designs have the parameters wall 1"),
            ("model = \"gyroid\"\n[parameters]\nwall = \"thin\"", "thin"),
            (
                "model = \"gyroid\"\n[[design]]\nwall = 1\n[[design]]\ncells = 1",
                "[[design]] 1 and 2 do not both have cells",
            ),
            ("model = \"gyroid\"\nmodle = 3", "modle"),
            (
                "model = \"gyroid\"\n[parameters]\nwall = [0.5, \"500um\", \"0.50\"]",
                "two designs have the parameters wall 500um",
            ),
            ("model = \"gyroid\"\nunit = \"mm\"\n[parameters]\nwall = 1", "unit is that of a file as region"),
            ("model = \"gyroid\"\n[parameters]\nwall = 1\n[settings]\ntortuosity-resolution = 0", "tortuosity is 0"),
            ("model = \"gyroid\"\n[parameters]\nwall = 1\n[settings]\noverhang-angle = 400", "0 to 90 degrees"),
            ("model = \"gyroid\"\n[parameters]\nwall = 1\n[settings]\nkozeny = -5", "positive number"),
            (
                "model = \"gyroid\"\nregion = \"hull\"\n[parameters]\nwall = 1\n[settings]\nedges = \"periodic\"",
                "periodic edges need a box",
            ),
            ("model = \"gyroid\"\n[parameters]\nwall = 1\n[pareto]\nwall = \"max\"\nwall.thinnest = \"min\"", "wall"),
            (
                "model = \"gyroid\"\n[parameters]\nwall = 1\n[pareto]\nwall = \"max\"\nthinnest-wall = \"min\"",
                "wall.thinnest is named twice",
            ),
            ("model = \"gyroid\"\n[parameters]\nwall = 1\n[settings]\nedges = \"open\"", "border, clip, periodic"),
            (
                "model = \"gyroid\"\n[parameters]\nwall = 1\n[settings]\nresolution = 3\npitch = 1",
                "exclude one another",
            ),
            (
                "model = \"gyroid\"\n[parameters]\nwall = 1\n[pareto]\nporosty = \"max\"",
                "the nearest names are porosity",
            ),
            ("model = \"gyroid\"\n[parameters]\nwall = 1\n[pareto]\nporosity = \"most\"", "max or min"),
        ] {
            let message = opened(text).err().unwrap_or_else(|| panic!("no error of {text}"));
            assert!(message.starts_with("plan.toml: ") && message.contains(said), "{message}");
        }
    }
}
