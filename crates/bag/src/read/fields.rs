//! The fields of a record, parsed in order. Lengths are not trusted: nothing is allocated before the bytes
//! are known to be there.

use std::collections::BTreeMap;

use mcap::{McapError, McapResult};

/// The remaining fields of a record.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    pub(crate) fn new(body: &'a [u8]) -> Fields<'a> {
        Fields(body)
    }

    /// The remaining bytes.
    pub(crate) fn rest(self) -> &'a [u8] {
        self.0
    }

    pub(crate) fn is_empty(self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn u16(&mut self) -> McapResult<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self) -> McapResult<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self) -> McapResult<u64> {
        self.array().map(u64::from_le_bytes)
    }

    /// The next `length` bytes.
    pub(crate) fn bytes(&mut self, length: u64) -> McapResult<&'a [u8]> {
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        let (bytes, rest) = self.0.split_at_checked(length).ok_or(McapError::UnexpectedEoc)?;
        self.0 = rest;
        Ok(bytes)
    }

    /// The next bytes, prefixed with their length.
    pub(crate) fn counted(&mut self) -> McapResult<&'a [u8]> {
        let length = self.u32()?;
        self.bytes(length.into())
    }

    pub(crate) fn string(&mut self) -> McapResult<String> {
        self.counted().map(|text| String::from_utf8_lossy(text).into_owned())
    }

    /// The next map, prefixed with its length in bytes.
    pub(crate) fn map<K: Ord, V>(
        &mut self,
        key: impl Fn(&mut Fields<'a>) -> McapResult<K>,
        value: impl Fn(&mut Fields<'a>) -> McapResult<V>,
    ) -> McapResult<BTreeMap<K, V>> {
        let mut entries = Fields(self.counted()?);
        let mut map = BTreeMap::new();
        while !entries.is_empty() {
            map.insert(key(&mut entries)?, value(&mut entries)?);
        }
        Ok(map)
    }

    fn array<const N: usize>(&mut self) -> McapResult<[u8; N]> {
        let (array, rest) = self.0.split_first_chunk().ok_or(McapError::UnexpectedEoc)?;
        self.0 = rest;
        Ok(*array)
    }
}
