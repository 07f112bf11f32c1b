//! The checksum that newer firmware appends to packets and replies.

const START: u16 = 0xb0ca;

/// Returns the checksum of bytes; it is sent low byte first. An odd number of bytes is padded with a zero.
///
/// ```
/// use teampulse_devices::shimmer3::crc::crc;
///
/// assert_eq!(crc(&[1, 2, 3, 4, 5, 6, 7, 8]), 0x48aa); // the firmware's own test
/// ```
pub fn crc(bytes: &[u8]) -> u16 {
    let padding = if bytes.len().is_multiple_of(2) { None } else { Some(&0) };
    bytes.iter().chain(padding).fold(START, |crc, byte| {
        let mut crc = crc.swap_bytes() ^ u16::from(*byte);
        crc ^= (crc & 0xff) >> 4;
        crc ^= crc << 12;
        crc ^ (crc & 0xff) << 5
    })
}

/// Whether the last two bytes are the checksum of the bytes before them.
pub fn is_intact(bytes: &[u8]) -> bool {
    let Some((message, sum)) = bytes.split_last_chunk() else { return false };
    u16::from_le_bytes(*sum) == crc(message)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_firmwares_own_vectors_hold() {
        let bytes: Vec<u8> = (1..=11).collect();
        let sums = [8, 9, 10, 11].map(|length| crc(&bytes[..length]));
        assert_eq!(sums, [0x48aa, 0x2a5d, 0x8b17, 0x794e]);
        assert!(is_intact(&[1, 2, 3, 4, 5, 6, 7, 8, 0xaa, 0x48]));
        assert!(!is_intact(&[1]));
    }
}
