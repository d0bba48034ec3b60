//! Values by id.

/// Values in the order of their ids. At every time step the same ids follow each other, so that the entry after the last
/// one is usually the next one.
#[derive(Debug, Clone)]
pub(crate) struct ById<T> {
    entries: Vec<(u32, T)>,
    /// Index of the expected next entry.
    next: usize,
}

impl<T> Default for ById<T> {
    fn default() -> Self {
        Self { entries: Vec::new(), next: 0 }
    }
}

impl<T> ById<T> {
    fn search(&self, id: u32) -> Result<usize, usize> {
        match self.entries.get(self.next) {
            Some((next, _)) if *next == id => Ok(self.next),
            _ => self.entries.binary_search_by_key(&id, |(known, _)| *known),
        }
    }

    pub(crate) fn get(&self, id: u32) -> Option<&T> {
        self.search(id).ok().map(|index| &self.entries[index].1)
    }

    pub(crate) fn get_mut(&mut self, id: u32) -> Option<&mut T> {
        let index = self.search(id).ok()?;
        Some(self.visit(index))
    }

    /// Returns the value at an index; the next one is expected after it.
    fn visit(&mut self, index: usize) -> &mut T {
        self.next = if index + 1 < self.entries.len() { index + 1 } else { 0 };
        &mut self.entries[index].1
    }

    /// Returns the value of an id; inserts a new one if the id is missing.
    pub(crate) fn entry(&mut self, id: u32, new: impl FnOnce() -> T) -> &mut T {
        let index = self.search(id).unwrap_or_else(|index| {
            self.entries.insert(index, (id, new()));
            index
        });
        self.visit(index)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (u32, &T)> {
        self.entries.iter().map(|(id, value)| (*id, value))
    }

    pub(crate) fn values(&self) -> impl Iterator<Item = &T> {
        self.entries.iter().map(|(_, value)| value)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Removes all values and keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.entries.clear();
        self.next = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_found_by_id_in_any_order_and_sorted() {
        let mut squares = ById::default();
        for id in [5, 9, 1, 5, 7, 9, 0, 1, 5, 7, 9, 0, 0, 3] {
            assert_eq!(*squares.entry(id, || id * id), id * id);
        }
        let all: Vec<(u32, u32)> = squares.iter().map(|(id, square)| (id, *square)).collect();
        assert_eq!(all, [(0, 0), (1, 1), (3, 9), (5, 25), (7, 49), (9, 81)]);
        assert_eq!((squares.get(4), squares.get(7), squares.get(10)), (None, Some(&49), None));
        *squares.get_mut(3).unwrap() = 8;
        assert_eq!(squares.values().sum::<u32>(), 164);
        squares.clear();
        assert!(squares.is_empty() && squares.get(0).is_none());
    }
}
