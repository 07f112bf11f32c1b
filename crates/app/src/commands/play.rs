//! `teampulse play`: plays a bag back onto ROS and shows it in a browser.

mod player;
mod shown;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use clap::Args;
use teampulse_bag::Bag;
use teampulse_core::clock::Clock;
use teampulse_dashboard::Playhead;
use teampulse_ros::BusId;
use teampulse_ros::bus::Bus;
use teampulse_sources::session::pause_by_key;

use crate::commands::info::{after_reading, open, warn_of_damage};
use crate::commands::replay::{describe_foreign, study_of};
use crate::commands::run::seconds;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::network;
use crate::output::say;
use crate::stop::Stop;

use player::Player;

/// Plays a bag back onto ROS, on this machine only by default, and shows it in a browser.
///
/// During playback, the space bar pauses and resumes, and `q` ends it. When the page moves to another moment of the
/// bag, what is published on ROS follows. At the end, the command waits as long as a browser shows the page.
#[derive(Debug, Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is an option of its own")]
pub struct Play {
    /// The bag's folder, or one of its .mcap files
    bag: PathBuf,
    /// The speed relative to the recording
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = speed)]
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
    /// The ROS domain, or another bus as KIND:ADDRESS; by default the domain of `ROS_DOMAIN_ID`, else 0
    #[arg(long, value_name = "ID")]
    domain: Option<BusId>,
    /// Publishes nothing: the bag is only shown in a browser, until Ctrl-C
    #[arg(long, conflicts_with_all = ["clock", "network", "domain", "no_dashboard"])]
    no_ros: bool,
    /// Starts no dashboard in a browser
    #[arg(long)]
    no_dashboard: bool,
    /// The port of the dashboard; by default 8742, or the next free one
    #[arg(long, conflicts_with = "no_dashboard")]
    port: Option<u16>,
}

/// Parses a speed relative to that of the recording.
fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse().ok().filter(|speed: &f64| speed.is_finite() && *speed > 0.0);
    speed.ok_or_else(|| {
        format!("`{text}` is not a speed: give a number above 0, such as 2 for twice as fast as the recording")
    })
}

impl Play {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        let mut bag = open(&self.bag)?;
        warn_of_damage(&bag);
        // A bag whose study can't be read is shown like a bag of another recorder.
        if study_of(&bag).ok().flatten().is_none() {
            describe_foreign(&mut bag);
        }
        let bag = Arc::new(bag);
        let playhead = self.playhead(&bag)?;
        let bus = if self.no_ros { None } else { Some(self.bus()?) };
        let shown = if self.no_dashboard { None } else { shown::show(&bag, &playhead, self.port)? };
        let stop = Stop::default();
        let (quit, toggled) = (stop.clone(), playhead.clone());
        let pause = move || toggled.set_paused(!toggled.position().is_paused);
        let _keys = pause_by_key(pause, move || quit.ask());
        let on = bus.as_ref().map_or_else(String::new, |bus| format!(" on {}", bus.name()));
        say(format!("playing {}{on}; Ctrl-C ends it", self.bag.display()));
        if let Some(shown) = &shown {
            for line in shown.addresses().lines() {
                say(line);
            }
        }
        let unread = Arc::default();
        let (has_clock, is_endless) = (self.clock, self.again);
        let player = Player { bag, playhead, bus, has_clock, shown, is_endless, stop, unread };
        let asked = player.stop.clone().asked(Clock::host(), None);
        let exit = player.play(self.start.is_none(), Box::pin(asked)).await;
        Ok(after_reading(&player.bag, &player.unread, exit))
    }

    /// The position at which playback starts.
    fn playhead(&self, bag: &Bag) -> Result<Playhead, Failure> {
        let (first, last) = bag.bounds().unwrap_or_default();
        let from = match self.start {
            Some(secs) if secs > last.secs_since(first) => {
                let lasts_secs = last.secs_since(first);
                return Err(Failure::new(format!("the bag is only {lasts_secs:.1} s long"))
                    .hint("give a --start within that time"));
            }
            Some(secs) => first + Duration::from_secs_f64(secs),
            None => first,
        };
        Ok(Playhead::new((first, last), from, self.rate))
    }

    fn bus(&self) -> Result<Arc<dyn Bus>, Failure> {
        let join = if self.network { network::buses } else { network::buses_on_this_machine };
        let buses = join("teampulse_player");
        let domain = self.domain.clone().map_or_else(|| network::default_bus(&buses), Ok)?;
        Ok(buses.get(&domain)?)
    }
}
