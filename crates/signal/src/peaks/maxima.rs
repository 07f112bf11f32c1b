//! Local maxima.

/// The indices of local maxima; the middle of a plateau, rounded down.
pub(super) fn local_maxima(signal: &[f64]) -> Vec<usize> {
    let mut maxima = Vec::new();
    let mut index = 1;
    while index + 1 < signal.len() {
        let height = signal[index];
        let mut end = index + 1;
        if signal[index - 1] < height {
            // The last sample may belong to a plateau, which is then not a maximum.
            while end + 1 < signal.len() && (height..=height).contains(&signal[end]) {
                end += 1;
            }
            if signal[end] < height {
                maxima.push(usize::midpoint(index, end - 1));
            }
        }
        index = end;
    }
    maxima
}
