//! `teampulse recover`: mends a damaged bag.

use std::path::PathBuf;

use clap::Args;
use teampulse_bag::RecoveredFile;

use crate::commands::info::told;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;

/// Mends a damaged bag: keeps all that can be read, in place.
#[derive(Debug, Args)]
pub struct Recover {
    /// The bag's folder, or one of its .mcap files
    bag: PathBuf,
}

impl Recover {
    /// Does it.
    pub fn run(self) -> Result<Exit, Failure> {
        let recovered = teampulse_bag::recover(&self.bag);
        let report = recovered.map_err(|error| Failure::to(&error).hint(error.hint()))?;
        report.files.iter().for_each(tell);
        if report.files.iter().any(|file| !file.damage.is_empty()) {
            eprintln!("`teampulse replay` makes its tidy files (summary.md and the tables) anew");
        }
        let is_lossy = report.files.iter().any(RecoveredFile::is_lossy);
        Ok(if is_lossy { Exit::DataLost } else { Exit::Fine })
    }
}

fn tell(file: &RecoveredFile) {
    let path = file.path.display();
    let lost = match file.lost_messages {
        Some(0) => ", none lost".to_owned(),
        Some(lost) => format!(", {lost} lost"),
        None => String::new(),
    };
    if file.damage.is_empty() {
        let lost = if file.is_lossy() { lost.as_str() } else { "" };
        output::line(format!("{path}: whole, {} messages{lost}", file.messages));
        return;
    }
    output::line(format!("{path}: mended, {} messages kept{lost}", file.messages));
    output::lines(file.damage.iter().map(|each| format!("  {}", told(each))));
    if let Some(original) = &file.original {
        output::line(format!("  the damaged file is kept as {}", original.display()));
    }
}
