//! `teampulse __model`: the process in which a session runs its models; not for users.

use std::io::{stdin, stdout};
use std::path::PathBuf;

use clap::Args;
use teampulse_workers::model::serve;

use crate::exit::Exit;

/// Runs models for a session, which sends pictures to its standard input.
#[derive(Debug, Args)]
pub struct ModelProcess {
    /// The most memory that the process may use [MiB]
    #[arg(long)]
    memory_mib: u64,
    /// The library of an ONNX Runtime
    #[arg(long)]
    onnx_runtime: Option<PathBuf>,
    /// The descriptors of the models
    #[arg(required = true)]
    descriptors: Vec<PathBuf>,
}

impl ModelProcess {
    /// Runs the command.
    pub fn run(self) -> Exit {
        serve::limit_memory(self.memory_mib);
        let library = serve::library(self.onnx_runtime);
        // The session was already sent the reason, and reports it.
        let served = serve::serve(&self.descriptors, &library, stdin().lock(), stdout().lock());
        if served.is_ok() { Exit::Fine } else { Exit::Failed }
    }
}
