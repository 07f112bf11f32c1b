//! The simulated team as a source.

use std::time::Duration;

use async_trait::async_trait;
use bytes::Bytes;
use teampulse_core::data::Data;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::SettingsError;
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::StreamId;
use teampulse_core::time::Time;
use teampulse_emulators::robots::{SimTime, Team};
use tokio::time::{Instant, sleep_until};

use super::encode::encode;
use super::published::stream;
use super::settings::SimulatedTeam;

/// The shortest sleep: with many robots, one wake-up serves several of them.
const GRAIN: Duration = Duration::from_millis(2);

/// The simulated team, in real time or faster.
struct Simulation(SimulatedTeam);

impl SimulatedTeam {
    /// Builds the source of the team's robots.
    pub fn build(self) -> Result<Box<dyn Source>, SettingsError> {
        self.check()?;
        Ok(Box::new(Simulation(self)))
    }
}

#[async_trait]
impl Source for Simulation {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let mut team = Team::new(&self.0.model());
        let declared = declare(&team, outlet);
        tokio::select! {
            () = self.report(&mut team, &declared, outlet) => {}
            () = outlet.closed() => {}
        }
        Ok(())
    }
}

impl Simulation {
    /// Offers the data of every topic when they are due; returns after the last step.
    async fn report(&self, team: &mut Team, streams: &[StreamId], outlet: &Outlet) {
        let end = self.0.steps.map(|steps| SimTime::START + Duration::from_secs(steps.into()));
        let (start, began) = (outlet.clock().now(), Instant::now());
        let mut due = Vec::new();
        loop {
            let now = end.map_or(team.next(), |end| team.next().min(end));
            let real_secs = now.secs() / self.0.speed;
            let grains = (real_secs / GRAIN.as_secs_f64()).ceil();
            sleep_until(began + GRAIN.mul_f64(grains)).await;
            outlet.clock().set(session_time(start, now));
            team.advance(now, &mut due);
            for telegram in due.drain(..) {
                let stamp = session_time(start, telegram.stamp);
                let cdr = encode(&telegram.body, stamp, &team.published()[telegram.stream]);
                outlet.offer(reading(streams[telegram.stream], stamp, cdr));
            }
            if end == Some(now) {
                return;
            }
        }
    }
}

fn declare(team: &Team, outlet: &Outlet) -> Vec<StreamId> {
    team.published().iter().map(|each| outlet.declare(stream(each))).collect()
}

fn session_time(start: Time, simulated: SimTime) -> Time {
    Time::from_nanos(start.nanos().saturating_add(simulated.nanos()))
}

fn reading(stream: StreamId, stamp: Time, cdr: Bytes) -> Reading {
    let source_time = Some(stamp);
    Reading { index: None, stream, device_time: None, source_time, data: Data::Message(cdr) }
}

#[cfg(test)]
mod tests {
    use teampulse_core::clock::Clock;
    use teampulse_core::outlet::Queue;
    use teampulse_core::stream::Shape;
    use teampulse_core::streams::Streams;

    use super::*;

    fn settable_outlet(queue: &Queue) -> Outlet {
        queue.outlet(Clock::settable(), Streams::default())
    }

    #[tokio::test(start_paused = true)]
    async fn simulated_time_runs_faster_by_the_speed_and_ends_with_the_last_step() {
        let settings = SimulatedTeam { speed: 10.0, steps: Some(30), ..SimulatedTeam::default() };
        let outlet = settable_outlet(&Queue::new());
        let began = Instant::now();
        Simulation(settings).run(&outlet).await.unwrap();
        assert_eq!(outlet.clock().now(), Time::EPOCH + Duration::from_secs(30));
        let lasted_secs = began.elapsed().as_secs_f64();
        assert!((lasted_secs - 3.0).abs() < 0.01, "{lasted_secs}");
    }

    #[tokio::test(start_paused = true)]
    async fn an_endless_simulation_ends_when_the_session_does() {
        let queue = Queue::new();
        let outlet = settable_outlet(&queue);
        let mut simulation = Simulation(SimulatedTeam::default());
        let close = async {
            tokio::time::sleep(Duration::from_secs(5)).await;
            queue.close();
        };
        let (ended, ()) = tokio::join!(simulation.run(&outlet), close);
        ended.unwrap();
    }

    #[tokio::test(start_paused = true)]
    async fn every_robot_declares_its_topics_with_their_standard_types() {
        let settings = SimulatedTeam { robots: 2, steps: Some(1), ..SimulatedTeam::default() };
        let outlet = settable_outlet(&Queue::new());
        Simulation(settings).run(&outlet).await.unwrap();
        let types = |(_, stream): (_, std::sync::Arc<teampulse_core::stream::Stream>)| {
            let Shape::Message(schema) = &stream.shape else { panic!("{stream:?}") };
            format!("{} {}", stream.name, schema.name)
        };
        let declared: Vec<String> = outlet.streams().all().into_iter().map(types).collect();
        let robot2 = [
            "/robot2/odom nav_msgs/msg/Odometry",
            "/robot2/battery_state sensor_msgs/msg/BatteryState",
            "/robot2/wifi wireless_msgs/msg/Connection",
            "/robot2/diagnostics diagnostic_msgs/msg/DiagnosticArray",
            "/sim/truth/robot2 nav_msgs/msg/Odometry",
            "/sim/truth/robot2/battery_state sensor_msgs/msg/BatteryState",
        ];
        assert_eq!(declared[6..], robot2);
    }
}
