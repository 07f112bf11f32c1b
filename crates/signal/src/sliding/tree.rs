//! An order-statistic tree.

/// The null index.
const NONE: u32 = u32::MAX;

/// A treap: a search tree kept shallow by deterministic pseudo-random priorities. Seidel & Aragon (1996),
/// doi:10.1007/BF01940876. Each value has an index; all nodes are allocated at the start.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    root: u32,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    value: f64,
    left: u32,
    right: u32,
    /// The size of the subtree; 0 for an empty node.
    count: u32,
}

const EMPTY: Node = Node { value: 0.0, left: NONE, right: NONE, count: 0 };

impl Tree {
    pub(super) fn new(places: usize) -> Tree {
        Tree { nodes: vec![EMPTY; places], root: NONE }
    }

    pub(super) fn places(&self) -> usize {
        self.nodes.len()
    }

    pub(super) fn count(&self) -> usize {
        self.count_below(self.root) as usize
    }

    /// Inserts a value at an empty index.
    pub(super) fn insert(&mut self, place: usize, value: f64) {
        let place = place as u32;
        self.nodes[place as usize] = Node { value, count: 1, ..EMPTY };
        let (before, after) = self.split(self.root, place);
        let with = self.joined(before, place);
        self.root = self.joined(with, after);
    }

    /// Removes the value at an index, if any.
    pub(super) fn remove(&mut self, place: usize) {
        if self.nodes[place].count > 0 {
            self.root = self.without(self.root, place as u32);
            self.nodes[place] = EMPTY;
        }
    }

    /// The value of a rank, from 0.
    pub(super) fn ranked(&self, mut rank: usize) -> Option<f64> {
        let mut at = self.root;
        while at != NONE {
            let node = self.nodes[at as usize];
            let before = self.count_below(node.left) as usize;
            match rank.cmp(&before) {
                std::cmp::Ordering::Less => at = node.left,
                std::cmp::Ordering::Equal => return Some(node.value),
                std::cmp::Ordering::Greater => {
                    rank -= before + 1;
                    at = node.right;
                }
            }
        }
        None
    }

    /// Splits the tree into the nodes ordered before `place`, and the others.
    fn split(&mut self, at: u32, place: u32) -> (u32, u32) {
        if at == NONE {
            return (NONE, NONE);
        }
        let node = self.nodes[at as usize];
        if self.is_before(at, place) {
            let (before, after) = self.split(node.right, place);
            (self.with_children(at, node.left, before), after)
        } else {
            let (before, after) = self.split(node.left, place);
            (before, self.with_children(at, after, node.right))
        }
    }

    /// Joins two trees; all of the first are ordered before all of the second.
    fn joined(&mut self, first: u32, second: u32) -> u32 {
        if first == NONE || second == NONE {
            return if first == NONE { second } else { first };
        }
        let (one, other) = (self.nodes[first as usize], self.nodes[second as usize]);
        if priority(first) > priority(second) {
            let right = self.joined(one.right, second);
            self.with_children(first, one.left, right)
        } else {
            let left = self.joined(first, other.left);
            self.with_children(second, left, other.right)
        }
    }

    fn without(&mut self, at: u32, place: u32) -> u32 {
        let node = self.nodes[at as usize];
        if at == place {
            self.joined(node.left, node.right)
        } else if self.is_before(at, place) {
            let right = self.without(node.right, place);
            self.with_children(at, node.left, right)
        } else {
            let left = self.without(node.left, place);
            self.with_children(at, left, node.right)
        }
    }

    fn with_children(&mut self, at: u32, left: u32, right: u32) -> u32 {
        let count = 1 + self.count_below(left) + self.count_below(right);
        let node = &mut self.nodes[at as usize];
        (node.left, node.right, node.count) = (left, right, count);
        at
    }

    fn count_below(&self, at: u32) -> u32 {
        if at == NONE { 0 } else { self.nodes[at as usize].count }
    }

    /// Equal values are ordered by index.
    fn is_before(&self, one: u32, other: u32) -> bool {
        let value = |at: u32| self.nodes[at as usize].value;
        value(one).total_cmp(&value(other)).then(one.cmp(&other)).is_lt()
    }
}

/// The finaliser of splitmix64: pseudo-random, and the same in every run.
fn priority(place: u32) -> u64 {
    let mut mixed = u64::from(place).wrapping_add(0x9e37_79b9_7f4a_7c15);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}
