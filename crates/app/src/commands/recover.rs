//! `teampulse recover`: mends a damaged bag.

use std::path::PathBuf;

use clap::Args;

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
        for file in &report.files {
            let path = file.path.display();
            if file.damage.is_empty() {
                output::line(format!("{path}: whole, {} messages", file.messages));
            } else {
                output::line(format!("{path}: mended, {} messages kept", file.messages));
                output::lines(file.damage.iter().map(|each| format!("  {}", told(each))));
            }
        }
        Ok(Exit::Fine)
    }
}
