//! Finds the heartbeats in a recording of a device.

use teampulse_core::stream::Signal;
use teampulse_formats::{Content, Run};
use teampulse_signal::ecg::find_beats;
use teampulse_signal::ppg::find_pulses;

use super::delay::Kind;
use super::imported::{DeviceRecording, Imported};
use super::joining::Happened;
use crate::failure::Failure;

/// Finds the heartbeats in a recording: in its ECG, else its pulse wave, else its intervals.
pub(super) fn of_heart(device: &DeviceRecording, session: Kind) -> Result<Happened, Failure> {
    let Some((signal, kind)) = best(device) else {
        return Err(Failure::new(format!("{} has no heart signal", device.name))
            .hint("join by a marker that is in both, with --at"));
    };
    let at_ns = match signal.stream.signal {
        Signal::Ecg => beats(signal),
        Signal::Ppg => pulses(signal, session),
        _ => ends(signal),
    };
    Ok(Happened::events(device.name.clone(), at_ns, kind).seen_by(&device.device))
}

/// Returns the kind of heart events in a recording; `None` if it has no heart signal.
pub(super) fn shown_by(device: &DeviceRecording) -> Option<Kind> {
    best(device).map(|(_, kind)| kind)
}

fn best(device: &DeviceRecording) -> Option<(&Imported, Kind)> {
    [Signal::Ecg, Signal::Ppg, Signal::Interval].into_iter().find_map(|wanted| {
        let signal = device.signals.iter().find(|each| each.stream.signal == wanted)?;
        Some((signal, Kind::of(wanted, &device.device)?))
    })
}

fn ends(signal: &Imported) -> Vec<i64> {
    match &signal.content {
        Content::Uneven { at_ns, .. } => at_ns.clone(),
        _ => Vec::new(),
    }
}

fn beats(signal: &Imported) -> Vec<i64> {
    in_runs(signal, |samples, rate_hz| {
        let beats = find_beats(samples, rate_hz).unwrap_or_default();
        beats.iter().map(|beat| beat.sample).collect()
    })
}

/// Finds pulses: their feet if the session has R waves, and their peaks if the session has pulses, which are timed at
/// their peaks.
fn pulses(signal: &Imported, session: Kind) -> Vec<i64> {
    in_runs(signal, |samples, rate_hz| {
        let pulses = find_pulses(samples, rate_hz).unwrap_or_default();
        pulses
            .iter()
            .map(|pulse| if session.is_of_pulses() { pulse.sample } else { pulse.onset })
            .collect()
    })
}

/// Applies a detector to the first channel of each run.
fn in_runs(signal: &Imported, found: impl Fn(&[f64], f64) -> Vec<f64>) -> Vec<i64> {
    let Content::Even(runs) = &signal.content else { return Vec::new() };
    let width = signal.stream.channels.len().max(1);
    let of_run = |run: &Run| {
        let first: Vec<f64> = run.samples.iter().copied().step_by(width).collect();
        let (start_ns, period_ns) = (run.start_ns, run.period_ns);
        let at = move |place: f64| start_ns.saturating_add((place * period_ns).round() as i64);
        found(&first, 1e9 / period_ns)
            .into_iter()
            .filter(|place| place.is_finite())
            .map(at)
            .collect::<Vec<i64>>()
    };
    runs.iter().flat_map(of_run).collect()
}
