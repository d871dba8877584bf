//! Membership in A ⊕ B.

use std::ops::{ControlFlow, Range};

use super::predicates::{Corners, Ray, Way, do_cross, may_reach, winding};
use super::shells::vertex_of_each_shell;
use super::tree::{PairStack, Stack, Tree, do_meet};
use crate::grid::{Axis, LatticeBox};
use crate::minkowski::{Exterior, Membership, Polyhedron};

/// The exact membership test of the sum of two solids.
///
/// Lattice positions of both are even and in [0, 2^30); those of points are in the same range and need not be even.
#[derive(Clone, Debug)]
pub struct SumMembership {
    pub(super) a: Surface,
    exterior_a: Exterior,
    pub(super) b: Surface,
}

/// The memory of a thread from one point to the next.
#[derive(Clone, Debug, Default)]
pub struct SumMemory {
    /// The triangles that crossed last, as indices in the trees' orders.
    pub(super) crossing: Option<[usize; 2]>,
    pairs: PairStack,
    pub(super) stack: Stack,
    pub(super) ray_stack: Stack,
}

/// A surface prepared for crossing tests and winding numbers.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    /// The tree over `triangles`.
    pub(super) tree: Tree,
    pub(super) triangles: Vec<Corners>,
    /// The tree over `shells`.
    shell_tree: Tree,
    /// A vertex of each shell.
    shells: Vec<[i32; 3]>,
    /// The axis along which the fewest triangles lie behind one another.
    ray_axis: Axis,
}

impl SumMembership {
    /// Returns whether A is a bounded solid, and no complement.
    pub(super) fn is_a_bounded(&self) -> bool {
        self.exterior_a == Exterior::Out
    }

    /// Prepares the sum of `a` and `b`. With [`Exterior::In`], `a` is the complement of a bounded solid and its triangles face
    /// inwards; its shells must not overlap then. `b` is always bounded.
    pub fn new(a: &Polyhedron, exterior_a: Exterior, b: &Polyhedron) -> SumMembership {
        SumMembership { a: Surface::new(a), exterior_a, b: Surface::new(b) }
    }

    /// Returns whether a movable point lies in A.
    pub(super) fn is_in_a(&self, point: [i32; 3], stack: &mut Stack) -> bool {
        let is_wound = self.a.winding(point, stack) != 0;
        match self.exterior_a {
            Exterior::Out => is_wound,
            // The solid that A is the complement of winds around the points outside A.
            Exterior::In => !is_wound,
        }
    }

    /// Returns whether two triangles, by indices in the trees' orders, cross where B is reflected and moved to the point.
    pub(super) fn do_cross(&self, [i, j]: [usize; 2], point: [i32; 3]) -> bool {
        do_cross(&self.a.triangles[i], &moved_to(point, &self.b.triangles[j]))
    }

    fn any_crossing(&self, point: [i32; 3], memory: &mut SumMemory) -> bool {
        let SumMemory { crossing, pairs, .. } = memory;
        // The boxes and triangles of B are reflected and moved to the point.
        let any_of_a = |of_a: Range<usize>, around_b: &LatticeBox| {
            let moved = LatticeBox { min: minus(point, around_b.max), max: minus(point, around_b.min) };
            self.a.triangles[of_a].iter().any(|corners| may_reach(corners, &moved))
        };
        let any_of_b = |around_a: &LatticeBox, of_b: Range<usize>| {
            self.b.triangles[of_b].iter().any(|corners| may_reach(&moved_to(point, corners), around_a))
        };
        let found = self.a.tree.visit_pairs(&self.b.tree, point, pairs, any_of_a, any_of_b, |of_a, of_b| {
            for j in of_b {
                let moved = moved_to(point, &self.b.triangles[j]);
                for i in of_a.clone() {
                    if do_cross(&self.a.triangles[i], &moved) {
                        *crossing = Some([i, j]);
                        return ControlFlow::Break(());
                    }
                }
            }
            ControlFlow::Continue(())
        });
        found.is_break()
    }

    /// Returns whether a vertex of a shell of B, reflected and moved to the point, lies in A.
    fn any_shell_of_b_in_a(&self, point: [i32; 3], memory: &mut SumMemory) -> bool {
        let SumMemory { stack, ray_stack, .. } = memory;
        let is_inside = |vertex| self.is_in_a(minus(point, vertex), ray_stack);
        any_shell(&self.b, stack, |around| do_meet(&self.a.tree.bounds(), around, point), is_inside)
    }

    /// Returns whether a vertex of a shell of A lies in B, reflected and moved to the point.
    fn any_shell_of_a_in_b(&self, point: [i32; 3], memory: &mut SumMemory) -> bool {
        let SumMemory { stack, ray_stack, .. } = memory;
        let is_inside = |vertex| self.b.winding(minus(point, vertex), ray_stack) != 0;
        any_shell(&self.a, stack, |around| do_meet(around, &self.b.tree.bounds(), point), is_inside)
    }
}

impl Membership for SumMembership {
    type Memory = SumMemory;

    fn contains(&self, point: [i32; 3], memory: &mut SumMemory) -> bool {
        let (around_a, around_b) = (self.a.tree.bounds(), self.b.tree.bounds());
        if around_b.is_empty() {
            return false;
        }
        match self.exterior_a {
            Exterior::Out if around_a.is_empty() || !do_meet(&around_a, &around_b, point) => return false,
            Exterior::In if around_a.is_empty() || reaches_out(&around_b, &around_a, point) => return true,
            _ => {}
        }
        memory.crossing.is_some_and(|pair| self.do_cross(pair, point))
            || self.any_crossing(point, memory)
            || self.any_shell_of_b_in_a(point, memory)
            || self.any_shell_of_a_in_b(point, memory)
    }
}

impl Surface {
    pub(super) fn new(solid: &Polyhedron) -> Surface {
        let positions = solid.positions();
        let corners: Vec<Corners> = solid.triangles().iter().map(|t| t.map(|v| positions[v as usize])).collect();
        let boxes: Vec<LatticeBox> = corners.iter().map(|corners| around(corners)).collect();
        let (tree, order) = Tree::new(&boxes);
        let vertices = vertex_of_each_shell(solid);
        let points: Vec<LatticeBox> = vertices.iter().map(|&vertex| around(&[vertex])).collect();
        let (shell_tree, shell_order) = Tree::new(&points);
        Surface {
            tree,
            triangles: order.iter().map(|&triangle| corners[triangle as usize]).collect(),
            shell_tree,
            shells: shell_order.iter().map(|&shell| vertices[shell as usize]).collect(),
            ray_axis: axis_of_fewest(&boxes),
        }
    }

    /// Returns the winding number of the surface around a movable point.
    pub(super) fn winding(&self, point: [i32; 3], stack: &mut Stack) -> i32 {
        let bounds = self.tree.bounds();
        let depth = self.ray_axis.depth();
        let is_below_middle = i64::from(point[depth]) * 2 < i64::from(bounds.min[depth]) + i64::from(bounds.max[depth]);
        let ray = Ray { axis: self.ray_axis, way: if is_below_middle { Way::Down } else { Way::Up } };
        let mut sum = 0;
        let every = self.tree.visit(
            stack,
            |bounds| ray.meets(bounds, point),
            |triangles| {
                sum += self.triangles[triangles].iter().map(|corners| winding(corners, point, ray)).sum::<i32>();
                ControlFlow::Continue(())
            },
        );
        debug_assert!(every.is_continue());
        sum
    }
}

/// Returns whether a vertex of any of a surface's shells, among those in boxes accepted by `enter`, is inside.
fn any_shell(
    of: &Surface,
    stack: &mut Stack,
    enter: impl Fn(&LatticeBox) -> bool,
    mut is_inside: impl FnMut([i32; 3]) -> bool,
) -> bool {
    let ask = |shells: Range<usize>| match of.shells[shells].iter().any(|&vertex| is_inside(vertex)) {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    };
    of.shell_tree.visit(stack, enter, ask).is_break()
}

/// Returns whether a box, reflected and moved to a movable point, extends beyond another one.
fn reaches_out(reflected: &LatticeBox, of: &LatticeBox, point: [i32; 3]) -> bool {
    (0..3).any(|i| point[i] < of.min[i] + reflected.max[i] || point[i] >= of.max[i] + reflected.min[i])
}

/// Returns the axis along which a random line through the common box meets the fewest boxes on average.
fn axis_of_fewest(boxes: &[LatticeBox]) -> Axis {
    let all = boxes.iter().fold(LatticeBox::EMPTY, |all, one| all.hull(one));
    let side = |of: &LatticeBox, i: usize| f64::from(of.max[i] - of.min[i]);
    let area = |of: &LatticeBox, axis: Axis| side(of, axis.column()) * side(of, axis.row());
    let met = |axis| boxes.iter().map(|one| area(one, axis)).sum::<f64>() / area(&all, axis).max(1.0);
    let least = Axis::ALL.into_iter().min_by(|&a, &b| met(a).total_cmp(&met(b)));
    least.unwrap_or(Axis::Z)
}

fn around(positions: &[[i32; 3]]) -> LatticeBox {
    let point = |&p: &[i32; 3]| LatticeBox { min: p, max: p };
    positions.iter().map(point).fold(LatticeBox::EMPTY, |all, one| all.hull(&one))
}

#[inline]
pub(super) fn minus([x, y, z]: [i32; 3], [from_x, from_y, from_z]: [i32; 3]) -> [i32; 3] {
    [x - from_x, y - from_y, z - from_z]
}

/// Returns a triangle reflected and moved to a point.
#[inline]
fn moved_to(point: [i32; 3], [a, b, c]: &Corners) -> Corners {
    [minus(point, *a), minus(point, *b), minus(point, *c)]
}
