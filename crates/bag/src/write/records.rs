//! Encoders for MCAP records.

/// Appends a record; `fill` appends its contents.
pub(super) fn record(out: &mut Vec<u8>, opcode: u8, fill: impl FnOnce(&mut Vec<u8>)) {
    out.push(opcode);
    let length_at = out.len();
    number(out, 0_u64.to_le_bytes());
    let begin = out.len();
    fill(out);
    let length = (out.len() - begin) as u64;
    out[length_at..begin].copy_from_slice(&length.to_le_bytes());
}

/// Appends a number in little-endian byte order, which MCAP uses throughout.
pub(super) fn number<const N: usize>(out: &mut Vec<u8>, little_endian: [u8; N]) {
    out.extend_from_slice(&little_endian);
}

/// Appends 64-bit numbers.
pub(super) fn numbers<const N: usize>(out: &mut Vec<u8>, all: [u64; N]) {
    for each in all {
        number(out, each.to_le_bytes());
    }
}

/// Appends bytes, prefixed with their length.
pub(super) fn counted(out: &mut Vec<u8>, bytes: &[u8]) {
    number(out, (bytes.len() as u32).to_le_bytes());
    out.extend_from_slice(bytes);
}

/// Appends a string, prefixed with its length.
pub(super) fn text(out: &mut Vec<u8>, text: &str) {
    counted(out, text.as_bytes());
}

/// Appends entries with `put`, prefixed with their length in bytes.
pub(super) fn all<T>(
    out: &mut Vec<u8>,
    entries: impl IntoIterator<Item = T>,
    put: impl Fn(&mut Vec<u8>, T),
) {
    let length_at = out.len();
    number(out, 0_u32.to_le_bytes());
    let begin = out.len();
    for entry in entries {
        put(out, entry);
    }
    let length = (out.len() - begin) as u32;
    out[length_at..begin].copy_from_slice(&length.to_le_bytes());
}
