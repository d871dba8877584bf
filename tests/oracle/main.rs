//! The oracle of the sampling contract, and tests that the contract itself keeps its promises: rays of closed solids close, the
//! three views agree about every node, and under ⊆ exact ⊆ over.

mod against_sampler;
mod against_sums;
mod brute_force;
mod on_lattice;
mod soups;
mod sums;
#[path = "../../src/testing/mod.rs"]
mod testing;

use brute_force::{
    FillRule, Image, Lattice, Mode, Operation, Solid, boolean, contains, crossings, image, intersection,
};
use soups::{Frame, Generator, Soup, oriented};
use testing::random::Random;

const FILLS: [FillRule; 2] = [FillRule::EvenOdd, FillRule::NonZero];

fn solid(soup: &Soup) -> Solid<'_> {
    Solid { positions: &soup.positions, triangles: &soup.triangles }
}

fn lattice(frame: &Frame, lod: u32) -> Lattice {
    Lattice { shift: frame.shift, rays: frame.rays, lod }
}

/// Returns random frames: mostly small pixels, where nodes often meet edges and planes, and sometimes the whole 30 bits.
fn random_frame(random: &mut Random) -> Frame {
    let shift = random.choose(&[2, 2, 2, 3, 4, 7, 12, 26]);
    Frame { shift, rays: std::array::from_fn(|_| random.between(6, if shift == 26 { 15 } else { 9 }) as u32) }
}

/// Draws LOD-C, from one voxel for the whole ray to voxels of two steps, the smallest.
fn random_lod(random: &mut Random) -> u32 {
    random.choose(&[1, 2, 3, 5, 8, 13, 64, 1024, 1 << 20])
}

fn random_oriented(random: &mut Random, frame: &Frame) -> Soup {
    let (_, generator) = random.choose(&oriented());
    generator(random, frame)
}

/// Calls a check with one named solid for every generator and seed; the random source continues after the solid.
fn for_every_soup(generators: &[(&str, Generator)], seeds: u64, check: impl Fn(&str, &Frame, &Soup, &mut Random)) {
    for (name, generator) in generators {
        for seed in 0..seeds {
            let mut random = Random::new(seed);
            let frame = random_frame(&mut random);
            let soup = generator(&mut random, &frame);
            check(&format!("{name}, seed {seed}, {frame:?}"), &frame, &soup, &mut random);
        }
    }
}

/// Returns the first ray where `smaller` covers something that `larger` does not.
fn outside(smaller: &Image, larger: &Image) -> Option<usize> {
    boolean(Operation::Difference, smaller, larger).samples.iter().position(|samples| !samples.is_empty())
}

/// Returns the first ray whose samples are not an even number of non-decreasing even depths within the axis.
fn malformed(image: &Image, length: i64) -> Option<usize> {
    image.samples.iter().position(|samples| {
        let even = samples.len() % 2 == 0 && samples.iter().all(|depth| depth % 2 == 0);
        let within = samples.iter().all(|&depth| (0..=length).contains(&i64::from(depth)));
        !(even && within && samples.is_sorted())
    })
}

fn assert_conservative(what: &str, under: &Image, exact: &Image, over: &Image, length: i64) {
    for (mode, image) in [("under", under), ("exact", exact), ("over", over)] {
        assert_eq!(malformed(image, length), None, "{what}: {mode} has a malformed ray");
    }
    assert_eq!(outside(under, exact), None, "{what}: under is not within exact\n{under:?}\n{exact:?}");
    assert_eq!(outside(exact, over), None, "{what}: exact is not within over\n{exact:?}\n{over:?}");
}

/// Returns the states of all nodes, x fastest, by one exact image along an axis.
fn node_states(lattice: &Lattice, exact: &Image, axis: usize) -> Vec<bool> {
    let [nx, ny, nz] = lattice.rays;
    let mut states = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                let (column, row, along) = [(y, z, x), (x, z, y), (x, y, z)][axis];
                let samples = &exact.samples[(row * exact.columns + column) as usize];
                states.push(contains(samples, lattice.node(along) as i32));
            }
        }
    }
    states
}

fn box_lattice() -> Lattice {
    Lattice { shift: 2, rays: [4, 3, 5], lod: 5 }
}

#[test]
fn columns_rows_and_depths_follow_the_axes_of_the_contract() {
    // Nodes lie at 3, 7, 11, 15, 19. The box spans node 1 of x, nodes 0 and 1 of y, nodes 2 to 4 of z.
    let soup = soups::cuboid([4, 2, 8], [10, 8, 20]);
    let along = |axis| image(&box_lattice(), solid(&soup), axis, Mode::Exact, FillRule::EvenOdd);
    let rays_with = |image: &Image| -> Vec<usize> {
        (0..image.samples.len()).filter(|&ray| !image.samples[ray].is_empty()).collect()
    };

    let x = along(0);
    assert_eq!((x.columns, x.rows), (3, 5));
    assert_eq!(rays_with(&x), [6, 7, 9, 10, 12, 13]);
    assert_eq!(x.samples[6], [4, 10]);

    let y = along(1);
    assert_eq!((y.columns, y.rows), (4, 5));
    assert_eq!(rays_with(&y), [9, 13, 17]);
    assert_eq!(y.samples[9], [2, 8]);

    let z = along(2);
    assert_eq!((z.columns, z.rows), (4, 3));
    assert_eq!(rays_with(&z), [1, 5]);
    assert_eq!(z.samples[1], [8, 20]);
}

#[test]
fn a_crossing_against_the_outward_normal_enters() {
    let soup = soups::cuboid([0, 0, 2], [16, 12, 6]);
    for on_ray in crossings(&box_lattice(), solid(&soup), 2) {
        let mut found: Vec<_> = on_ray.iter().map(|c| (c.floor, c.ceil, c.nearest, c.entering)).collect();
        found.sort_unstable();
        assert_eq!(found, [(2, 2, 2, true), (6, 6, 6, false)]);
    }
}

#[test]
fn the_fill_rules_differ_where_two_boxes_overlap() {
    let mut soup = soups::cuboid([0, 0, 2], [16, 12, 10]);
    soup.add(&soups::cuboid([0, 0, 6], [16, 12, 14]));
    let samples = |mode, fill| image(&box_lattice(), solid(&soup), 2, mode, fill).samples[0].clone();
    assert_eq!(samples(Mode::Exact, FillRule::EvenOdd), [2, 6, 10, 14]);
    assert_eq!(samples(Mode::Exact, FillRule::NonZero), [2, 14]);
    // Voxels are 4 steps long: the crossings fall into voxels 0, 1, 2 and 3.
    assert_eq!(samples(Mode::Over, FillRule::EvenOdd), [2, 6, 10, 14]);
    assert_eq!(samples(Mode::Under, FillRule::EvenOdd), [2, 6, 10, 14]);
    assert_eq!(samples(Mode::Over, FillRule::NonZero), [2, 14]);
    assert_eq!(samples(Mode::Under, FillRule::NonZero), [2, 14]);
}

#[test]
fn a_thin_box_in_one_voxel_is_in_over_and_not_in_under() {
    let lattice = Lattice { lod: 2, ..box_lattice() };
    assert_eq!(lattice.voxel(2), 10);
    let soup = soups::cuboid([0, 0, 2], [16, 12, 8]);
    let samples = |mode| image(&lattice, solid(&soup), 2, mode, FillRule::EvenOdd).samples[0].clone();
    assert_eq!(samples(Mode::Over), [2, 8]);
    assert_eq!(samples(Mode::Exact), [2, 8]);
    assert_eq!(samples(Mode::Under), [0; 0]);
}

#[test]
fn a_gap_within_one_voxel_is_filled_in_over_and_kept_in_under() {
    let lattice = Lattice { lod: 2, ..box_lattice() };
    let mut soup = soups::cuboid([0, 0, 2], [16, 12, 12]);
    soup.add(&soups::cuboid([0, 0, 16], [16, 12, 18]));
    soup.add(&soups::cuboid([0, 0, 4], [16, 12, 6]).inverted());
    for fill in FILLS {
        let samples = |mode| image(&lattice, solid(&soup), 2, mode, fill).samples[0].clone();
        assert_eq!(samples(Mode::Exact), [2, 4, 6, 12, 16, 18]);
        // The far voxel goes from inside to outside over three crossings, the near one from outside to inside.
        assert_eq!(samples(Mode::Over), [2, 18]);
        assert_eq!(samples(Mode::Under), [6, 12]);
    }
}

#[test]
fn crossings_belong_to_the_voxel_of_their_floor() {
    // The near face leans from depth 2 to 4, so its crossings lie within (2, 4), and voxels are 4 steps long.
    let mut soup = soups::cuboid([0, 0, 2], [16, 12, 6]);
    soup.positions.iter_mut().filter(|p| p[0] == 16 && p[2] == 2).for_each(|p| p[2] = 4);
    let samples = |mode| image(&box_lattice(), solid(&soup), 2, mode, FillRule::EvenOdd).samples[0].clone();
    assert_eq!(samples(Mode::Over), [2, 6]);
    assert_eq!(samples(Mode::Exact), [2, 6]);
    assert_eq!(samples(Mode::Under), [4, 6]);
}

#[test]
fn touching_boxes_of_one_winding_merge_except_in_under() {
    let lattice = Lattice { lod: 4, ..box_lattice() };
    assert_eq!(lattice.voxel(2), 6);
    let mut soup = soups::cuboid([0, 0, 2], [16, 12, 8]);
    soup.add(&soups::cuboid([0, 0, 8], [16, 12, 16]));
    let samples = |mode, fill| image(&lattice, solid(&soup), 2, mode, fill).samples[0].clone();
    assert_eq!(samples(Mode::Exact, FillRule::EvenOdd), [2, 8, 8, 16]);
    assert_eq!(samples(Mode::Exact, FillRule::NonZero), [2, 16]);
    for fill in FILLS {
        assert_eq!(samples(Mode::Over, fill), [2, 16]);
        // The order of the two faces within their group is unknown, so their voxel is touched under both rules.
        assert_eq!(samples(Mode::Under, fill), [2, 8, 8, 16]);
    }
}

#[test]
fn an_untouched_solid_adds_no_ends_to_the_intersection() {
    // In voxels 1 and 2, of 6 steps, the winding number of the first solid goes from 1 to 2 and back.
    let lattice = Lattice { lod: 4, ..box_lattice() };
    let mut a = soups::cuboid([0, 0, 0], [16, 12, 20]);
    a.add(&soups::cuboid([0, 0, 8], [16, 12, 16]));
    let b = soups::cuboid([0, 0, 10], [16, 12, 14]);
    let masks = |mode, fill| intersection(&lattice, solid(&a), solid(&b), 2, mode, fill).samples[0].clone();
    for mode in [Mode::Exact, Mode::Over, Mode::Under] {
        assert_eq!(masks(mode, FillRule::NonZero), [10, 14], "{mode:?}");
    }
    // Under the even-odd rule the first solid has a gap there.
    assert_eq!(masks(Mode::Exact, FillRule::EvenOdd), [0; 0]);
    assert_eq!(masks(Mode::Over, FillRule::EvenOdd), [8, 10, 14, 16]);
    assert_eq!(masks(Mode::Under, FillRule::EvenOdd), [0; 0]);
}

#[test]
fn faces_on_voxel_boundaries_belong_to_the_next_voxel_except_at_the_end() {
    let lattice = box_lattice();
    assert_eq!(lattice.voxel(2), 4);
    let soup = soups::cuboid([0, 0, 4], [16, 12, 20]);
    for mode in [Mode::Exact, Mode::Over, Mode::Under] {
        assert_eq!(image(&lattice, solid(&soup), 2, mode, FillRule::EvenOdd).samples[0], [4, 20], "{mode:?}");
    }
    // A box that fills voxel 1 has its faces in voxels 1 and 2, so nothing of it is lost.
    let soup = soups::cuboid([0, 0, 4], [16, 12, 8]);
    for mode in [Mode::Exact, Mode::Over, Mode::Under] {
        assert_eq!(image(&lattice, solid(&soup), 2, mode, FillRule::EvenOdd).samples[0], [4, 8], "{mode:?}");
    }
    // A box that fills the last voxel has both faces in it.
    let soup = soups::cuboid([0, 0, 16], [16, 12, 20]);
    let samples = |mode| image(&lattice, solid(&soup), 2, mode, FillRule::EvenOdd).samples[0].clone();
    assert_eq!(samples(Mode::Over), [16, 20]);
    assert_eq!(samples(Mode::Under), [0; 0]);
}

#[test]
fn voxels_have_even_length_and_cover_the_axis() {
    let voxel = |length_in_pixels, lod| Lattice { shift: 2, rays: [length_in_pixels; 3], lod }.voxel(0);
    assert_eq!(voxel(5, 1), 20);
    assert_eq!(voxel(5, 2), 10);
    assert_eq!(voxel(5, 3), 8);
    assert_eq!(voxel(5, 10), 2);
    assert_eq!(voxel(5, 11), 2);
    assert_eq!(voxel(5, u32::MAX), 2);
    assert_eq!(Lattice { shift: 26, rays: [16; 3], lod: 3 }.voxel(0), 357_913_942);
}

#[test]
fn depths_have_an_even_floor_ceiling_and_nearest() {
    // Along z the plane through these corners has depth x / 3 + 2 at every y. Nodes of x: 3, 7, 11 → 3, 4⅓, 5⅔.
    let mut soup = soups::Soup { positions: vec![[0, 0, 2], [24, 0, 10], [0, 24, 2]], triangles: vec![[0, 1, 2]] };
    let lattice = Lattice { shift: 2, rays: [6; 3], lod: 4 };
    let first = |soup: &Soup, ray: usize| {
        let crossing = crossings(&lattice, solid(soup), 2)[ray][0];
        (crossing.floor, crossing.ceil, crossing.nearest, crossing.entering)
    };
    // The plane rises along x, by a third of ε₁, which is far above ε₃: the surface is above the node.
    assert_eq!(first(&soup, 0), (2, 4, 4, false));
    assert_eq!(first(&soup, 1), (4, 6, 4, false));
    assert_eq!(first(&soup, 2), (4, 6, 6, false));
    soup = soup.inverted();
    assert_eq!(first(&soup, 0), (2, 4, 4, true));
}

#[test]
fn depths_halfway_between_round_by_the_perturbation() {
    // Planes through the node (3, 3, 3), each seen along z, by the slope of depth over x and y.
    let lattice = Lattice { shift: 2, rays: [6; 3], lod: 4 };
    let nearest = |slope_x: i32, slope_y: i32| {
        let depth = |x: i32, y: i32| 3 + slope_x * (x - 3) + slope_y * (y - 3) + 40;
        let corners = [[0, 0], [12, 0], [0, 14]].map(|[x, y]| [x, y, depth(x, y)]);
        let soup = soups::Soup { positions: corners.to_vec(), triangles: vec![[0, 1, 2]] };
        crossings(&lattice, solid(&soup), 2)[0][0].nearest
    };
    assert_eq!(nearest(1, 0), 44);
    assert_eq!(nearest(-1, 0), 42);
    assert_eq!(nearest(0, 1), 44);
    assert_eq!(nearest(0, -1), 42);
    assert_eq!(nearest(2, -1), 44);
    assert_eq!(nearest(-2, 1), 42);
    // ε₁ decides although the slope over y is far greater.
    assert_eq!(nearest(1, -2), 44);
}

#[test]
fn a_ray_through_an_edge_crosses_one_of_its_two_triangles() {
    // The diagonal x + y = 6 runs through the node (3, 3); the perturbed ray has a greater x + y.
    let positions = vec![[0, 6, 2], [6, 0, 2], [0, 0, 2], [6, 6, 2]];
    let soup = soups::Soup { positions, triangles: vec![[2, 1, 0], [0, 1, 3]] };
    let lattice = Lattice { shift: 2, rays: [6; 3], lod: 4 };
    let on_ray = &crossings(&lattice, solid(&soup), 2)[0];
    assert_eq!(on_ray.iter().map(|crossing| crossing.triangle).collect::<Vec<_>>(), [1]);
    // The diagonal x = y runs through the node too; ε₁ ≫ ε₂ puts the perturbed ray where x > y.
    let soup = soups::Soup { triangles: vec![[2, 3, 0], [2, 1, 3]], ..soup };
    let on_ray = &crossings(&lattice, solid(&soup), 2)[0];
    assert_eq!(on_ray.iter().map(|crossing| crossing.triangle).collect::<Vec<_>>(), [1]);
}

#[test]
fn unclosed_rays_have_no_samples_and_are_listed() {
    let mut soup = soups::cuboid([0, 0, 2], [8, 4, 6]);
    soup.add(&soups::cuboid([8, 0, 2], [12, 4, 6]));
    // The near face of the first box is the first quadrilateral seen along z; without one of its triangles, one of
    // the two rays there is open.
    let is_near = |triangle: &[u32; 3]| triangle.iter().all(|&vertex| soup.positions[vertex as usize][2] == 2);
    let near = soup.triangles.iter().position(is_near).expect("a box has a near face");
    soup.triangles.remove(near);
    for fill in FILLS {
        for mode in [Mode::Exact, Mode::Over, Mode::Under] {
            let image = image(&box_lattice(), solid(&soup), 2, mode, fill);
            assert_eq!(image.unclosed.len(), 1);
            let open = image.unclosed[0] as usize;
            assert!(open < 2);
            assert_eq!(image.samples[open], [0; 0]);
            assert_eq!(image.samples[1 - open], [2, 6]);
            assert_eq!(image.samples[2], [2, 6]);
        }
    }
    // Over keeps the least floor of both solids in a voxel where both enter, so this one enters a voxel before.
    let lattice = Lattice { lod: 10, ..box_lattice() };
    let whole = soups::cuboid([0, 0, 0], [16, 12, 20]);
    for mode in [Mode::Exact, Mode::Over, Mode::Under] {
        let both = intersection(&lattice, solid(&whole), solid(&soup), 2, mode, FillRule::EvenOdd);
        assert_eq!(both.unclosed.len(), 1, "{mode:?}");
        assert_eq!(both.samples[2], [2, 6], "{mode:?}");
    }
}

#[test]
fn booleans_drop_empty_intervals_and_merge_touching_ones() {
    let ray = |samples: &[i32]| Image { columns: 1, rows: 1, samples: vec![samples.to_vec()], unclosed: vec![] };
    let result = |operation, a: &[i32], b: &[i32]| boolean(operation, &ray(a), &ray(b)).samples[0].clone();
    assert_eq!(result(Operation::Union, &[2, 4], &[4, 8]), [2, 8]);
    assert_eq!(result(Operation::Union, &[2, 4, 4, 6], &[8, 8]), [2, 6]);
    assert_eq!(result(Operation::Intersection, &[2, 4], &[4, 8]), [0; 0]);
    assert_eq!(result(Operation::Intersection, &[2, 10], &[4, 6, 6, 8]), [4, 8]);
    assert_eq!(result(Operation::Intersection, &[2, 10], &[4, 4]), [0; 0]);
    assert_eq!(result(Operation::Difference, &[2, 10], &[4, 6]), [2, 4, 6, 10]);
    assert_eq!(result(Operation::Difference, &[2, 10], &[2, 10]), [0; 0]);
    assert_eq!(result(Operation::Xor, &[2, 6], &[4, 8]), [2, 4, 6, 8]);
    assert_eq!(result(Operation::Xor, &[2, 6], &[6, 8]), [2, 8]);
    let open = Image { unclosed: vec![0], ..ray(&[]) };
    assert_eq!(boolean(Operation::Union, &open, &ray(&[2, 4])), open);
}

#[test]
fn rotation_rounds_to_even_positions() {
    assert_eq!([-3.0, -1.0, -0.9, 0.9, 1.0, 2.9, 3.0].map(soups::rounded_to_even), [-2, 0, 0, 0, 2, 2, 4]);
    let quarter = std::f64::consts::FRAC_PI_2;
    assert_eq!(soups::rotated([14, 10, 6], [10.0; 3], [0.0, 0.0, 1.0], quarter), [10, 14, 6]);
    assert_eq!(soups::rotated([14, 10, 6], [10.0; 3], [0.0, 2.0, 0.0], quarter), [6, 10, 6]);
}

#[test]
fn soups_are_closed_oriented_even_and_within_their_frame() {
    for_every_soup(&oriented(), 200, |what, frame, soup, _| {
        assert!(soup.is_closed() && soup.is_oriented(), "{what}");
        let mut coordinates = soup.positions.iter().flat_map(|position| position.iter().zip([0, 1, 2]));
        assert!(coordinates.all(|(&p, axis)| p % 2 == 0 && (0..=frame.most(axis)).contains(&p)), "{what}");
        let welded = soup.welded();
        assert!(soup.corners().eq(welded.corners()), "{what}");
    });
    let mut oriented = 0;
    for_every_soup(&[("disoriented", soups::disoriented)], 200, |what, _, soup, _| assert!(soup.is_closed(), "{what}"));
    for seed in 0..200 {
        let mut random = Random::new(seed);
        let frame = random_frame(&mut random);
        oriented += u32::from(soups::disoriented(&mut random, &frame).is_oriented());
    }
    assert!(oriented < 20, "most disoriented soups are, but {oriented} are not");
}

#[test]
fn soups_with_a_missing_or_turned_triangle_are_not_closed_or_not_oriented() {
    let mut soup = soups::octahedron([8, 8, 8], 4);
    soup.triangles.pop();
    assert!(!soup.is_closed() && !soup.is_oriented());
    let mut soup = soups::octahedron([8, 8, 8], 4);
    soup.triangles[0].swap(0, 1);
    assert!(soup.is_closed() && !soup.is_oriented());
}

/// The generators must often produce each of these difficult cases; otherwise tests that use them prove little.
#[test]
fn soups_often_hit_odd_depths_crowded_rays_and_edges() {
    let (mut crossed, mut halfway, mut crowded, mut tied) = (0, 0, 0, 0);
    for (_, generator) in oriented() {
        for seed in 0..40 {
            let mut random = Random::new(seed);
            let frame = random_frame(&mut random);
            let soup = generator(&mut random, &frame);
            let lattice = lattice(&frame, 4);
            for axis in 0..3 {
                for on_ray in crossings(&lattice, solid(&soup), axis) {
                    crossed += on_ray.len();
                    halfway += on_ray.iter().filter(|c| c.ceil == c.floor + 2 && is_halfway(&soup, c, axis)).count();
                    crowded += usize::from(on_ray.len() > 4);
                }
                tied += rays_on_edges(&lattice, &soup, axis);
            }
        }
    }
    assert!(crossed > 50_000, "{crossed} crossings");
    assert!(halfway > 1_000, "{halfway} crossings at odd depths");
    assert!(crowded > 1_000, "{crowded} rays of more than four crossings");
    assert!(tied > 1_000, "{tied} rays through edges");
}

/// Returns whether a crossing may have an odd depth: its triangle is at 45° to this axis and exactly one other.
fn is_halfway(soup: &Soup, crossing: &brute_force::Crossing, axis: usize) -> bool {
    let [a, b, c] = soup.triangles[crossing.triangle as usize].map(|vertex| soup.positions[vertex as usize]);
    let component = |u: usize, v: usize| {
        let edge = |from: [i32; 3], to: [i32; 3], axis: usize| i128::from(to[axis]) - i128::from(from[axis]);
        (edge(a, b, u) * edge(a, c, v) - edge(a, b, v) * edge(a, c, u)).abs()
    };
    let normal = [component(1, 2), component(2, 0), component(0, 1)];
    let (u, v) = [(1, 2), (0, 2), (0, 1)][axis];
    (normal[u] == 0 && normal[v] == normal[axis]) || (normal[v] == 0 && normal[u] == normal[axis])
}

/// Counts the pairs of a ray and an edge that meet exactly, in one view.
fn rays_on_edges(lattice: &Lattice, soup: &Soup, axis: usize) -> usize {
    let (u, v) = [(1, 2), (0, 2), (0, 1)][axis];
    let mut tied = 0;
    for [a, b, _] in soup.corners().flat_map(|[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]]) {
        for row in 0..lattice.rays[v] {
            for column in 0..lattice.rays[u] {
                let ray = [lattice.node(column), lattice.node(row)].map(i128::from);
                let (from, to) = ([a[u], a[v]].map(i128::from), [b[u], b[v]].map(i128::from));
                let side = (to[0] - from[0]) * (ray[1] - from[1]) - (to[1] - from[1]) * (ray[0] - from[0]);
                let between = (ray[0] - from[0]) * (ray[0] - to[0]) < 0;
                tied += usize::from(side == 0 && between);
            }
        }
    }
    tied
}

#[test]
fn every_ray_of_a_closed_soup_closes() {
    let closed = |what: &str, frame: &Frame, soup: &Soup, fill| {
        for axis in 0..3 {
            let exact = image(&lattice(frame, 1), solid(soup), axis, Mode::Exact, fill);
            assert_eq!(exact.unclosed, [0; 0], "{what}, axis {axis}, {fill:?}");
        }
    };
    for_every_soup(&oriented(), 100, |what, frame, soup, _| {
        for fill in FILLS {
            closed(what, frame, soup, fill);
        }
    });
    for_every_soup(&[("disoriented", soups::disoriented)], 200, |what, frame, soup, _| {
        closed(what, frame, soup, FillRule::EvenOdd)
    });
}

#[test]
fn the_three_views_agree_about_every_node() {
    let agree = |what: &str, frame: &Frame, soup: &Soup, fill| {
        let lattice = lattice(frame, 1);
        let [x, y, z] = std::array::from_fn(|axis| {
            node_states(&lattice, &image(&lattice, solid(soup), axis, Mode::Exact, fill), axis)
        });
        assert!(x == y && y == z, "{what}, {fill:?}");
    };
    for_every_soup(&oriented(), 100, |what, frame, soup, _| {
        for fill in FILLS {
            agree(what, frame, soup, fill);
        }
    });
    for_every_soup(&[("disoriented", soups::disoriented)], 200, |what, frame, soup, _| {
        agree(what, frame, soup, FillRule::EvenOdd)
    });
}

/// The state of a node is that of one real point near it, which a ray in an oblique direction tests. Here each ε has a value,
/// small enough for this geometry, in place of the order ε₁ ≫ ε₂ ≫ ε₃.
#[test]
fn node_states_equal_those_of_a_real_point_beside_the_node() {
    // A normal's components stay below 2¹³ on 64 steps, so each ε outweighs all smaller ones by 2¹⁵, and the largest
    // is below 2⁻¹⁵.
    const SCALE: i128 = 1 << 48;
    const EPSILON: [i128; 3] = [1 << 32, 1 << 16, 1];
    const DIRECTION: [i128; 3] = [1009, 757, 541];
    let cross = |a: [i128; 3], b: [i128; 3]| {
        [0, 1, 2].map(|i: usize| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            a[j] * b[k] - a[k] * b[j]
        })
    };
    let dot = |a: [i128; 3], b: [i128; 3]| -> i128 { (0..3).map(|i| a[i] * b[i]).sum() };
    let minus = |a: [i128; 3], b: [i128; 3]| [0, 1, 2].map(|i: usize| a[i] - b[i]);
    let winding_and_parity = |soup: &Soup, point: [i128; 3]| {
        let (mut winding, mut parity) = (0, false);
        for corners in soup.corners() {
            let [a, b, c] = corners.map(|corner| corner.map(i128::from));
            let normal = cross(minus(b, a), minus(c, a));
            // The side of each edge on which the ray's line passes: direction · ((from − point) × (to − point)).
            let side = |from: [i128; 3], to: [i128; 3]| {
                let scaled = cross(from, to).map(|product| product * SCALE);
                dot(DIRECTION, minus(scaled, cross(point, minus(to, from)))).signum()
            };
            let sides = [side(a, b), side(b, c), side(c, a)];
            let facing = dot(DIRECTION, normal).signum();
            assert!(!sides.contains(&0) || normal == [0; 3] || facing == 0, "the direction meets an edge");
            if facing == 0 || sides != [facing; 3] {
                continue;
            }
            let above_plane = dot(normal, minus(point, a.map(|coordinate| coordinate * SCALE))).signum();
            assert_ne!(above_plane, 0, "the point lies in a face");
            if above_plane != facing {
                winding -= facing;
                parity = !parity;
            }
        }
        (winding != 0, parity)
    };
    let frame = Frame { shift: 2, rays: [8, 7, 9] };
    let lattice = lattice(&frame, 1);
    for (name, generator) in oriented() {
        for seed in 0..25 {
            let soup = generator(&mut Random::new(seed), &frame);
            let states =
                FILLS.map(|fill| node_states(&lattice, &image(&lattice, solid(&soup), 2, Mode::Exact, fill), 2));
            let mut index = 0;
            for z in 0..frame.rays[2] {
                for y in 0..frame.rays[1] {
                    for x in 0..frame.rays[0] {
                        let node = [x, y, z].map(|i| i128::from(lattice.node(i)) * SCALE);
                        let point = [0, 1, 2].map(|i: usize| node[i] + EPSILON[i]);
                        let (non_zero, odd) = winding_and_parity(&soup, point);
                        assert_eq!((odd, non_zero), (states[0][index], states[1][index]), "{name}, seed {seed}");
                        index += 1;
                    }
                }
            }
        }
    }
}

#[test]
fn under_lies_within_exact_within_over() {
    let conservative = |what: &str, frame: &Frame, soup: &Soup, random: &mut Random, fill| {
        let lattice = lattice(frame, random_lod(random));
        for axis in 0..3 {
            let [under, exact, over] =
                [Mode::Under, Mode::Exact, Mode::Over].map(|mode| image(&lattice, solid(soup), axis, mode, fill));
            let what = format!("{what}, axis {axis}, {fill:?}, LOD-C {}", lattice.lod);
            assert_conservative(&what, &under, &exact, &over, lattice.length(axis));
        }
    };
    for_every_soup(&oriented(), 150, |what, frame, soup, random| {
        for fill in FILLS {
            conservative(what, frame, soup, random, fill);
        }
    });
    for_every_soup(&[("disoriented", soups::disoriented)], 150, |what, frame, soup, random| {
        // Under the non-zero rule some rays are unclosed; the other rays are still conservative.
        for fill in FILLS {
            conservative(what, frame, soup, random, fill);
        }
    });
}

#[test]
fn conservative_intersections_enclose_the_exact_one() {
    for_every_soup(&oriented(), 60, |what, frame, soup, random| {
        let other = random_oriented(random, frame);
        let lattice = lattice(frame, random_lod(random));
        for (axis, fill) in [(0, FILLS[0]), (1, FILLS[0]), (2, FILLS[0]), (0, FILLS[1]), (1, FILLS[1]), (2, FILLS[1])] {
            let [under, exact, over] = [Mode::Under, Mode::Exact, Mode::Over]
                .map(|mode| intersection(&lattice, solid(soup), solid(&other), axis, mode, fill));
            let what = format!("{what}, axis {axis}, {fill:?}, LOD-C {}", lattice.lod);
            assert_conservative(&what, &under, &exact, &over, lattice.length(axis));
            assert_eq!(exact.unclosed, [0; 0]);
        }
    });
}

/// The masks keep at most two depths a voxel for both solids together. Their image is therefore less tight than a merge of the
/// two solids' own conservative images, but it still encloses the exact one.
#[test]
fn merged_conservative_images_lie_between_the_exact_one_and_the_masks() {
    for_every_soup(&oriented(), 60, |what, frame, soup, random| {
        let other = random_oriented(random, frame);
        let lattice = lattice(frame, random_lod(random));
        for (axis, fill) in [(0, FILLS[0]), (1, FILLS[1]), (2, FILLS[0]), (2, FILLS[1])] {
            let masks = |mode| intersection(&lattice, solid(soup), solid(&other), axis, mode, fill);
            let merged = |mode| {
                let image_of = |soup| image(&lattice, solid(soup), axis, mode, fill);
                boolean(Operation::Intersection, &image_of(soup), &image_of(&other))
            };
            let (exact, over, under) = (masks(Mode::Exact), merged(Mode::Over), merged(Mode::Under));
            let what = format!("{what}, axis {axis}, {fill:?}, LOD-C {}", lattice.lod);
            assert_conservative(&what, &under, &exact, &over, lattice.length(axis));
            assert_eq!(outside(&over, &masks(Mode::Over)), None, "{what}: over");
            assert_eq!(outside(&masks(Mode::Under), &under), None, "{what}: under");
        }
    });
}

#[test]
fn the_masks_of_two_entries_in_one_voxel_keep_the_earlier() {
    let (a, b) = (soups::cuboid([0, 0, 0], [16, 12, 20]), soups::cuboid([0, 0, 2], [16, 12, 18]));
    let lattice = box_lattice();
    let masks = |mode| intersection(&lattice, solid(&a), solid(&b), 2, mode, FillRule::EvenOdd).samples[0].clone();
    assert_eq!(masks(Mode::Over), [0, 20]);
    assert_eq!(masks(Mode::Exact), [2, 18]);
    assert_eq!(masks(Mode::Under), [2, 18]);
}

/// The over-estimate adds and the under-estimate removes only within voxels that hold crossings; elsewhere the three images are
/// equal.
#[test]
fn the_images_differ_only_in_voxels_with_crossings() {
    let local = |what: &str, lattice: &Lattice, axis: usize, solids: &[Solid], over: &Image, under: &Image| {
        let voxel = lattice.voxel(axis);
        let last = i64::from(lattice.lod) - 1;
        let slack = boolean(Operation::Difference, over, under);
        let found = solids.iter().map(|&solid| crossings(lattice, solid, axis)).collect::<Vec<_>>();
        for (ray, samples) in slack.samples.iter().enumerate() {
            let held: std::collections::BTreeSet<i64> = found
                .iter()
                .flat_map(|rays| &rays[ray])
                .map(|crossing| (i64::from(crossing.floor) / voxel).min(last))
                .collect();
            for span in samples.chunks(2) {
                let (first, end) = (i64::from(span[0]) / voxel, (i64::from(span[1]) + voxel - 1) / voxel);
                for z in first..end {
                    assert!(held.contains(&z.min(last)), "{what}, axis {axis}, ray {ray}, voxel {z}: {span:?}");
                }
            }
        }
    };
    for_every_soup(&oriented(), 30, |what, frame, soup, random| {
        let other = random_oriented(random, frame);
        let lattice = lattice(frame, random.choose(&[1, 2, 3, 5, 8, 13, 64, 1024]));
        for (axis, fill) in [(0, FILLS[0]), (1, FILLS[1]), (2, FILLS[0]), (2, FILLS[1])] {
            let one = |mode| image(&lattice, solid(soup), axis, mode, fill);
            local(what, &lattice, axis, &[solid(soup)], &one(Mode::Over), &one(Mode::Under));
            let both = |mode| intersection(&lattice, solid(soup), solid(&other), axis, mode, fill);
            let solids = [solid(soup), solid(&other)];
            local(what, &lattice, axis, &solids, &both(Mode::Over), &both(Mode::Under));
        }
    });
}

#[test]
fn comparisons_find_escapes_malformed_rays_and_wrong_nodes() {
    let frame = Frame { shift: 2, rays: [6; 3] };
    let lattice = lattice(&frame, 3);
    let soup = soups::octahedron([12, 12, 12], 10);
    let of = |mode| image(&lattice, solid(&soup), 2, mode, FillRule::EvenOdd);
    let (under, exact, over) = (of(Mode::Under), of(Mode::Exact), of(Mode::Over));
    assert!(outside(&exact, &under).is_some() && outside(&over, &under).is_some());
    assert_eq!(malformed(&exact, 24), None);
    let middle = exact.samples.iter().position(|samples| !samples.is_empty()).expect("the octahedron is seen");
    for broken in [vec![2], vec![4, 2], vec![2, 3], vec![2, 26], vec![-2, 2]] {
        let mut image = exact.clone();
        image.samples[middle] = broken;
        assert_eq!(malformed(&image, 24), Some(middle));
    }
    let mut longer = exact.clone();
    longer.samples[middle][0] -= 2;
    assert_eq!(outside(&longer, &exact), Some(middle));
    // The agreement of the views detects a sample on the wrong side of a node.
    let other_view = node_states(&lattice, &image(&lattice, solid(&soup), 0, Mode::Exact, FillRule::EvenOdd), 0);
    assert_eq!(other_view, node_states(&lattice, &exact, 2));
    let mut shifted = exact.clone();
    shifted.samples.iter_mut().flatten().for_each(|depth| *depth += 4);
    assert_ne!(other_view, node_states(&lattice, &shifted, 2));
}
