//! Camera frames.

/// The most bytes that may follow the JPEG in a frame, as some cameras pad their frames.
const MOST_FILL_BYTES: usize = 1024;

/// Returns the JPEG in a frame, from its first to its last marker; `None` if one is missing, as in a truncated frame.
pub fn whole_jpeg(frame: &[u8]) -> Option<&[u8]> {
    if !frame.starts_with(&[0xff, 0xd8]) {
        return None;
    }
    let from = frame.len().saturating_sub(MOST_FILL_BYTES).max(2);
    let end = frame[from.min(frame.len())..].windows(2).rposition(|pair| pair == [0xff, 0xd9])?;
    Some(&frame[..from + end + 2])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn file(content: &[u8]) -> Vec<u8> {
        [&[0xff, 0xd8], content, &[0xff, 0xd9]].concat()
    }

    #[test]
    fn what_fills_a_frame_up_is_no_part_of_its_file() {
        let jpeg = file(&[1, 2, 3]);
        let filled = [jpeg.as_slice(), &[0; 500]].concat();
        assert_eq!(whole_jpeg(&filled), Some(jpeg.as_slice()));
        assert_eq!(whole_jpeg(&jpeg), Some(jpeg.as_slice()));
    }

    #[test]
    fn what_was_cut_off_is_no_file() {
        let jpeg = file(&[7; 3000]);
        assert_eq!(whole_jpeg(&jpeg[..2000]), None);
        assert_eq!(whole_jpeg(&jpeg[1..]), None);
        for few in [&[][..], &[0xff], &[0xff, 0xd8], &[0xff, 0xd8, 0xff]] {
            assert_eq!(whole_jpeg(few), None);
        }
        // Nor is one with a small picture inside, whose end is far from its own.
        let inside = [&[0xff, 0xd8][..], &file(&[1]), &[5; 4000]].concat();
        assert_eq!(whole_jpeg(&inside), None);
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_file_or_none(frame: Vec<u8>) {
            if let Some(jpeg) = whole_jpeg(&frame) {
                prop_assert!(jpeg.starts_with(&[0xff, 0xd8]) && jpeg.ends_with(&[0xff, 0xd9]));
                prop_assert!(frame.starts_with(jpeg));
            }
        }
    }
}
