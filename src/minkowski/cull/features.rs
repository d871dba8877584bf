//! What of a polyhedron can carry the boundary of a sum: its facets, its corners, its convex edges.

use std::cmp::Ordering;

use glam::DVec3;
use rayon::prelude::*;

use super::sign::{Direction, Normal};
use crate::minkowski::Polyhedron;
use crate::minkowski::polyhedron::may_be_turned;

/// The features of a polyhedron that may meet those of another one.
pub struct Features<'p> {
    /// Lattice positions of all vertices.
    pub positions: &'p [[i32; 3]],
    /// Facets that have an area; those that may have been turned over come once for each side.
    pub facets: Vec<Facet>,
    /// Vertices that are no points of a plane or of an edge.
    pub corners: Vec<Corner>,
    /// Edges that are not certainly reflex or flat; needles among them, which have no sides.
    pub edges: Vec<Edge>,
    /// From each corner to its neighbours, corner by corner.
    pub spokes: Vec<Direction>,
    /// (o − p) × (q − p) for each edge pq and the third vertex o of each of its facets, edge by edge; without those of no
    /// area.
    pub sides: Vec<Normal>,
    /// All edges, also those that are left out above.
    pub all_edges: usize,
}

/// A facet with an area.
pub struct Facet {
    /// Its vertices.
    pub vertices: [u32; 3],
    /// Its outward normal.
    pub normal: Normal,
    /// Whether that is known.
    facing: Facing,
}

/// Which side of a facet the solid is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Facing {
    /// Behind it.
    Outwards,
    /// Nobody knows: it is so thin that rounding to the lattice may have turned it over.
    Either,
}

/// A vertex that may support a plane.
pub struct Corner {
    /// Which vertex.
    pub vertex: u32,
    /// Where its spokes begin, and where they end.
    pub spokes: [u32; 2],
}

/// An edge that may support a plane along its length.
pub struct Edge {
    /// Its vertices, the lesser first.
    pub ends: [u32; 2],
    /// From the first to the second.
    pub along: Direction,
    /// Where its sides begin, where those of facets that run from the second end to the first do, and where they end. These
    /// are the normals of their facets, and those before are the opposite ones.
    pub sides: [u32; 3],
    /// What its outward normals lie between.
    pub bounds: Bounds,
}

/// What the outward normals of an edge lie between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounds {
    /// The normals of its two facets.
    TwoFacets,
    /// The normal of its first side and the opposite one.
    OneFacet,
    /// Those too; nobody knows on which side of one of its facets the solid is.
    TurnedFacet,
    /// Nothing: none of its facets has an area.
    NoFacet,
}

/// Two to five directions.
pub struct Arc {
    points: [DVec3; 5],
    count: usize,
}

impl Arc {
    /// The directions in turn.
    pub fn points(&self) -> &[DVec3] {
        &self.points[..self.count]
    }
}

/// A facet at an edge: the edge's lesser and greater vertex, the facet, and whether it runs from the first to the second.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct HalfEdge {
    ends: [u32; 2],
    facet: u32,
    runs: Runs,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Runs {
    Forward,
    Backward,
}

impl Facet {
    fn new(vertices: [u32; 3], positions: &[[i32; 3]]) -> Facet {
        let corners = vertices.map(|vertex| positions[vertex as usize]);
        let [a, b, c] = corners;
        let facing = if may_be_turned(corners) { Facing::Either } else { Facing::Outwards };
        Facet { vertices, normal: Direction::between(a, b).cross(&Direction::between(a, c)), facing }
    }

    /// The same facet seen from the other side.
    fn reversed(&self) -> Facet {
        let [a, b, c] = self.vertices;
        Facet { vertices: [a, c, b], normal: self.normal.reversed(), facing: self.facing }
    }
}

impl Edge {
    /// Whether it is not known which way its facets face, or there are none.
    pub fn may_face_anywhere(&self) -> bool {
        matches!(self.bounds, Bounds::NoFacet | Bounds::TurnedFacet)
    }
}

impl Features<'_> {
    /// Finds them.
    pub fn new(solid: &Polyhedron) -> Features<'_> {
        let positions = solid.positions();
        let facet = |&vertices: &[u32; 3]| Facet::new(vertices, positions);
        let mut facets: Vec<Facet> = solid.triangles().par_iter().map(facet).collect();
        let half_edges = half_edges(solid.triangles(), positions.len());
        let mut features = Features {
            positions,
            facets: Vec::new(),
            corners: Vec::new(),
            edges: Vec::new(),
            spokes: Vec::new(),
            sides: Vec::new(),
            all_edges: 0,
        };
        let mut rims = Vec::with_capacity(half_edges.len() / 2);
        features.edges.reserve(half_edges.len() / 2);
        features.sides.reserve(half_edges.len());
        for around in half_edges.chunk_by(|a, b| a.ends == b.ends) {
            features.add_edge(around, &facets);
            rims.push(around[0].ends);
        }
        features.all_edges = rims.len();
        features.add_corners(&rims);
        facets.retain(|facet| !facet.normal.is_zero());
        let turned: Vec<Facet> =
            facets.iter().filter(|facet| facet.facing == Facing::Either).map(Facet::reversed).collect();
        facets.extend(turned);
        features.facets = facets;
        features
    }

    fn add_edge(&mut self, around: &[HalfEdge], facets: &[Facet]) {
        let ends = around[0].ends;
        let first = self.sides.len() as u32;
        // Seen from the edge's first vertex, a facet that runs forward has its third vertex on the left.
        let side = |half: &HalfEdge| {
            let normal = &facets[half.facet as usize].normal;
            match half.runs {
                Runs::Forward => normal.reversed(),
                Runs::Backward => *normal,
            }
        };
        let [p, q] = ends.map(|vertex| self.positions[vertex as usize]);
        let along = Direction::between(p, q);
        let real = |half: &&HalfEdge| !facets[half.facet as usize].normal.is_zero();
        let is_turned = around.iter().any(|half| facets[half.facet as usize].facing == Facing::Either);
        let mut bounds = if is_turned { Bounds::TurnedFacet } else { Bounds::OneFacet };
        if let [one, other] = around
            && real(&one)
            && real(&other)
            && one.runs != other.runs
            && !is_turned
        {
            let [forward, backward] = [one, other].map(|half| &facets[half.facet as usize].normal);
            let opposite = facets[other.facet as usize].vertices.into_iter().find(|vertex| !ends.contains(vertex));
            let opposite = self.positions[opposite.expect("three vertices differ") as usize];
            match forward.sign(&Direction::between(p, opposite)) {
                Ordering::Greater => return,
                Ordering::Equal if forward.faces(backward) => return,
                Ordering::Equal => {}
                Ordering::Less => bounds = Bounds::TwoFacets,
            }
        }
        self.sides.extend(around.iter().filter(real).map(side));
        let forward = around.iter().filter(real).filter(|half| half.runs == Runs::Forward).count() as u32;
        let sides = [first, first + forward, self.sides.len() as u32];
        if sides[0] == sides[2] {
            bounds = Bounds::NoFacet;
        }
        self.edges.push(Edge { ends, along, sides, bounds });
    }

    /// A corner has three edges at the least that are convex, or one that may be of a part without thickness.
    fn add_corners(&mut self, rims: &[[u32; 2]]) {
        let mut convex = vec![0_u32; self.positions.len()];
        for edge in &self.edges {
            let counts = match edge.bounds {
                Bounds::TwoFacets => 1,
                Bounds::OneFacet | Bounds::TurnedFacet | Bounds::NoFacet => 3,
            };
            edge.ends.into_iter().for_each(|end| convex[end as usize] += counts);
        }
        let mut starts = vec![0_u32; self.positions.len() + 1];
        let is_corner = |vertex: u32| convex[vertex as usize] >= 3;
        for end in rims.iter().copied().flatten().filter(|&end| is_corner(end)) {
            starts[end as usize + 1] += 1;
        }
        for vertex in 0..self.positions.len() {
            starts[vertex + 1] += starts[vertex];
        }
        let corners = (0..self.positions.len() as u32).filter(|&vertex| is_corner(vertex));
        let spokes = |vertex: u32| [starts[vertex as usize], starts[vertex as usize + 1]];
        self.corners = corners.map(|vertex| Corner { vertex, spokes: spokes(vertex) }).collect();
        let nowhere = Direction::between([0; 3], [0; 3]);
        self.spokes = vec![nowhere; starts[self.positions.len()] as usize];
        let mut next = starts;
        for &[p, q] in rims {
            for [from, to] in [[p, q], [q, p]].into_iter().filter(|&[from, _]| is_corner(from)) {
                let spoke = Direction::between(self.positions[from as usize], self.positions[to as usize]);
                self.spokes[next[from as usize] as usize] = spoke;
                next[from as usize] += 1;
            }
        }
    }

    /// The directions from a corner to its neighbours.
    pub fn spokes_of(&self, corner: &Corner) -> &[Direction] {
        &self.spokes[corner.spokes[0] as usize..corner.spokes[1] as usize]
    }

    /// Whether a normal which is, up to its sign and length, that of all facets at an edge points out of one of them, as far
    /// as that is known, or the edge has none and is all that there is.
    pub fn has_facet_towards(&self, edge: &Edge, normal: &Normal) -> bool {
        if edge.may_face_anywhere() {
            return true;
        }
        let [first, turn, end] = edge.sides.map(|index| index as usize);
        let (forward, backward) = (&self.sides[first..turn], &self.sides[turn..end]);
        let turned = normal.reversed();
        forward.iter().any(|side| side.faces(&turned)) || backward.iter().any(|side| side.faces(normal))
    }

    /// Directions on the unit sphere, a right angle at most from one to the next: all outward normals of an edge lie between.
    pub fn arc(&self, edge: &Edge) -> Arc {
        let sides = self.sides_of(edge);
        let unit = |v: [f64; 3]| DVec3::from(v).normalize();
        let along = unit(edge.along.rounded);
        let Some(first) = sides.first().map(|side| unit(side.rounded)) else {
            let (u, v) = along.any_orthonormal_pair();
            return Arc { points: [u, v, -u, -v, u], count: 5 };
        };
        // From the edge into a facet; the middle of the arc is where all facets lie behind.
        let inward = along.cross(first);
        let of_three = |a, b, c| Arc { points: [a, b, c, c, c], count: 3 };
        match edge.bounds {
            Bounds::OneFacet | Bounds::TurnedFacet | Bounds::NoFacet => of_three(first, -inward, -first),
            Bounds::TwoFacets => {
                let last = unit(sides[1].rounded);
                match -first.dot(last) >= 0.0 {
                    true => Arc { points: [-first, last, last, last, last], count: 2 },
                    false => of_three(-first, -(inward + along.cross(last)).normalize(), last),
                }
            }
        }
    }

    /// The sides of an edge.
    pub fn sides_of(&self, edge: &Edge) -> &[Normal] {
        &self.sides[edge.sides[0] as usize..edge.sides[2] as usize]
    }
}

/// All facets at all edges, in the order of their ends, first that runs forward.
fn half_edges(triangles: &[[u32; 3]], vertices: usize) -> Vec<HalfEdge> {
    let of_facet = |(facet, &[a, b, c]): (usize, &[u32; 3])| {
        let facet = facet as u32;
        [[a, b], [b, c], [c, a]].map(|[from, to]| match from < to {
            true => HalfEdge { ends: [from, to], facet, runs: Runs::Forward },
            false => HalfEdge { ends: [to, from], facet, runs: Runs::Backward },
        })
    };
    let all = || triangles.iter().enumerate().flat_map(of_facet);
    let mut next = vec![0_u32; vertices + 1];
    all().for_each(|half| next[half.ends[0] as usize + 1] += 1);
    for vertex in 0..vertices {
        next[vertex + 1] += next[vertex];
    }
    let mut half_edges = vec![HalfEdge { ends: [0; 2], facet: 0, runs: Runs::Forward }; 3 * triangles.len()];
    for half in all() {
        let place = &mut next[half.ends[0] as usize];
        half_edges[*place as usize] = half;
        *place += 1;
    }
    for from_vertex in half_edges.chunk_by_mut(|a, b| a.ends[0] == b.ends[0]) {
        from_vertex.sort_unstable_by_key(|half| (half.ends[1], half.runs, half.facet));
    }
    half_edges
}
