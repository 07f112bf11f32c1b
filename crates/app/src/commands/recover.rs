//! `teampulse recover`: repairs a damaged bag.

use std::path::{Path, PathBuf};

use clap::Args;
use teampulse_bag::{BagError, Found, RecoveredFile, folder_with};
use teampulse_core::counted::counted;

use crate::commands::info::{NO_CHECKSUMS, damage_text};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::{self, say};
use crate::tidied::{SUMMARY, write_tidy_files};

/// Repairs a damaged bag in place, keeping all readable messages, and writes its tidy files
#[derive(Debug, Args)]
pub struct Recover {
    /// The bag's folder, or one of its .mcap files: either way the whole bag is repaired
    bag: PathBuf,
}

impl Recover {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        // A symbolic link is kept, and its target is repaired.
        let path = self.bag.canonicalize().unwrap_or_else(|_| self.bag.clone());
        let path = folder_with(&path).map(Path::to_owned).unwrap_or(path);
        let report = teampulse_bag::recover(&path).map_err(|error| self.refused(&error))?;
        report.files.iter().for_each(print_file);
        for file in &report.absent {
            output::line(format!(
                "{}: missing; metadata.yaml now lists the other files",
                file.display()
            ));
        }
        let is_mended = report.files.iter().any(|file| !file.damage.is_empty());
        let mut exit = Exit::Fine;
        if path.is_dir() && (is_mended || !path.join(SUMMARY).exists()) {
            exit = tidied(&path).await;
        }
        let is_lossy =
            !report.absent.is_empty() || report.files.iter().any(RecoveredFile::is_lossy);
        Ok(if is_lossy { Exit::DataLost } else { exit })
    }

    /// Explains why a bag can't be repaired. A file that is not MCAP is never changed; `import` makes a new bag of it.
    fn refused(&self, error: &BagError) -> Failure {
        let bag = self.bag.display();
        match error {
            BagError::NotABag { found: Found::Foreign, .. } => {
                Failure::new(format!("{bag} is not an MCAP bag: it can be read as far as it is intact, but is never changed"))
                    .hint(format!(
                        "`teampulse import {bag}` makes a new bag of everything that can be read, with its tidy files"
                    ))
            }
            _ => Failure::to(error).hint(error.hint()),
        }
    }
}

/// Writes the tidy files; a bag without a usable study is complete without them.
async fn tidied(folder: &Path) -> Exit {
    match write_tidy_files(folder).await {
        Ok(exit) => exit,
        Err(failure) => {
            say("the bag is intact, but its tidy files can't be written:");
            failure.show();
            Exit::Fine
        }
    }
}

fn print_file(file: &RecoveredFile) {
    let path = file.path.display();
    let lost = match file.lost_messages {
        Some(0) => ", none lost".to_owned(),
        Some(lost) => format!(", {lost} lost"),
        None => ", an unknown number lost".to_owned(),
    };
    let messages = counted(file.messages, "message", "messages");
    if file.damage.is_empty() {
        let lost = if file.is_lossy() { lost.as_str() } else { "" };
        let unsure =
            if file.lacked_checksums { format!(", {NO_CHECKSUMS}") } else { String::new() };
        output::line(format!("{path}: intact, {messages}{lost}{unsure}"));
        return;
    }
    output::line(format!("{path}: repaired, {messages} kept{lost}"));
    output::lines(file.damage.iter().map(|each| format!("  {}", damage_text(each))));
    if let Some(original) = &file.original {
        output::line(format!("  the damaged file is kept as {}", original.display()));
    }
}
