//! A priority queue of nodes by radius, in levels of 1/64 of a pitch.

/// Levels in a pitch.
pub(super) const LEVELS: f32 = 64.0;

/// Nodes of a block: with its two other words, 128 bytes.
const BLOCK: usize = 30;

/// The index that denotes no block.
const NONE: u32 = u32::MAX;

struct Block {
    next: u32,
    filled: u32,
    nodes: [u32; BLOCK],
}

/// A bucket queue of nodes by bottleneck radius, widest first. A node must not be wider than the last one popped when it is
/// pushed, so that a stack for each level is enough. Emptied blocks are reused, so the memory used is that of the waiting
/// nodes.
pub(super) struct Queue {
    blocks: Vec<Block>,
    /// The first of the unused blocks.
    spare: u32,
    /// The first block of each level.
    levels: Vec<u32>,
    /// No level above this has nodes.
    top: usize,
}

impl Queue {
    /// Creates a queue for radii up to `widest`; wider ones count as that.
    pub fn new(widest: f32) -> Queue {
        let levels = (widest * LEVELS) as usize + 1;
        Queue { blocks: Vec::new(), spare: NONE, levels: vec![NONE; levels], top: levels - 1 }
    }

    /// Pushes a node with a radius.
    pub fn push(&mut self, radius: f32, node: u32) {
        let level = ((radius * LEVELS) as usize).min(self.levels.len() - 1);
        let first = self.levels[level];
        if first != NONE && (self.blocks[first as usize].filled as usize) < BLOCK {
            let block = &mut self.blocks[first as usize];
            block.nodes[block.filled as usize] = node;
            block.filled += 1;
            return;
        }
        let mut nodes = [0; BLOCK];
        nodes[0] = node;
        let block = Block { next: first, filled: 1, nodes };
        self.levels[level] = if self.spare == NONE {
            self.blocks.push(block);
            (self.blocks.len() - 1) as u32
        } else {
            let at = self.spare;
            self.spare = std::mem::replace(&mut self.blocks[at as usize], block).next;
            at
        };
    }

    /// Pops one of the widest nodes, with the lower bound of its level.
    pub fn pop(&mut self) -> Option<(f32, u32)> {
        while self.levels[self.top] == NONE {
            self.top = self.top.checked_sub(1)?;
        }
        let first = self.levels[self.top];
        let block = &mut self.blocks[first as usize];
        block.filled -= 1;
        let node = block.nodes[block.filled as usize];
        if block.filled == 0 {
            self.levels[self.top] = block.next;
            block.next = self.spare;
            self.spare = first;
        }
        Some((self.top as f32 / LEVELS, node))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_queue_pops_the_widest_first_and_reuses_blocks() {
        let mut queue = Queue::new(16.0);
        let radius = |node: u32| (node * 7919 % 1000) as f32 / 1000.0 * 16.0;
        (0..1000).for_each(|node| queue.push(radius(node), node));
        let mut last = f32::INFINITY;
        let mut left = 0;
        while let Some((least, node)) = queue.pop() {
            let now = if node < 1000 { radius(node) } else { radius(node - 1000) / 2.0 };
            assert!((least..least + 1.0 / LEVELS).contains(&now), "{now} at {least}");
            assert!(now < last + 1.0 / LEVELS, "{now} after {last}");
            last = now;
            left += 1;
            if node < 1000 {
                queue.push(now / 2.0, node + 1000);
            }
        }
        assert_eq!(left, 2000);
        assert!(queue.blocks.len() < 1100, "{}", queue.blocks.len());
    }
}
