//! The features of a polyhedron that can carry the boundary of a sum: its facets, its corners, its convex edges.

use std::cmp::Ordering;

use crate::parallel::*;
use glam::DVec3;

use super::sign::{Direction, Normal};
use crate::minkowski::Polyhedron;
use crate::minkowski::polyhedron::may_be_turned;

/// The features of a polyhedron that may meet those of another one.
pub struct Features<'p> {
    /// Lattice positions of all vertices.
    pub positions: &'p [[i32; 3]],
    /// Facets that have an area; those that may have been flipped occur once for each side.
    pub facets: Vec<Facet>,
    /// Vertices that are not interior to a plane or an edge.
    pub corners: Vec<Corner>,
    /// Edges that are not certainly reflex or flat, including needles, which have no sides.
    pub edges: Vec<Edge>,
    /// The directions from each corner to its neighbours, corner by corner.
    pub spokes: Vec<Direction>,
    /// (o − p) × (q − p) for each edge pq and the third vertex o of each of its facets, edge by edge; without facets of zero
    /// area.
    pub sides: Vec<Normal>,
    /// The number of all edges, including those that are omitted above.
    pub all_edges: usize,
}

/// A facet with an area.
pub struct Facet {
    /// Its vertices.
    pub vertices: [u32; 3],
    /// Its outward normal.
    pub normal: Normal,
    /// The reliability of the normal.
    facing: Facing,
}

/// The side of a facet that the solid is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Facing {
    /// The solid is behind it.
    Outwards,
    /// Unknown: the facet is so thin that rounding to the lattice may have flipped it.
    Either,
}

/// A vertex that may support a plane.
pub struct Corner {
    /// The index of the vertex.
    pub vertex: u32,
    /// The first of its spokes, and the end of them.
    pub spokes: [u32; 2],
}

/// An edge that may support a plane along its length.
pub struct Edge {
    /// Its vertices, the lesser first.
    pub ends: [u32; 2],
    /// The direction from the first to the second.
    pub along: Direction,
    /// The first of its sides, the first side of facets that run from the second end to the first, and the end of the sides.
    /// The latter are the normals of their facets, the former the opposite ones.
    pub sides: [u32; 3],
    /// The limits of its outward normals.
    pub bounds: Bounds,
}

/// The limits of an edge's outward normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounds {
    /// The normals of its two facets.
    TwoFacets,
    /// The normal of its first side and the opposite one.
    OneFacet,
    /// The same; for one of its facets the side of the solid is unknown.
    TurnedFacet,
    /// No limits: none of its facets has an area.
    NoFacet,
}

/// Two to five directions.
pub struct Arc {
    points: [DVec3; 5],
    count: usize,
}

impl Arc {
    /// Returns the directions in order.
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

    /// Returns the same facet seen from the other side.
    fn reversed(&self) -> Facet {
        let [a, b, c] = self.vertices;
        Facet { vertices: [a, c, b], normal: self.normal.reversed(), facing: self.facing }
    }
}

impl Edge {
    /// Returns whether the orientation of its facets is unknown, or it has none with an area.
    pub fn may_face_anywhere(&self) -> bool {
        matches!(self.bounds, Bounds::NoFacet | Bounds::TurnedFacet)
    }
}

impl Features<'_> {
    /// Finds the features of a polyhedron.
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

    /// Adds the corners: vertices with at least three convex edges, or with one that may belong to a part without thickness.
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

    /// Returns the directions from a corner to its neighbours.
    pub fn spokes_of(&self, corner: &Corner) -> &[Direction] {
        &self.spokes[corner.spokes[0] as usize..corner.spokes[1] as usize]
    }

    /// Returns whether a normal, which up to its sign and length is that of all facets at an edge, points out of one of them.
    /// Also true if that is unknown, or if no facet of the edge has an area.
    pub fn has_facet_towards(&self, edge: &Edge, normal: &Normal) -> bool {
        if edge.may_face_anywhere() {
            return true;
        }
        let [first, turn, end] = edge.sides.map(|index| index as usize);
        let (forward, backward) = (&self.sides[first..turn], &self.sides[turn..end]);
        let turned = normal.reversed();
        forward.iter().any(|side| side.faces(&turned)) || backward.iter().any(|side| side.faces(normal))
    }

    /// Returns directions on the unit sphere, consecutive ones at most a right angle apart, that enclose all outward normals of
    /// an edge.
    pub fn arc(&self, edge: &Edge) -> Arc {
        let sides = self.sides_of(edge);
        let unit = |v: [f64; 3]| DVec3::from(v).normalize();
        let along = unit(edge.along.rounded);
        let Some(first) = sides.first().map(|side| unit(side.rounded)) else {
            let (u, v) = along.any_orthonormal_pair();
            return Arc { points: [u, v, -u, -v, u], count: 5 };
        };
        // From the edge into a facet; the middle of the arc has all facets behind it.
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

    /// Returns the sides of an edge.
    pub fn sides_of(&self, edge: &Edge) -> &[Normal] {
        &self.sides[edge.sides[0] as usize..edge.sides[2] as usize]
    }
}

/// Returns all facets at all edges, in the order of the edges' ends; those that run forward come first.
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
