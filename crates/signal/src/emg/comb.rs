//! Tones with harmonics: mains through a rectifier, a telephone's buzz, a motor.

/// A Hann window spreads a tone over this many bins.
const LINE_BINS: usize = 3;
/// The minimum length of a spectrum in which harmonics are looked for [bins]; a shorter one holds too few.
const LEAST_LENGTH: usize = 40;
const NEARLY_ALL: f64 = 0.9;
/// The highest order that the strongest harmonic may have.
const MOST_ORDER: u32 = 4;
/// The minimum number of bins between harmonics.
const LEAST_BINS: f64 = 8.0;

/// The share of a spectrum's power that belongs to one tone, or to one tone with its harmonics, less what would be at
/// these frequencies by chance, whichever is more [0..1]; NaN without power.
pub(super) fn tone(power: &[f64], total: f64) -> f64 {
    let (mut most, mut strongest) = (0.0, 0);
    for (place, line) in power.windows(LINE_BINS).enumerate() {
        let line: f64 = line.iter().sum();
        if line > most {
            (most, strongest) = (line, place);
        }
    }
    let single = most / total;
    // If one tone has nearly all the power, its harmonics are noise.
    if power.len() < LEAST_LENGTH || single > NEARLY_ALL {
        return single;
    }
    let sums = power[strongest..strongest + LINE_BINS].iter().zip(strongest..);
    let middle = sums.map(|(power, bin)| power * bin as f64).sum::<f64>() / most;
    let spaced = (1..=MOST_ORDER).map(|order| middle / f64::from(order));
    let combs = spaced.filter(|spacing| *spacing >= LEAST_BINS).map(|spacing| {
        let by_chance = LINE_BINS as f64 / spacing;
        (share(power, spacing) / total - by_chance) / (1.0 - by_chance)
    });
    combs.fold(single, f64::max)
}

/// The power of the lines at all multiples of a bin.
fn share(power: &[f64], spacing: f64) -> f64 {
    let at = |order: u32| (f64::from(order) * spacing).round() as usize;
    let bins = (1..).map(at).take_while(|bin| bin + 1 < power.len());
    bins.map(|bin| power[bin - 1..=bin + 1].iter().sum::<f64>()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(height: impl Fn(usize) -> f64) -> f64 {
        let power: Vec<f64> = (0..126).map(height).collect();
        tone(&power, power.iter().sum())
    }

    #[test]
    fn a_tone_with_harmonics_is_one_and_a_muscle_is_none() {
        let is_near = |bin: usize, spacing: f64| {
            let cycles = bin as f64 / spacing;
            bin > 3 && (cycles - cycles.round()).abs() * spacing <= 1.0
        };
        for spacing in [12.5, 30.0, 54.25] {
            let comb = of(|bin| if is_near(bin, spacing) { 1.0 } else { 0.0 });
            assert!(comb > 0.9, "{spacing}: {comb}");
            let beside = of(|bin| if is_near(bin, spacing) { 1.0 } else { 0.01 });
            assert!(beside > 0.7, "{spacing}: {beside}");
        }
        assert!(of(|bin| if bin == 40 { 1.0 } else { 0.0 }) > 0.999);
        let muscle = |bin: usize| {
            let chance = (bin * bin * 7919 % 997) as f64 / 997.0;
            (-(bin as f64 / 30.0 - 1.0).powi(2)).exp() * -(1.0 - chance).ln()
        };
        assert!(of(muscle) < 0.3, "{}", of(muscle));
        assert!(of(|_| 0.0).is_nan() && tone(&[], 0.0).is_nan());
    }
}
