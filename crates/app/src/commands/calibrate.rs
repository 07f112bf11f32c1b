//! `teampulse calibrate`: finds a device's fixed latency from events that two streams recorded.

mod edit;
pub(super) mod signals;

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;
use teampulse_bag::{Bag, STUDY_NAME, Unread};
use teampulse_core::counted::counted;
use teampulse_timefilter::calibrate::{Calibration, LONGEST_LAG_SECS, calibrate};
use teampulse_timefilter::clock::{KnownDevice, Latency};

use crate::commands::info::{after_reading, open, warn_of_damage};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;
use crate::study::Study;
use signals::{Recorded, Span, Wanted, record};

/// A latency with a larger uncertainty is not written [s].
const WORST_SECS: f64 = 0.1;

/// Finds a device's fixed latency from events that two streams of a bag recorded.
///
/// Record a session in which you tap the device, press a button or switch a light a few times, at irregular intervals
/// of a few seconds, in such a way that a stream with correct times records the events as well.
///
/// The lag is how much later the events appear in the device's stream than in the reference, by their corrected times.
/// The device's latency is the lag plus the latency that was already subtracted during the recording. It differs by up
/// to 11 ms between connection intervals of Bluetooth: where arrival times show the interval, the latency applies to
/// links with that interval, and the study holds one latency per interval.
#[derive(Debug, Args)]
pub struct Calibrate {
    /// The bag's folder, or one of its .mcap files
    bag: PathBuf,
    /// The stream with correct times; after a colon, one of its channels, a field of its messages or the label of its
    /// events
    #[arg(long, value_name = "STREAM[:CHANNEL]")]
    reference: Wanted,
    /// The stream of the device
    #[arg(long, value_name = "STREAM[:CHANNEL]")]
    stream: Wanted,
    /// Where to start, in seconds after the start of the bag
    #[arg(long, value_name = "SECS", value_parser = some_seconds)]
    from: Option<f64>,
    /// Where to stop, in seconds after the start of the bag
    #[arg(long, value_name = "SECS", value_parser = some_seconds)]
    to: Option<f64>,
    /// The longest lag to search for, in either direction, at most 60 s
    #[arg(long, value_name = "SECS", default_value = "1", value_parser = lag_seconds)]
    max_lag: f64,
    /// The name of the device in the study; by default the one in the stream
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Writes the latency into this study
    #[arg(long, value_name = "STUDY")]
    write: Option<PathBuf>,
    /// Prints one JSON object
    #[arg(long)]
    json: bool,
}

/// The result of a calibration.
#[derive(Debug, Serialize)]
struct CalibrationReport {
    reference: String,
    stream: String,
    lag_secs: f64,
    /// Half the width of the 95 % interval of the lag, and so of the latency.
    uncertainty_secs: f64,
    events: usize,
    correlation: f64,
    next_correlation: f64,
    device: String,
    /// The connection interval of the stream's link; null if the arrival times do not show one.
    interval_secs: Option<f64>,
    /// The latency assumed during the recording.
    recorded_latency_secs: f64,
    latency_secs: f64,
    /// Why the result is doubtful; null if it is not.
    doubt: Option<String>,
}

impl Calibrate {
    /// Runs the command.
    pub fn run(self) -> Result<Exit, Failure> {
        in_order(self.from, self.to)?;
        let bag = open(&self.bag)?;
        warn_of_damage(&bag);
        let span = Span::of(&bag, self.from, self.to);
        let recorded = record(&bag, [&self.reference, &self.stream], span)?;
        if recorded.devices.len() > 1 {
            // The stream has no single device whose latency could be corrected.
            let devices = recorded.devices.join(", ");
            return Err(Failure::new(format!(
                "{} is computed from several devices: {devices}",
                self.stream
            ))
            .hint("choose a stream of one device"));
        }
        let [reference, stream] = &recorded.seen;
        let found = calibrate(reference.seen(), stream.seen(), self.max_lag);
        let found = found.map_err(|error| Failure::to(error).hint(error.hint()))?;
        let report = self.report(&bag, &recorded, &found)?;
        if self.json {
            output::json(&report);
        } else {
            show(&report);
        }
        match (&report.doubt, &self.write) {
            (Some(doubt), Some(study)) => {
                return Err(Failure::new(format!("{} is not changed: {doubt}", study.display()))
                    .hint(
                        "record more events, separate from other motion, or give --from and --to",
                    ));
            }
            (Some(doubt), None) => output::note(format!("warning: {doubt}")),
            (None, Some(study)) => write(study, &report)?,
            (None, None) => {}
        }
        let exit = if recorded.is_whole { Exit::Fine } else { Exit::DataLost };
        Ok(after_reading(&bag, &Unread::default(), exit))
    }

    fn report(
        &self,
        bag: &Bag,
        recorded: &Recorded,
        found: &Calibration,
    ) -> Result<CalibrationReport, Failure> {
        let [_, stream] = &recorded.seen;
        let recorded_as = stream.device();
        // The connection interval matters only where the session itself modelled the device's clock.
        let interval_secs = stream.interval_secs().filter(|_| recorded.has_latency);
        let in_force =
            recorded.has_latency.then(|| latency_in_force(bag, &recorded_as, interval_secs));
        let in_force = in_force.transpose()?;
        let device = self.device.clone().unwrap_or(recorded_as);
        let recorded_latency_secs = in_force.unwrap_or(0.0);
        let latency_secs = recorded_latency_secs + found.lag_secs;
        // A latency near zero may be estimated slightly below zero.
        let is_none = latency_secs < 0.0 && -latency_secs <= found.uncertainty_secs;
        Ok(CalibrationReport {
            reference: self.reference.to_string(),
            stream: self.stream.to_string(),
            lag_secs: found.lag_secs,
            uncertainty_secs: (found.uncertainty_secs * 1e4).ceil() / 1e4,
            events: found.events,
            correlation: found.correlation,
            next_correlation: found.next_correlation,
            device,
            interval_secs,
            recorded_latency_secs,
            latency_secs: if is_none { 0.0 } else { (latency_secs * 1e4).round() / 1e4 },
            doubt: doubt(found, if is_none { 0.0 } else { latency_secs }),
        })
    }
}

/// Returns why a result is doubtful, if it is.
fn doubt(found: &Calibration, latency_secs: f64) -> Option<String> {
    if !found.is_trustworthy() {
        let share = 100.0 * found.correlation;
        return Some(format!("the streams agree on only a few events (correlation {share:.0} %)"));
    }
    if found.uncertainty_secs > WORST_SECS {
        let uncertainty_ms = 1e3 * found.uncertainty_secs;
        return Some(format!("the latency is uncertain by {uncertainty_ms:.0} ms"));
    }
    let message = "the stream is earlier than its reference: a latency can't be below 0";
    (latency_secs < 0.0).then(|| message.to_owned())
}

/// Returns the latency that the session subtracted for a device: the one in the study, else in the table of known
/// devices, else the default for Bluetooth.
fn latency_in_force(bag: &Bag, device: &str, interval_secs: Option<f64>) -> Result<f64, Failure> {
    let kept = bag.attachment(STUDY_NAME);
    let kept = kept.map_err(|error| Failure::to(&error).hint(error.hint()))?;
    let text = kept.map(|kept| String::from_utf8_lossy(&kept).into_owned()).unwrap_or_default();
    let study = Study::parse(Path::new(STUDY_NAME), text)?;
    let settings =
        study.general.clocks.get(device).and_then(|clock| clock.latency_secs_at(interval_secs));
    let known = || KnownDevice::find(device).map_or(Latency::BLUETOOTH, |known| known.latency);
    Ok(settings.unwrap_or_else(|| known().secs))
}

fn show(report: &CalibrationReport) {
    let CalibrationReport { reference, stream, events, .. } = report;
    let (lag_ms, uncertainty_ms) = (1e3 * report.lag_secs, 1e3 * report.uncertainty_secs);
    output::line(format!(
        "{stream} shows {} of {reference} {:.1} ms {} (± {uncertainty_ms:.1} ms, 95 %)",
        counted(*events, "event", "events"),
        lag_ms.abs(),
        if lag_ms < 0.0 { "earlier" } else { "later" },
    ));
    output::line(format!(
        "correlation {:.2}, at the next best lag {:.2}",
        report.correlation, report.next_correlation
    ));
    if report.recorded_latency_secs > 0.0 {
        let recorded_ms = 1e3 * report.recorded_latency_secs;
        output::line(format!("recorded with a latency of {recorded_ms:.1} ms"));
    }
    if let Some(interval_secs) = report.interval_secs {
        output::line(format!("over a connection interval of {} ms", 1e3 * interval_secs));
    }
    if report.doubt.is_none() {
        output::line(format!("\n{}", edit::lines(&report.device, &report.clock())));
    }
}

impl CalibrationReport {
    fn clock(&self) -> edit::Latency {
        edit::Latency {
            secs: self.latency_secs,
            uncertainty_secs: self.uncertainty_secs,
            interval_secs: self.interval_secs,
        }
    }
}

/// Writes the latency into a study, which must be valid before and after.
fn write(path: &Path, report: &CalibrationReport) -> Result<(), Failure> {
    let shown = path.display();
    let unreadable = |error| Failure::to(format!("read the study {shown}: {error}"));
    let text = std::fs::read_to_string(path).map_err(unreadable)?;
    Study::parse(path, text.clone())?;
    let edited = edit::with_latency(&text, &report.device, &report.clock())
        .map_err(|reason| Failure::to(format!("edit the study {shown}: {reason}")))?;
    Study::parse(path, edited.clone())?;
    let unwritten = |error| Failure::to(format!("write the study {shown}: {error}"));
    std::fs::write(path, edited).map_err(unwritten)?;
    output::note(format!("written to {shown}"));
    Ok(())
}

/// Reads a finite number of seconds that is not negative.
fn some_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(secs) if secs.is_finite() && secs >= 0.0 => Ok(secs),
        _ => Err(format!("`{text}` is not a number of seconds")),
    }
}

/// Fails if the part to read ends before it starts.
fn in_order(from_secs: Option<f64>, to_secs: Option<f64>) -> Result<(), Failure> {
    match (from_secs.unwrap_or(0.0), to_secs) {
        (from, Some(to)) if to <= from => {
            let message = format!("--to ({to} s) is not after --from ({from} s)");
            let hint = "both are seconds since the start of the bag";
            Err(Failure::new(message).hint(hint).exit(Exit::BadArguments))
        }
        _ => Ok(()),
    }
}

/// Parses the longest lag.
fn lag_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(secs) if secs > 0.0 && secs <= LONGEST_LAG_SECS => Ok(secs),
        _ => Err(format!("`{text}` is not a number of seconds from 0 to {LONGEST_LAG_SECS}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_that_ends_before_it_begins_is_refused() {
        let (message, _) = in_order(Some(100.0), Some(50.0)).unwrap_err().words();
        assert_eq!(message, "--to (50 s) is not after --from (100 s)");
        assert!(in_order(None, Some(0.0)).is_err());
        for (from, to) in
            [(None, None), (Some(100.0), None), (None, Some(50.0)), (Some(1.0), Some(2.0))]
        {
            assert!(in_order(from, to).is_ok());
        }
    }
}
