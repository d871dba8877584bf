//! Lengths and fluxes compared with closed forms.

use super::*;
use crate::metrics::{BoundaryCondition, NodeSet};

const TOLERANCE: f64 = 1e-9;

fn diffusion(nodes: &NodeSet, axis: Axis, edges: BoundaryCondition) -> Diffusion {
    let found = diffusive(nodes, axis, edges, EndCondition::Faces, TOLERANCE, &|_| ()).unwrap();
    found.expect("something reaches from end to end")
}

fn shortest(nodes: &NodeSet, axis: Axis, edges: BoundaryCondition) -> f64 {
    geodesic(nodes, axis, edges).unwrap().expect("a path")
}

/// Returns the orders of convergence, as powers of 2, for each halving of the pitch.
fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).abs().log2()).collect()
}

#[test]
fn a_straight_tube_has_a_tortuosity_of_exactly_1() {
    for axis in Axis::ALL {
        let bore = |node: [usize; 3]| {
            let [u, v] = [node[axis.column()], node[axis.row()]].map(|c| c as f64 - 8.0);
            u.hypot(v) < 5.0
        };
        let mut size = [17; 3];
        size[axis.depth()] = 40;
        let tube = NodeSet::from_fn(size, bore);
        assert_eq!(geodesic(&tube, axis, BoundaryCondition::Clip), Ok(Some(1.0)));
        let found = diffusion(&tube, axis, BoundaryCondition::Clip);
        assert!((found.tortuosity - 1.0).abs() < 1e-8, "{found:?}");
        assert!((found.formation_factor * found.share - 1.0).abs() < 1e-8, "{found:?}");
        assert_eq!(found.share, found.spanning_share);
        let nodes =
            diffusive(&tube, axis, BoundaryCondition::Clip, EndCondition::Nodes, TOLERANCE, &|_| ()).unwrap().unwrap();
        assert!((nodes.tortuosity - 1.0).abs() < 1e-8, "{nodes:?}");
    }
}

#[test]
fn dead_ends_have_no_path() {
    let dead = NodeSet::from_fn([20; 3], |[x, y, z]| (5..15).contains(&x) && y > 3 && z < 19);
    for (axis, open) in [(Axis::Z, false), (Axis::X, false), (Axis::Y, false)] {
        assert_eq!(geodesic(&dead, axis, BoundaryCondition::Clip).unwrap().is_some(), open);
        assert_eq!(diffusive(&dead, axis, BoundaryCondition::Clip, EndCondition::Faces, TOLERANCE, &|_| ()), Ok(None));
    }
    // The ends are no neighbours where the raster repeats, and the other faces are.
    for axis in Axis::ALL {
        for condition in [EndCondition::Faces, EndCondition::Nodes] {
            let through = |nodes: &NodeSet, edges| {
                diffusive(nodes, axis, edges, condition, TOLERANCE, &|_| ()).unwrap().is_some()
            };
            let apart = NodeSet::from_fn([12; 3], |node| !(3..9).contains(&node[axis.depth()]));
            assert!(!through(&apart, BoundaryCondition::Periodic));
            // Two halves of a way, at opposite faces.
            let halves = NodeSet::from_fn([12; 3], |node| {
                let (along, aside) = (node[axis.depth()], node[axis.column()]);
                along <= 6 && aside == 0 || along >= 6 && aside == 11
            });
            assert!(through(&halves, BoundaryCondition::Periodic) && !through(&halves, BoundaryCondition::Clip));
        }
    }
    // Two halves that meet in an edge are separate.
    let halves = NodeSet::from_fn([8; 3], |[x, _, z]| (x < 4) == (z < 4));
    assert_eq!(geodesic(&halves, Axis::Z, BoundaryCondition::Clip), Ok(None));
    assert_eq!(diffusive(&halves, Axis::Z, BoundaryCondition::Clip, EndCondition::Faces, TOLERANCE, &|_| ()), Ok(None));
    // Pieces that do not reach from end to end count only in the share of the phase.
    let tube = |[x, y, _]: [usize; 3]| (2..6).contains(&x) && (2..6).contains(&y);
    let both = NodeSet::from_fn([20; 3], |node| tube(node) || (node[0] > 10 && node[2] < 10));
    let found = diffusion(&both, Axis::Z, BoundaryCondition::Clip);
    let alone = diffusion(&NodeSet::from_fn([20; 3], tube), Axis::Z, BoundaryCondition::Clip);
    assert!((found.formation_factor / alone.formation_factor - 1.0).abs() < 1e-9);
    assert_eq!(found.spanning_share, alone.share);
    assert!(found.share > 1.5 * alone.share && (found.tortuosity - 1.0).abs() < 1e-6, "{found:?}");
}

#[test]
fn impossible_inputs_are_refused() {
    let thin = NodeSet::full([4, 4, 1]);
    assert_eq!(
        geodesic(&thin, Axis::Z, BoundaryCondition::Clip),
        Err(TortuosityError::TooThin { axis: Axis::Z, nodes: 1, least: 2 })
    );
    let of = |condition, tolerance| diffusive(&thin, Axis::Z, BoundaryCondition::Clip, condition, tolerance, &|_| ());
    assert!((of(EndCondition::Faces, 1e-9).unwrap().unwrap().tortuosity - 1.0).abs() < 1e-12);
    assert!(matches!(of(EndCondition::Nodes, 1e-9), Err(TortuosityError::TooThin { least: 2, .. })));
    assert!(matches!(of(EndCondition::Faces, 1e-15), Err(TortuosityError::Tolerance { .. })));
    let pair = NodeSet::from_fn([3, 3, 2], |[x, _, z]| x < 2 || z == 0);
    let found =
        diffusive(&pair, Axis::Z, BoundaryCondition::Clip, EndCondition::Nodes, 1e-9, &|_| ()).unwrap().unwrap();
    assert!((found.effective_diffusivity - 2.0 / 3.0).abs() < 1e-12, "{found:?}");
}

/// Returns slits between planes along y at slope 3/4 to z, periodic along x: of width `gap` and of period `period`, both along
/// x and in parts of the length along z.
fn slits(length: usize, period: f64, gap: f64) -> NodeSet {
    let n = length as f64;
    let width = (period * n).round() as usize;
    NodeSet::from_fn([width, 1, length], |[x, _, z]| {
        let [x, z] = [x, z].map(|c| c as f64 + 0.5);
        (x - 0.75 * z).rem_euclid(period * n) < gap * n
    })
}

/// cos θ = 4/5, with tan θ = 3/4: 25/16 and 5/4. The shortening by the ends is proportional to the width of the gap over the
/// length; it cancels between two lengths. Walls of nodes are stairs, whose treads conduct nothing: to first order in the
/// pitch, the conducting gap is narrower than the share of nodes implies.
#[test]
fn slits_at_an_angle_have_their_closed_form_tortuosity() {
    let exact = [1.5625, 1.25];
    let mut errors = [Vec::new(), Vec::new()];
    for nodes in [4, 8, 16, 32] {
        // The gap has this number of nodes across, and lengths of 8 and 16 gaps.
        let found = [8, 16].map(|long| {
            let length = nodes * long;
            let nodes = slits(length, 0.25, 1.0 / long as f64);
            let diffusion = diffusion(&nodes, Axis::Z, BoundaryCondition::Periodic);
            let along = shortest(&nodes, Axis::Z, BoundaryCondition::Periodic) * (length - 1) as f64;
            [diffusion.tortuosity * length as f64, along].map(|value| value / length as f64)
        });
        let between = [0, 1].map(|i| 2.0 * found[1][i] - found[0][i]);
        println!(
            "{nodes} nodes across: diffusive, geodesic {found:.4?}, without ends {between:.4?}, exactly {exact:?}"
        );
        (0..2).for_each(|i| errors[i].push(between[i] - exact[i]));
    }
    println!("orders: diffusive {:.2?}, geodesic {:.2?}", orders(&errors[0]), orders(&errors[1]));
    assert!(errors[0][3].abs() < 0.04 * exact[0] && orders(&errors[0]).iter().all(|&order| order > 0.9), "{errors:?}");
    let extrapolated = 2.0 * errors[0][3] - errors[0][2];
    assert!(extrapolated.abs() < 5e-3 * exact[0], "{extrapolated}");
    assert!(errors[1].iter().skip(1).all(|error| error.abs() < 2e-3 * exact[1]), "{errors:?}");
}

/// A plate across the path that leaves a gap at one side: straight lines to its edge and on from there.
#[test]
fn shortest_paths_bend_around_an_edge() {
    let mut errors = Vec::new();
    for side in [16, 32, 64, 128usize] {
        let half = side / 2;
        // A plate of one plane: paths bend at its middle to within half a pitch.
        let open = NodeSet::from_fn([side, 1, side + 1], |[x, _, z]| z != half || x < side / 4);
        let edge = (side / 4) as f64 - 0.5;
        let exact = (0..side).map(|x| x as f64).map(|x| {
            if x <= edge {
                side as f64
            } else {
                let from = |h: f64| (x - edge).hypot(h);
                // The near end is a whole face: straight to the edge.
                half as f64 + from(half as f64)
            }
        });
        let exact = exact.sum::<f64>() / side as f64 / side as f64;
        let found = shortest(&open, Axis::Z, BoundaryCondition::Clip);
        println!("{side}: {found:.5}, exactly {exact:.5}");
        errors.push(found - exact);
    }
    println!("orders {:.2?}", orders(&errors));
    assert!(errors[3].abs() < 4e-3, "{errors:?}");
}

/// Perrins, McKenzie and McPhedran's value for circular cylinders, from which D_eff / D₀ = 0.77672.
#[test]
fn diffusion_across_cylinders_matches_the_known_value() {
    let exact = 1.1257;
    let mut errors = Vec::new();
    for side in [32, 64, 128, 256] {
        let array = NodeSet::from_fn([side, 1, side], |[x, _, z]| {
            let [x, z] = [x, z].map(|c| (c as f64 + 0.5) / side as f64 - 0.5);
            x.hypot(z) > 0.2
        });
        let found = diffusion(&array, Axis::Z, BoundaryCondition::Periodic);
        println!("{side}: {:.5} after {} iterations, exactly {exact}", found.tortuosity, found.iterations);
        let aside = diffusion(&array, Axis::X, BoundaryCondition::Clip);
        assert!((aside.tortuosity - found.tortuosity).abs() < 1e-6, "{aside:?}");
        errors.push(found.tortuosity - exact);
    }
    println!("orders {:.2?}", orders(&errors));
    assert!(errors[3].abs() < 4e-3 && orders(&errors)[1..].iter().all(|&order| order > 0.9), "{errors:?}");
    let extrapolated = 2.0 * errors[3] - errors[2];
    assert!(extrapolated.abs() < 2e-3, "{extrapolated}");
}

fn gyroid(side: usize, cells: f64, level: f64) -> NodeSet {
    NodeSet::from_fn([side; 3], |node| {
        let [(sx, cx), (sy, cy), (sz, cz)] =
            node.map(|c| (std::f64::consts::TAU * cells * (c as f64 + 0.5) / side as f64).sin_cos());
        sx * cy + sy * cz + sz * cx > level
    })
}

/// The sum of the squares of differences of the solution is the flux, and an independent solver gives the same result: plain
/// relaxation until nothing changes.
#[test]
fn the_solution_agrees_with_plain_relaxation() {
    let side = 12;
    let nodes = gyroid(side, 1.0, 0.2);
    for (edges, condition) in
        [(BoundaryCondition::Clip, EndCondition::Faces), (BoundaryCondition::Periodic, EndCondition::Nodes)]
    {
        let expected = relaxed(&nodes, edges, condition);
        for tolerance in [1e-4, 1e-6, 1e-8, 1e-11] {
            let found = diffusive(&nodes, Axis::Y, edges, condition, tolerance, &|_| ()).unwrap().unwrap();
            let excess = found.effective_diffusivity / expected - 1.0;
            assert!((-1e-10..tolerance + 1e-10).contains(&excess), "{found:?} for {expected}");
            assert!(found.error <= tolerance && found.iterations < 25, "{found:?}");
        }
    }
}

/// Diffusivities are the least energies of all concentrations, so that they are too large; by less than the tolerance.
#[test]
fn diffusivities_are_too_large_by_less_than_the_tolerance() {
    let barely = NodeSet::from_fn([48; 3], |[x, y, z]| noise((z * 48 + y) * 48 + x) < 0.35);
    let far = NodeSet::from_fn([8, 8, 200], |[x, y, z]| noise((z * 8 + y) * 8 + x) < 0.5);
    for nodes in [gyroid(48, 2.0, 0.2), gyroid(32, 1.0, -0.9), gyroid(64, 2.0, 0.9), barely, far] {
        for condition in [EndCondition::Faces, EndCondition::Nodes] {
            let of = |tolerance| {
                let found = diffusive(&nodes, Axis::Z, BoundaryCondition::Clip, condition, tolerance, &|_| ());
                found.unwrap().expect("pieces reach from end to end")
            };
            let exact = of(1e-12).effective_diffusivity;
            for tolerance in [1e-3, 1e-4, 1e-6, 1e-8, 1e-10] {
                let found = of(tolerance);
                let excess = found.effective_diffusivity / exact - 1.0;
                println!(
                    "{condition:?}: {excess:e} too large, estimated {:e}, {} steps",
                    found.error, found.iterations
                );
                assert!((-1e-11..tolerance).contains(&excess), "{tolerance:e}: {excess:e}");
                assert!(
                    excess < 3.0 * found.error + 1e-11 && found.error < 20.0 * excess + 1e-11,
                    "{found:?}: {excess:e}"
                );
            }
        }
    }
}

/// Returns D_eff / D₀ along y by Gauss–Seidel relaxation.
fn relaxed(nodes: &NodeSet, edges: BoundaryCondition, condition: EndCondition) -> f64 {
    let side = nodes.size()[1];
    let at = |[x, y, z]: [usize; 3]| (z * side + y) * side + x;
    let mut values = vec![0.5; nodes.volume()];
    let all: Vec<[usize; 3]> = (0..nodes.volume()).map(|i| [i % side, i / side % side, i / side / side]).collect();
    for _ in 0..20_000 {
        for &node in all.iter().filter(|&&node| nodes.contains(node)) {
            let mut links: Vec<f64> = Vec::new();
            for (axis, up) in [(0, false), (0, true), (1, false), (1, true), (2, false), (2, true)] {
                let mut other = node;
                let beyond = if up { node[axis] + 1 == side } else { node[axis] == 0 };
                if beyond && axis == 1 {
                    if condition == EndCondition::Faces {
                        links.extend([f64::from(u8::from(!up)); 2]);
                    }
                    continue;
                }
                if beyond && edges != BoundaryCondition::Periodic {
                    continue;
                }
                other[axis] = (node[axis] + if up { 1 } else { side - 1 }) % side;
                if nodes.contains(other) {
                    links.push(values[at(other)]);
                }
            }
            values[at(node)] = match (condition, node[1]) {
                (EndCondition::Nodes, 0) => 1.0,
                (EndCondition::Nodes, y) if y + 1 == side => 0.0,
                _ if links.is_empty() => 0.0,
                _ => links.iter().sum::<f64>() / links.len() as f64,
            };
        }
    }
    // Through the plane between the two in the middle.
    let through = all.iter().filter(|node| node[1] == side / 2 && nodes.contains(**node)).map(|&node| {
        let before = [node[0], node[1] - 1, node[2]];
        if nodes.contains(before) { values[at(before)] - values[at(node)] } else { 0.0 }
    });
    let length = if condition == EndCondition::Faces { side } else { side - 1 };
    through.sum::<f64>() * length as f64 / (side * side) as f64
}

#[test]
fn iterations_hardly_grow_with_the_raster() {
    let mut told = std::sync::Mutex::new(Vec::new());
    let mut most = Vec::new();
    for (side, cells, level) in
        [(16, 1.0, 0.0), (32, 1.0, 0.0), (64, 1.0, 0.0), (64, 4.0, 0.0), (64, 4.0, -0.8), (64, 2.0, 0.9)]
    {
        let nodes = gyroid(side, cells, level);
        let found = diffusive(&nodes, Axis::X, BoundaryCondition::Clip, EndCondition::Faces, 1e-9, &|share| {
            told.lock().unwrap().push(share)
        });
        let found = found.unwrap().unwrap();
        println!("{side}, {cells} cells, level {level}: {found:?}");
        most.push(found.iterations);
        let told = std::mem::take(told.get_mut().unwrap());
        assert!(told.len() > 2 && told.is_sorted() && told.last() == Some(&1.0), "{told:?}");
    }
    // Slightly above the connectivity threshold: winding paths of single nodes with dead ends.
    let barely = NodeSet::from_fn([48; 3], |[x, y, z]| noise((z * 48 + y) * 48 + x) < 0.35);
    let found = diffusion(&barely, Axis::Z, BoundaryCondition::Clip);
    println!("{found:?}");
    assert!(found.spanning_share < found.share && found.tortuosity > 20.0, "{found:?}");
    most.push(found.iterations);
    assert!(most.iter().all(|&iterations| iterations <= 30), "{most:?}");
}

/// Returns a pseudo-random number from 0 to 1.
fn noise(of: usize) -> f64 {
    let stir = |x: u64| (x ^ x >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93);
    (stir(stir(stir(of as u64 + 1))) >> 11) as f64 / (1u64 << 53) as f64
}

#[test]
fn tortuosity_does_not_depend_on_the_thread_count() {
    let nodes = gyroid(48, 2.0, 0.0);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| diffusion(&nodes, Axis::Z, BoundaryCondition::Periodic))
    };
    assert_eq!(with(1), with(3));
}
