//! The commands, one file each.

mod calibrate;
mod check;
mod demo;
mod emulate;
mod export;
mod extract;
mod import;
pub mod info;
mod list;
mod model_process;
mod models;
mod play;
mod recover;
pub mod replay;
mod retime;
mod run;
mod scan;
pub(crate) mod schema;
pub mod simulate;

use clap::Subcommand;

use crate::exit::Exit;
use crate::failure::Failure;

/// The commands of `teampulse`.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Shows everything at once: simulated robots in a separate process, monitored and recorded
    Demo(demo::Demo),
    /// Monitors and records a real team
    Run(run::Run),
    /// Reports go or no-go before a recording
    Check(check::Check),
    /// Shows what is in range, with the lines of a study to paste
    Scan(scan::Scan),
    /// Plays a bag back onto ROS
    Play(play::Play),
    /// Computes all derived streams again from raw data, as fast as possible
    Replay(replay::Replay),
    /// Writes a new bag with improved times
    Retime(retime::Retime),
    /// Finds a device's fixed latency from events that two streams recorded
    Calibrate(calibrate::Calibrate),
    /// Shows the contents of a bag
    Info(info::Info),
    /// Repairs a damaged bag
    Recover(recover::Recover),
    /// Converts recordings and tables of other programs to bags
    Import(Box<import::Import>),
    /// Exports a bag as tables
    Export(export::Export),
    /// Finds beats, responses and features in any table of samples
    Extract(extract::Extract),
    /// Lists the components that a study can use
    List(list::List),
    /// Lists, adds and verifies the models that a session can run on pictures
    Models(models::Models),
    /// Prints the JSON schema of a study, for completion and hover texts in an editor
    Schema,
    /// Runs only the simulated robots and people of a study, on ROS
    Simulate(simulate::Simulate),
    /// Runs only the emulated wearables of a study, on their transports
    Emulate(emulate::Emulate),
    /// Runs models for a session in a separate process
    #[command(name = "__model", hide = true)]
    ModelProcess(model_process::ModelProcess),
}

impl Command {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        match self {
            Command::Demo(command) => command.run().await,
            Command::Run(command) => command.run().await,
            Command::Check(command) => command.run().await,
            Command::Scan(command) => command.run().await,
            Command::Play(command) => command.run().await,
            Command::Replay(command) => command.run().await,
            Command::Retime(command) => command.run().await,
            Command::Calibrate(command) => command.run(),
            Command::Info(command) => command.run(),
            Command::Recover(command) => command.run().await,
            Command::Import(command) => command.run().await,
            Command::Export(command) => command.run().await,
            Command::Extract(command) => command.run(),
            Command::List(command) => Ok(command.run()),
            Command::Models(command) => command.run(),
            Command::Schema => Ok(schema::run()),
            Command::Simulate(command) => command.run().await,
            Command::Emulate(command) => command.run().await,
            Command::ModelProcess(command) => Ok(command.run()),
        }
    }
}
