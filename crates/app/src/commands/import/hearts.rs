//! The heartbeats in a recording of a device.

use teampulse_core::stream::Signal;
use teampulse_formats::{Content, Run};
use teampulse_signal::ecg::find_beats;
use teampulse_signal::ppg::find_pulses;

use super::imported::{DeviceRecording, Imported};
use super::joining::{Happened, Kind};
use crate::failure::Failure;

/// The heartbeats in a recording: from its ECG, else its pulse wave, else its intervals.
pub(super) fn of_heart(device: &DeviceRecording, session: Kind) -> Result<Happened, Failure> {
    let of = |signal: Signal| device.signals.iter().find(move |each| each.stream.signal == signal);
    let found = of(Signal::Ecg)
        .map(|ecg| (beats(ecg), Kind::Beats))
        .or_else(|| of(Signal::Ppg).map(|ppg| (pulses(ppg, session), Kind::Pulses)))
        .or_else(|| {
            of(Signal::Interval).map(|intervals| (ends(intervals), interval_kind(&device.device)))
        });
    let Some((at_ns, kind)) = found else {
        return Err(Failure::new(format!("{} has no heart signal", device.name))
            .hint("join by a marker that both have, with --at"));
    };
    Ok(Happened::events(device.name.clone(), at_ns, kind))
}

/// Whether a recording shows the beats of a heart.
pub(super) fn has_heart(device: &DeviceRecording) -> bool {
    let of_heart = [Signal::Ecg, Signal::Ppg, Signal::Interval];
    device.signals.iter().any(|signal| of_heart.contains(&signal.stream.signal))
}

/// Wristbands measure intervals between pulses.
fn interval_kind(device: &str) -> Kind {
    let is_wristband = device.starts_with("empatica") || device.starts_with("embrace");
    if is_wristband { Kind::PulseIntervals } else { Kind::Beats }
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

/// The feet of pulses, to match R waves, and their peaks, to match pulses of the session, which are known by their
/// peaks.
fn pulses(signal: &Imported, session: Kind) -> Vec<i64> {
    in_runs(signal, |samples, rate_hz| {
        let pulses = find_pulses(samples, rate_hz).unwrap_or_default();
        pulses
            .iter()
            .map(|pulse| if session == Kind::Pulses { pulse.sample } else { pulse.onset })
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
