//! Where a recording has room to begin and to continue.

use std::path::{Path, PathBuf};

use teampulse_sinks::Bag;

use crate::machine::unfit;

/// The folder of a recording.
pub struct Room {
    /// The folder in which it begins: the one that was asked for, or the fallback if nothing can be recorded there.
    pub folder: PathBuf,
    /// Why it begins in the fallback.
    pub instead: Option<String>,
    /// Why it can begin in neither.
    pub unfit: Option<String>,
    /// Why it could not continue in its fallback.
    pub unfit_fallback: Option<String>,
}

impl Room {
    /// That of a recording into `out` by these sinks of a study.
    pub fn of(bags: &[Bag], out: &Path) -> Room {
        let keep_free_bytes = bags.iter().map(keep_free_bytes).max().unwrap_or(0);
        let unfit_fallback = bags.iter().find_map(|bag| {
            let reason = unfit(bag.fallback.as_deref()?, keep_free_bytes)?;
            Some(format!("the recording could not continue in its fallback: {reason}"))
        });
        let room = Room { folder: out.to_owned(), instead: None, unfit: None, unfit_fallback };
        let Some(reason) = unfit(out, keep_free_bytes) else { return room };
        match bags.iter().find_map(|bag| bag.fallback.clone()) {
            Some(folder) if room.unfit_fallback.is_none() => {
                let instead = format!("{reason}: the recording begins in {}", folder.display());
                Room { folder, instead: Some(instead), ..room }
            }
            _ => Room { unfit: Some(reason), ..room },
        }
    }
}

/// The space that a bag leaves free [bytes].
fn keep_free_bytes(bag: &Bag) -> u64 {
    bag.keep_free_mib.saturating_mul(1 << 20)
}
