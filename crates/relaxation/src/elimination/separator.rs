//! The fewest nodes that part two halves: a vertex cover of the springs between them.

/// Working memory of [`cover`], kept between calls. All entries are back to zero after each.
#[derive(Debug, Default)]
pub(super) struct Cover {
    /// For each node, how many of its springs across the cut are not covered yet.
    open: Vec<u32>,
    leaves: Vec<u32>,
}

impl Cover {
    pub(super) fn new(nodes: usize) -> Self {
        Self { open: vec![0; nodes], leaves: Vec::new() }
    }

    /// Chooses nodes so that every spring across the cut ends at one of them, and calls `choose` with each.
    ///
    /// `frontier` holds the nodes on both sides at which such springs end, some perhaps repeatedly; `across(v)` gives the other ends.
    /// Whoever has one open spring left lets its other end be chosen: no better choice exists then, and cuts of maps
    /// consist of short paths, so this finds the least cover nearly always. What has cycles is cut open where it is widest.
    pub(super) fn find<I: Iterator<Item = u32>>(
        &mut self,
        frontier: &[u32],
        across: impl Fn(u32) -> I,
        mut choose: impl FnMut(u32),
    ) {
        for &node in frontier {
            let springs = across(node).map(|_| 1).sum();
            self.open[node as usize] = springs;
            if springs == 1 {
                self.leaves.push(node);
            }
        }
        for &node in frontier {
            self.follow_leaves(&across, &mut choose);
            if self.open[node as usize] > 2 {
                self.take(node, &across, &mut choose);
            }
        }
        for &node in frontier {
            self.follow_leaves(&across, &mut choose);
            if self.open[node as usize] > 0 {
                self.take(node, &across, &mut choose);
            }
        }
        self.leaves.clear();
    }

    fn follow_leaves<I: Iterator<Item = u32>>(&mut self, across: &impl Fn(u32) -> I, choose: &mut impl FnMut(u32)) {
        while let Some(leaf) = self.leaves.pop() {
            if self.open[leaf as usize] == 1
                && let Some(partner) = across(leaf).find(|&other| self.open[other as usize] > 0)
            {
                self.take(partner, across, choose);
            }
        }
    }

    /// Puts `node` into the cover: its springs are covered.
    fn take<I: Iterator<Item = u32>>(&mut self, node: u32, across: &impl Fn(u32) -> I, choose: &mut impl FnMut(u32)) {
        choose(node);
        self.open[node as usize] = 0;
        for other in across(node) {
            let open = &mut self.open[other as usize];
            if *open > 0 {
                *open -= 1;
                if *open == 1 {
                    self.leaves.push(other);
                }
            }
        }
    }
}
