//! Nested dissection by coordinates: the order of elimination of the core.
//!
//! Dead reckoning says roughly where every place is, so a straight line through the median parts the map in two; the few
//! places at which springs cross it (a least vertex cover of them) are eliminated last, and the halves are parted in the
//! same way (George 1973). The separators are the supernodes of the factor, their nesting is its assembly tree. Where
//! coordinates mislead, because odometry has drifted too far or because they say nothing at all, breadth-first layers do
//! instead.

use nalgebra::{Point2, Vector2};

use super::compliance::Compliance;
use super::graph::{Graph, Springs};
use super::minimum_degree::{self, Block, Group, Neighbours};
use super::separator::Cover;

/// Unknowns that are eliminated together, as the columns `first..end` of the factor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Supernode {
    pub(crate) first: u32,
    pub(crate) end: u32,
    /// The supernode that takes what this one leaves behind, `u32::MAX` for none.
    pub(crate) parent: u32,
}

/// An order of elimination.
#[derive(Debug, Clone)]
pub(crate) struct Order {
    /// The node at each position; anchors are not among them.
    pub(crate) node: Vec<u32>,
    /// The position of each node, `u32::MAX` for anchors.
    pub(crate) position: Vec<u32>,
    /// Children before parents.
    pub(crate) supernodes: Vec<Supernode>,
}

/// Sets no larger than this are not parted: minimum degree orders them better, and in less time.
const BLOCK: usize = minimum_degree::LARGEST;

/// A separator is suspiciously large above this many times the square root of what it parts: the coordinates mislead.
const SUSPICIOUS: f64 = 3.0;

/// How far from the middle a set may be parted for the sake of a smaller separator, in percent of its nodes.
const LATITUDE: usize = 6;

/// A node and where it seems to be: each coordinate as a number that sorts like it, the node's number in the last 32 bits.
#[derive(Debug, Clone, Copy)]
struct Item {
    x: u64,
    y: u64,
}

impl Item {
    #[expect(clippy::cast_possible_truncation, reason = "coordinates need no more than to be compared")]
    fn new(place: Vector2<f64>, node: u32) -> Self {
        let key = |coordinate: f64| u64::from(sortable(coordinate as f32)) << 32 | u64::from(node);
        Self { x: key(place.x), y: key(place.y) }
    }

    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "the last 32 bits are the node")]
    fn node(self) -> u32 {
        self.x as u32
    }
}

/// A number that sorts like `value`.
fn sortable(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}

/// The value of a key.
fn coordinate(key: u64) -> f32 {
    let bits = (key >> 32) as u32;
    f32::from_bits(if bits >> 31 == 1 { bits ^ 1 << 31 } else { !bits })
}

struct Dissector<'a, C> {
    graph: &'a Graph<C>,
    /// Which half each node is in: a number given to no other half.
    side: Vec<u32>,
    next_side: u32,
    frontier: Vec<u32>,
    separator: Vec<u32>,
    cover: Cover,
    supernodes: Vec<Supernode>,
    /// Supernodes that have no parent yet.
    orphans: Vec<u32>,
    /// A number for each node within the set at hand: its bit in a block, or its rank where layers had to do.
    rank: Vec<u32>,
    block: Block,
    block_order: Vec<usize>,
    groups: Vec<Group>,
}

/// The mark of the nodes that part two halves.
const SEPARATOR: u32 = u32::MAX;

/// Orders the nodes of `graph`, which seem to be at `positions`.
#[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
pub(crate) fn dissect<C: Compliance>(graph: &Graph<C>, positions: &[Point2<f64>]) -> Order {
    let mut anchored = vec![false; graph.nodes];
    for &anchor in &graph.anchors {
        anchored[anchor as usize] = true;
    }
    let centre = positions.first().copied().unwrap_or(Point2::origin());
    let mut items: Vec<Item> = (0..graph.nodes as u32)
        .filter(|&node| !anchored[node as usize])
        .map(|node| Item::new(positions[node as usize] - centre, node))
        .collect();
    let mut dissector = Dissector {
        graph,
        side: vec![0; graph.nodes],
        next_side: 1,
        frontier: Vec::new(),
        separator: Vec::new(),
        cover: Cover::new(graph.nodes),
        supernodes: Vec::new(),
        orphans: Vec::new(),
        rank: vec![0; graph.nodes],
        block: Block::default(),
        block_order: Vec::new(),
        groups: Vec::new(),
    };
    dissector.order(&mut items, 0);
    let node: Vec<u32> = items.iter().map(|item| item.node()).collect();
    let mut position = vec![u32::MAX; graph.nodes];
    for (at, &node) in (0_u32..).zip(&node) {
        position[node as usize] = at;
    }
    Order { node, position, supernodes: dissector.supernodes }
}

impl<C: Compliance> Dissector<'_, C> {
    /// Orders `items`, which get the positions from `first` on.
    #[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
    fn order(&mut self, items: &mut [Item], first: u32) {
        let adopted = self.orphans.len();
        if items.len() <= BLOCK {
            return self.order_block(items, first);
        }
        let (left, right) = self.part(items);
        let own = left + right;
        if own > 0 {
            self.order(&mut items[..left], first);
            self.order(&mut items[left..own], first + left as u32);
        }
        if own == items.len() {
            return; // Two halves without a spring between them need no separator, and their trees no common root.
        }
        let id = self.supernodes.len() as u32;
        for child in self.orphans.drain(adopted..) {
            self.supernodes[child as usize].parent = id;
        }
        self.orphans.push(id);
        let (begin, end) = (first + own as u32, first + items.len() as u32);
        self.supernodes.push(Supernode { first: begin, end, parent: u32::MAX });
    }

    /// Orders a small set by minimum degree.
    #[expect(clippy::cast_possible_truncation, reason = "`Network` checked that every index fits 32 bits")]
    fn order_block(&mut self, items: &mut [Item], first: u32) {
        let (inside, outside) = (self.next_side, self.next_side + 1);
        self.next_side += 2;
        for (local, item) in items.iter().enumerate() {
            self.side[item.node() as usize] = inside;
            self.rank[item.node() as usize] = local as u32;
        }
        let mut others = 0;
        self.block.size = items.len();
        for (local, item) in items.iter().enumerate() {
            let mut neighbours = Neighbours::default();
            for end in self.graph.ends(item.node() as usize) {
                let node = end.node as usize;
                if self.side[node] == inside {
                    neighbours.inside |= 1 << self.rank[node];
                    continue;
                }
                if self.side[node] != outside {
                    // Neighbours outside part this set from others; their sides are not needed any more.
                    self.side[node] = outside;
                    self.rank[node] = others % u64::BITS;
                    others += 1;
                }
                neighbours.outside |= 1 << self.rank[node];
            }
            self.block.neighbours[local] = neighbours;
        }
        self.block.order(&mut self.block_order, &mut self.groups);

        let base = self.supernodes.len();
        let mut begin = first;
        for group in &self.groups {
            let end = begin + group.size as u32;
            let parent = group.parent.map_or(u32::MAX, |parent| (base + parent) as u32);
            if group.parent.is_none() {
                self.orphans.push(self.supernodes.len() as u32);
            }
            self.supernodes.push(Supernode { first: begin, end, parent });
            begin = end;
        }
        let mut sorted = [Item { x: 0, y: 0 }; BLOCK];
        for (to, &from) in sorted.iter_mut().zip(&self.block_order) {
            *to = items[from];
        }
        items.copy_from_slice(&sorted[..items.len()]);
    }

    /// Sorts `items` into two halves and, at the end, the separator between them; returns the sizes of the halves.
    fn part(&mut self, items: &mut [Item]) -> (usize, usize) {
        let (mut low, mut high) = ([u64::MAX; 2], [0; 2]);
        for item in items.iter() {
            low = [low[0].min(item.x), low[1].min(item.y)];
            high = [high[0].max(item.x), high[1].max(item.y)];
        }
        let extent = |axis: usize| coordinate(high[axis]) - coordinate(low[axis]);
        let half = if extent(0) >= extent(1) { self.narrowest(items, |i| i.x) } else { self.narrowest(items, |i| i.y) };
        self.separate(&items[..half]);
        #[expect(clippy::cast_precision_loss, reason = "a rule of thumb")]
        if self.separator.len() as f64 > SUSPICIOUS * (items.len() as f64).sqrt() + 2.0 {
            let by_coordinates = self.separator.len();
            self.sort_by_layers(items);
            let half = items.len() / 2;
            self.label(items, half);
            self.separate(&items[..half]);
            tracing::trace!(
                size = items.len(),
                by_coordinates,
                by_layers = self.separator.len(),
                "suspicious separator"
            );
        }
        self.collect_halves(items)
    }

    /// Sorts `items` as far as is needed to part them somewhere near the middle, where the fewest springs cross.
    fn narrowest(&mut self, items: &mut [Item], key: impl Fn(&Item) -> u64 + Copy) -> usize {
        let (first, last) = (items.len() * (50 - LATITUDE) / 100, items.len() * (50 + LATITUDE) / 100);
        items.select_nth_unstable_by_key(first, key);
        items[first..].select_nth_unstable_by_key(last - first, key);
        items[first..last].sort_unstable_by_key(key);
        let (left, right) = self.label(items, first);
        // The line moves over one node after the other: springs to the right begin to cross it, those to the left cease to.
        let (mut crossing, mut least, mut best) = (0_i64, 0_i64, first);
        for (i, item) in items[..last].iter().enumerate().skip(first) {
            self.side[item.node() as usize] = left;
            for end in self.graph.ends(item.node() as usize) {
                let side = self.side[end.node as usize];
                crossing += i64::from(side == right) - i64::from(side == left);
            }
            if crossing < least || (crossing == least && i < items.len() / 2) {
                (least, best) = (crossing, i + 1);
            }
        }
        for item in &items[best..last] {
            self.side[item.node() as usize] = right;
        }
        best
    }

    /// Gives the two halves sides that no other set has.
    fn label(&mut self, items: &[Item], half: usize) -> (u32, u32) {
        let (left, right) = (self.next_side, self.next_side + 1);
        self.next_side += 2;
        for (i, item) in items.iter().enumerate() {
            self.side[item.node() as usize] = if i < half { left } else { right };
        }
        (left, right)
    }

    /// Finds the separator between the two halves labelled last, the left one of which is given.
    fn separate(&mut self, left_items: &[Item]) {
        let (left, right) = (self.next_side - 2, self.next_side - 1);
        let (graph, side) = (self.graph, &self.side);
        let across = |node: u32| {
            let other = left + right - side[node as usize];
            graph.ends(node as usize).iter().map(|end| end.node).filter(move |&n| side[n as usize] == other)
        };
        self.frontier.clear();
        for item in left_items {
            let before = self.frontier.len();
            self.frontier.extend(across(item.node()));
            if self.frontier.len() > before {
                self.frontier.push(item.node());
            }
        }
        self.separator.clear();
        self.cover.find(&self.frontier, across, |node| self.separator.push(node));
    }

    /// Moves the separator to the end, the halves before it in their order.
    fn collect_halves(&mut self, items: &mut [Item]) -> (usize, usize) {
        for &node in &self.separator {
            self.side[node as usize] = SEPARATOR;
        }
        let left_side = self.next_side - 2;
        let mut left = 0;
        for i in 0..items.len() {
            if self.side[items[i].node() as usize] == left_side {
                items.swap(i, left);
                left += 1;
            }
        }
        let mut both = left;
        for i in left..items.len() {
            if self.side[items[i].node() as usize] != SEPARATOR {
                items.swap(i, both);
                both += 1;
            }
        }
        (left, both - left)
    }

    /// Sorts by breadth-first distance from a node at the rim.
    fn sort_by_layers(&mut self, items: &mut [Item]) {
        let (left, right) = (self.next_side - 2, self.next_side - 1);
        let here = self.next_side;
        self.next_side += 2;
        debug_assert!(left < right);
        for item in items.iter() {
            self.side[item.node() as usize] = here;
        }
        let mut seed = items[0].node();
        for _ in 0..3 {
            seed = self.rank_from(seed, items, here);
        }
        items.sort_unstable_by_key(|item| self.rank[item.node() as usize]);
    }

    /// Ranks the nodes of side `here` breadth first from `seed`, then from whatever was not reached; returns the last of the first.
    fn rank_from(&mut self, seed: u32, items: &[Item], here: u32) -> u32 {
        let seen = self.next_side;
        let mut queue: Vec<u32> = Vec::with_capacity(items.len());
        let mut last = seed;
        for start in std::iter::once(seed).chain(items.iter().map(|item| item.node())) {
            if self.side[start as usize] != here {
                continue;
            }
            let mut head = queue.len();
            self.side[start as usize] = seen;
            queue.push(start);
            while head < queue.len() {
                for end in self.graph.ends(queue[head] as usize) {
                    if self.side[end.node as usize] == here {
                        self.side[end.node as usize] = seen;
                        queue.push(end.node);
                    }
                }
                head += 1;
            }
            if start == seed {
                last = queue[queue.len() - 1];
            }
        }
        for (rank, &node) in (0_u32..).zip(&queue) {
            self.rank[node as usize] = rank;
            self.side[node as usize] = here;
        }
        last
    }
}
