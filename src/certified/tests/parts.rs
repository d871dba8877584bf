//! The parts of the proof: places of triangles, shares of the integral, and the bounds after Fréchet.

use super::super::cell::Cell;
use super::super::flux::{Sum, add_share};
use super::super::frechet::{self, Part};
use super::super::place::{Place, place};
use super::*;

fn random_point(random: &mut Random, size: f64) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| size * random.unit()))
}

/// Draws a cell, and a triangle near it: large, small, thin, or with coordinates in the faces of the cell.
fn random_pair(random: &mut Random) -> (Cell, [DVec3; 3]) {
    let min = random_point(random, 1.0);
    let cell = Cell { min, max: min + DVec3::from_array([(); 3].map(|()| 0.1 + random.share())) };
    let size = [4.0, 1.0, 0.3][random.below(3)];
    let mut corners = [(); 3].map(|()| min + random_point(random, size));
    match random.below(4) {
        0 => corners[2] = corners[0] + (corners[1] - corners[0]) * random.share() + random_point(random, 1e-9),
        1 => {
            let axis = random.below(3);
            let plane = [cell.min, cell.max][random.below(2)][axis];
            corners.iter_mut().for_each(|corner| corner[axis] = plane);
        }
        _ => {}
    }
    (cell, corners)
}

/// Draws a point of a triangle.
fn point_of(random: &mut Random, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let (u, v) = (random.share(), random.share());
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    a + (b - a) * u + (c - a) * v
}

#[test]
fn triangles_are_placed_where_their_points_are() {
    let mut random = Random::new(4);
    let mut counts = [0; 4];
    for _ in 0..40_000 {
        let (cell, corners) = random_pair(&mut random);
        let found = place(&corners, &cell, true);
        counts[match found {
            Place::Off => 0,
            Place::Across(_) => 1,
            Place::Below => 2,
            Place::Inside => 3,
        }] += 1;
        for _ in 0..20 {
            let point = point_of(&mut random, corners);
            // Points of the triangle are rounded.
            let inside = |axis: usize| cell.min[axis] + 1e-12 < point[axis] && point[axis] < cell.max[axis] - 1e-12;
            let is_across = inside(1) && inside(2);
            let is_below = is_across && point.x < cell.min.x;
            assert!(found == Place::Inside || !(is_across && inside(0)), "{found:?} {cell:?} {corners:?}");
            assert!(!is_below || found != Place::Off, "{found:?} {cell:?} {corners:?}");
            if let Place::Across(_) = found {
                assert!(point.x <= cell.min.x + 1e-12 || !is_across, "{cell:?} {corners:?}");
            }
        }
        if let Place::Across(change) = found {
            let mut sum = Sum::default();
            add_share(&mut sum, &corners, &cell);
            let (share, error) = sum.total();
            assert!((share - f64::from(change) * cell.volume().0).abs() <= 2.0 * error + 1e-15, "{share} {change}");
        }
    }
    assert!(counts.iter().all(|&count| count > 400), "{counts:?}");
}

/// Triangles that do not meet the cell are found, so that few cells seem divided.
#[test]
fn few_triangles_are_inside_by_mistake() {
    let mut random = Random::new(5);
    let cell = Cell { min: DVec3::ZERO, max: DVec3::ONE };
    for _ in 0..20_000 {
        let corners = [(); 3].map(|()| DVec3::splat(0.5) + random_point(&mut random, 1.5));
        let is_inside = place(&corners, &cell, true) == Place::Inside;
        let meets = (0..2_000).any(|_| {
            let point = point_of(&mut random, corners);
            (point.cmpgt(DVec3::splat(-0.05)) & point.cmplt(DVec3::splat(1.05))).all()
        });
        if is_inside && !meets {
            // A corner or a thin strip of it may be in the cell without a sample.
            let nearest = (0..200_000)
                .map(|_| point_of(&mut random, corners))
                .map(|point| (point - point.clamp(DVec3::ZERO, DVec3::ONE)).length());
            assert!(nearest.fold(f64::INFINITY, f64::min) < 0.05, "{corners:?}");
        }
    }
}

/// The share of a triangle, from the areas of slices: a sum over rays through the middles of small squares.
fn share_by_rays([a, b, c]: [DVec3; 3], cell: &Cell, rays: usize) -> f64 {
    let area = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    let seen = |p: DVec3| [p.y, p.z];
    let whole = area(seen(a), seen(b), seen(c));
    let sides = cell.sides();
    let mut sum = 0.0;
    for (j, k) in (0..rays).flat_map(|j| (0..rays).map(move |k| (j, k))) {
        let at = |i: usize, axis: usize| cell.min[axis] + sides[axis] * (i as f64 + 0.5) / rays as f64;
        let ray = [at(j, 1), at(k, 2)];
        let weights = [area(ray, seen(b), seen(c)), area(seen(a), ray, seen(c)), area(seen(a), seen(b), ray)]
            .map(|part| part / whole);
        if weights.iter().all(|&weight| weight >= 0.0) {
            let x = weights[0] * a.x + weights[1] * b.x + weights[2] * c.x;
            sum -= whole.signum() * (cell.max.x - x).clamp(0.0, sides.x);
        }
    }
    sum * sides.y * sides.z / (rays * rays) as f64
}

#[test]
fn shares_are_those_of_rays() {
    let mut random = Random::new(6);
    for _ in 0..300 {
        let (cell, corners) = random_pair(&mut random);
        let mut sum = Sum::default();
        add_share(&mut sum, &corners, &cell);
        let (share, error) = sum.total();
        let by_rays = share_by_rays(corners, &cell, 120);
        assert!((share - by_rays).abs() < 0.02 * cell.volume().0 + error, "{share} {by_rays} {cell:?} {corners:?}");
        assert!(error < 1e-9, "{error}");
    }
}

/// The shares of a triangle in the halves of a cell, and of the halves of a triangle, add up within their errors.
#[test]
fn shares_add_up() {
    let mut random = Random::new(7);
    for _ in 0..20_000 {
        let (cell, corners) = random_pair(&mut random);
        let share = |corners: &[DVec3; 3], cell: &Cell| {
            let mut sum = Sum::default();
            add_share(&mut sum, corners, cell);
            sum.total()
        };
        let (whole, error) = share(&corners, &cell);
        let axis = random.below(3);
        let middle = cell.min[axis] + (cell.max[axis] - cell.min[axis]) * random.share();
        let (mut low, mut high) = (cell, cell);
        (low.max[axis], high.min[axis]) = (middle, middle);
        if axis != 0 && low.sides().min_element() > 0.0 {
            let [(a, of_a), (b, of_b)] = [low, high].map(|half| share(&corners, &half));
            assert!((a + b - whole).abs() <= error + of_a + of_b, "{a} {b} {whole} {error}");
        }
        // With opposite triangles it closes, so that the parts cancel.
        let [p, q, r] = corners;
        let (back, of_back) = share(&[p, r, q], &cell);
        assert!((whole + back).abs() <= error + of_back);
    }
}

#[test]
fn frechet_bounds_enclose_all_sets_of_points_and_are_reached() {
    // Sets of points of a cell of six.
    let (cell, exact) =
        (Part { volume: 6.0, error: 0.0 }, |volume: u32| Part { volume: f64::from(volume), error: 0.0 });
    for table in (0..16u32).map(|bits| [0, 1, 2, 3].map(|i| bits >> i & 1 == 1)) {
        let mut seen = std::collections::BTreeMap::new();
        for (a, b) in (0..64u32).flat_map(|a| (0..64u32).map(move |b| (a, b))) {
            let holds = |i: u32| table[((a >> i & 1) + 2 * (b >> i & 1)) as usize];
            let volume = (0..6).filter(|&i| holds(i)).count() as f64;
            let [least, most] = seen.entry((a.count_ones(), b.count_ones())).or_insert([volume; 2]);
            (*least, *most) = (least.min(volume), most.max(volume));
        }
        for ((a, b), [least, most]) in seen {
            let [lower, upper] = frechet::of_two(table, [exact(a), exact(b)], cell);
            assert!(lower <= least && most <= upper, "{table:?} {a} {b}: {least} to {most}, {lower} to {upper}");
            assert!(least - lower < 1e-12 && upper - most < 1e-12, "{table:?} {a} {b}");
            let loose = |volume: u32| Part { volume: f64::from(volume), error: 0.25 };
            let wide = frechet::of_two(table, [loose(a), loose(b)], cell);
            assert!(wide[0] <= (lower - 0.5).max(0.0) + 1e-12 && wide[1] >= (upper + 0.5).min(6.0) - 1e-12);
        }
    }
}

#[test]
fn bounds_of_many_sets_enclose_all_sets_of_points() {
    let mut random = Random::new(8);
    let cell = Part { volume: 64.0, error: 0.0 };
    for _ in 0..2_000 {
        let sets = [(); 5].map(|()| random.bits() & random.bits() & random.bits());
        let table = random.bits() as u32;
        let state = |i: u32| sets.iter().enumerate().map(|(j, set)| ((set >> i & 1) as u32) << j).sum::<u32>();
        let volume = (0..64).filter(|&i| table >> state(i) & 1 == 1).count() as f64;
        let sizes = sets.map(|set| f64::from(set.count_ones()));
        let most: u32 = sizes.iter().enumerate().map(|(j, &size)| u32::from(size > 32.0) << j).sum();
        let lesser = sizes.map(|size| Part { volume: size.min(64.0 - size), error: 0.0 });
        let [lower, upper] = frechet::of_many(table >> most & 1 == 1, lesser.into_iter(), cell);
        assert!(lower <= volume && volume <= upper, "{volume} {lower} {upper}");
    }
}
