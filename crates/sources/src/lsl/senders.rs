//! The clocks of senders, each with a name.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Clocks that differ by less are one [s].
const SAME_SECS: f64 = 0.1;
/// The most clocks of a computer; later ones share the last name.
const MOST: usize = 100;

/// The clocks of all computers that send, by how far they are ahead: a computer that was switched on again has
/// another one.
#[derive(Clone, Debug, Default)]
pub(super) struct SenderClocks(Arc<Mutex<BTreeMap<String, Vec<f64>>>>);

impl SenderClocks {
    /// The name of the clock of a computer that is this far ahead [s].
    pub fn name(&self, hostname: &str, offset_secs: f64) -> String {
        let mut clocks = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let offsets = clocks.entry(hostname.to_owned()).or_default();
        let known = offsets.iter().position(|known| (known - offset_secs).abs() < SAME_SECS);
        let number = known.unwrap_or_else(|| {
            if offsets.len() < MOST {
                offsets.push(offset_secs);
            }
            offsets.len() - 1
        });
        if let Some(known) = offsets.get_mut(number) {
            *known = offset_secs;
        }
        match number {
            0 => format!("LSL on {hostname}"),
            number => format!("LSL on {hostname} ({})", number + 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_computer_that_was_switched_on_again_has_another_clock() {
        let clocks = SenderClocks::default();
        assert_eq!(clocks.name("lab", -1.7e9), "LSL on lab");
        assert_eq!(clocks.name("lab", -1.7e9 + 0.05), "LSL on lab");
        assert_eq!(clocks.name("lab", -1.7e9 + 0.12), "LSL on lab", "it drifts");
        assert_eq!(clocks.name("lab", -1.8e9), "LSL on lab (2)");
        assert_eq!(clocks.name("other", -1.8e9), "LSL on other");
    }
}
