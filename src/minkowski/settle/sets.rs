//! Sets of open nodes, united as they are found to touch.

/// The set of all nodes that are certainly out.
pub const OUT: u32 = 0;

/// The set of all nodes that are certainly in.
pub const IN: u32 = 1;

/// Disjoint sets, each known by its least element, so that no order of unions changes a name.
#[derive(Debug)]
pub struct Sets {
    /// None is greater than its element.
    parents: Vec<u32>,
}

/// [`OUT`] and [`IN`] were to be united.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contradiction;

impl Sets {
    /// `open` elements, from 2 on, beside [`OUT`] and [`IN`].
    pub fn new(open: u32) -> Sets {
        Sets { parents: (0..open + IN + 1).collect() }
    }

    /// Adds elements up to the given number of all.
    pub fn grow(&mut self, len: u32) {
        self.parents.extend(self.len()..len);
    }

    /// Elements, [`OUT`] and [`IN`] among them.
    pub fn len(&self) -> u32 {
        self.parents.len() as u32
    }

    /// Whether an element is the least of its set.
    pub fn is_root(&self, element: u32) -> bool {
        self.parents[element as usize] == element
    }

    /// The least element of a set. Halves the path to it.
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

    /// Makes two sets one.
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

    /// Numbers the sets by their least elements: the number of each element's set, and the elements that are least, those of
    /// [`OUT`] and [`IN`] left out.
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
