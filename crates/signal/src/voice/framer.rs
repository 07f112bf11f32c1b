use super::activity::{Floor, LEAST_FLOOR_DBFS, Speech};
use super::frame::{Frame, Glottal};
use super::nuclei::Nuclei;
use super::path::{DELAY, Path};
use super::periodicity::{Candidates, Periodicity};
use super::pulses::Pulses;
use super::settings::Settings;
use super::sound::Sound;
use super::tilt::tilt;
use crate::error::SignalError;
use crate::gaps::is_usable;

/// The number of frames per second.
pub(super) const FRAMES_HZ: f64 = 100.0;
/// The time over which the level of a frame is computed [s].
const LEVEL_SECS: f64 = 0.02;
/// The level of silence [dBFS].
const NOTHING_DBFS: f64 = -120.0;
/// Samples at least this large are at full scale.
const FULL_SCALE: f64 = 0.999;
/// The cut-off of the high-pass that removes a constant offset [Hz].
const CONSTANT_HZ: f64 = 10.0;
/// Sound this far below the loudest recent sound is not a voice [dB].
const BELOW_LOUDEST_DB: f64 = 35.0;
/// How fast the loudest level decays [dB a frame]: 2 dB/s.
const FORGOTTEN_DB: f64 = 0.02;
/// Sound with at least this periodicity is active, regardless of its level above the floor.
const SURELY_VOICED: f64 = 0.8;
/// How gradually the likelihood of voicing rises with periodicity.
const LIKELIHOOD_WIDTH: f64 = 0.06;
/// The strength of the unvoiced state where no voice is possible.
const SURELY_UNVOICED: f64 = 2.0;

/// Computes [frames](Frame) of a sound, sample by sample; no sample allocates in steady state.
pub struct Framer {
    settings: Settings,
    rate_hz: f64,
    high_pass: HighPass,
    sound: Sound,
    periodicity: Periodicity,
    path: Path,
    floor: Floor,
    speech: Speech,
    nuclei: Nuclei,
    pulses: Pulses,
    loudest_dbfs: f64,
    /// The numbers of samples at full scale and of all samples since the last frame.
    clipped: (usize, usize),
    /// The newest frames, starting with the next one to be decided.
    waiting: [Waiting; DELAY + 1],
    /// The number of frames pending or decided.
    count: usize,
}

/// A frame whose pitch is not yet decided.
#[derive(Clone, Copy)]
struct Waiting {
    frame: Frame,
    middle: usize,
    is_active: bool,
    periodicity: f64,
}

impl Framer {
    /// Creates the framer for a rate [Hz]. Returns an error for a rate or settings out of range.
    pub fn new(settings: &Settings, rate_hz: f64) -> Result<Framer, SignalError> {
        settings.checked(rate_hz)?;
        let periodicity = Periodicity::new(rate_hz, settings.lowest_hz, settings.highest_hz);
        let window = 2 * periodicity.half() + 1;
        let hop = (rate_hz / FRAMES_HZ).ceil() as usize;
        let waiting = Waiting {
            frame: Frame::unknown(0),
            middle: 0,
            is_active: false,
            periodicity: f64::NAN,
        };
        Ok(Framer {
            settings: settings.clone(),
            rate_hz,
            high_pass: HighPass::new(rate_hz),
            sound: Sound::new(2 * window + (DELAY + 2) * hop),
            periodicity,
            path: Path::new(),
            floor: Floor::new(),
            speech: Speech::new(),
            nuclei: Nuclei::new(),
            pulses: Pulses::default(),
            loudest_dbfs: NOTHING_DBFS,
            clipped: (0, 0),
            waiting: [waiting; DELAY + 1],
            count: 0,
        })
    }

    /// The delay of a frame after its middle [s].
    pub fn delay_secs(&self) -> f64 {
        self.periodicity.half() as f64 / self.rate_hz + DELAY as f64 / FRAMES_HZ
    }

    /// Takes in the next sample (1 is full scale), NaN if missing, and its time [ns]; returns the frame that became
    /// known.
    pub fn push(&mut self, at_ns: i64, sample: f64) -> Option<Frame> {
        let is_clipped = is_usable(sample) && sample.abs() >= FULL_SCALE;
        self.clipped = (self.clipped.0 + usize::from(is_clipped), self.clipped.1 + 1);
        self.sound.push(at_ns, self.high_pass.push(sample));
        let half = self.periodicity.half();
        let middle = half + (self.count as f64 * self.rate_hz / FRAMES_HZ).round() as usize;
        if self.sound.count() <= middle + half {
            return None;
        }
        self.waiting.rotate_left(1);
        let (waiting, candidates) = self.look(middle);
        self.waiting[DELAY] = waiting;
        self.clipped = (0, 0);
        self.count += 1;
        let unvoiced = self.unvoiced(&waiting);
        let is_due = self.path.push(&candidates, unvoiced);
        is_due.then(|| self.decide())
    }

    /// The features of the frame around a sample that are known at once, with its pitch candidates.
    fn look(&mut self, middle: usize) -> (Waiting, Candidates) {
        let at_ns = self.sound.time_ns(middle).unwrap_or_default();
        let mut frame = Frame::unknown(at_ns);
        let around = |half: usize| (middle as i64 - half as i64, (middle + half + 1) as i64);
        let (from, to) = around(self.periodicity.half());
        let window = self.sound.get(from, to).unwrap_or_default();
        if window.is_empty() || window.iter().any(|sample| sample.is_nan()) {
            self.floor.push(f64::NAN);
            let waiting = Waiting { frame, middle, is_active: false, periodicity: f64::NAN };
            return (waiting, Candidates::default());
        }
        let (from, to) = around((LEVEL_SECS / 2.0 * self.rate_hz).round() as usize);
        frame.level_dbfs = level_dbfs(self.sound.get(from, to).unwrap_or_default());
        frame.floor_dbfs = self.floor.push(frame.level_dbfs);
        frame.clipped = self.clipped.0 as f64 / self.clipped.1.max(1) as f64;
        let candidates = self.periodicity.of(window);
        let (powers, step_hz) = self.periodicity.powers();
        frame.tilt_db_per_octave = tilt(powers, step_hz);
        self.loudest_dbfs = (self.loudest_dbfs - FORGOTTEN_DB).max(frame.level_dbfs);
        let periodicity = candidates.as_slice().iter().map(|each| each.periodicity);
        let periodicity = periodicity.fold(0.0, f64::max);
        let is_loud = frame.level_dbfs > frame.floor_dbfs + self.settings.above_floor_db;
        let is_active = is_loud || periodicity > SURELY_VOICED && !self.is_silent(&frame);
        (Waiting { frame, middle, is_active, periodicity }, candidates)
    }

    /// Whether a frame is too quiet for a voice.
    fn is_silent(&self, frame: &Frame) -> bool {
        let least_dbfs = LEAST_FLOOR_DBFS.max(self.loudest_dbfs - BELOW_LOUDEST_DB);
        frame.level_dbfs.is_nan() || frame.level_dbfs < least_dbfs
    }

    /// The strength of the unvoiced state.
    fn unvoiced(&self, waiting: &Waiting) -> f64 {
        if self.is_silent(&waiting.frame) { SURELY_UNVOICED } else { self.settings.voiced }
    }

    /// The oldest pending frame, with its decision.
    fn decide(&mut self) -> Frame {
        let Waiting { mut frame, middle, periodicity, .. } = self.waiting[0];
        let is_speech = self.speech.push(self.waiting.iter().map(|each| each.is_active));
        let pitch = self.path.decision().filter(|_| is_speech);
        let end = middle + (self.rate_hz / FRAMES_HZ / 2.0).round() as usize;
        let period = pitch.map(|pitch| self.rate_hz / pitch.pitch_hz);
        frame.glottal = self.pulses.push(&self.sound, (middle, end), period, self.rate_hz);
        let in_speech = if is_speech { frame.level_dbfs } else { f64::NAN };
        frame.nuclei = f64::from(self.nuclei.push(in_speech, pitch.is_some()));
        if frame.level_dbfs.is_nan() {
            return Frame { nuclei: frame.nuclei, glottal: Glottal::default(), ..frame };
        }
        frame.speech = f64::from(is_speech);
        let periodicity = pitch.map_or(periodicity, |pitch| pitch.periodicity);
        let above = (periodicity - self.settings.voiced) / LIKELIHOOD_WIDTH;
        frame.voicing = if is_speech { 1.0 / (1.0 + (-above).exp()) } else { 0.0 };
        frame.pitch_hz = pitch.map_or(f64::NAN, |pitch| pitch.pitch_hz);
        if pitch.is_none() {
            frame.tilt_db_per_octave = f64::NAN;
        }
        frame
    }
}

fn level_dbfs(samples: &[f64]) -> f64 {
    let power = samples.iter().map(|sample| sample * sample).sum::<f64>() / samples.len() as f64;
    (10.0 * power.log10()).max(NOTHING_DBFS)
}

/// Removes a constant offset.
struct HighPass {
    kept: f64,
    last: Option<(f64, f64)>,
}

impl HighPass {
    fn new(rate_hz: f64) -> HighPass {
        let kept = 1.0 - std::f64::consts::TAU * CONSTANT_HZ / rate_hz;
        HighPass { kept, last: None }
    }

    fn push(&mut self, sample: f64) -> f64 {
        if !is_usable(sample) {
            self.last = None;
            return f64::NAN;
        }
        let (before, passed) = self.last.unwrap_or((sample, 0.0));
        let passed = sample - before + self.kept * passed;
        self.last = Some((sample, passed));
        passed
    }
}
