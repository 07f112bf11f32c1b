//! Plays a bag onto ROS, from the current position until the end.

use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;

use teampulse_bag::{Bag, BagSource, Pace, Selection, Unread};
use teampulse_core::clocks::Clocks;
use teampulse_core::session::Session;
use teampulse_core::time::Time;
use teampulse_dashboard::{Playhead, Shown};
use teampulse_messages::convert::encode;
use teampulse_ros::bus::Bus;
use teampulse_ros::sink::{Publish, RosSink};

use crate::exit::Exit;
use crate::outcome::conclude;
use crate::output::say;
use crate::stop::Stop;

/// How often to check whether the end is reached, and whether a browser still shows the page.
const LOOK: Duration = Duration::from_millis(200);
/// The number of successive checks after the end that must find no browser before the command ends: a page that is
/// being reloaded is soon back.
const PATIENCE: u32 = 15;

/// Plays a bag.
pub(super) struct Player {
    pub bag: Arc<Bag>,
    pub playhead: Playhead,
    /// The bus on which the bag is published; `None` if it is only shown.
    pub bus: Option<Arc<dyn Bus>>,
    /// Whether `/clock` is published, too.
    pub has_clock: bool,
    pub shown: Option<Shown>,
    /// Whether the bag starts again at the end.
    pub is_endless: bool,
    pub stop: Stop,
    pub unread: Arc<Unread>,
}

/// Why playback of a stretch ended.
enum Ended {
    /// The command was asked to stop.
    Stopped,
    /// The position was moved.
    Moved,
    /// The end of the bag was reached.
    Over,
}

/// Resolves when the command is asked to stop.
type Asked = Pin<Box<dyn Future<Output = ()> + Send>>;

impl Player {
    /// Plays until the end, or until asked to stop. Starts at the start of the bag or at the current position, and
    /// continues from the new position whenever it is moved.
    pub(super) async fn play(&self, is_from_start: bool, mut asked: Asked) -> Exit {
        let mut exit = Exit::Fine;
        let mut from = (!is_from_start).then(|| self.playhead.now());
        loop {
            let (ended, was) = match &self.bus {
                Some(bus) => self.publish(bus, from, &mut asked).await,
                None => (self.pass(&mut asked).await, Exit::Fine),
            };
            exit = if exit == Exit::Fine { was } else { exit };
            let goes_on = match ended {
                Ended::Stopped => false,
                Ended::Moved => true,
                Ended::Over if self.is_endless => {
                    self.playhead.jump(self.playhead.first());
                    true
                }
                Ended::Over => self.is_moved(&mut asked).await,
            };
            if !goes_on {
                return exit;
            }
            from = Some(self.playhead.now());
        }
    }

    /// Publishes the bag in step with the position, until the position jumps.
    async fn publish(
        &self,
        bus: &Arc<dyn Bus>,
        from: Option<Time>,
        asked: &mut Asked,
    ) -> (Ended, Exit) {
        let position = self.playhead.position();
        let pace = Pace::new(position.rate);
        pace.set_paused(position.is_paused);
        let source = BagSource::new(Arc::clone(&self.bag), Selection::RawAndDerived).as_placed();
        let mut source = source.paced(pace.clone()).noting(&self.unread);
        if let Some(from) = from {
            source = source.starting(from);
        }
        let mut sink = RosSink::lossless(Arc::clone(bus), Publish::Everything);
        if self.has_clock {
            sink = sink.with_clock();
        }
        let session = Session {
            sinks: vec![Box::new(sink)],
            ..Session::of_recording(source, Clocks::as_stamped(), encode)
        };
        let mut ended = Ended::Over;
        let until = async {
            ended = tokio::select! {
                () = asked => Ended::Stopped,
                () = self.moved(position.jumps, &pace) => Ended::Moved,
            };
        };
        let outcome = session.run_until(until, self.stop.clone().hurried()).await;
        (ended, conclude(outcome))
    }

    /// Resolves when the position jumps to another time; until then, passes changes of speed and pauses on to `pace`.
    async fn moved(&self, jumps: u64, pace: &Pace) {
        let mut changes = self.playhead.changes();
        loop {
            let position = *changes.borrow_and_update();
            if position.jumps != jumps {
                return;
            }
            pace.set_rate(position.rate);
            pace.set_paused(position.is_paused);
            if changes.changed().await.is_err() {
                std::future::pending::<()>().await;
            }
        }
    }

    /// Waits for the end of the bag if nothing is published.
    async fn pass(&self, asked: &mut Asked) -> Ended {
        let over = async {
            while !self.playhead.is_over() {
                tokio::time::sleep(LOOK).await;
            }
        };
        tokio::select! {
            () = asked => Ended::Stopped,
            () = over => Ended::Over,
        }
    }

    /// Waits at the end as long as a browser shows the page or, if the bag is only shown, until asked to stop. Returns
    /// whether playback continues from another time.
    async fn is_moved(&self, asked: &mut Asked) -> bool {
        let Some(shown) = &self.shown else { return false };
        let is_only_shown = self.bus.is_none();
        if is_only_shown || shown.viewers() > 0 {
            say("the bag has ended; choose another time on the page, or press Ctrl-C");
        }
        let jumps = self.playhead.position().jumps;
        let mut alone = if shown.viewers() > 0 { 0 } else { PATIENCE };
        while self.playhead.position().jumps == jumps {
            if shown.has_ended() || (!is_only_shown && alone >= PATIENCE) {
                return false;
            }
            tokio::select! {
                () = &mut *asked => return false,
                () = tokio::time::sleep(LOOK) => {}
            }
            alone = if shown.viewers() > 0 { 0 } else { alone.saturating_add(1) };
        }
        true
    }
}
