//! Tests of the shaders' exact arithmetic alone: crossings of triangles for which floating point has no correct digit.
//!
//! Every kind of triangle is made for the view along one axis and sampled along all three. The meshes are open, so the tests
//! compare lists of crossings, which need no closed ray.

use ldi_ops::grid::Axis;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::Route;

use crate::comparison::assert_same;
use crate::on_lattice::{grid, mesh};
use crate::soups::{Frame, Soup};
use crate::testing::random::Random;
use crate::twin::{self, Twin};

/// The corners of a triangle by column, row and depth.
type Seen = [[i32; 3]; 3];

/// The cube that a triangle is made for: pixels of 2^shift steps, and the greatest even position.
struct Cube {
    shift: u32,
    rays: u32,
    most: i32,
}

impl Cube {
    /// Draws any even position.
    fn even(&self, random: &mut Random) -> i32 {
        random.even(0, self.most)
    }

    /// Draws either end, or any even position.
    fn extreme(&self, random: &mut Random) -> i32 {
        let anywhere = self.even(random);
        random.choose(&[0, self.most, anywhere, anywhere])
    }

    /// Draws the position of a ray, which is odd.
    fn ray(&self, random: &mut Random) -> i32 {
        ((random.below(self.rays as usize) as i32) << self.shift) + (1 << (self.shift - 1)) + 1
    }

    /// Draws a triangle whose depth is `depth` at the middle and changes by `slope.0 / divisor` a column and `slope.1 / divisor`
    /// a row, if it lies in the cube.
    fn sloping(&self, random: &mut Random, slope: [i64; 2], divisor: i64, reach: i64) -> Option<Seen> {
        let middle = [self.ray(random), self.ray(random)].map(|ray| i64::from(ray) + random.choose(&[-1, 1]));
        let depth = i64::from(self.most / 4 + random.even(0, self.most / 4 / 2 * 2) / 2) / 2 * 2;
        let corner = |random: &mut Random| {
            let steps = reach / (2 * divisor);
            let [column, row] = [(); 2].map(|()| random.between(-steps as i32, steps as i32) as i64 * 2);
            let at =
                [middle[0] + column * divisor, middle[1] + row * divisor, depth + slope[0] * column + slope[1] * row];
            let inside = at.iter().all(|position| (0..=i64::from(self.most)).contains(position));
            inside.then(|| at.map(|position| position as i32))
        };
        Some([corner(random)?, corner(random)?, corner(random)?])
    }

    /// Draws the reach of a triangle of `sloping`, and a slope that keeps a triangle of this reach in the cube.
    fn reach(&self, random: &mut Random, divisor: i64) -> (i64, i64) {
        let reach =
            (i64::from(self.most) >> random.between(1, 31 - self.most.leading_zeros() as i32 - 3)).max(2 * divisor);
        (reach, (i64::from(self.most) * divisor / (4 * reach)).max(2))
    }
}

fn anywhere(random: &mut Random, cube: &Cube) -> Option<Seen> {
    Some([(); 3].map(|()| [(); 3].map(|()| cube.even(random))))
}

/// A triangle two steps wide and as high as the cube, about a column of rays: the depth changes by up to half the cube in one
/// step.
fn across_a_column(random: &mut Random, cube: &Cube) -> Option<Seen> {
    let column = cube.ray(random);
    let beside = |random: &mut Random| column + random.choose(&[-1, 1]);
    let low = random.choose(&[0, 2, cube.most / 4 / 2 * 2]);
    Some([
        [column - 1, low, cube.even(random)],
        [column + 1, low + random.choose(&[0, 2]), cube.even(random)],
        [beside(random), cube.most - random.choose(&[0, 2]), cube.even(random)],
    ])
}

/// A triangle along the diagonal, through rays or a few steps beside them: large terms nearly cancel.
fn along_a_diagonal(random: &mut Random, cube: &Cube) -> Option<Seen> {
    Some([(); 3].map(|()| {
        let along = random.even(8, cube.most - 8);
        [along, along + random.even(-8, 8), cube.extreme(random)]
    }))
}

/// A triangle about one ray and a few steps wide, almost parallel to the ray.
fn around_a_ray(random: &mut Random, cube: &Cube) -> Option<Seen> {
    let (column, row) = (cube.ray(random), cube.ray(random));
    let beside = |random: &mut Random, ray: i32| (ray + random.choose(&[-3, -1, -1, 1, 1, 3])).clamp(0, cube.most);
    Some([(); 3].map(|()| [beside(random, column), beside(random, row), cube.extreme(random)]))
}

/// A triangle whose slopes are integers of even sum: all depths at rays are even integers.
fn even_depths(random: &mut Random, cube: &Cube) -> Option<Seen> {
    let (reach, steepest) = cube.reach(random, 1);
    let slope = random.between(-steepest as i32, steepest as i32) as i64;
    let other = slope % 2 + 2 * random.between(-steepest as i32 / 2, steepest as i32 / 2) as i64;
    cube.sloping(random, [slope, other], 1, reach)
}

/// A triangle whose slopes are integers of odd sum: all depths at rays are odd integers, which is a tie.
fn odd_depths(random: &mut Random, cube: &Cube) -> Option<Seen> {
    let (reach, steepest) = cube.reach(random, 1);
    let slope = random.between(-steepest as i32, steepest as i32) as i64;
    let other = 1 - (slope % 2).abs() + 2 * random.between(-steepest as i32 / 2, steepest as i32 / 2 - 1) as i64;
    let slopes = random.choose(&[[slope, other], [other, slope]]);
    cube.sloping(random, slopes, 1, reach)
}

/// A triangle whose slopes are integers but for one corner that is two steps aside: depths are as near to integers as possible.
fn next_to_integers(random: &mut Random, cube: &Cube) -> Option<Seen> {
    let seen = random.choose(&[even_depths, odd_depths])(random, cube);
    seen.map(|mut seen| {
        let corner = &mut seen[random.below(3)];
        corner[2] = (corner[2] + random.choose(&[-2, 2])).clamp(0, cube.most);
        seen
    })
}

/// A triangle whose slopes are fractions: some depths are integers, and the others are halves, thirds, fifths or sevenths.
fn fractions(random: &mut Random, cube: &Cube) -> Option<Seen> {
    let divisor = random.choose(&[2, 3, 5, 7]);
    let (reach, steepest) = cube.reach(random, divisor);
    let slope = [(); 2].map(|()| random.between(-steepest as i32, steepest as i32) as i64);
    cube.sloping(random, slope, divisor, reach)
}

type Kind = fn(&mut Random, &Cube) -> Option<Seen>;

const KINDS: [(&str, Kind); 8] = [
    ("anywhere", anywhere),
    ("across a column", across_a_column),
    ("along a diagonal", along_a_diagonal),
    ("around a ray", around_a_ray),
    ("even depths", even_depths),
    ("odd depths", odd_depths),
    ("next to integers", next_to_integers),
    ("fractions", fractions),
];

/// Cubes with pixels from four steps to half the lattice, and as many as fit; and pixels of few steps, where every depth is near
/// a tie.
const CUBES: [(u32, u32); 9] = [(29, 1), (28, 3), (27, 7), (26, 15), (25, 31), (24, 60), (12, 40), (4, 50), (2, 64)];

/// The number of triangles of a mesh.
const TRIANGLES: usize = 400;

/// The number of crossings that each kind has to give along each axis.
const CROSSINGS: usize = 4000;

fn soup_for(random: &mut Random, cube: &Cube, axis: Axis, kind: Kind) -> Soup {
    let mut soup = Soup::default();
    while soup.triangles.len() < TRIANGLES {
        let Some(seen) = kind(random, cube) else { continue };
        let first = soup.positions.len() as u32;
        soup.triangles.push([first, first + 1, first + 2]);
        soup.positions.extend(seen.map(|[column, row, depth]| {
            let mut position = [0; 3];
            (position[axis.column()], position[axis.row()], position[axis.depth()]) = (column, row, depth);
            position
        }));
    }
    soup
}

#[test]
fn extreme_triangles_have_equal_crossings_on_cpu_and_gpu() {
    // The list routes all give the same lists of crossings, so one route is enough.
    let twins: Vec<&Twin> = twin::all().iter().filter(|twin| twin.options.route == Route::Lists).collect();
    for (name, kind) in KINDS {
        for axis in Axis::ALL {
            let mut random = Random::new(axis.depth() as u64);
            let mut crossings = [0; 3];
            for (shift, rays) in CUBES.into_iter().cycle() {
                let frame = Frame { shift, rays: [rays; 3] };
                let cube = Cube { shift, rays, most: frame.side() };
                let mesh = mesh(&soup_for(&mut random, &cube, axis, kind));
                let solid = grid(&frame, 64).quantise_open(&mesh).unwrap();
                for view in Axis::ALL {
                    let expected = CpuSampler::default().list_stages(&solid, view);
                    for twin in &twins {
                        let found = twin.gpu.list_stages(&solid, view);
                        let what = format_args!("{name} along {axis:?}, {shift}, {rays}, {view:?}; {}", twin.name());
                        assert_same(what, &found, &expected);
                    }
                    if view == axis {
                        // Bits 1 and 2 encode the offset of the depth above an even integer: zero, less than one, or more.
                        for crossing in expected.unwrap().crossings {
                            crossings[(crossing >> 1 & 3) as usize] += 1;
                        }
                    }
                }
                if crossings.iter().sum::<usize>() > CROSSINGS && rays == 64 {
                    break;
                }
            }
            let [even, below, above] = crossings;
            match name {
                "even depths" => assert_eq!([below, above], [0, 0], "{name}, {axis:?}"),
                "odd depths" => assert!(even == 0 && below + above > CROSSINGS, "{name}, {axis:?}: {crossings:?}"),
                _ => assert!(below > 100 && above > 100, "{name}, {axis:?}: {crossings:?}"),
            }
        }
    }
}
