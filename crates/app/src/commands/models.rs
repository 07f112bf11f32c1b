//! `teampulse models`: manages the models that a session can run on pictures.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use teampulse_core::clock::Stopwatch;
use teampulse_vision::model::Model;
use teampulse_vision::model::descriptor::{Descriptor, contents, sha256};
use teampulse_vision::model::ready::{READY, named};
use teampulse_vision::model::tensor::shown;
use teampulse_workers::model::serve::{library, limit_memory};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;

/// The most memory that a model may use while it is verified [MiB].
const MEMORY_MIB: u64 = 4096;
/// The hint for every error in a descriptor.
const SEE_DOCS: &str = "docs/models.md has the settings of a descriptor";

/// Lists the models that are ready to use, adds and verifies them.
#[derive(Debug, Args)]
pub struct Models {
    #[command(subcommand)]
    act: Act,
}

#[derive(Debug, Subcommand)]
enum Act {
    /// Lists the descriptors that are ready, or those in a folder
    List {
        /// A folder with descriptors
        folder: Option<PathBuf>,
    },
    /// Writes the descriptor of a model that you have downloaded next to its file, with the hash of the file
    Add {
        /// The name of a ready descriptor
        name: String,
        /// The ONNX file
        file: PathBuf,
    },
    /// Checks files against their descriptors, and runs each model once on a black picture
    Verify {
        /// The descriptors
        #[arg(required = true)]
        descriptors: Vec<PathBuf>,
        /// The library of an ONNX Runtime; by default the one in `ORT_DYLIB_PATH`, or else the engine in pure Rust
        #[arg(long)]
        onnx_runtime: Option<PathBuf>,
    },
}

impl Models {
    /// Runs the command.
    pub fn run(self) -> Result<Exit, Failure> {
        match self.act {
            Act::List { folder: None } => list_ready(),
            Act::List { folder: Some(folder) } => list(&folder),
            Act::Add { name, file } => add(&name, &file),
            Act::Verify { descriptors, onnx_runtime } => Ok(verify(&descriptors, onnx_runtime)),
        }
    }
}

fn list_ready() -> Result<Exit, Failure> {
    for ready in READY {
        let descriptor = Descriptor::parse(ready.text).map_err(Failure::to)?;
        show(&descriptor);
        output::line(format!("    from     {}", descriptor.origin));
    }
    output::note("download one, then `teampulse models add NAME FILE`");
    Ok(Exit::Fine)
}

fn list(folder: &Path) -> Result<Exit, Failure> {
    let unread = |error| Failure::to(format!("read {}: {error}", folder.display()));
    let entries = std::fs::read_dir(folder).map_err(unread)?;
    let paths = entries.flatten().map(|entry| entry.path());
    let mut paths: Vec<_> =
        paths.filter(|path| path.extension().is_some_and(|end| end == "toml")).collect();
    paths.sort();
    let mut exit = Exit::Fine;
    for path in paths {
        match Descriptor::read(&path) {
            Ok(descriptor) => {
                show(&descriptor);
                output::line(format!("    in       {}", path.display()));
            }
            Err(error) => {
                output::say(failed(&path, &error));
                exit = Exit::Failed;
            }
        }
    }
    Ok(exit)
}

fn show(descriptor: &Descriptor) {
    let Descriptor { name, doc, licence, file, .. } = descriptor;
    let looks_at = format!("{:?}", descriptor.input.source).to_lowercase();
    output::line(format!("{name}: {doc}"));
    output::line(format!("    looks at {looks_at}"));
    output::line(format!("    file     {}", file.display()));
    output::line(format!("    licence  {licence}"));
}

/// Writes a ready descriptor next to a model's file.
fn add(name: &str, file: &Path) -> Result<Exit, Failure> {
    let Some(ready) = named(name) else {
        let names: Vec<&str> = READY.iter().map(|ready| ready.name).collect();
        let failure = Failure::new(format!("there is no ready descriptor `{name}`"));
        return Err(failure
            .exit(Exit::BadArguments)
            .hint(format!("ready descriptors are {}", names.join(", "))));
    };
    let bytes = contents(file).map_err(Failure::to)?;
    // An ONNX file starts with the version of its format; a web page or a Git LFS pointer starts differently.
    if bytes.first() != Some(&0x08) {
        let failure = Failure::new(format!("{} is not an ONNX file", file.display()));
        return Err(failure.hint(
            "was a page downloaded instead of the file? `teampulse models list` has its address",
        ));
    }
    let hash = sha256(&bytes);
    let descriptor = Descriptor::parse(ready.text).map_err(Failure::to)?;
    let of_file = file.file_name().unwrap_or_default().to_string_lossy();
    let old = format!("file    = {:?}\n", descriptor.file.display().to_string());
    let new = format!("file    = {of_file:?}\nsha256  = \"{hash}\"\n");
    let path = file.with_file_name(format!("{name}.toml"));
    let text = ready.text.replacen(&old, &new, 1);
    let mut options = std::fs::OpenOptions::new();
    let written = options.write(true).create_new(true).open(&path);
    let written = written.and_then(|mut to| std::io::Write::write_all(&mut to, text.as_bytes()));
    written.map_err(|error| Failure::to(format!("write {}: {error}", path.display())))?;
    output::line(path.display().to_string());
    output::note(format!(
        "its licence is {}; `teampulse models verify` runs it once",
        descriptor.licence
    ));
    Ok(Exit::Fine)
}

/// Describes the failure to use a descriptor, with its path unless the error contains it.
fn failed(path: &Path, error: &dyn std::fmt::Display) -> String {
    let (path, error) = (path.display().to_string(), error.to_string());
    if error.contains(&path) {
        format!("failed to {error}")
    } else {
        format!("{path}: failed to {error}")
    }
}

fn verify(descriptors: &[PathBuf], onnx_runtime: Option<PathBuf>) -> Exit {
    limit_memory(MEMORY_MIB);
    let library = library(onnx_runtime);
    let mut exit = Exit::Fine;
    for path in descriptors {
        let run = Model::load(path, &library).and_then(|mut model| {
            let began = Stopwatch::start();
            let outputs = model.dry_run()?;
            let took_ms = began.elapsed().as_secs_f64() * 1e3;
            show(&model.descriptor);
            output::line(format!("    input    {}", shown(&model.descriptor.input.shape())));
            for output in &outputs {
                output::line(format!("    output   {} {}", output.name, output.shown()));
            }
            output::line(format!("    ran in   {took_ms:.1} ms with {}", model.engine()));
            Ok(())
        });
        if let Err(error) = run {
            Failure::new(failed(path, &error)).hint(SEE_DOCS).show();
            exit = Exit::Failed;
        }
    }
    exit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_has_its_path_once() {
        let path = Path::new("/nope");
        assert_eq!(failed(path, &"read /nope: not found"), "failed to read /nope: not found");
        assert_eq!(failed(path, &"use the model `x`"), "/nope: failed to use the model `x`");
    }
}
