//! A cache of FFT plans.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use super::welch::{Lengths, Transform, Welch};

/// The cache size: windows of one length in seconds differ in samples by a dozen lengths.
const MOST_KEPT: usize = 32;

/// FFT plans of earlier spectra: planning costs more than the transform. Shared by its clones; it does not
/// affect results.
#[derive(Clone, Default)]
pub(crate) struct Transforms(Arc<Mutex<Vec<Kept>>>);

struct Kept {
    settings: Welch,
    lengths: Lengths,
    transform: Transform,
}

impl Transforms {
    /// Uses the plan for these settings.
    pub(super) fn with<T>(
        &self,
        settings: &Welch,
        lengths: Lengths,
        of: impl FnOnce(&mut Transform) -> T,
    ) -> T {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_it = |kept: &Kept| kept.lengths == lengths && kept.settings == *settings;
        let place = all.iter().position(is_it).unwrap_or_else(|| {
            let transform = Transform::new(settings, lengths);
            if all.len() == MOST_KEPT {
                all.remove(0);
            }
            all.push(Kept { settings: settings.clone(), lengths, transform });
            all.len() - 1
        });
        of(&mut all[place].transform)
    }
}

impl fmt::Debug for Transforms {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Transforms").finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kept_transform_gives_what_a_new_one_gives() {
        let kept = Transforms::default();
        let signal: Vec<f64> = (0..100u32).map(|k| f64::from(k * k % 37)).collect();
        for length in (40..100).chain(40..100) {
            for rate_hz in [4.0, 8.0] {
                let (welch, signal) = (Welch::new(rate_hz, 64), &signal[..length]);
                assert_eq!(welch.of_next(signal, &kept), welch.of(signal));
            }
        }
        assert_eq!(kept.0.lock().unwrap().len(), MOST_KEPT);
    }
}
