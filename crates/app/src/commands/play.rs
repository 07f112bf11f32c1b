//! `teampulse play`: plays a bag back onto ROS.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use clap::Args;
use teampulse_bag::{BagSource, Pace as Playing, Selection};
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::session::Session;
use teampulse_messages::convert::encode;
use teampulse_ros::BusId;
use teampulse_ros::sink::{Publish, RosSink};
use teampulse_sources::session::pause_by_key;

use crate::commands::info::{after_reading, open, warn_of_damage};
use crate::commands::run::seconds;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::network;
use crate::output::say;
use crate::setup::conclude;
use crate::stop::Stop;

/// Plays a bag back onto ROS, on this machine only by default.
///
/// During playback the space bar pauses and resumes, `q` ends it.
#[derive(Debug, Args)]
pub struct Play {
    /// The bag's folder, or one of its .mcap files
    bag: PathBuf,
    /// The speed relative to the recording
    #[arg(long, default_value = "1", value_parser = seconds)]
    rate: f64,
    /// Seconds to skip at the start
    #[arg(long, value_name = "SECS", value_parser = seconds)]
    start: Option<f64>,
    /// Starts again at the end, forever
    #[arg(long = "loop")]
    again: bool,
    /// Publishes /clock
    #[arg(long)]
    clock: bool,
    /// Plays onto the network, where real robots may receive it
    #[arg(long)]
    network: bool,
    /// The ROS domain; by default that of `ROS_DOMAIN_ID`, else 0
    #[arg(long, value_name = "ID")]
    domain: Option<BusId>,
}

impl Play {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        let bag = Arc::new(open(&self.bag)?);
        warn_of_damage(&bag);
        let join = if self.network { network::buses } else { network::buses_on_this_machine };
        let buses = join("teampulse_player");
        let domain = self.domain.clone().map_or_else(|| network::default_bus(&buses), Ok)?;
        let bus = buses.get(&domain)?;
        let pace = Playing::new(self.rate);
        let mut source = BagSource::new(Arc::clone(&bag), Selection::RawAndDerived)
            .as_placed()
            .paced(pace.clone())
            .repeated(if self.again { u64::MAX } else { 1 });
        if let (Some(secs), Some((first, last))) = (self.start, bag.bounds()) {
            if secs > last.secs_since(first) {
                let lasts_secs = last.secs_since(first);
                return Err(Failure::new(format!("the bag lasts {lasts_secs:.1} s only"))
                    .hint("give a --start within it"));
            }
            source = source.starting(first + Duration::from_secs_f64(secs));
        }
        let unread = source.unread();
        let mut sink = RosSink::lossless(bus, Publish::Everything);
        if self.clock {
            sink = sink.with_clock();
        }
        let stop = Stop::default();
        let quit = stop.clone();
        let pause = move || pace.set_paused(!pace.is_paused());
        let _keys = pause_by_key(pause, move || quit.ask());
        say(format!("playing {} on {domain}; Ctrl-C ends it", self.bag.display()));
        let session = Session {
            sinks: vec![Box::new(sink)],
            ..Session::of_recording(source, Clocks::as_stamped(), encode)
        };
        let exit = conclude(stop.run(session, Clock::host(), None).await);
        Ok(after_reading(&bag, &unread, exit))
    }
}
