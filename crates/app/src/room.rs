//! Finds a folder where a recording has room to start and to continue.

use std::path::{Path, PathBuf};

use teampulse_sinks::Bag;

use crate::machine::unfit;

/// The folder of a recording, and why it can't be used as intended.
pub struct Room {
    /// The folder in which the recording starts: the requested one, or the fallback if nothing can be recorded there.
    pub folder: PathBuf,
    /// Why the recording starts in the fallback.
    pub instead: Option<String>,
    /// Why the recording can start in neither folder.
    pub unfit: Option<String>,
    /// Why the recording could not continue in its fallback.
    pub unfit_fallback: Option<String>,
}

impl Room {
    /// Finds where a recording into `out` has room, given the settings of the study's bags.
    pub fn of(bags: &[Bag], out: &Path) -> Room {
        let keep_free_bytes = bags.iter().map(keep_free_bytes).max().unwrap_or(0);
        let unfit_fallback = bags.iter().find_map(|bag| {
            let reason = unfit(bag.fallback.as_deref()?, keep_free_bytes)?;
            Some(format!("the fallback of the bag is unusable: {reason}"))
        });
        let room = Room { folder: out.to_owned(), instead: None, unfit: None, unfit_fallback };
        let Some(reason) = unfit(out, keep_free_bytes) else { return room };
        match bags.iter().find_map(|bag| bag.fallback.clone()) {
            Some(folder) if room.unfit_fallback.is_none() => {
                let instead = format!("{reason}: the recording starts in {}", folder.display());
                Room { folder, instead: Some(instead), ..room }
            }
            _ => Room { unfit: Some(reason), ..room },
        }
    }
}

/// The space that a bag leaves free on its disk [bytes].
fn keep_free_bytes(bag: &Bag) -> u64 {
    bag.keep_free_mib.saturating_mul(1 << 20)
}
