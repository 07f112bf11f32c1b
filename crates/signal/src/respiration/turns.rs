//! Turning points of a signal.

/// The kind of a turning point.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub(super) enum Kind {
    Trough,
    Peak,
}

/// A turning point of a signal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    pub(super) kind: Kind,
    pub(super) place: f64,
    pub(super) height: f64,
}

/// Detects extremes from which a signal has returned by a threshold, alternating troughs and peaks.
///
/// The first extreme counts only if the signal has also approached it by the threshold; otherwise it is only where the
/// data start.
#[derive(Clone, Debug, Default)]
pub(super) struct Turns {
    highest: Option<Extreme>,
    lowest: Option<Extreme>,
    last: Option<Kind>,
    before: Option<f64>,
}

/// A sample and its neighbours.
#[derive(Clone, Copy, Debug)]
struct Extreme {
    place: usize,
    height: f64,
    before: Option<f64>,
    after: Option<f64>,
    /// The distance of the extreme from the opposite one before it.
    approach: f64,
}

impl Turns {
    /// Takes in the sample at the next index, and returns the turning point that it confirms.
    pub(super) fn push(&mut self, place: usize, height: f64, threshold: f64) -> Option<Turn> {
        let before = self.before.replace(height);
        let from = |extreme: Option<Extreme>| {
            let approach = extreme.map_or(0.0, |extreme| (extreme.height - height).abs());
            Extreme { place, height, before, after: None, approach }
        };
        let (up, down) = (from(self.lowest), from(self.highest));
        update(&mut self.highest, up, |height, top| height > top);
        update(&mut self.lowest, down, |height, bottom| height < bottom);
        let (highest, lowest) = (self.highest?, self.lowest?);
        if self.last != Some(Kind::Peak) && highest.height - height > threshold {
            self.lowest = Some(down);
            return self.turn(Kind::Peak, highest, threshold);
        }
        if self.last != Some(Kind::Trough) && height - lowest.height > threshold {
            self.highest = Some(up);
            return self.turn(Kind::Trough, lowest, threshold);
        }
        None
    }

    fn turn(&mut self, kind: Kind, extreme: Extreme, threshold: f64) -> Option<Turn> {
        let is_first = self.last.replace(kind).is_none();
        if is_first && extreme.approach <= threshold {
            return None;
        }
        let neighbours = extreme.before.zip(extreme.after);
        let (away, height) = neighbours
            .map_or((0.0, extreme.height), |(before, after)| vertex(before, extreme.height, after));
        Some(Turn { kind, place: extreme.place as f64 + away, height })
    }
}

fn update(extreme: &mut Option<Extreme>, here: Extreme, beats: impl Fn(f64, f64) -> bool) {
    match extreme {
        Some(extreme) if !beats(here.height, extreme.height) => {
            if here.place == extreme.place + 1 {
                extreme.after = Some(here.height);
            }
        }
        _ => *extreme = Some(here),
    }
}

/// Moves a turning point to the corresponding extreme of another `signal`, which starts at index `first`.
///
/// Returns it unchanged if that extreme lies at an end of the signal.
pub(super) fn placed(turn: Turn, first: usize, signal: &[f64]) -> Turn {
    let sign = if turn.kind == Kind::Peak { 1.0 } else { -1.0 };
    let inner = 1..signal.len().saturating_sub(1);
    let best = inner.max_by(|&a, &b| (sign * signal[a]).total_cmp(&(sign * signal[b])));
    let is_turn = |k: &usize| {
        sign * signal[*k] >= sign * signal[k - 1] && sign * signal[*k] >= sign * signal[k + 1]
    };
    let Some(best) = best.filter(is_turn) else { return turn };
    let (away, height) = vertex(signal[best - 1], signal[best], signal[best + 1]);
    Turn { kind: turn.kind, place: (first + best) as f64 + away, height }
}

/// The vertex of the parabola through three neighbours: its offset from the central one, and its height.
pub(super) fn vertex(before: f64, height: f64, after: f64) -> (f64, f64) {
    let (slope, bend) = ((after - before) / 2.0, before - 2.0 * height + after);
    let away = -slope / bend;
    if away.abs() <= 1.0 { (away, height + slope * away / 2.0) } else { (0.0, height) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turns(signal: &[f64], threshold: f64) -> Vec<(Kind, f64)> {
        let mut turns = Turns::default();
        let found = signal.iter().enumerate().filter_map(|(k, &v)| turns.push(k, v, threshold));
        found.map(|turn| (turn.kind, turn.place)).collect()
    }

    #[test]
    fn only_turns_that_are_deep_enough_count() {
        let signal = [0.0, 5.0, 0.0, 1.0, 0.0, 5.0, 4.5, 5.5, 0.0];
        let found = turns(&signal, 2.0);
        let kinds: Vec<Kind> = found.iter().map(|turn| turn.0).collect();
        assert_eq!(kinds, [Kind::Peak, Kind::Trough, Kind::Peak]);
        // Interpolated where there is a sample on both sides.
        for (turn, place) in found.iter().zip([1.0, 2.0 + 1.0 / 3.0, 7.0 - 9.0 / 26.0]) {
            assert!((turn.1 - place).abs() < 1e-12, "{turn:?}");
        }
        assert_eq!(turns(&signal, 0.7).len(), 5);
        assert_eq!(turns(&signal, f64::INFINITY), []);
        assert_eq!(turns(&signal, f64::NAN), []);
    }

    #[test]
    fn the_start_of_a_signal_is_no_turn() {
        assert_eq!(turns(&[3.0, 5.0, 0.0, 5.0], 2.0).len(), 1);
        assert_eq!(turns(&[2.5, 5.0, 0.0, 5.0], 2.0).len(), 2);
        assert_eq!(turns(&[1.0, 0.0, 5.0, 0.0, 5.0], 2.0).len(), 2);
        assert_eq!(turns(&[3.0, 0.0, 5.0, 0.0, 5.0], 2.0).len(), 3);
    }

    #[test]
    fn a_parabola_has_its_vertex() {
        let height = |x: f64| 3.0 - 2.0 * (x - 0.25).powi(2);
        let (away, top) = vertex(height(-1.0), height(0.0), height(1.0));
        assert!((away - 0.25).abs() < 1e-12 && (top - 3.0).abs() < 1e-12);
        assert_eq!(vertex(1.0, 1.0, 1.0), (0.0, 1.0));
    }
}
