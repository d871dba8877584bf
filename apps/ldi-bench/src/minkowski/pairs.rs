//! The pairs of solids whose sums are timed.

use std::path::Path;

use ldi_ops::mesh::{ClosedMesh, LengthUnit, io};

use crate::BenchError;
use crate::models;

/// A solid of the library, by name and parameters.
pub struct Operand {
    kind: &'static str,
    parameters: &'static [(&'static str, &'static str)],
}

impl Operand {
    /// Returns the checked mesh.
    pub fn mesh(&self) -> Result<ClosedMesh, BenchError> {
        models::closed(self.kind, models::build(self.kind, self.parameters)?)
    }
}

/// The published figures of a sum in Table IV of Leung and Wang, on a GeForce GTX 580 at 512² rays (see
/// [`SeedModel`](crate::models::SeedModel)).
pub struct Published {
    /// Number of sampled primitives.
    pub primitives: u64,
    /// Seconds of sampling the flooded volume, without culling and flooding.
    pub retrieval: f64,
    /// Number of samples of the result, if stated.
    pub samples: Option<u64>,
}

/// Two solids to be added.
pub struct Pair {
    /// The name on the command line and of its files.
    pub name: &'static str,
    /// Its description in tables.
    pub title: &'static str,
    /// The first operand.
    pub a: Operand,
    /// The second.
    pub b: Operand,
    /// The published figures of such a pair.
    pub published: Option<Published>,
}

/// Pairs like those of Table IV, and two that manifold3d finishes in reasonable time.
pub const PAIRS: [Pair; 5] = [
    Pair {
        name: "organic-ball",
        title: "organic 25 k ⊕ ball 0.5 k",
        a: Operand { kind: "organic", parameters: &[] },
        b: BALL,
        published: Some(Published { primitives: 68_000, retrieval: 0.072, samples: Some(602_000) }),
    },
    Pair {
        name: "skull-knot",
        title: "skull 12 k ⊕ knot 1 k",
        a: Operand { kind: "skull", parameters: &[] },
        b: Operand {
            kind: "knot",
            parameters: &[("major", "2"), ("minor", "1"), ("tube", "0.4"), ("segments", "62"), ("sides", "8")],
        },
        published: Some(Published { primitives: 372_500, retrieval: 0.137, samples: None }),
    },
    Pair {
        name: "star-torus",
        title: "star ⊕ torus",
        a: Operand { kind: "star", parameters: &[] },
        b: Operand {
            kind: "torus",
            parameters: &[("major", "5"), ("minor", "2"), ("around", "288"), ("across", "108")],
        },
        published: Some(Published { primitives: 474_700, retrieval: 0.052, samples: None }),
    },
    Pair {
        name: "small-organic-ball",
        title: "organic 6.8 k ⊕ ball 0.5 k",
        a: Operand { kind: "organic", parameters: &[("resolution", "34")] },
        b: BALL,
        published: None,
    },
    Pair {
        name: "knot-torus",
        title: "knot 960 ⊕ torus 96",
        a: Operand { kind: "knot", parameters: &[] },
        b: Operand { kind: "torus", parameters: &[("major", "2"), ("minor", "0.7"), ("around", "8"), ("across", "6")] },
        published: None,
    },
];

/// A geodesic sphere of 500 triangles, a tenth of the organic solid's size.
const BALL: Operand = Operand { kind: "geodesic", parameters: &[("radius", "2"), ("frequency", "5")] };

impl Pair {
    /// Returns the pair of a name.
    pub fn named(name: &str) -> Result<&'static Pair, BenchError> {
        let known = || PAIRS.iter().map(|pair| pair.name).collect::<Vec<_>>().join(", ");
        let found = PAIRS.iter().find(|pair| pair.name == name);
        found.ok_or_else(|| BenchError::model(name, format!("there is no such pair; the pairs are {}", known())))
    }

    /// Writes both solids to a folder, for programs that read files.
    pub fn write(&self, folder: &Path) -> Result<(), BenchError> {
        for (side, operand) in [("a", &self.a), ("b", &self.b)] {
            let file = models::file(folder, &format!("{}-{side}", self.name));
            io::write(&file, operand.mesh()?.mesh(), Some(LengthUnit::Millimetre))
                .map_err(|error| BenchError::model(self.name, error))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operands_are_solids_of_the_sizes_that_titles_tell() {
        for (name, a, b) in [
            ("organic-ball", 25_300, 500),
            ("skull-knot", 12_400, 990),
            ("star-torus", 60, 62_208),
            ("small-organic-ball", 6_800, 500),
            ("knot-torus", 960, 96),
        ] {
            let pair = Pair::named(name).unwrap();
            for (operand, expected) in [(&pair.a, a), (&pair.b, b)] {
                let triangles = operand.mesh().unwrap().mesh().triangles.len() as f64;
                assert!((triangles / f64::from(expected) - 1.0).abs() < 0.03, "{name}: {triangles}");
            }
        }
        assert!(Pair::named("ball").is_err_and(|error| error.to_string().contains("organic-ball, skull-knot")));
    }
}
