/// The smallest width of a block: whether a single bit is signed is not documented.
const LEAST_BITS: u32 = 2;

/// Compresses samples: the first one whole, in this many bytes per channel, then one block of differences.
///
/// *Online measurement*, "Delta frame": bit width, count, and differences from the lowest bit up.
pub(super) fn compress<const N: usize>(samples: &[[i32; N]], bytes: usize) -> Vec<u8> {
    let Some((first, rest)) = samples.split_first() else { return Vec::new() };
    let mut packed: Vec<u8> =
        first.iter().flat_map(|value| value.to_le_bytes().into_iter().take(bytes)).collect();
    let pairs = samples.windows(2);
    let differences = pairs.flat_map(|pair| (0..N).map(|at| pair[1][at].wrapping_sub(pair[0][at])));
    let differences: Vec<i32> = differences.collect();
    let bits = differences.iter().map(|difference| bits_of(*difference)).max();
    let bits = bits.unwrap_or(LEAST_BITS).max(LEAST_BITS);
    if !rest.is_empty() {
        packed.extend([bits as u8, rest.len() as u8]);
        packed.extend(pack(&differences, bits));
    }
    packed
}

/// Returns the number of bits needed for a number in two's complement.
const fn bits_of(number: i32) -> u32 {
    let magnitude = if number < 0 { !number } else { number };
    33 - magnitude.leading_zeros()
}

fn pack(numbers: &[i32], width: u32) -> Vec<u8> {
    let (mut packed, mut held, mut count) = (Vec::new(), 0_u64, 0);
    for number in numbers {
        let low = u64::from(*number as u32) & ((1 << width) - 1);
        held |= low << count;
        count += width;
        while count >= 8 {
            packed.push(held as u8);
            held >>= 8;
            count -= 8;
        }
    }
    if count > 0 {
        packed.push(held as u8);
    }
    packed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_written_as_the_tests_of_polars_sdk_have_them() {
        // AccDataTest: a difference in six bits a channel.
        let bytes = [0xf1, 0xff, 0x14, 0x00, 0xf0, 0x03, 0x06, 0x01, 0x7b, 0x0f, 0x00];
        assert_eq!(compress(&[[-15, 20, 1008], [-20, 17, 1008]], 2)[..6], bytes[..6]);
        assert_eq!(pack(&[-5, -3, 0], 6), bytes[8..]);
    }

    #[test]
    fn a_number_has_the_bits_that_it_needs() {
        assert_eq!([0, -1, 1, -2, 2, 127, -128, 128].map(bits_of), [1, 1, 2, 2, 3, 8, 8, 9]);
        assert_eq!([i32::MAX, i32::MIN].map(bits_of), [32, 32]);
    }
}
