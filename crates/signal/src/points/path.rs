/// The time over which positions are averaged before the path length is computed [ns].
const BIN_NANOS: i64 = 250_000_000;

/// The position of a point at a time, and the length that serves as the unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stay {
    pub at_ns: i64,
    pub place: [f64; 2],
    pub unit: f64,
}

/// The speed of a point [units per second] from positions in order of time: the path between means of
/// 0.25 s. Times at which the point is not in view are left out; `None` without two successive means.
pub(crate) fn speed(stays: impl Iterator<Item = Stay>) -> Option<f64> {
    let mut bins: Vec<(i64, [f64; 3], f64)> = Vec::new();
    for Stay { at_ns, place: [x, y], unit } in stays {
        let numbers = [x, y, unit];
        if !numbers.iter().all(|number| number.is_finite()) {
            continue;
        }
        let bin = at_ns.div_euclid(BIN_NANOS);
        if bins.last().is_none_or(|(last, ..)| *last != bin) {
            bins.push((bin, [0.0; 3], 0.0));
        }
        if let Some((_, sums, count)) = bins.last_mut() {
            sums.iter_mut().zip(numbers).for_each(|(sum, number)| *sum += number);
            *count += 1.0;
        }
    }
    let (mut path, mut secs) = (0.0, 0.0);
    for pair in bins.windows(2) {
        let [(bin, one, of_one), (next, other, of_other)] = [pair[0], pair[1]];
        if next - bin == 1 {
            let [x, y, unit] = one.map(|sum| sum / of_one);
            let [to_x, to_y, to_unit] = other.map(|sum| sum / of_other);
            path += (to_x - x).hypot(to_y - y) / f64::midpoint(unit, to_unit);
            secs += BIN_NANOS as f64 / 1e9;
        }
    }
    (secs > 0.0 && path.is_finite()).then(|| path / secs)
}
