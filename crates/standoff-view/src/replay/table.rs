//! A table of numbers over time in a layout that compresses well.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::Serialize;

/// Values of objects at the time steps of a part: a row of single-precision numbers per object and time step, with NaN
/// for missing values.
#[derive(Debug)]
pub(super) struct Table {
    name: Cow<'static, str>,
    columns: Vec<Cow<'static, str>>,
    steps: usize,
    /// Rows by object, one after the other.
    objects: BTreeMap<u32, Vec<f32>>,
}

/// Directory entry of a table, with which the page reads its bytes.
#[derive(Debug, Serialize)]
pub(super) struct Directory {
    name: Cow<'static, str>,
    columns: Vec<Cow<'static, str>>,
    ids: Vec<u32>,
}

impl Table {
    pub(super) fn new(name: &'static str, columns: impl IntoIterator<Item = Cow<'static, str>>) -> Self {
        Self::at(name, columns, 0)
    }

    /// Makes a table that starts at a later time step of its part and was empty before. `steps`: number of time
    /// steps including the current one, at least 1.
    pub(super) fn at(
        name: impl Into<Cow<'static, str>>,
        columns: impl IntoIterator<Item = Cow<'static, str>>,
        steps: usize,
    ) -> Self {
        Self { name: name.into(), columns: columns.into_iter().collect(), steps, objects: BTreeMap::new() }
    }

    /// Starts the next time step.
    pub(super) fn next_step(&mut self) {
        self.steps += 1;
    }

    /// Sets the row of an object at this time step; a second row for the same object is ignored.
    pub(super) fn put(&mut self, id: u32, row: impl IntoIterator<Item = Option<f64>>) {
        let (rows, before) = (self.objects.entry(id).or_default(), (self.steps - 1) * self.columns.len());
        if rows.len() <= before {
            rows.resize(before, f32::NAN);
            rows.extend(row.into_iter().map(single));
        }
    }

    /// Number of rows, including missing ones.
    pub(super) fn rows(&self) -> usize {
        self.objects.len() * self.steps
    }

    /// Number of rows after one more time step with `new` new objects.
    pub(super) fn rows_with(&self, new: usize) -> usize {
        (self.objects.len() + new) * (self.steps + 1)
    }

    pub(super) fn directory(&self) -> Directory {
        Directory {
            name: self.name.clone(),
            columns: self.columns.clone(),
            ids: self.objects.keys().copied().collect(),
        }
    }

    /// Writes the table by column, object and time step. Each number is stored as the difference of its bits from those
    /// of the previous time step. Within a column, all least significant bytes come first, then the next ones, and so
    /// on, so that slowly changing values give mostly zeros.
    pub(super) fn write(&self, bytes: &mut Vec<u8>) {
        let width = self.columns.len();
        for column in 0..width {
            let of = |rows: &[f32], step: usize| rows.get(step * width + column).unwrap_or(&f32::NAN).to_bits();
            for place in 0..4 {
                for rows in self.objects.values() {
                    let mut before = 0;
                    bytes.extend((0..self.steps).map(|step| {
                        let bits = of(rows, step);
                        let difference = bits.wrapping_sub(before);
                        before = bits;
                        difference.to_le_bytes()[place]
                    }));
                }
            }
        }
    }
}

/// Converts to single precision. Missing, not finite and too large values become the same NaN.
pub(super) fn single(value: Option<f64>) -> f32 {
    value.map(|value| value as f32).filter(|value| value.is_finite()).unwrap_or(f32::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads a table back as the page does.
    fn read<const N: usize>(table: &Table) -> BTreeMap<u32, Vec<[f32; N]>> {
        let mut bytes = Vec::new();
        table.write(&mut bytes);
        let (ids, steps) = (table.directory().ids, table.steps);
        let plane = ids.len() * steps;
        assert_eq!(bytes.len(), 4 * N * plane);
        let mut objects = BTreeMap::new();
        for (object, id) in ids.iter().enumerate() {
            let mut rows = vec![[0.0; N]; steps];
            for column in 0..N {
                let mut bits = 0u32;
                for (step, row) in rows.iter_mut().enumerate() {
                    let at = |place: usize| bytes[(4 * column + place) * plane + object * steps + step];
                    bits = bits.wrapping_add(u32::from_le_bytes([at(0), at(1), at(2), at(3)]));
                    row[column] = f32::from_bits(bits);
                }
            }
            objects.insert(*id, rows);
        }
        objects
    }

    #[test]
    fn a_table_reads_back_with_nan_for_missing_values() {
        let mut table = Table::new("t", ["a", "b"].map(Cow::from));
        table.next_step();
        table.put(7, [Some(1.5), None]);
        table.put(7, [Some(99.0), None]);
        table.next_step();
        table.put(3, [Some(-2.0), Some(1e300)]);
        table.next_step();
        table.put(7, [Some(-0.25), Some(f64::NAN)]);
        let objects = read::<2>(&table);
        let text = |id: u32| format!("{:?}", objects[&id]);
        assert_eq!(text(3), "[[NaN, NaN], [-2.0, NaN], [NaN, NaN]]");
        assert_eq!(text(7), "[[1.5, NaN], [NaN, NaN], [-0.25, NaN]]");
        assert_eq!(objects.len(), 2);
    }
}
