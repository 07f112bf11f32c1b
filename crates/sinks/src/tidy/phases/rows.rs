//! The rows of the phase table, most of them on disk.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::ops::Range;
use std::path::Path;

use teampulse_bag::Spill;
use teampulse_core::stream::Subject;
use teampulse_core::time::Time;

/// The number of rows held in memory, for phases that are running or have just ended.
const IN_MEMORY: usize = 32;
/// The size of a value on disk, with its column index [bytes].
const VALUE_BYTES: usize = 12;

/// The values of a phase by column index.
pub(super) type Row = BTreeMap<usize, f64>;

/// The values of each phase by subject and start, with bounded memory.
#[derive(Debug)]
pub(super) struct Rows {
    recent: BTreeMap<(Subject, Time), Row>,
    /// The ranges on disk of the parts of each row.
    kept: BTreeMap<(Subject, Time), Vec<Range<u64>>>,
    spill: Spill,
    /// The columns in which each subject has a value.
    used: BTreeMap<Subject, BTreeSet<usize>>,
}

impl Rows {
    /// An empty table; rows are spilled to this folder's disk.
    pub(super) fn new(folder: &Path) -> Rows {
        let (recent, kept, used) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        Rows { recent, kept, spill: Spill::new(folder), used }
    }

    /// Adds values to a row, replacing values in the same column.
    pub(super) fn extend(
        &mut self,
        (subject, begin): (Subject, Time),
        values: impl Iterator<Item = (usize, f64)>,
    ) {
        let used = self.used.entry(subject.clone()).or_default();
        let row = self.recent.entry((subject, begin)).or_default();
        for (place, value) in values {
            used.insert(place);
            row.insert(place, value);
        }
        if self.recent.len() > IN_MEMORY {
            self.put_oldest_away();
        }
    }

    /// The columns in which each subject has a value.
    pub(super) fn used(&self) -> &BTreeMap<Subject, BTreeSet<usize>> {
        &self.used
    }

    /// The subject and the start of each row.
    pub(super) fn all(&self) -> BTreeSet<&(Subject, Time)> {
        self.kept.keys().chain(self.recent.keys()).collect()
    }

    /// The values of a row.
    pub(super) fn row(&self, of: &(Subject, Time)) -> io::Result<Row> {
        let mut row = Row::new();
        for part in self.kept.get(of).into_iter().flatten() {
            row.extend(unpacked(&self.spill.read_range(part.clone())?));
        }
        row.extend(self.recent.get(of).into_iter().flatten());
        Ok(row)
    }

    fn put_oldest_away(&mut self) {
        let oldest = self.recent.keys().min_by_key(|(_, begin)| *begin).cloned();
        let Some((of, row)) = oldest.and_then(|of| self.recent.remove_entry(&of)) else { return };
        let begin = self.spill.len();
        self.spill.append(|out| out.extend(row.into_iter().flat_map(packed)));
        self.kept.entry(of).or_default().push(begin..self.spill.len());
    }
}

fn packed((place, value): (usize, f64)) -> [u8; VALUE_BYTES] {
    let mut bytes = [0; VALUE_BYTES];
    bytes[..4].copy_from_slice(&(place as u32).to_le_bytes());
    bytes[4..].copy_from_slice(&value.to_le_bytes());
    bytes
}

fn unpacked(bytes: &[u8]) -> impl Iterator<Item = (usize, f64)> + '_ {
    let (values, _) = bytes.as_chunks::<VALUE_BYTES>();
    values.iter().map(|[p0, p1, p2, p3, value @ ..]| {
        (u32::from_le_bytes([*p0, *p1, *p2, *p3]) as usize, f64::from_le_bytes(*value))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_as_they_were_reported_however_many_there_are() {
        let folder = tempfile::tempdir().unwrap();
        let mut rows = Rows::new(folder.path());
        let of = |robot: u32, phase: i64| {
            (Subject::robot(format!("robot{robot}")), Time::from_nanos(phase))
        };
        let expected = |robot: u32, phase: i64| -> Row {
            (0..300_u32)
                .map(|place| {
                    (place as usize, f64::from(robot) + phase as f64 / f64::from(place + 1))
                })
                .collect()
        };
        for phase in 0..200 {
            for robot in 0..5 {
                rows.extend(of(robot, phase), (0..100).map(|place| (place, f64::NAN)));
                rows.extend(of(robot, phase), expected(robot, phase).into_iter());
            }
        }
        // Values that arrive late are still put into their row.
        rows.extend(of(3, 7), [(1, -1.0), (301, 5.0)].into_iter());
        assert!(rows.recent.len() <= IN_MEMORY);
        assert_eq!(rows.all().len(), 1000);
        assert_eq!(rows.row(&of(4, 150)).unwrap(), expected(4, 150));
        assert_eq!(rows.row(&of(4, 199)).unwrap(), expected(4, 199));
        let mut late = expected(3, 7);
        late.extend([(1, -1.0), (301, 5.0)]);
        assert_eq!(rows.row(&of(3, 7)).unwrap(), late);
        assert_eq!(rows.used()[&Subject::robot("robot3")].len(), 301);
        assert_eq!(rows.used()[&Subject::robot("robot4")].len(), 300);
    }
}
