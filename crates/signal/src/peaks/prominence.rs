//! The prominence of peaks.

use super::Peak;

/// Lowest sample of a stretch of the signal.
#[derive(Clone, Copy)]
struct Lowest {
    index: usize,
    height: f64,
}

/// The peaks at the ascending `indices`, without widths.
pub(super) fn measured(signal: &[f64], indices: &[usize]) -> Vec<Peak> {
    let left = bases(signal.iter().copied().enumerate(), indices.iter().copied());
    let right = bases(signal.iter().copied().enumerate().rev(), indices.iter().rev().copied());
    let both = indices.iter().zip(left.iter().zip(right.iter().rev()));
    both.map(|(&index, (left, right))| Peak {
        index,
        height: signal[index],
        prominence: signal[index] - left.height.max(right.height),
        left_base: left.index,
        right_base: right.index,
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
/// stack.
fn bases(
    samples: impl Iterator<Item = (usize, f64)>,
    mut peaks: impl Iterator<Item = usize>,
) -> Vec<Lowest> {
    let mut bases = Vec::new();
    let mut higher: Vec<(f64, Lowest)> = Vec::new();
    let mut next = peaks.next();
    for (index, height) in samples {
        let mut lowest = Lowest { index, height };
        while let Some((_, before)) = higher.pop_if(|(before, _)| *before <= height) {
            if before.height < lowest.height {
                lowest = before;
            }
        }
        higher.push((height, lowest));
        if next == Some(index) {
            bases.push(lowest);
            next = peaks.next();
        }
    }
    bases
}
