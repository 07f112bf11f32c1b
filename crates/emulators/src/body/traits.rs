//! How people differ from each other.

use crate::noise::Noise;

/// Separates the random numbers of the traits from those of the body with the same seed.
const SALT: u64 = 0x7465_616d_7075_6c73;

/// The traits of a person, at rest unless stated otherwise.
///
/// The means are those of a seated adult; the strength of a response is stated for full workload or arousal. Traits can
/// be set one by one.
#[derive(Clone, Debug, PartialEq)]
pub struct Traits {
    /// Mean heart rate [1/min].
    pub heart_rate_bpm: f64,
    /// The rise of the heart rate at full workload [1/min].
    pub heart_rate_rise_bpm: f64,
    /// The amplitude of respiratory sinus arrhythmia [s].
    pub rsa_secs: f64,
    /// The amplitude of the 10 s rhythm of blood pressure in the RR interval [s].
    pub mayer_secs: f64,
    /// The share of beats that come early, from a ventricle [0..1].
    pub ectopic_share: f64,
    /// The height of the R wave [mV].
    pub r_wave_mv: f64,
    /// The time from the R wave to the foot of the pulse at the finger [s].
    pub pulse_arrival_secs: f64,
    /// The height of the pulse [1].
    pub pulse_amplitude: f64,
    /// The skin conductance level [µS].
    pub skin_level_us: f64,
    /// The median amplitude of skin conductance responses [µS].
    pub skin_response_us: f64,
    /// The breathing rate [1/min].
    pub breaths_per_min: f64,
    /// The share of inhaling in a breath [0..1].
    pub inhale_share: f64,
    /// The temperature of the skin [°C].
    pub skin_temperature_c: f64,
    /// The fall of skin temperature at full workload [K].
    pub cooling_k: f64,
    /// The tone of a resting forearm muscle [µV RMS].
    pub muscle_tone_uv: f64,
    /// The frequency of the alpha rhythm [Hz].
    pub alpha_hz: f64,
    /// The amplitude of the alpha rhythm behind the ears with open eyes [µV RMS].
    pub alpha_uv: f64,
    /// The blink rate [1/min].
    pub blinks_per_min: f64,
    /// The rate of spontaneous movements of the arm [1/min].
    pub movements_per_min: f64,
}

impl Traits {
    /// Generates a person from a seed.
    pub fn of_seed(seed: u64) -> Traits {
        let mut noise = Noise::seeded(seed ^ SALT);
        Traits {
            heart_rate_bpm: noise.around(68.0, 7.0),
            heart_rate_rise_bpm: 9.0 * noise.factor(0.25),
            rsa_secs: 0.045 * noise.factor(0.2),
            mayer_secs: 0.030 * noise.factor(0.2),
            ectopic_share: 0.002,
            r_wave_mv: noise.factor(0.2),
            pulse_arrival_secs: noise.around(0.25, 0.015),
            pulse_amplitude: noise.factor(0.2),
            skin_level_us: 4.0 * noise.factor(0.25),
            skin_response_us: 0.15 * noise.factor(0.25),
            breaths_per_min: noise.around(14.0, 1.2),
            inhale_share: noise.around(0.42, 0.03),
            skin_temperature_c: noise.around(33.5, 0.7),
            cooling_k: noise.uniform(0.3..0.8),
            muscle_tone_uv: 4.0 * noise.factor(0.25),
            alpha_hz: noise.around(10.0, 0.6),
            alpha_uv: 6.0 * noise.factor(0.25),
            blinks_per_min: 15.0 * noise.factor(0.25),
            movements_per_min: 0.3 * noise.factor(0.5),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_is_the_same_person_and_another_is_another() {
        assert_eq!(Traits::of_seed(4), Traits::of_seed(4));
        assert_ne!(Traits::of_seed(4), Traits::of_seed(5));
    }
}
