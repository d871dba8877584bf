//! Comparisons that several processes share.

use glam::DVec3;
use ldi_ops::driver::clash::{Common, Overlap, OverlapMethod, Relation};
use ldi_ops::mesh::Aabb;
use ldi_ops::{ComparedPair, FillRule};
use pyo3::prelude::*;

use crate::clash::Clashes;
use crate::error::exception;
use crate::keywords::Call;

/// The parts of an assembly, in one unit, and the pairs of them to compare: here, or some in each of several processes.
#[pyclass(frozen, module = "ldi_ops._native")]
pub struct ClashPlan {
    pub plan: ldi_ops::ClashPlan,
    pub fill: FillRule,
}

/// How two parts lie to one another, as plain numbers, which cross the borders of processes without rounding.
#[derive(FromPyObject, IntoPyObject)]
pub enum Found {
    /// They share no volume; `touching` is the greatest depth of a contact.
    #[pyo3(from_item_all)]
    Apart { touching: Option<f64>, distance: f64, points: [[f64; 3]; 2] },
    /// They share a volume: its value, lower and upper end; the lower and the upper bound of its depth.
    #[pyo3(from_item_all)]
    Shared {
        volume: [f64; 3],
        exact: bool,
        bounds: [[f64; 3]; 2],
        deepest: [f64; 3],
        depth: [f64; 2],
        contained: Option<usize>,
        certain: bool,
    },
}

/// What is found of a pair, and the codes and sentences of warnings.
type Row = (Found, Vec<(String, String)>);

impl From<Relation> for Found {
    fn from(relation: Relation) -> Found {
        let apart = |touching, distance, points: [DVec3; 2]| Found::Apart {
            touching,
            distance,
            points: points.map(|point| point.to_array()),
        };
        match relation {
            Relation::Separate { distance, points } => apart(None, distance, points),
            Relation::Touching { distance, depth_bound, points } => apart(Some(depth_bound), distance, points),
            Relation::Overlapping(Common { volume, bounds, deepest, depth, depth_bound, contained, is_certain }) => {
                Found::Shared {
                    volume: [volume.value, volume.lower, volume.upper],
                    exact: volume.method == OverlapMethod::Exact,
                    bounds: [bounds.min.to_array(), bounds.max.to_array()],
                    deepest: deepest.to_array(),
                    depth: [depth, depth_bound],
                    contained,
                    certain: is_certain,
                }
            }
        }
    }
}

impl From<Found> for Relation {
    fn from(found: Found) -> Relation {
        match found {
            Found::Apart { touching, distance, points } => {
                let points = points.map(DVec3::from);
                match touching {
                    Some(depth_bound) => Relation::Touching { distance, depth_bound, points },
                    None => Relation::Separate { distance, points },
                }
            }
            Found::Shared { volume: [value, lower, upper], exact, bounds, deepest, depth, contained, certain } => {
                let method = if exact { OverlapMethod::Exact } else { OverlapMethod::Estimate };
                let [min, max] = bounds.map(DVec3::from);
                Relation::Overlapping(Common {
                    volume: Overlap { value, lower, upper, method },
                    bounds: Aabb { min, max },
                    deepest: deepest.into(),
                    depth: depth[0],
                    depth_bound: depth[1],
                    contained,
                    is_certain: certain,
                })
            }
        }
    }
}

#[pymethods]
impl ClashPlan {
    /// The unit of all parts, such as 'mm'; None if it is not known.
    #[getter]
    fn unit(&self) -> Option<&'static str> {
        self.plan.unit().map(|unit| unit.symbol())
    }

    /// The pairs to compare, in at most `count` groups of about equal cost that have few parts each.
    fn tiles(&self, count: usize) -> Vec<Vec<(usize, usize)>> {
        let tiles = self.plan.tiles(count).into_iter();
        tiles.map(|tile| tile.into_iter().map(|[i, j]| (i, j)).collect()).collect()
    }

    /// A hash of the mesh of each part, in the unit of the plan.
    fn fingerprints(&self, py: Python<'_>) -> PyResult<Vec<u64>> {
        Call::new(py, None)?.install(py, || Ok(self.plan.fingerprints()))
    }

    /// Compares pairs, and returns what is found of each, in their order: a dict, and codes and sentences of warnings.
    fn compare(&self, py: Python<'_>, pairs: Vec<[usize; 2]>) -> PyResult<Vec<Row>> {
        let compared = Call::new(py, None)?.run(py, |settings| self.plan.compare(&pairs, settings))?;
        let row = |pair: ComparedPair| {
            let warnings = pair.warnings.into_iter().map(|warning| (warning.code.to_owned(), warning.message));
            (Found::from(pair.relation), warnings.collect())
        };
        Ok(compared.into_iter().map(row).collect())
    }

    /// The comparison of all pairs of the plan, each of which was compared here or elsewhere.
    fn join(&self, py: Python<'_>, compared: Vec<([usize; 2], Row)>) -> PyResult<Clashes> {
        let pairs = compared
            .into_iter()
            .map(|(parts, (found, warnings))| ComparedPair::received(parts, found.into(), warnings));
        let joined = pairs.collect::<Result<Vec<_>, _>>().and_then(|pairs| self.plan.clone().join(pairs));
        let clashes = joined.map_err(|error| exception(py, &error))?;
        Ok(Clashes { clashes, fill: self.fill })
    }
}
