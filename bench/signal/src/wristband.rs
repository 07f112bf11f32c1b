//! Acceleration and temperature of wristbands, checked by what is known of the recordings.

use std::error::Error;
use std::path::Path;

use teampulse_signal::acceleration::{Unit, analysis as acceleration};
use teampulse_signal::analysis::{Recording, Whole};
use teampulse_signal::temperature::analysis as temperature;

use crate::golden::verdict;
use crate::records::column;

/// The number of header lines in an Empatica E4's export: the time and the rate.
const E4_HEADER: usize = 2;
const E4_STEPS_PER_G: f64 = 64.0;

/// Prints the figures with their bars; returns whether all bars were met.
pub fn measure(data: &Path) -> Result<bool, Box<dyn Error>> {
    let e4 = axes(&data.join("e4_devicely/ACC.csv"))?;
    let e4: Vec<Vec<f64>> = e4.into_iter().map(|axis| axis[E4_HEADER..].to_vec()).collect();
    let shaken = axes(&data.join("acc/acc_100hz.txt"))?;
    let skin = column(&data.join("e4_devicely/TEMP.csv"))?;
    let met = [
        wrist("resting wrist, E4", &e4, 32.0, Unit::StepsPerG(E4_STEPS_PER_G), false)?,
        wrist("moving sensor, 100 Hz", &shaken, 100.0, Unit::G, true)?,
        skin_temperature(&skin[E4_HEADER..])?,
    ];
    Ok(met.iter().all(|&each| each))
}

/// Reads three columns of numbers, whatever separates them.
fn axes(path: &Path) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    let mut axes = vec![Vec::new(); 3];
    for line in std::fs::read_to_string(path)?.lines() {
        let cells = line.split([',', '\t', ' ']).map(str::trim).filter(|cell| !cell.is_empty());
        let row: Vec<f64> = cells.map_while(|cell| cell.parse().ok()).collect();
        if let [x, y, z] = row[..] {
            axes.iter_mut().zip([x, y, z]).for_each(|(axis, value)| axis.push(value));
        }
    }
    Ok(axes)
}

/// Returns the values of a whole recording by their names.
fn reported(all: &Whole, recording: &Recording<'_>) -> impl Fn(&str) -> f64 {
    let names: Vec<String> = all.windows.values().iter().map(|v| v.name.to_string()).collect();
    let values = all.windows.measure(recording.span()).values;
    move |name: &str| {
        let place = names.iter().position(|each| each == name);
        place.and_then(|place| values[place].ok()).unwrap_or(f64::NAN)
    }
}

fn wrist(
    what: &str,
    channels: &[Vec<f64>],
    rate_hz: f64,
    unit: Unit,
    moves: bool,
) -> Result<bool, Box<dyn Error>> {
    let recording = Recording { rate_hz, begin_ns: 0, channels };
    let settings = acceleration::Settings { unit, ..acceleration::Settings::default() };
    let all = acceleration::whole(&settings, &recording)?;
    let quality = all.windows.measure(recording.span()).quality;
    let value = reported(&all, &recording);
    let [gravity, spread, enmo, deviation, counts] =
        ["ACC_VM_Mean", "ACC_VM_SD", "ACC_ENMO", "ACC_MAD", "ACC_Counts"].map(&value);
    println!(
        "      acceleration, {what}: ENMO {enmo:.4} g, MAD {deviation:.4} g, SD {spread:.4} g, \
         {counts:.2} g·s/min"
    );
    let artefact = value("ACC_Artefact");
    let near = (gravity - 1.0).abs() <= 0.05 && quality >= 0.95;
    let met = near && if moves { artefact > 0.5 } else { artefact < 0.2 };
    let bar = if moves { "above 0.5" } else { "below 0.2" };
    Ok(verdict(
        met,
        &format!(
            "acceleration, {what}: {gravity:.3} g (bar 1 ± 0.05), quality {quality:.2} (bar 0.95), \
             artefacts {artefact:.2} (bar {bar})"
        ),
    ))
}

fn skin_temperature(readings_c: &[f64]) -> Result<bool, Box<dyn Error>> {
    let channels = [readings_c.to_vec()];
    let recording = Recording { rate_hz: 4.0, begin_ns: 0, channels: &channels };
    let all = temperature::whole(&temperature::Settings::default(), &recording)?;
    let value = reported(&all, &recording);
    let (first, last) = (readings_c[0], readings_c[readings_c.len() - 1]);
    let minutes = (readings_c.len() - 1) as f64 / 240.0;
    let ends = (last - first) / minutes;
    let slope = value("TEMP_Slope");
    let text = format!("temperature, E4: {:.2} °C, {slope:.2} °C/min", value("TEMP_Mean"));
    let met = (slope / ends - 1.0).abs() <= 0.25;
    Ok(verdict(met, &format!("{text} (bar {ends:.2} ± 25 %, the slope from end to end)")))
}
