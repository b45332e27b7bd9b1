/// The largest set of `count` things of which every two are consistent, as ascending indices.
///
/// Exact up to 64 things (branch and bound on bit sets); beyond that greedy, from the thing that is consistent with the
/// most others, which may miss the largest. Of equally large sets the one with the lowest indices wins.
/// `consistent(i, j)` is asked once for each `i < j`.
#[must_use]
pub fn largest_consistent_set(count: usize, consistent: impl Fn(usize, usize) -> bool) -> Vec<usize> {
    let mut neighbors = vec![Vec::new(); count];
    for i in 0..count {
        for j in i + 1..count {
            if consistent(i, j) {
                neighbors[i].push(j);
                neighbors[j].push(i);
            }
        }
    }
    if count <= 64 { exact(&neighbors) } else { greedy(&neighbors) }
}

fn exact(neighbors: &[Vec<usize>]) -> Vec<usize> {
    let masks: Vec<u64> = neighbors.iter().map(|list| list.iter().fold(0, |mask, &j| mask | 1 << j)).collect();
    let everything = masks.iter().enumerate().fold(0_u64, |mask, (i, _)| mask | 1 << i);
    let mut best = 0_u64;
    grow(&masks, 0, everything, &mut best);
    (0..neighbors.len()).filter(|i| best >> i & 1 == 1).collect()
}

/// Grows the clique `chosen` by all means out of `open`, which holds only neighbours of all chosen.
fn grow(masks: &[u64], chosen: u64, mut open: u64, best: &mut u64) {
    while open != 0 {
        if chosen.count_ones() + open.count_ones() <= best.count_ones() {
            return; // even all of them would not be more
        }
        let next = open.trailing_zeros();
        open &= open - 1;
        grow(masks, chosen | 1 << next, open & masks[next as usize], best);
    }
    if chosen.count_ones() > best.count_ones() {
        *best = chosen;
    }
}

fn greedy(neighbors: &[Vec<usize>]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..neighbors.len()).collect();
    order.sort_by_key(|&i| (std::cmp::Reverse(neighbors[i].len()), i));
    let mut chosen: Vec<usize> = Vec::new();
    for candidate in order {
        // The lists are ascending, because `i` and `j` were.
        if chosen.iter().all(|other| neighbors[candidate].binary_search(other).is_ok()) {
            chosen.push(candidate);
        }
    }
    chosen.sort_unstable();
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_larger_of_two_cliques_wins() {
        let edges = [(0, 1), (0, 2), (1, 2), (3, 4), (3, 5), (3, 6), (4, 5), (4, 6), (5, 6), (2, 3)];
        assert_eq!(largest_consistent_set(7, |i, j| edges.contains(&(i, j))), [3, 4, 5, 6]);
    }

    #[test]
    fn nothing_and_everything() {
        assert!(largest_consistent_set(0, |_, _| true).is_empty());
        assert_eq!(largest_consistent_set(3, |_, _| false), [0]);
        assert_eq!(largest_consistent_set(64, |_, _| true).len(), 64);
        assert_eq!(largest_consistent_set(200, |_, _| true).len(), 200);
    }

    #[test]
    fn beyond_64_a_planted_clique_is_found() {
        let inside = |i: usize| i.is_multiple_of(3);
        let found = largest_consistent_set(150, |i, j| inside(i) && inside(j) || (i + j).is_multiple_of(17));
        assert!(found.len() >= 50, "{found:?}");
    }

    #[test]
    fn exactness_against_all_subsets() {
        for seed in 0_u64..50 {
            let edge = |i: usize, j: usize| (seed * 31 + (i * 17 + j * 7) as u64 * 2_654_435_761) % 7 < 4;
            let best = (0_u32..1 << 10)
                .filter(|set| {
                    (0..10).all(|i| (i + 1..10).all(|j| set >> i & 1 == 0 || set >> j & 1 == 0 || edge(i, j)))
                })
                .map(u32::count_ones)
                .max();
            assert_eq!(largest_consistent_set(10, edge).len(), best.unwrap() as usize);
        }
    }
}
