use super::Wearer;

/// The time between two notifications of the heart rate \[s\].
pub(super) const HEART_RATE_SECS: f64 = 1.0;

/// The part of a strap that finds beats and writes Heart Rate Measurements (Heart Rate Service 1.0, 3.1).
#[derive(Debug, Default)]
pub(super) struct BeatDetector {
    from_secs: f64,
    last_beat_secs: Option<f64>,
}

impl BeatDetector {
    /// Returns when the next measurement is due \[s\].
    pub fn due_secs(&self) -> f64 {
        self.from_secs + HEART_RATE_SECS
    }

    /// Returns the rate of the last beats, and every interval since the last measurement. `contact` is skin contact,
    /// for straps that report it; `quartz` is the speed of the strap's clock.
    pub fn measure(
        &mut self,
        secs: f64,
        wearer: Option<&mut dyn Wearer>,
        contact: Option<bool>,
        quartz: f64,
    ) -> Vec<u8> {
        let from_secs = std::mem::replace(&mut self.from_secs, secs);
        let flags = contact.map_or(0, |contact| 0x04 | u8::from(contact) << 1);
        let mut value = vec![flags, 0];
        let Some(wearer) = wearer else {
            self.last_beat_secs = None;
            return value;
        };
        for beat_secs in wearer.beats(from_secs, secs) {
            if let Some(last_secs) = self.last_beat_secs.replace(beat_secs) {
                let interval_secs = (beat_secs - last_secs) * quartz;
                value.extend(((interval_secs * 1024.0).round() as u16).to_le_bytes());
                value[1] = (60.0 / interval_secs).round().clamp(0.0, 255.0) as u8;
            }
        }
        if value.len() > 2 {
            value[0] |= 0x10;
        }
        value
    }
}
