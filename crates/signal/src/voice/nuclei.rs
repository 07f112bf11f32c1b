//! Syllable nuclei.

/// The minimum depth of the dips beside a nucleus [dB].
const DIP_DB: f64 = 2.0;
/// The largest distance of a nucleus below the loudest recent speech [dB].
const BELOW_LOUDEST_DB: f64 = 25.0;
/// How fast the loudest level decays [dB a frame]: 1 dB/s.
const FORGOTTEN_DB: f64 = 0.01;
/// The number of frames over which the level is averaged.
const SMOOTH: usize = 5;

/// Counts peaks of level between dips, in voiced speech (de Jong & Wempe 2009, doi:10.3758/BRM.41.2.385).
#[derive(Debug)]
pub(super) struct Nuclei {
    recent: [f64; SMOOTH],
    loudest: f64,
    /// The lowest level since the last nucleus [dBFS].
    dip: f64,
    /// The maximum level since the dip, and whether it was voiced.
    peak: Option<(f64, bool)>,
}

impl Nuclei {
    pub(super) fn new() -> Nuclei {
        let (recent, infinite) = ([f64::NAN; SMOOTH], f64::INFINITY);
        Nuclei { recent, loudest: -infinite, dip: infinite, peak: None }
    }

    /// Takes in the level of the next frame, NaN without speech; returns whether a nucleus became known.
    pub(super) fn push(&mut self, level_dbfs: f64, is_voiced: bool) -> bool {
        self.recent.rotate_left(1);
        self.recent[SMOOTH - 1] = level_dbfs;
        let level = self.recent.iter().sum::<f64>() / SMOOTH as f64;
        if !level.is_finite() {
            // Without speech the level is −∞.
            let known = self.peak.take().is_some_and(|peak| self.is_nucleus(peak));
            self.dip = f64::NEG_INFINITY;
            return known;
        }
        self.loudest = (self.loudest - FORGOTTEN_DB).max(level);
        match &mut self.peak {
            Some((peak, was_voiced)) if level > *peak => (*peak, *was_voiced) = (level, is_voiced),
            Some((peak, _)) if level < *peak - DIP_DB => {
                let known = self.peak.take().is_some_and(|peak| self.is_nucleus(peak));
                self.dip = level;
                return known;
            }
            Some((_, was_voiced)) => *was_voiced |= is_voiced,
            None if level > self.dip + DIP_DB => self.peak = Some((level, is_voiced)),
            None => self.dip = self.dip.min(level),
        }
        false
    }

    fn is_nucleus(&self, (peak, was_voiced): (f64, bool)) -> bool {
        was_voiced && peak > self.loudest - BELOW_LOUDEST_DB
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_voiced_swell_is_a_nucleus() {
        let mut nuclei = Nuclei::new();
        let level = |k: i32| -30.0 + 6.0 * (std::f64::consts::TAU * f64::from(k) / 25.0).sin();
        let count = |nuclei: &mut Nuclei, voiced: bool| {
            (0..1000).filter(|&k| nuclei.push(level(k), voiced)).count()
        };
        assert!((39..=40).contains(&count(&mut nuclei, true)));
        assert!(count(&mut nuclei, false) <= 1);
    }
}
