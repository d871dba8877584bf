//! Solids made of cells of a cubic or sheared lattice, compared with a direct count of cells.

use super::*;

const SIDE: usize = 3;

/// The filled cells among 3 × 3 × 3.
#[derive(Clone, Copy, Debug)]
pub struct Cells([[[bool; SIDE]; SIDE]; SIDE]);

impl Cells {
    /// Returns a block of cells.
    pub fn solid(size: [usize; 3]) -> Cells {
        let is_filled = |x, y, z| x < size[0] && y < size[1] && z < size[2];
        Cells(std::array::from_fn(|x| std::array::from_fn(|y| std::array::from_fn(|z| is_filled(x, y, z)))))
    }

    fn random(random: &mut Random) -> Cells {
        let density = random.within(1..10);
        let mut cells = Cells::solid([0; 3]);
        cells.0.iter_mut().flatten().flatten().for_each(|cell| *cell = random.within(0..10) < density);
        cells
    }

    fn has(&self, cell: [i32; 3]) -> bool {
        cell.iter().all(|&c| (0..SIDE as i32).contains(&c)) && {
            let [x, y, z] = cell.map(|c| c as usize);
            self.0[x][y][z]
        }
    }

    fn filled(&self) -> impl Iterator<Item = [i32; 3]> {
        let side = SIDE as i32;
        let all = (0..side * side * side).map(move |i| [i / (side * side), i / side % side, i % side]);
        all.filter(|&cell| self.has(cell))
    }

    /// Returns the faces between filled cells and empty ones, with sides of 1.
    pub fn surface(&self) -> Unit {
        let mut unit = Unit { positions: Vec::new(), triangles: Vec::new() };
        for cell in self.filled() {
            for axis in 0..3 {
                for side in [0, 1] {
                    let mut beyond = cell;
                    beyond[axis] += 2 * side - 1;
                    if !self.has(beyond) {
                        unit.add_face(cell, axis, side);
                    }
                }
            }
        }
        unit
    }
}

/// A surface before it is placed on a lattice.
pub struct Unit {
    positions: Vec<[i32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Unit {
    fn add_face(&mut self, cell: [i32; 3], axis: usize, side: i32) {
        let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| {
            let mut corner = cell;
            corner[axis] += side;
            corner[(axis + 1) % 3] += u;
            corner[(axis + 2) % 3] += v;
            self.vertex(corner)
        });
        let [a, b, c, d] = if side == 1 { corners } else { [corners[0], corners[3], corners[2], corners[1]] };
        self.triangles.extend([[a, b, c], [a, c, d]]);
    }

    fn vertex(&mut self, corner: [i32; 3]) -> u32 {
        let known = self.positions.iter().position(|&position| position == corner);
        known.unwrap_or_else(|| {
            self.positions.push(corner);
            self.positions.len() - 1
        }) as u32
    }

    pub fn map(self, place: impl Fn([i32; 3]) -> [i32; 3]) -> Polyhedron {
        Polyhedron::from_parts(self.positions.into_iter().map(place).collect(), self.triangles)
    }
}

/// A lattice of cells that keep their volume and orientation: a product of shears, and its inverse.
#[derive(Clone, Copy, Debug)]
struct Frame {
    to_lattice: [[i32; 3]; 3],
    to_cells: [[i32; 3]; 3],
}

fn times(matrix: [[i32; 3]; 3], [x, y, z]: [i32; 3]) -> [i32; 3] {
    matrix.map(|[a, b, c]| a * x + b * y + c * z)
}

impl Frame {
    fn upright() -> Frame {
        let identity = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
        Frame { to_lattice: identity, to_cells: identity }
    }

    fn sheared(mut self, random: &mut Random) -> Frame {
        let (i, by) = (random.within(0..3) as usize, 2 * random.within(0..2) - 1);
        let j = (i + random.within(1..3) as usize) % 3;
        // Row i of the map gains row j; column j of the inverse loses column i.
        for k in 0..3 {
            self.to_lattice[i][k] += by * self.to_lattice[j][k];
            self.to_cells[k][j] -= by * self.to_cells[k][i];
        }
        self
    }

    /// Returns the cell coordinates of a movable point, doubled where it lies in no wall and plus or minus 1 where it does.
    fn in_cells(&self, point: [i32; 3]) -> [i32; 3] {
        let place = times(self.to_cells, point);
        std::array::from_fn(|i| {
            let by = self.to_cells[i].into_iter().find(|&by| by != 0).unwrap();
            2 * place[i] + by.signum()
        })
    }
}

/// A solid of cells with the given side, from the given corner on.
#[derive(Clone, Copy, Debug)]
struct Placed {
    cells: Cells,
    side: i32,
    corner: [i32; 3],
}

const FAR: i32 = 1 << 10;

impl Placed {
    fn random(random: &mut Random) -> Placed {
        let side = 2 * random.within(1..4);
        Placed { cells: Cells::random(random), side, corner: random.point(-4..4).map(|c| 2 * c) }
    }

    fn polyhedron(&self, frame: &Frame) -> Polyhedron {
        let place = |cell: [i32; 3]| std::array::from_fn(|i| self.corner[i] + self.side * cell[i]);
        self.cells.surface().map(|cell| times(frame.to_lattice, place(cell)).map(|c| c + FAR))
    }

    fn boxes(&self) -> impl Iterator<Item = [[i32; 3]; 2]> {
        let from = |cell: [i32; 3]| std::array::from_fn(|i| self.corner[i] + self.side * cell[i]);
        self.cells.filled().map(move |cell| [from(cell), from(cell).map(|c| c + self.side)])
    }
}

/// Returns whether a position, doubled and off all walls, is in the sum of any two cells.
fn is_in_sum(a: &Placed, b: &Placed, place: [i32; 3]) -> bool {
    let is_in = |a: [[i32; 3]; 2], b: [[i32; 3]; 2]| {
        (0..3).all(|i| 2 * (a[0][i] + b[0][i]) < place[i] && place[i] < 2 * (a[1][i] + b[1][i]))
    };
    a.boxes().any(|a| b.boxes().any(|b| is_in(a, b)))
}

/// Returns whether any cell of B, reflected and moved to a position, extends beyond A.
fn reaches_out(a: &Placed, b: &Placed, place: [i32; 3]) -> bool {
    let cells_between = |i: usize, b: [[i32; 3]; 2]| {
        let cell = |c: i32| (c - 2 * a.corner[i]).div_euclid(2 * a.side);
        cell(place[i] - 2 * b[1][i])..=cell(place[i] - 2 * b[0][i])
    };
    b.boxes().any(|b| {
        let [x, y, z] = [0, 1, 2].map(|i| cells_between(i, b));
        let column = |x: i32, y: i32| z.clone().all(|z| a.cells.has([x, y, z]));
        !x.into_iter().all(|x| y.clone().all(|y| column(x, y)))
    })
}

#[test]
fn membership_in_sums_of_cells_agrees_with_counting() {
    let mut random = Random::new(1);
    let (mut counts, mut far_counts) = ([0; 2], [0; 2]);
    for round in 0..400 {
        let (a, b) = (Placed::random(&mut random), Placed::random(&mut random));
        let frame = (0..round % 4).fold(Frame::upright(), |frame, _| frame.sheared(&mut random));
        let (solid_a, solid_b) = (a.polyhedron(&frame), b.polyhedron(&frame));
        let sum = SumMembership::new(&solid_a, Exterior::Out, &solid_b);
        let far_sum = SumMembership::new(&solid_a.complement(), Exterior::In, &solid_b);
        let places: Vec<[i32; 3]> = (0..100).map(|_| random.point(-20..50)).collect();
        let points = || places.iter().map(|&place| times(frame.to_lattice, place).map(|c| c + 2 * FAR));
        for (sum, counts, expected) in [
            (sum, &mut counts, is_in_sum as fn(&Placed, &Placed, [i32; 3]) -> bool),
            (far_sum, &mut far_counts, reaches_out),
        ] {
            for (point, answer) in answers(&sum, points()) {
                let place = frame.in_cells(point.map(|c| c - 2 * FAR));
                assert_eq!(answer, expected(&a, &b, place), "{point:?}, {a:?}, {b:?}, {frame:?}");
                counts[usize::from(answer)] += 1;
            }
        }
    }
    assert!(counts.iter().chain(&far_counts).all(|&count| count > 300), "{counts:?}, {far_counts:?}");
}
