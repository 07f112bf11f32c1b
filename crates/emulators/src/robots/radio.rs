//! The radio: how well a robot receives the router.
//!
//! Two-slope path loss as in the channel models of 802.11n (Erceg et al. 2004, IEEE 802.11-03/940r4), with shadowing
//! that is correlated along the path (Gudmundson 1991, doi:10.1049/el:19911328).

use crate::noise::{Correlated, Noise};

use super::arena::{Arena, Point, ROUTER};

/// The transmit power of the router [dBm].
pub const SENT_DBM: f64 = 20.0;
/// The frequency of channel 6 [Hz].
pub const FREQUENCY_HZ: f64 = 2.437e9;
/// The noise floor [dBm].
pub const NOISE_DBM: f64 = -95.0;
/// The loss over the first metre at 2.437 GHz in free space [dB].
const FIRST_METRE_DB: f64 = 40.2;
/// The breakpoint, beyond which the loss is steeper [m]: models B and C.
const BREAK_M: f64 = 5.0;
/// The standard deviation of shadowing before the breakpoint [dB].
const SHADOW_NEAR_DB: f64 = 2.0;
/// The standard deviation of shadowing beyond the breakpoint [dB].
const SHADOW_FAR_DB: f64 = 2.5;
/// The distance over which the correlation of shadowing falls to 1/e [m].
const SHADOW_WAY_M: f64 = 1.5;
/// The attenuation by a box in the line of sight [dB].
const BOX_DB: f64 = 2.0;
/// The standard deviation between readings [dB].
const JITTER_DB: f64 = 1.0;

/// Receiver sensitivity [dBm] and bit rate [Mbit/s] of MCS 0 to 7 of 802.11n in 20 MHz.
const RATES: [(f64, f64); 8] = [
    (-82.0, 6.5),
    (-79.0, 13.0),
    (-77.0, 19.5),
    (-74.0, 26.0),
    (-70.0, 39.0),
    (-66.0, 52.0),
    (-65.0, 58.5),
    (-64.0, 65.0),
];

/// The readings of a robot's radio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reception {
    /// The signal strength, in whole decibels as drivers report it [dBm].
    pub signal_dbm: f64,
    /// The bit rate that this strength allows [Mbit/s]; 0 below the lowest.
    pub bitrate_mbitps: f64,
}

impl Reception {
    /// The quality as Linux drivers report it [0..70].
    pub fn quality(self) -> f64 {
        (self.signal_dbm + 110.0).clamp(0.0, 70.0)
    }
}

/// Returns the loss over a distance [dB], without shadowing.
pub fn path_loss_db(distance_m: f64) -> f64 {
    let distance_m = distance_m.max(0.1);
    let near_db = FIRST_METRE_DB + 20.0 * distance_m.min(BREAK_M).log10();
    near_db + 35.0 * (distance_m / BREAK_M).max(1.0).log10()
}

/// The link between one robot and the router.
#[derive(Clone, Debug)]
pub struct Link {
    shadow: Correlated,
    heard_at: Point,
    noise: Noise,
}

impl Link {
    /// Creates the link of a robot at this place.
    pub fn new(at: Point, mut noise: Noise) -> Link {
        Link { shadow: Correlated::new(SHADOW_WAY_M, noise.fork()), heard_at: at, noise }
    }

    /// Returns the reception at the robot's present place.
    pub fn heard(&mut self, at: Point, arena: &Arena) -> Reception {
        let shadow = self.shadow.after(self.heard_at.distance_m(at));
        self.heard_at = at;
        let distance_m = at.distance_m(ROUTER);
        let sigma_db = if distance_m < BREAK_M { SHADOW_NEAR_DB } else { SHADOW_FAR_DB };
        let boxes_db = BOX_DB * arena.boxes_between(at, ROUTER) as f64;
        let mean_dbm = SENT_DBM - path_loss_db(distance_m) - boxes_db;
        let signal_dbm = mean_dbm + sigma_db * shadow + JITTER_DB * self.noise.normal();
        reception(signal_dbm.round())
    }
}

fn reception(signal_dbm: f64) -> Reception {
    let fits = RATES.iter().rev().find(|(least_dbm, _)| signal_dbm >= *least_dbm);
    Reception { signal_dbm, bitrate_mbitps: fits.map_or(0.0, |(_, rate)| *rate) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loss_has_two_slopes() {
        let decade_db = |from_m: f64| path_loss_db(10.0 * from_m) - path_loss_db(from_m);
        assert!((path_loss_db(1.0) - 40.2).abs() < 1e-9);
        assert!((decade_db(0.4) - 20.0).abs() < 1e-9);
        assert!((decade_db(5.0) - 35.0).abs() < 1e-9);
    }

    #[test]
    fn a_weaker_signal_is_slower_until_it_is_none() {
        let rates: Vec<f64> =
            (-90..=-60).map(|dbm| reception(f64::from(dbm)).bitrate_mbitps).collect();
        assert!(rates.is_sorted());
        assert!(rates[0].abs() < 1e-9 && rates[30] > 64.0);
    }
}
