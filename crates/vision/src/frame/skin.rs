//! Detection of skin-coloured regions.
//!
//! Skin of every tone has nearly the same hue, which is that of blood. Its Cb and Cr are within one range (Chai & Ngan
//! 1999, doi:10.1109/76.767122), as are those of wood and sand.

use super::blocks::Blocks;

/// The ranges of Cb and Cr for skin [0..255].
const BLUE: std::ops::RangeInclusive<f64> = 77.0..=127.0;
const RED: std::ops::RangeInclusive<f64> = 133.0..=173.0;
/// The smallest luma at which colours are reliable [0..1].
const DARK: f64 = 0.08;

/// The largest region of skin-coloured blocks.
#[derive(Clone, Debug)]
pub(super) struct Region {
    /// The region's share of all blocks [0..1].
    pub share: f64,
    /// The mean red, green and blue of the region [0..1]; NaN without a block.
    pub colour: [f64; 3],
    /// Whether each block belongs to the region.
    pub is_in: Vec<bool>,
}

/// Finds the largest connected skin-coloured region.
pub(super) fn largest(blocks: &Blocks) -> Region {
    let mut is_free: Vec<bool> = blocks.colours.iter().map(is_skin).collect();
    let mut largest = Vec::new();
    for start in 0..is_free.len() {
        if is_free[start] {
            let region = connected(start, blocks, &mut is_free);
            if region.len() > largest.len() {
                largest = region;
            }
        }
    }
    let mut is_in = vec![false; is_free.len()];
    let mut colour = [0.0; 3];
    for place in &largest {
        is_in[*place] = true;
        for (sum, part) in colour.iter_mut().zip(blocks.colours[*place]) {
            *sum += part / largest.len() as f64;
        }
    }
    if largest.is_empty() {
        colour = [f64::NAN; 3];
    }
    Region { share: largest.len() as f64 / is_free.len().max(1) as f64, colour, is_in }
}

/// Returns a block and all blocks connected to it by an edge, and marks them as taken.
fn connected(start: usize, blocks: &Blocks, is_free: &mut [bool]) -> Vec<usize> {
    is_free[start] = false;
    let mut region = vec![start];
    let mut next = 0;
    while let Some(&place) = region.get(next) {
        next += 1;
        let column = place % blocks.columns;
        let left = (column > 0).then(|| place - 1);
        let right = (column + 1 < blocks.columns).then_some(place + 1);
        let above = place.checked_sub(blocks.columns);
        let below = Some(place + blocks.columns).filter(|below| *below < is_free.len());
        for neighbour in [left, right, above, below].into_iter().flatten() {
            if std::mem::replace(&mut is_free[neighbour], false) {
                region.push(neighbour);
            }
        }
    }
    region
}

fn is_skin([red, green, blue]: &[f64; 3]) -> bool {
    let luma = 0.299 * red + 0.587 * green + 0.114 * blue;
    let difference_of = |part: f64, scale: f64| 128.0 + 255.0 * (part - luma) / scale;
    luma >= DARK
        && BLUE.contains(&difference_of(*blue, 1.772))
        && RED.contains(&difference_of(*red, 1.402))
}
