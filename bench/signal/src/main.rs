//! The measurements of `bench/signal/run`. Each part prints figures; a bar is the limit that a figure must meet.

#![expect(clippy::print_stdout, reason = "figures go to standard output")]
#![expect(clippy::print_stderr, reason = "errors go to standard error")]

mod beats;
mod eda;
mod emg;
mod wristband;
mod hrv;
mod eeg;
mod ppg;
mod ppg_peers;
mod pulses;
mod disturbances;
mod respiration;
mod statistics;
mod speed;
mod rolling;
mod golden;
mod records;
mod noise;
mod recorded;
mod resampling;
mod unkind;
mod voice;

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let outcome = match words[..] {
        ["beats", data] => beats::measure(Path::new(data)),
        ["beats", data, "each"] => beats::list(Path::new(data)),
        ["recorded", data] => recorded::measure(Path::new(data)),
        ["eda", data] => eda::measure(Path::new(data)),
        ["emg", data] => emg::measure(Path::new(data)),
        ["wristband", data] => wristband::measure(Path::new(data)),
        ["hrv", data] => hrv::measure(Path::new(data)),
        ["eeg", data] => eeg::measure(Path::new(data)),
        ["ppg", data] => ppg::measure(Path::new(data)),
        ["respiration", data] => respiration::measure(Path::new(data)),
        ["statistics", data] => statistics::measure(Path::new(data)),
        ["unkind", "write", seeds, count, folder] => unkind::write(seeds, count, Path::new(folder)),
        ["unkind", seeds, count, ref peers @ ..] => {
            let peers = peers.first().map(Path::new);
            unkind::measure(seeds, count, peers)
        }
        ["variability", seeds, count] => unkind::measure_variability(seeds, count),
        ["rolling", folder, windows_secs] => rolling::measure(Path::new(folder), windows_secs),
        ["voice", folder, rate_hz] => voice::write(Path::new(folder), rate_hz),
        ["speed", job, rate_hz, file] => speed::measure(job, rate_hz, Path::new(file)),
        _ => Err("there is no such part".into()),
    };
    match outcome {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}
