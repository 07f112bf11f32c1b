//! The speed of analyses of an hour of signal. `speed.py` runs them alternately with other programs.

use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use teampulse_signal::analysis::{Recording, Span, Whole};
use teampulse_signal::{ecg, eda, eeg, emg, hrv, ppg, respiration};

/// The number of times that an analysis runs; the best time counts.
const ROUNDS: usize = 3;
/// The length of the windows in which whole recordings are measured [s].
const WINDOW_SECS: i64 = 60;

/// Prints how long a job takes on the samples of a file [s].
pub fn measure(job: &str, rate_hz: &str, file: &Path) -> Result<bool, Box<dyn Error>> {
    let rate_hz: f64 = rate_hz.parse()?;
    let samples = samples(file)?;
    let width = match job {
        "emg" => 8,
        "eeg" => 4,
        _ => 1,
    };
    let channels: Vec<Vec<f64>> = (0..width)
        .map(|channel| samples.iter().skip(channel).step_by(width).copied().collect())
        .collect();
    let recording = Recording { rate_hz, begin_ns: 0, channels: &channels };
    let mut best_secs = f64::INFINITY;
    for _ in 0..ROUNDS {
        #[expect(clippy::disallowed_methods, reason = "a benchmark reads the machine's time")]
        let begin = Instant::now();
        run(job, &recording)?;
        best_secs = best_secs.min(begin.elapsed().as_secs_f64());
    }
    println!("{best_secs}");
    Ok(true)
}

fn samples(file: &Path) -> Result<Vec<f64>, Box<dyn Error>> {
    let bytes = std::fs::read(file)?;
    let numbers = bytes.chunks_exact(8).map(|each| each.try_into().map(f64::from_le_bytes));
    Ok(numbers.collect::<Result<_, _>>()?)
}

fn run(job: &str, recording: &Recording<'_>) -> Result<(), Box<dyn Error>> {
    let (signal, rate_hz) = (&recording.channels[0], recording.rate_hz);
    match job {
        "beats" => {
            black_box(ecg::clean(signal, rate_hz, 50.0)?);
            black_box(ecg::find_beats(signal, rate_hz)?);
        }
        "ecg" => measured(
            &ecg::analysis::whole(&ecg::analysis::Settings::default(), recording)?,
            recording,
        ),
        "ppg" => measured(
            &ppg::analysis::whole(&ppg::analysis::Settings::default(), recording)?,
            recording,
        ),
        "eda" => measured(
            &eda::analysis::whole(&eda::analysis::Settings::default(), recording)?,
            recording,
        ),
        "cvxeda" => drop(black_box(eda::cvx_eda(signal, rate_hz)?)),
        "respiration" => {
            let settings = respiration::analysis::Settings::default();
            measured(&respiration::analysis::whole(&settings, recording)?, recording);
        }
        "emg" => {
            let channel = |k: usize| emg::analysis::Channel { name: format!("ch{k}"), mvc: None };
            let channels = (1..=recording.channels.len()).map(channel).collect();
            let settings =
                emg::analysis::Settings { channels, ..emg::analysis::Settings::default() };
            measured(&emg::analysis::whole(&settings, recording)?, recording);
        }
        "eeg" => {
            let channels = ["TP9", "AF7", "AF8", "TP10"].map(String::from).to_vec();
            let settings =
                eeg::analysis::Settings { channels, ..eeg::analysis::Settings::default() };
            measured(&eeg::analysis::whole(&settings, recording)?, recording);
        }
        "nonlinear" => nonlinear(signal),
        other => return Err(format!("there is no job {other}").into()),
    }
    Ok(())
}

/// Computes all values of NeuroKit2's function of the same name, for intervals [ms].
fn nonlinear(intervals_ms: &[f64]) {
    black_box(hrv::poincare(intervals_ms));
    black_box(hrv::asymmetry(intervals_ms));
    black_box(hrv::fragmentation(intervals_ms));
    black_box(hrv::entropies(intervals_ms));
    black_box(hrv::detrended_fluctuation(intervals_ms));
}

/// Requests successive windows.
fn measured(whole: &Whole, recording: &Recording<'_>) {
    let window_ns = WINDOW_SECS * 1_000_000_000;
    let end_ns = recording.span().end_ns;
    let begins = (0..).map(|k| k * window_ns).take_while(|begin_ns| begin_ns + window_ns <= end_ns);
    for begin_ns in begins {
        black_box(whole.windows.measure(Span { begin_ns, end_ns: begin_ns + window_ns }));
    }
}
