//! A union–find of the sets of open nodes.

/// The set of all nodes that are certainly out.
pub const OUT: u32 = 0;

/// The set of all nodes that are certainly in.
pub const IN: u32 = 1;

/// A union–find whose representatives are the least elements, so that the order of unions does not matter.
#[derive(Debug)]
pub struct Sets {
    /// No parent is greater than its element.
    parents: Vec<u32>,
}

/// The error of uniting [`OUT`] and [`IN`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contradiction;

impl Sets {
    /// Creates `open` elements, from 2 on, besides [`OUT`] and [`IN`].
    pub fn new(open: u32) -> Sets {
        Sets { parents: (0..open + IN + 1).collect() }
    }

    /// Adds elements up to the given total number.
    pub fn grow(&mut self, len: u32) {
        self.parents.extend(self.len()..len);
    }

    /// Returns the number of elements, including [`OUT`] and [`IN`].
    pub fn len(&self) -> u32 {
        self.parents.len() as u32
    }

    /// Returns whether an element is the least of its set.
    pub fn is_root(&self, element: u32) -> bool {
        self.parents[element as usize] == element
    }

    /// Returns the least element of a set. Halves the path to it.
    pub fn root(&mut self, mut element: u32) -> u32 {
        loop {
            let parent = self.parents[element as usize];
            if parent == element {
                return element;
            }
            let next = self.parents[parent as usize];
            self.parents[element as usize] = next;
            element = next;
        }
    }

    /// Unites two sets.
    #[inline]
    pub fn unite(&mut self, a: u32, b: u32) -> Result<(), Contradiction> {
        let (a, b) = (self.root(a), self.root(b));
        let (least, other) = (a.min(b), a.max(b));
        if (least, other) == (OUT, IN) {
            return Err(Contradiction);
        }
        self.parents[other as usize] = least;
        Ok(())
    }

    /// Numbers the sets by their least elements. Returns the number of each element's set, and the least elements without
    /// [`OUT`] and [`IN`].
    pub fn number(mut self) -> (Vec<u32>, Vec<u32>) {
        let mut least = Vec::new();
        for element in IN + 1..self.len() {
            let parent = self.parents[element as usize];
            self.parents[element as usize] = if parent == element {
                least.push(element);
                least.len() as u32 + IN
            } else {
                // The parent comes first, and has its number.
                self.parents[parent as usize]
            };
        }
        (self.parents, least)
    }
}
