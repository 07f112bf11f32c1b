//! The results of other programs for the same arrivals: LSL online, and `pyxdf` afterwards.

use super::Session;

/// The half time of LSL's smoothing [s].
const HALF_TIME_SECS: f64 = 90.0;
/// A pause is a break for `pyxdf` if it exceeds this time [s] and this many samples.
const BREAK_SECS: f64 = 1.0;
const BREAK_SAMPLES: f64 = 500.0;

/// Returns the times of packets [s since the first arrival] as liblsl's post-processing smooths them online: recursive
/// least squares of arrivals over numbers, packet by packet.
pub fn lsl(session: &Session) -> Vec<f64> {
    let rate = session.packet_hz;
    let lambda = 2f64.powf(-1.0 / (rate * HALF_TIME_SECS));
    let (mut p00, mut p01, mut p11) = (1e10, 0.0, 1e10);
    let (mut w0, mut w1) = (0.0, 1.0 / rate);
    let smooth = |(number, at): (usize, f64)| {
        let u = number as f64;
        let (pi0, pi1) = (p00 + u * p01, p01 + u * p11);
        let error = at - (w0 + u * w1);
        let gain = 1.0 / (lambda + pi0 + pi1 * u);
        p00 = (p00 - pi0 * pi0 * gain) / lambda;
        p01 = (p01 - pi0 * pi1 * gain) / lambda;
        p11 = (p11 - pi1 * pi1 * gain) / lambda;
        w0 += error * (p00 + p01 * u);
        w1 += error * (p01 + p11 * u);
        w0 + u * w1
    };
    arrivals(session).into_iter().enumerate().map(smooth).collect()
}

/// Returns the times of packets [s since the first arrival] as `pyxdf` removes jitter from a recording: a straight line
/// through the arrivals of each stretch without a break.
pub fn pyxdf(session: &Session) -> Vec<f64> {
    let arrivals = arrivals(session);
    let count = session.packets.first().map_or(1, |packet| packet.stamps.count);
    let longest = BREAK_SECS.max(BREAK_SAMPLES / session.packet_hz / f64::from(count));
    let mut times = Vec::with_capacity(arrivals.len());
    for part in arrivals.chunk_by(|a, b| b - a <= longest) {
        let count = part.len() as f64;
        let (mean_x, mean_y) = ((count - 1.0) / 2.0, part.iter().sum::<f64>() / count);
        let (mut xx, mut xy) = (0.0, 0.0);
        for (x, y) in part.iter().enumerate() {
            let x = x as f64 - mean_x;
            xx += x * x;
            xy += x * (y - mean_y);
        }
        let slope = if xx > 0.0 { xy / xx } else { 0.0 };
        times.extend((0..part.len()).map(|x| mean_y + slope * (x as f64 - mean_x)));
    }
    times
}

fn arrivals(session: &Session) -> Vec<f64> {
    let first = session.packets.first().map_or(0, |packet| packet.stamps.arrival);
    let arrival = |packet: &super::Packet| (packet.stamps.arrival - first) as f64 / 1e9;
    session.packets.iter().map(arrival).collect()
}
