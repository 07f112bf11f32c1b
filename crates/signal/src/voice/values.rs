//! The values of a span of frames.

use super::frame::{Frame, Glottal};
use super::framer::FRAMES_HZ;
use super::store::Store;
use crate::analysis::{LEAST_COVERAGE, Measured, Reason, Span, Value};
use crate::robust::median;

/// The minimum amount of speech for values of speech [frames].
const LEAST_SPEECH: usize = 50;
/// The minimum amount of voiced speech for values of pitch [frames].
const LEAST_VOICED: usize = 20;
/// The minimum number of pairs of periods for jitter and shimmer.
const LEAST_PAIRS: f64 = 30.0;
/// A shorter gap is not a pause, but a closure or a hesitation [frames].
const LEAST_PAUSE: usize = 25;
/// The signal-to-noise ratio at which quality reaches 1 [dB].
const FULL_QUALITY_DB: f64 = 30.0;
/// The factor on the share of clipped samples that reduces quality: a share of a tenth reduces it to 0.
const CLIPPING: f64 = 10.0;
/// The ranges within which pitch, as a share, and level [dB] count as steady.
const STEADY_PITCH: f64 = 0.002;
const STEADY_DB: f64 = 3.0;
/// Frames that are steady for longer than this [frames] hardly come from a voice, and certainly do not from the longer
/// time on, which is the length of a breath.
const STEADY: usize = 20;
const LONGEST_STEADY: usize = 600;
/// The weight of steady frames that may still be a voice, such as that of a speaking machine.
const DOUBTFUL: f64 = 0.25;
/// The lowest quality for values of the voice.
const LEAST_QUALITY: f64 = 0.2;

/// The values of windows.
pub(super) static VALUES: [Value; 14] = [
    Value::new(
        "VOICE_Level",
        "dB",
        "RMS of frames of 20 ms in speech, their powers averaged; re full scale",
    ),
    Value::new("VOICE_Level_SD", "dB", "standard deviation of the levels of frames in speech"),
    Value::new(
        "VOICE_Noise",
        "dB",
        "median noise floor: minimum of 50 ms means over the last 8 s; re full scale",
    ),
    Value::new(
        "VOICE_Activity",
        "1",
        "share of frames in speech: 5 dB above the floor or with a periodicity above 0.8, 30 ms or longer, closures up to 0.2 s filled",
    ),
    Value::new(
        "VOICE_Voiced",
        "1",
        "share of voiced frames among those in speech: autocorrelation over that of the window (Boersma 1993), path with a delay of 0.2 s",
    ),
    Value::new("VOICE_Pitch_Median", "Hz", "median pitch of voiced frames, 65–500 Hz"),
    Value::new(
        "VOICE_Pitch_SD",
        "semitone",
        "standard deviation of the pitch of voiced frames on a logarithmic scale",
    ),
    Value::new(
        "VOICE_Speaking_Rate",
        "1/s",
        "syllable nuclei (voiced peaks in level, separated by dips of 2 dB, as in de Jong & Wempe 2009) over the time from the start of the first stretch of speech to the end of the last",
    ),
    Value::new("VOICE_Articulation_Rate", "1/s", "syllable nuclei over the time in speech"),
    Value::new(
        "VOICE_Pauses",
        "1/min",
        "pauses of 0.25 s or more within speech, over the time from the start of the first stretch of speech to the end of the last",
    ),
    Value::new("VOICE_Pause_Mean", "s", "mean length of these pauses"),
    Value::new(
        "VOICE_Jitter",
        "1",
        "mean absolute difference of consecutive periods over the mean period (Praat's local jitter), without pairs that differ by more than a factor of 1.3",
    ),
    Value::new(
        "VOICE_Shimmer",
        "1",
        "mean absolute difference of consecutive amplitudes over the mean amplitude (Praat's local shimmer), without pairs that differ by more than a factor of 1.6",
    ),
    Value::new(
        "VOICE_Tilt",
        "dB/oct",
        "median slope over the third octaves from 100 Hz to 5 kHz, of voiced frames",
    ),
];

/// The values of a span.
pub(super) fn measure(store: &Store, span: Span) -> Measured {
    let coverage = store.coverage(span);
    let frames = store.known(span);
    let quality = quality(frames.clone());
    if coverage < LEAST_COVERAGE {
        return Measured::nothing(coverage, quality, VALUES.len(), Reason::Gap);
    }
    let known = frames.clone().count();
    let speech: Vec<&Frame> = frames.clone().filter(|frame| frame.is_speech()).collect();
    let voiced: Vec<&Frame> = speech.iter().copied().filter(|frame| frame.is_voiced()).collect();
    let floors: Vec<f64> = frames.clone().map(|frame| frame.floor_dbfs).collect();
    let in_speech = |of: &dyn Fn() -> Result<f64, Reason>| enough(speech.len(), LEAST_SPEECH, of);
    let of_voice = |of: &dyn Fn() -> Result<f64, Reason>| {
        if quality < LEAST_QUALITY && !speech.is_empty() {
            return Err(Reason::Quality);
        }
        enough(voiced.len(), LEAST_VOICED, of)
    };
    let talk = Talk::of(frames.clone());
    let glottal = glottal(frames);
    let values = vec![
        in_speech(&|| Ok(mean_level_db(&speech))),
        in_speech(&|| spread(speech.iter().map(|frame| frame.level_dbfs))),
        median(&floors).ok_or(Reason::Gap),
        Ok(speech.len() as f64 / known as f64),
        in_speech(&|| Ok(voiced.len() as f64 / speech.len() as f64)),
        of_voice(&|| middle(&voiced, |frame| frame.pitch_hz)),
        of_voice(&|| spread(voiced.iter().map(|frame| 12.0 * frame.pitch_hz.log2()))),
        in_speech(&|| Ok(talk.nuclei / talk.secs())),
        in_speech(&|| Ok(talk.nuclei / (speech.len() as f64 / FRAMES_HZ))),
        in_speech(&|| Ok(talk.pauses as f64 / talk.secs() * 60.0)),
        in_speech(&|| talk.mean_pause_secs()),
        of_voice(&|| jitter(&glottal)),
        of_voice(&|| shimmer(&glottal)),
        of_voice(&|| middle(&voiced, |frame| frame.tilt_db_per_octave)),
    ];
    Measured { coverage, quality, values }
}

/// The value of `count` frames, if they are enough.
fn enough(count: usize, least: usize, of: &dyn Fn() -> Result<f64, Reason>) -> Result<f64, Reason> {
    match count {
        0 => Err(Reason::Nothing),
        _ if count < least => Err(Reason::Short),
        _ => of(),
    }
}

/// The signal-to-noise ratio or voicing, reduced by clipping and by [tones](Steady) [0..1]; in a span without speech,
/// the share of samples that are not clipped.
fn quality<'a>(frames: impl Iterator<Item = &'a Frame>) -> f64 {
    let [mut count, mut clipped, mut in_speech, mut clear] = [0.0; 4];
    let mut steady = Steady::default();
    for frame in frames {
        (count, clipped) = (count + 1.0, clipped + frame.clipped.max(0.0));
        if frame.is_speech() {
            in_speech += 1.0;
            // A voice without pauses raises the floor to its own level.
            let above = (frame.level_dbfs - frame.floor_dbfs) / FULL_QUALITY_DB;
            let voicing = if frame.is_voiced() { frame.voicing } else { 0.0 };
            clear += steady.push(frame, above.max(voicing).clamp(0.0, 1.0));
        } else {
            clear += steady.finish();
        }
    }
    clear += steady.finish();
    if count == 0.0 {
        return 0.0;
    }
    let whole = (1.0 - CLIPPING * clipped / count).max(0.0);
    if in_speech == 0.0 { whole } else { whole * clear / in_speech }
}

/// Frames with the same pitch and level, and how clear they are as a voice: the frames of a hum or a beep are steadier
/// than those of any voice.
#[derive(Debug, Default)]
struct Steady {
    frames: usize,
    pitch_hz: (f64, f64),
    level_db: (f64, f64),
    clear: f64,
}

impl Steady {
    /// Adds a frame in speech; returns how clear the frames before it are, if this frame ends their steadiness.
    fn push(&mut self, frame: &Frame, clear: f64) -> f64 {
        let with = |(least, most): (f64, f64), value: f64| (value.min(least), value.max(most));
        let pitch_hz = with(self.pitch_hz, frame.pitch_hz);
        let level_db = with(self.level_db, frame.level_dbfs);
        let is_steady = frame.is_voiced()
            && pitch_hz.1 <= pitch_hz.0 * (1.0 + STEADY_PITCH)
            && level_db.1 - level_db.0 <= STEADY_DB;
        if self.frames > 0 && is_steady {
            let (frames, clear) = (self.frames + 1, self.clear + clear);
            *self = Steady { frames, pitch_hz, level_db, clear };
            return 0.0;
        }
        let before = self.finish();
        let frames = usize::from(frame.is_voiced());
        let (pitch_hz, level_db) = (frame.pitch_hz, frame.level_dbfs);
        let (pitch_hz, level_db) = ((pitch_hz, pitch_hz), (level_db, level_db));
        *self = Steady { frames, pitch_hz, level_db, clear };
        before
    }

    /// How clear the frames so far are.
    fn finish(&mut self) -> f64 {
        let Steady { frames, clear, .. } = std::mem::take(self);
        match frames {
            LONGEST_STEADY.. => 0.0,
            STEADY.. => DOUBTFUL * clear,
            _ => clear,
        }
    }
}

fn mean_level_db(frames: &[&Frame]) -> f64 {
    let power = |frame: &&Frame| 10f64.powf(frame.level_dbfs / 10.0);
    10.0 * (frames.iter().map(power).sum::<f64>() / frames.len() as f64).log10()
}

fn spread(values: impl Iterator<Item = f64> + Clone) -> Result<f64, Reason> {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    Reason::unless_finite(
        (values.map(|each| (each - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt(),
    )
}

fn middle(frames: &[&Frame], of: impl Fn(&Frame) -> f64) -> Result<f64, Reason> {
    let values: Vec<f64> =
        frames.iter().map(|frame| of(frame)).filter(|each| each.is_finite()).collect();
    median(&values).ok_or(Reason::Undefined)
}

fn jitter(sums: &Glottal) -> Result<f64, Reason> {
    if sums.period_pairs < LEAST_PAIRS {
        return Err(Reason::Short);
    }
    let mean_ms = sums.period_ms / sums.periods;
    Reason::unless_finite(sums.period_change_ms / sums.period_pairs / mean_ms)
}

fn shimmer(sums: &Glottal) -> Result<f64, Reason> {
    if sums.amplitude_pairs < LEAST_PAIRS {
        return Err(Reason::Short);
    }
    let mean = sums.amplitude / sums.periods;
    Reason::unless_finite(sums.amplitude_change / sums.amplitude_pairs / mean)
}

fn glottal<'a>(frames: impl Iterator<Item = &'a Frame>) -> Glottal {
    frames.fold(Glottal::default(), |sums, Frame { glottal, .. }| Glottal {
        periods: sums.periods + glottal.periods,
        period_ms: sums.period_ms + glottal.period_ms,
        period_pairs: sums.period_pairs + glottal.period_pairs,
        period_change_ms: sums.period_change_ms + glottal.period_change_ms,
        amplitude: sums.amplitude + glottal.amplitude,
        amplitude_pairs: sums.amplitude_pairs + glottal.amplitude_pairs,
        amplitude_change: sums.amplitude_change + glottal.amplitude_change,
    })
}

/// The part from the first to the last frame in speech.
#[derive(Debug, Default)]
struct Talk {
    nuclei: f64,
    frames: usize,
    pauses: usize,
    paused: usize,
}

impl Talk {
    fn of<'a>(frames: impl Iterator<Item = &'a Frame>) -> Talk {
        let mut talk = Talk::default();
        let mut silent = None;
        for frame in frames {
            talk.nuclei += frame.nuclei;
            if !frame.is_speech() {
                silent = silent.map(|silent: usize| silent + 1);
                continue;
            }
            let pause = silent.replace(0).unwrap_or(0);
            talk.frames += pause + 1;
            if pause >= LEAST_PAUSE {
                (talk.pauses, talk.paused) = (talk.pauses + 1, talk.paused + pause);
            }
        }
        talk
    }

    fn secs(&self) -> f64 {
        self.frames as f64 / FRAMES_HZ
    }

    fn mean_pause_secs(&self) -> Result<f64, Reason> {
        let mean_frames = self.paused as f64 / self.pauses as f64;
        if self.pauses == 0 { Err(Reason::Nothing) } else { Ok(mean_frames / FRAMES_HZ) }
    }
}
