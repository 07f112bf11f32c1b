//! The cost of the feature `statistics` on all streams of an operator. `rolling.py` runs this alternately with pandas
//! on the same samples.

use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;

use teampulse_core::data::{Data, Wave};
use teampulse_core::feature::{Feature, Outputs};
use teampulse_core::registry::Component;
use teampulse_core::sample::{Sample, Turn};
use teampulse_core::stream::{About, Channel, Shape, Stream, StreamId, Subject};
use teampulse_core::time::Time;
use teampulse_features::any::statistics::Statistics;
use teampulse_features::context::FeatureContext;

/// The number of times that all streams are run; the best time counts.
const ROUNDS: usize = 3;
/// The number of waves after which the results are taken.
const TAKEN_AT_ONCE: usize = 100;
/// The duration of a wave [ns].
const WAVE_NS: f64 = 1e8;

/// A stream with all its samples, in waves.
struct Input {
    stream: Stream,
    waves: Vec<Sample>,
}

/// Prints the processor time that the statistics of all streams take [s], for each file `NAME_CHANNELS_RATE.f64` in a
/// folder, over windows of these lengths [s].
pub fn measure(folder: &Path, windows_secs: &str) -> Result<bool, Box<dyn Error>> {
    let windows_secs: Vec<f64> =
        windows_secs.split(',').map(str::parse).collect::<Result<_, _>>()?;
    let mut paths: Vec<_> =
        folder.read_dir()?.map(|entry| Ok(entry?.path())).collect::<Result<_, Box<dyn Error>>>()?;
    paths.sort();
    let inputs: Vec<Input> = paths.iter().map(|path| input(path)).collect::<Result<_, _>>()?;
    let waves = in_order(&inputs);
    let mut best_secs = f64::INFINITY;
    for _ in 0..ROUNDS {
        let feature = Statistics { windows_secs: Some(windows_secs.clone()) };
        let feature = feature.build(&FeatureContext::default())?;
        let begin_secs = processor_secs()?;
        run(feature.as_ref(), &inputs, &waves);
        best_secs = best_secs.min(processor_secs()? - begin_secs);
    }
    println!("{best_secs}");
    Ok(true)
}

/// Returns the processor time that this thread has used so far [s]; the time of other threads does not count.
fn processor_secs() -> Result<f64, Box<dyn Error>> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    let used_ns: f64 = text.split(' ').next().ok_or("no time of a processor")?.parse()?;
    Ok(used_ns / 1e9)
}

fn input(path: &Path) -> Result<Input, Box<dyn Error>> {
    let stem = path.file_stem().ok_or("a file without a name")?.to_string_lossy().into_owned();
    let [name, width, rate_hz] = stem.split('_').collect::<Vec<_>>()[..] else {
        return Err(format!("expected NAME_CHANNELS_RATE, not {stem}").into());
    };
    let (width, rate_hz): (usize, f64) = (width.parse()?, rate_hz.parse()?);
    let bytes = std::fs::read(path)?;
    let numbers = bytes.chunks_exact(8).map(|each| each.try_into().map(f64::from_le_bytes));
    let numbers: Vec<f64> = numbers.collect::<Result<_, _>>()?;
    let subject = Subject { about: About::Person, id: "p001".into() };
    let stream = Stream::raw(format!("/humans/persons/p001/bench/{name}"), subject, Shape::Wave);
    let channels = (0..width).map(|channel| Channel::new(format!("c{channel}"), "1")).collect();
    let stream = Stream { rate_hz, channels, ..stream };
    let period_ns = 1e9 / rate_hz;
    let length = (WAVE_NS / period_ns).round().max(1.0) as usize;
    let wave = |(place, samples): (usize, &[f64])| Sample {
        stream: StreamId(0),
        measured: Time::from_nanos(((place * length) as f64 * period_ns).round() as i64),
        log_time: Time::EPOCH,
        device_time: None,
        source_time: None,
        period_ns,
        index: 0,
        turn: Turn::OnTime,
        data: Data::Wave(Wave { period_ns, channels: width as u32, samples: Arc::from(samples) }),
    };
    let waves = numbers.chunks(length * width).enumerate().map(wave).collect();
    Ok(Input { stream, waves })
}

/// Returns the waves of all streams in the order in which they arrive.
fn in_order(inputs: &[Input]) -> Vec<Sample> {
    let of_stream = |(id, input): (u32, &Input)| {
        let of_stream = |wave: &Sample| Sample { stream: StreamId(id), ..wave.clone() };
        input.waves.iter().map(of_stream).collect::<Vec<_>>()
    };
    let mut waves: Vec<Sample> = (0..).zip(inputs).flat_map(of_stream).collect();
    waves.sort_by_key(|wave| wave.measured);
    waves
}

fn run(feature: &dyn Feature, inputs: &[Input], waves: &[Sample]) {
    let mut out = Outputs::new();
    let mut extractor = feature.start(&inputs[0].stream);
    for (id, input) in (0..).zip(inputs) {
        extractor.join(StreamId(id), &input.stream, &mut out);
    }
    for waves in waves.chunks(TAKEN_AT_ONCE) {
        for wave in waves {
            extractor.push(wave, &mut out);
        }
        // The results are removed, as a pump does.
        black_box(std::mem::take(&mut out).samples().count());
    }
}
