//! Decision diagrams: expressions for a device, which has no memory to keep count of the operands of every ray.
//!
//! Bryant 1986 (Graph-Based Algorithms for Boolean Function Manipulation). A node asks for one leaf and leads on to another node,
//! or to the result. On every way leaves are asked for in their order, no two nodes are equal, and each leads to two different ones.
//! So a union of n leaves has n nodes.

use std::collections::HashMap;

/// The nodes that give the result at once: 0 and 1.
const FALSE: u32 = 0;
const TRUE: u32 = 1;

/// Most nodes of a diagram, and most nodes and choices that its construction may take.
const MOST_NODES: usize = 1 << 14;
const MOST_BUILT: usize = 1 << 16;

/// A node: the leaf it asks for, and where to go if that is not inside, and if it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Node {
    leaf: u32,
    next: [u32; 2],
}

/// The result of an expression, by the leaves that a point is in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagram {
    /// Node i + 2; it leads to nodes of smaller numbers.
    nodes: Vec<Node>,
    root: u32,
}

impl Diagram {
    /// Most leaves.
    pub const MOST_LEAVES: usize = 64;

    /// Returns the number of leaves that it may ask for.
    pub fn leaves(&self) -> usize {
        self.nodes.iter().map(|node| node.leaf as usize + 1).max().unwrap_or(0)
    }

    /// Returns whether a point is in the result, given whether it is in each leaf.
    pub fn holds(&self, is_inside: impl Fn(usize) -> bool) -> bool {
        let mut at = self.root;
        while at > TRUE {
            let Node { leaf, next } = self.nodes[at as usize - 2];
            at = next[usize::from(is_inside(leaf as usize))];
        }
        at == TRUE
    }

    /// Returns the first node, and then the three numbers of each from node 2 on: its leaf, where to go outside it, and inside.
    #[cfg(any(feature = "gpu", test))]
    pub(crate) fn words(&self) -> Vec<u32> {
        let nodes = self.nodes.iter().flat_map(|node| [node.leaf, node.next[0], node.next[1]]);
        std::iter::once(self.root).chain(nodes).collect()
    }

    /// Returns the results in all states of some leaves: bit `s` where the leaves inside are the bits of `s`.
    #[cfg(feature = "gpu")]
    pub(crate) fn table(&self, leaves: usize) -> Vec<u32> {
        let mut words = vec![0; (1usize << leaves).div_ceil(32)];
        for state in (0..1usize << leaves).filter(|state| self.holds(|leaf| state >> leaf & 1 == 1)) {
            words[state / 32] |= 1 << (state % 32);
        }
        words
    }
}

/// A diagram under construction; its nodes stand for results, by number. Functions return `None` where there are too many.
#[derive(Debug, Default)]
pub(crate) struct Builder {
    nodes: Vec<Node>,
    numbers: HashMap<Node, u32>,
    /// The results of `choose`.
    chosen: HashMap<[u32; 3], u32>,
}

impl Builder {
    pub fn never() -> u32 {
        FALSE
    }

    pub fn always() -> u32 {
        TRUE
    }

    /// Returns the result that is a leaf.
    pub fn leaf(&mut self, leaf: usize) -> Option<u32> {
        self.node(leaf as u32, [FALSE, TRUE])
    }

    pub fn not(&mut self, a: u32) -> Option<u32> {
        self.choose([a, FALSE, TRUE])
    }

    pub fn both(&mut self, a: u32, b: u32) -> Option<u32> {
        self.choose([a, b, FALSE])
    }

    pub fn any(&mut self, a: u32, b: u32) -> Option<u32> {
        self.choose([a, TRUE, b])
    }

    pub fn xor(&mut self, a: u32, b: u32) -> Option<u32> {
        let other = self.not(b)?;
        self.choose([a, other, b])
    }

    fn node(&mut self, leaf: u32, next: [u32; 2]) -> Option<u32> {
        let node = Node { leaf, next };
        if next[0] == next[1] || self.numbers.contains_key(&node) {
            return Some(self.numbers.get(&node).copied().unwrap_or(next[0]));
        }
        if self.nodes.len() == MOST_BUILT {
            return None;
        }
        self.nodes.push(node);
        let number = self.nodes.len() as u32 + TRUE;
        self.numbers.insert(node, number);
        Some(number)
    }

    /// Returns the second result where the first holds, and the third where it does not.
    fn choose(&mut self, of @ [a, b, c]: [u32; 3]) -> Option<u32> {
        match (a, b, c) {
            (TRUE, ..) => return Some(b),
            (FALSE, ..) => return Some(c),
            (_, TRUE, FALSE) => return Some(a),
            _ if b == c => return Some(b),
            _ => {}
        }
        if let Some(&known) = self.chosen.get(&of) {
            return Some(known);
        }
        if self.chosen.len() >= MOST_BUILT {
            return None;
        }
        let node = |number: u32| number.checked_sub(2).map(|at| self.nodes[at as usize]);
        let nodes = of.map(node);
        let leaf = nodes.iter().flatten().map(|node| node.leaf).min()?;
        let [outside, inside] = [0, 1].map(|side| {
            let next = |i: usize| nodes[i].filter(|node| node.leaf == leaf).map_or(of[i], |node| node.next[side]);
            [next(0), next(1), next(2)]
        });
        let next = [self.choose(outside)?, self.choose(inside)?];
        let chosen = self.node(leaf, next)?;
        self.chosen.insert(of, chosen);
        Some(chosen)
    }

    /// Returns the diagram of a result: the nodes that lead to it.
    pub fn finish(self, root: u32) -> Option<Diagram> {
        let mut is_needed = vec![false; self.nodes.len()];
        let mut numbers: Vec<u32> = vec![FALSE, TRUE];
        numbers.resize(self.nodes.len() + 2, FALSE);
        let mut waiting = vec![root];
        while let Some(at) = waiting.pop().map(|number| number as usize) {
            if at > 1 && !std::mem::replace(&mut is_needed[at - 2], true) {
                waiting.extend(self.nodes[at - 2].next);
            }
        }
        let mut nodes = Vec::new();
        // Nodes lead to earlier ones.
        for at in (0..is_needed.len()).filter(|&at| is_needed[at]) {
            let Node { leaf, next } = self.nodes[at];
            nodes.push(Node { leaf, next: next.map(|number| numbers[number as usize]) });
            numbers[at + 2] = nodes.len() as u32 + TRUE;
        }
        (nodes.len() <= MOST_NODES).then(|| Diagram { nodes, root: numbers[root as usize] })
    }
}
