//! The prominence of peaks.

use super::Peak;

/// The lowest sample of a stretch of the signal.
#[derive(Clone, Copy)]
struct Lowest {
    index: usize,
    height: f64,
}

/// The peaks at the ascending `indices`, without widths.
pub(super) fn measured(signal: &[f64], indices: &[usize]) -> Vec<Peak> {
    let last = signal.len().saturating_sub(1);
    let left = bases(signal.len(), |index| signal[index], indices.iter().copied());
    let backwards = indices.iter().rev().map(|index| last - index);
    let right = bases(signal.len(), |index| signal[last - index], backwards);
    let both = indices.iter().zip(left.iter().zip(right.iter().rev()));
    both.map(|(&index, (left, right))| Peak {
        index,
        height: signal[index],
        prominence: signal[index] - left.height.max(right.height),
        left_base: left.index,
        right_base: last - right.index,
        width: 0.0,
        left_crossing: index as f64,
        right_crossing: index as f64,
    })
    .collect()
}

/// For each peak the minimum between it and the last higher sample (or NaN) before it, the nearest of equal
/// ones, in one pass.
///
/// The stack holds samples in descending order, each with the minimum between it and the one below it on the
/// stack. A sample within a rise or a fall is neither the minimum nor needed as higher ground.
fn bases(
    count: usize,
    height: impl Fn(usize) -> f64,
    mut peaks: impl Iterator<Item = usize>,
) -> Vec<Lowest> {
    let mut bases = Vec::new();
    let mut higher: Vec<(f64, Lowest)> = Vec::new();
    let mut next_peak = peaks.next();
    let mut previous = f64::NAN;
    for index in 0..count {
        let here = height(index);
        let after = if index + 1 < count { height(index + 1) } else { f64::NAN };
        let is_between = previous < here && here < after || previous > here && here > after;
        previous = here;
        if is_between {
            continue;
        }
        let mut lowest = Lowest { index, height: here };
        while let Some((_, before)) = higher.pop_if(|(height, _)| *height <= here) {
            if before.height < lowest.height {
                lowest = before;
            }
        }
        higher.push((here, lowest));
        if next_peak == Some(index) {
            bases.push(lowest);
            next_peak = peaks.next();
        }
    }
    bases
}
