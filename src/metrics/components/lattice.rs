//! Pieces of a periodic cell: their unions across its faces, and the directions in which they are endless.
//!
//! A piece of the cell that meets another across a face forms one piece with it, displaced by a cell. So pieces are joined by a
//! union–find, each with its displacement from the root of its set. Where two pieces of one set meet with a displacement other
//! than theirs, there is a path from the piece to its own image that many cells away: a *winding*, and the piece is endless in
//! that direction.

/// A displacement in cells.
pub(super) type Cells = [i64; 3];

/// Independent displacements at which a piece meets its own images, three at most.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Windings(Vec<Cells>);

impl Windings {
    /// Adds a displacement, unless it is a combination of the present ones.
    pub fn add(&mut self, way: Cells) {
        let is_new = match self.0[..] {
            [] => way != [0; 3],
            [a] => cross(a, way) != [0; 3],
            [a, b] => cross(a, b).iter().zip(way).map(|(&n, w)| n * i128::from(w)).sum::<i128>() != 0,
            _ => false,
        };
        if is_new {
            self.0.push(way);
        }
    }

    /// Adds all displacements of another piece.
    pub fn extend(&mut self, other: &Windings) {
        other.0.iter().for_each(|&way| self.add(way));
    }

    /// Returns the number of independent directions.
    pub fn rank(&self) -> usize {
        self.0.len()
    }
}

fn cross(a: Cells, b: Cells) -> [i128; 3] {
    let [a, b] = [a, b].map(|v| v.map(i128::from));
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// A union–find of pieces, with displacements.
pub(super) struct Displaced {
    parents: Vec<u32>,
    /// The displacement from the parent.
    displacements: Vec<Cells>,
    windings: Vec<Windings>,
}

impl Displaced {
    /// Creates `count` separate pieces.
    pub fn new(count: u32) -> Displaced {
        Displaced {
            parents: (0..count).collect(),
            displacements: vec![[0; 3]; count as usize],
            windings: vec![Windings::default(); count as usize],
        }
    }

    /// Returns the root of a piece, the lowest of its set, and the displacement from there.
    pub fn find(&mut self, piece: u32) -> (u32, Cells) {
        let mut path = Vec::new();
        let mut root = piece;
        while self.parents[root as usize] != root {
            path.push(root);
            root = self.parents[root as usize];
        }
        let mut total = [0; 3];
        for &piece in path.iter().rev() {
            total = plus(total, self.displacements[piece as usize]);
            (self.parents[piece as usize], self.displacements[piece as usize]) = (root, total);
        }
        (root, total)
    }

    /// Records that piece `a` meets the image of piece `b` in the cell displaced by `by`.
    pub fn meet(&mut self, a: u32, b: u32, by: Cells) {
        let ((a, from_a), (b, from_b)) = (self.find(a), self.find(b));
        // The position of the root of b, relative to the root of a.
        let apart = minus(plus(from_a, by), from_b);
        if a == b {
            self.windings[a as usize].add(apart);
            return;
        }
        let (root, under, apart) = if a < b { (a, b, apart) } else { (b, a, minus([0; 3], apart)) };
        (self.parents[under as usize], self.displacements[under as usize]) = (root, apart);
        let ways = std::mem::take(&mut self.windings[under as usize]);
        self.windings[root as usize].extend(&ways);
    }

    /// Returns the displacements at which the set of a root meets its own images.
    pub fn windings(&self, root: u32) -> &Windings {
        &self.windings[root as usize]
    }
}

fn plus(a: Cells, b: Cells) -> Cells {
    std::array::from_fn(|i| a[i] + b[i])
}

fn minus(a: Cells, b: Cells) -> Cells {
    std::array::from_fn(|i| a[i] - b[i])
}
