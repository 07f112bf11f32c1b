//! A sorted map whose clones share unchanged entries.

use std::cmp::Ordering;
use std::iter::Peekable;
use std::sync::Arc;

/// The most entries in a chunk.
const MOST: usize = 128;

/// A sorted map in chunks that its clones share: cloning takes constant time, a change copies one chunk and
/// the list of chunks, and the [differences](SharedMap::differences) of two clones are found in the chunks
/// that they do not share.
#[derive(Clone, Debug)]
pub(crate) struct SharedMap<K, V>(Arc<Vec<Chunk<K, V>>>);

/// Entries in order, at least one.
type Chunk<K, V> = Arc<Vec<(K, V)>>;

impl<K, V> Default for SharedMap<K, V> {
    fn default() -> SharedMap<K, V> {
        SharedMap(Arc::default())
    }
}

impl<K: Ord + Clone, V: Clone> SharedMap<K, V> {
    pub(crate) fn get(&self, key: &K) -> Option<&V> {
        let chunk = &self.0.get(self.chunk_of(key))?;
        let place = chunk.binary_search_by(|(each, _)| each.cmp(key)).ok()?;
        Some(&chunk[place].1)
    }

    /// Inserts a value; returns the value that it replaces.
    pub(crate) fn insert(&mut self, key: K, value: V) -> Option<V> {
        let at = self.chunk_of(&key).min(self.0.len().saturating_sub(1));
        let chunks = Arc::make_mut(&mut self.0);
        let Some(chunk) = chunks.get_mut(at) else {
            chunks.push(Arc::new(vec![(key, value)]));
            return None;
        };
        let entries = Arc::make_mut(chunk);
        match entries.binary_search_by(|(each, _)| each.cmp(&key)) {
            Ok(place) => return Some(std::mem::replace(&mut entries[place].1, value)),
            Err(place) => entries.insert(place, (key, value)),
        }
        if entries.len() > MOST {
            let behind = entries.split_off(MOST / 2);
            chunks.insert(at + 1, Arc::new(behind));
        }
        None
    }

    /// Removes a value.
    pub(crate) fn remove(&mut self, key: &K) -> Option<V> {
        let at = self.chunk_of(key);
        let place = self.0.get(at)?.binary_search_by(|(each, _)| each.cmp(key)).ok()?;
        let chunks = Arc::make_mut(&mut self.0);
        if chunks[at].len() == 1 {
            return chunks.remove(at).first().map(|(_, value)| value.clone());
        }
        Some(Arc::make_mut(&mut chunks[at]).remove(place).1)
    }

    /// All entries, in order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&K, &V)> {
        self.starting_where(|_| false)
    }

    /// The entries in order, starting with the first for whose key `is_before` is false.
    pub(crate) fn starting_where(
        &self,
        is_before: impl Fn(&K) -> bool,
    ) -> impl Iterator<Item = (&K, &V)> {
        let ends_before = |chunk: &Chunk<K, V>| chunk.last().is_some_and(|(key, _)| is_before(key));
        let chunks = &self.0[self.0.partition_point(ends_before)..];
        let first =
            chunks.first().map_or(0, |first| first.partition_point(|(key, _)| is_before(key)));
        chunks.iter().flat_map(|chunk| chunk.iter()).skip(first).map(|(key, value)| (key, value))
    }

    /// The keys whose values differ from those in `other`, in order, including keys in only one of the
    /// maps.
    pub(crate) fn differences(&self, other: &Self) -> Vec<K>
    where
        V: PartialEq,
    {
        let (mut ours, mut theirs) = unshared(&self.0, &other.0);
        let mut differences = Vec::new();
        loop {
            let order = match (ours.peek(), theirs.peek()) {
                (None, None) => return differences,
                (Some(_), None) => Ordering::Less,
                (None, Some(_)) => Ordering::Greater,
                (Some((ours, _)), Some((theirs, _))) => ours.cmp(theirs),
            };
            let ours = if order.is_le() { ours.next() } else { None };
            let theirs = if order.is_ge() { theirs.next() } else { None };
            if ours.map(|(_, value)| value) != theirs.map(|(_, value)| value) {
                differences.extend(ours.or(theirs).map(|(key, _)| key.clone()));
            }
        }
    }

    /// The index of the chunk that a key belongs to; past the end for a key greater than all others.
    fn chunk_of(&self, key: &K) -> usize {
        self.0.partition_point(|chunk| chunk.last().is_some_and(|(last, _)| last < key))
    }
}

impl<K: Ord + Clone, V: Clone + PartialEq> PartialEq for SharedMap<K, V> {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.differences(other).is_empty()
    }
}

type Entries<'a, K, V> = Peekable<std::vec::IntoIter<&'a (K, V)>>;

/// The entries in chunks that two maps do not share.
fn unshared<'a, K: Ord, V>(
    ours: &'a [Chunk<K, V>],
    theirs: &'a [Chunk<K, V>],
) -> (Entries<'a, K, V>, Entries<'a, K, V>) {
    let first = |chunk: &'a Chunk<K, V>| chunk.first().map(|(key, _)| key);
    let (mut ours, mut theirs) = (ours.iter().peekable(), theirs.iter().peekable());
    let (mut only_ours, mut only_theirs) = (Vec::new(), Vec::new());
    loop {
        // Both lists are sorted, so a shared chunk is reached in both at the same time.
        let order = match (ours.peek(), theirs.peek()) {
            (None, None) => break,
            (Some(_), None) => Ordering::Less,
            (None, Some(_)) => Ordering::Greater,
            (Some(ours), Some(theirs)) => first(ours).cmp(&first(theirs)),
        };
        let ours = if order.is_le() { ours.next() } else { None };
        let theirs = if order.is_ge() { theirs.next() } else { None };
        if !matches!((ours, theirs), (Some(ours), Some(theirs)) if Arc::ptr_eq(ours, theirs)) {
            only_ours.extend(ours.into_iter().flat_map(|chunk| chunk.iter()));
            only_theirs.extend(theirs.into_iter().flat_map(|chunk| chunk.iter()));
        }
    }
    (only_ours.into_iter().peekable(), only_theirs.into_iter().peekable())
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use proptest::prelude::*;

    use super::*;

    type Changes = Vec<(u16, Option<u8>)>;

    fn change(map: &mut SharedMap<u16, u8>, model: &mut BTreeMap<u16, u8>, changes: &Changes) {
        for (key, value) in changes {
            match value {
                Some(value) => assert_eq!(map.insert(*key, *value), model.insert(*key, *value)),
                None => assert_eq!(map.remove(key), model.remove(key)),
            }
        }
    }

    proptest! {
        #[test]
        fn it_is_a_sorted_map_whose_differences_are_those_of_its_entries(
            first in prop::collection::vec((0_u16..600, any::<Option<u8>>()), 0..1500),
            second in prop::collection::vec((0_u16..600, any::<Option<u8>>()), 0..50),
            from in 0_u16..600,
        ) {
            let (mut map, mut model) = (SharedMap::default(), BTreeMap::new());
            change(&mut map, &mut model, &first);
            let (before, model_before) = (map.clone(), model.clone());
            change(&mut map, &mut model, &second);
            prop_assert!(map.iter().eq(model.iter()));
            prop_assert!(before.iter().eq(model_before.iter()));
            prop_assert!(map.starting_where(|key| *key < from).eq(model.range(from..)));
            prop_assert_eq!(map.get(&from), model.get(&from));
            let keys: BTreeSet<u16> = model.keys().chain(model_before.keys()).copied().collect();
            let differ = |key: &u16| model.get(key) != model_before.get(key);
            prop_assert_eq!(map.differences(&before), keys.into_iter().filter(differ).collect::<Vec<_>>());
            prop_assert_eq!(map == before, model == model_before);
        }
    }

    #[test]
    fn what_did_not_change_is_shared() {
        let mut map = SharedMap::default();
        for key in 0..10_000 {
            map.insert(key, ());
        }
        let before = map.clone();
        map.insert(5000, ());
        map.remove(&7000);
        let (ours, theirs) = unshared(&map.0, &before.0);
        assert!(ours.len() <= 2 * MOST && theirs.len() <= 2 * MOST);
        assert_eq!(map.differences(&before), [7000]);
    }
}
