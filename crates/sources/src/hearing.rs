//! Converts blocks of sound to the data that are recorded.

use std::sync::Arc;

use teampulse_core::data::{Data, Wave};
use teampulse_core::stream::{Channel, Shape, Signal, Stream, Subject};
use teampulse_core::time::Time;
use teampulse_messages::audio::{AudioBlock, AudioInfo};
use teampulse_messages::convert::Decoded;
use teampulse_signal::voice::{CHANNELS, Framer, RATES_HZ, Settings};

/// The period of frames [ns].
pub(crate) const FRAME_NANOS: i64 = 10_000_000;
/// After a gap longer than this, the analysis of a voice restarts [s].
const LOST_SECS: f64 = 2.0;
/// How far a stamp may be from the time expected from the received samples before sound counts as missing [blocks].
const LATE_BLOCKS: f64 = 1.5;
/// The largest amount of sound that waits until its format is known [bytes].
const WAITING_BYTES: usize = 1 << 20;

/// What is kept of a microphone's sound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kept {
    /// Frames of a voice, from which no words can be reconstructed.
    Frames,
    /// The sound itself.
    Sound,
}

impl Kept {
    /// The channels of the microphone's stream.
    pub fn channels(self) -> Vec<Channel> {
        match self {
            Kept::Frames => {
                CHANNELS.iter().map(|(name, unit)| Channel::new(*name, *unit)).collect()
            }
            Kept::Sound => vec![Channel::new("audio", "1")],
        }
    }

    /// Returns the stream of a person's microphone, whose sound has this rate [Hz].
    pub fn stream(self, person: &str, rate_hz: f64) -> Stream {
        let (leaf, device, rate_hz, doc) = match self {
            Kept::Frames => {
                let rate_hz = 1e9 / FRAME_NANOS as f64;
                let doc = "how the person speaks, in frames of 10 ms; no words";
                ("voice", "microphone_voice", rate_hz, doc)
            }
            Kept::Sound => ("audio", "microphone", rate_hz, "the sound of a microphone"),
        };
        let name = format!("/humans/persons/{person}/microphone/{leaf}");
        Stream {
            signal: Signal::Audio,
            device: device.to_owned(),
            channels: self.channels(),
            rate_hz,
            doc: doc.to_owned(),
            ..Stream::raw(name, Subject::person(person), Shape::Wave)
        }
    }
}

/// A microphone's state, from which its blocks are processed in order.
pub(crate) struct Hearing {
    kept: Kept,
    info: Option<AudioInfo>,
    /// Blocks that arrived before their format was known.
    waiting: Vec<(AudioBlock, u64)>,
    voice: Option<Framer>,
    /// The number of samples received and lost so far.
    samples: i64,
    /// The number of samples in the last block, and its stamp.
    block: i64,
    stamp: Option<Time>,
}

impl Hearing {
    pub fn new(kept: Kept, info: Option<AudioInfo>) -> Hearing {
        Hearing { kept, info, waiting: Vec::new(), voice: None, samples: 0, block: 0, stamp: None }
    }

    /// Sets the format of the blocks.
    pub fn learn(&mut self, info: AudioInfo) {
        if self.info != Some(info) {
            let (kept, waiting) = (self.kept, std::mem::take(&mut self.waiting));
            *self = Hearing { waiting, ..Hearing::new(kept, Some(info)) };
        }
    }

    /// Takes the next block, before which `lost` blocks were lost; returns the resulting data.
    ///
    /// Blocks wait while their format is unknown. An error fits after "failed to".
    pub fn hear(&mut self, block: AudioBlock, lost: u64) -> Result<Option<Decoded>, String> {
        let Some(info) = self.info else {
            let waiting: usize = self.waiting.iter().map(|(block, _)| block.data.len()).sum();
            if waiting + block.data.len() > WAITING_BYTES {
                let reason = "know the rate and format of the sound: nothing publishes an `AudioInfo`, and the \
                              study gives no `rate_hz`";
                return Err(reason.to_owned());
            }
            self.waiting.push((block, lost));
            return Ok(None);
        };
        if info.rate_hz < RATES_HZ.0 || info.rate_hz > RATES_HZ.1 {
            let (least, most) = (RATES_HZ.0 / 1e3, RATES_HZ.1 / 1e3);
            return Err(format!(
                "analyse a voice at {} Hz; {least} to {most} kHz are supported",
                info.rate_hz
            ));
        }
        let mut heard = Heard::default();
        for (block, lost) in std::mem::take(&mut self.waiting) {
            self.take(&info, &block, lost, &mut heard)?;
        }
        self.take(&info, &block, lost, &mut heard)?;
        Ok(heard.decoded(self.kept, info.rate_hz))
    }

    fn take(
        &mut self,
        info: &AudioInfo,
        block: &AudioBlock,
        lost: u64,
        heard: &mut Heard,
    ) -> Result<(), String> {
        let missing = self.missing(info, block, lost);
        let is_long = missing as f64 > LOST_SECS * info.rate_hz;
        if is_long {
            // Sound from before a long gap must not affect the analysis after it.
            self.voice = None;
            self.samples += missing;
            heard.clear();
        }
        let silence = if is_long { 0 } else { missing as usize };
        let samples = std::iter::repeat_n(f64::NAN, silence).chain(info.first_channel(&block.data));
        let before = self.samples;
        for sample in samples {
            let at_ns = nanos(self.samples, info.rate_hz);
            self.samples += 1;
            match self.kept {
                Kept::Sound => heard.push(at_ns, &[sample]),
                Kept::Frames => {
                    if let Some(frame) = self.framer(info)?.push(at_ns, sample) {
                        heard.push(frame.at_ns, &frame.numbers());
                    }
                }
            }
        }
        self.block = (self.samples - before - silence as i64).max(0);
        self.stamp = block.stamp;
        Ok(())
    }

    fn framer(&mut self, info: &AudioInfo) -> Result<&mut Framer, String> {
        match &mut self.voice {
            Some(framer) => Ok(framer),
            none => {
                let framer = Framer::new(&Settings::default(), info.rate_hz);
                Ok(none.insert(framer.map_err(|error| format!("analyse a voice: {error}"))?))
            }
        }
    }

    /// Returns how many samples are missing before a block: by the stamps if both blocks have one, else by the lost
    /// blocks.
    fn missing(&self, info: &AudioInfo, block: &AudioBlock, lost: u64) -> i64 {
        let by_blocks = i64::try_from(lost).unwrap_or(i64::MAX).saturating_mul(self.block);
        let Some((before, stamp)) = self.stamp.zip(block.stamp) else { return by_blocks };
        let passed = stamp.secs_since(before) * info.rate_hz;
        let missing = passed - self.block as f64;
        let is_gap = lost > 0 && missing > 0.0 && passed > LATE_BLOCKS * self.block as f64;
        if is_gap { missing.round() as i64 } else { by_blocks }
    }
}

/// Returns the time of a sample since the first one, by the clock of the microphone [ns].
fn nanos(samples: i64, rate_hz: f64) -> i64 {
    (samples as f64 / rate_hz * 1e9).round() as i64
}

/// The data that result from a block.
#[derive(Default)]
struct Heard {
    first_ns: Option<i64>,
    numbers: Vec<f64>,
}

impl Heard {
    fn push(&mut self, at_ns: i64, numbers: &[f64]) {
        self.first_ns.get_or_insert(at_ns);
        self.numbers.extend_from_slice(numbers);
    }

    /// Clears the data after a long gap, so that nothing is joined across it.
    fn clear(&mut self) {
        *self = Heard::default();
    }

    fn decoded(self, kept: Kept, rate_hz: f64) -> Option<Decoded> {
        let first_ns = self.first_ns?;
        let period_ns = match kept {
            Kept::Frames => FRAME_NANOS as f64,
            Kept::Sound => 1e9 / rate_hz,
        };
        let wave = Wave {
            period_ns,
            channels: kept.channels().len() as u32,
            samples: Arc::from(self.numbers),
        };
        let (stamp, device_time, data) = (Time::EPOCH, Some(first_ns), Data::Wave(wave));
        Some(Decoded { stamp, device_time, index: None, data })
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use proptest::prelude::*;
    use teampulse_messages::audio::SampleFormat;
    use teampulse_signal::analysis::Span;
    use teampulse_signal::voice::analysis;

    use super::*;

    const RATE_HZ: f64 = 16_000.0;
    const INFO: AudioInfo =
        AudioInfo { rate_hz: RATE_HZ, channels: 1, format: SampleFormat::S16LE };

    /// A voice at 120 Hz that says "a" for a second and pauses for half a second.
    fn voice(secs: f64) -> Vec<i16> {
        let sample = |k: usize| {
            let t = k as f64 / RATE_HZ;
            let is_loud = t % 1.5 < 1.0;
            let harmonics = (1..20)
                .map(|h| (std::f64::consts::TAU * 120.0 * t * f64::from(h)).sin() / f64::from(h));
            let noise = ((k * 7919) % 101) as f64 / 101.0 - 0.5;
            (4000.0 * if is_loud { harmonics.sum::<f64>() } else { 0.0 } + 40.0 * noise) as i16
        };
        (0..(secs * RATE_HZ) as usize).map(sample).collect()
    }

    fn block(samples: &[i16]) -> AudioBlock {
        let data: Vec<u8> = samples.iter().flat_map(|sample| sample.to_le_bytes()).collect();
        AudioBlock { stamp: None, data: Bytes::from(data) }
    }

    /// The rows of the resulting numbers, with their times [ns].
    fn rows(all: &[Decoded]) -> Vec<(i64, Vec<f64>)> {
        let mut rows = Vec::new();
        for decoded in all {
            let Data::Wave(wave) = &decoded.data else { panic!() };
            let first = decoded.device_time.unwrap();
            for (place, row) in wave.samples.chunks(wave.channels as usize).enumerate() {
                rows.push((first + (place as f64 * wave.period_ns) as i64, row.to_vec()));
            }
        }
        rows
    }

    fn heard(hearing: &mut Hearing, sound: &[i16], size: usize) -> Vec<Decoded> {
        let blocks = sound.chunks(size).map(block);
        blocks.filter_map(|block| hearing.hear(block, 0).unwrap()).collect()
    }

    #[test]
    fn windows_of_frames_are_those_of_the_sound() {
        let sound = voice(8.0);
        let frames = heard(&mut Hearing::new(Kept::Frames, Some(INFO)), &sound, 512);
        let mut of_frames = analysis::of_frames();
        for (at_ns, row) in rows(&frames) {
            of_frames.push(at_ns, &row);
        }
        let mut of_sound = analysis::causal(&Settings::default(), RATE_HZ).unwrap();
        for (k, sample) in sound.iter().enumerate() {
            of_sound.push(nanos(k as i64, RATE_HZ), &[f64::from(*sample) / 32_768.0]);
        }
        let span = Span { begin_ns: 1_000_000_000, end_ns: 7_000_000_000 };
        let [one, other] = [of_frames.measure(span), of_sound.measure(span)];
        assert_eq!(format!("{one:?}"), format!("{other:?}"));
        assert!(
            format!("{one:?}").contains("119.") || format!("{one:?}").contains("120."),
            "{one:?}"
        );
    }

    #[test]
    fn a_second_of_frames_is_too_little_for_words() {
        let sound = voice(4.0);
        let frames = heard(&mut Hearing::new(Kept::Frames, Some(INFO)), &sound, 400);
        let numbers: usize = rows(&frames).iter().map(|(_, row)| row.len()).sum();
        // 100 rows of 15 numbers a second, of which none is a sample.
        assert!(numbers <= 4 * 1500, "{numbers}");
        let samples: Vec<f64> = sound.iter().map(|sample| f64::from(*sample) / 32_768.0).collect();
        let is_sample = |number: &f64| *number != 0.0 && samples.contains(number);
        let rows = rows(&frames);
        let same = rows.iter().flat_map(|(_, row)| row).filter(|number| is_sample(number)).count();
        assert!(same * 1000 < numbers, "{same} of {numbers}");
    }

    #[test]
    fn blocks_wait_until_it_is_known_what_they_are() {
        let mut hearing = Hearing::new(Kept::Sound, None);
        assert!(hearing.hear(block(&[1, 2]), 0).unwrap().is_none());
        hearing.learn(INFO);
        let heard = hearing.hear(block(&[3]), 0).unwrap().unwrap();
        assert_eq!(heard.device_time, Some(0));
        assert_eq!(rows(&[heard]).len(), 3);
        let mut never = Hearing::new(Kept::Sound, None);
        let sizes = (0..40).map(|_| never.hear(block(&vec![0; 20_000]), 0));
        let errors: Vec<_> = sizes.filter_map(Result::err).collect();
        assert!(errors[0].contains("rate and format"), "{errors:?}");
    }

    #[test]
    fn lost_blocks_are_missing_and_the_rest_keeps_its_time() {
        let mut hearing = Hearing::new(Kept::Sound, Some(INFO));
        hearing.hear(block(&[1; 160]), 0).unwrap();
        let next = hearing.hear(block(&[1; 160]), 2).unwrap().unwrap();
        let rows = rows(&[next]);
        assert_eq!((rows[0].0, rows.len()), (10_000_000, 480));
        assert!(rows[319].1[0].is_nan() && !rows[320].1[0].is_nan());
        // Ten minutes are not filled.
        let far = hearing.hear(block(&[1; 160]), 60_000).unwrap().unwrap();
        assert_eq!(far.device_time, Some(40_000_000 + 600_000_000_000));
    }

    #[test]
    fn a_rate_that_no_voice_is_heard_at_is_refused() {
        let info = AudioInfo { rate_hz: 2_000.0, ..INFO };
        let error = Hearing::new(Kept::Frames, Some(info)).hear(block(&[0; 10]), 0).unwrap_err();
        assert!(error.contains("2000 Hz"), "{error}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(8))]

        #[test]
        fn frames_do_not_depend_on_the_size_of_blocks(size in 1_usize..3000) {
            let sound = voice(0.5);
            let one = heard(&mut Hearing::new(Kept::Frames, Some(INFO)), &sound, size);
            let other = heard(&mut Hearing::new(Kept::Frames, Some(INFO)), &sound, sound.len());
            let text = |all: &[Decoded]| format!("{:?}", rows(all).iter().map(|(_, row)| row.clone()).collect::<Vec<_>>());
            prop_assert_eq!(text(&one), text(&other));
        }
    }
}
