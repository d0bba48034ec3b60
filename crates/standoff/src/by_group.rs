//! Index of elements by their group.

/// Indices of the elements of each group, so that those of one group are found without a search of all. `G` identifies
/// a group.
#[derive(Debug, Clone, PartialEq)]
pub struct ByGroup<G> {
    /// Group and index of an element, ascending.
    entries: Vec<(G, usize)>,
}

impl<G> Default for ByGroup<G> {
    fn default() -> Self {
        Self { entries: Vec::new() }
    }
}

impl<G: Copy + Ord> ByGroup<G> {
    /// Replaces the entries by these pairs of group and index; reuses the memory.
    pub fn fill(&mut self, entries: impl IntoIterator<Item = (G, usize)>) {
        self.entries.clear();
        self.entries.extend(entries);
        // Most are: the elements of small teams have few groups.
        if !self.entries.is_sorted_by(|one, next| one < next) {
            self.entries.sort_unstable();
            self.entries.dedup();
        }
    }

    /// Indices of the elements of a group, ascending.
    pub fn of(&self, group: G) -> impl ExactSizeIterator<Item = usize> + Clone + '_ {
        let start = self.entries.partition_point(|(of, _)| *of < group);
        let count = self.entries[start..].iter().take_while(|(of, _)| *of == group).count();
        self.entries[start..start + count].iter().map(|(_, index)| *index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_elements_of_a_group_are_ascending_and_unique() {
        let mut elements = ByGroup::default();
        elements.fill([(7, 4), (2, 3), (7, 1), (7, 4), (9, 0)]);
        let of = |group| elements.of(group).collect::<Vec<_>>();
        assert_eq!([0, 2, 7, 8, 9, 10].map(of), [vec![], vec![3], vec![1, 4], vec![], vec![0], vec![]]);
        elements.fill([]);
        assert_eq!(elements.of(7).len(), 0);
    }
}
