//! Times of rows.

/// Reads the time of a cell in a unit of `unit_ns` [ns], to the nanosecond; `None` if the cell is marked as missing.
///
/// Digits are parsed as decimals, with a point or comma: as a float, a time since 1970 would only be exact to a quarter
/// of a microsecond.
pub fn nanos(cell: &str, unit_ns: i64) -> Result<Option<i64>, ()> {
    if cell.is_empty() || cell.eq_ignore_ascii_case("nan") {
        return Ok(None);
    }
    let with_point = (cell.matches(',').count() == 1).then(|| cell.replace(',', "."));
    let cell = with_point.as_deref().unwrap_or(cell);
    decimal(cell, unit_ns).or_else(|| scientific(cell, unit_ns)).map(Some).ok_or(())
}

fn decimal(cell: &str, unit_ns: i64) -> Option<i64> {
    let (sign, digits) = cell.strip_prefix('-').map_or((1, cell), |digits| (-1, digits));
    let (whole, part) = digits.split_once('.').unwrap_or((digits, ""));
    let is_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || !is_digits(whole) || !is_digits(part) {
        return None;
    }
    let mut nanos = i128::from(whole.parse::<i64>().ok()?) * i128::from(unit_ns);
    let mut step = i128::from(unit_ns);
    for digit in part.bytes().take_while(|_| unit_ns > 1).take(18) {
        step /= 10;
        nanos += i128::from(digit - b'0') * step;
    }
    i64::try_from(sign * nanos).ok()
}

fn scientific(cell: &str, unit_ns: i64) -> Option<i64> {
    let time: f64 = cell.parse().ok()?;
    let nanos = (time * unit_ns as f64).round();
    (nanos.abs() < i64::MAX as f64).then_some(nanos as i64)
}

/// The rate of rows at these times [ns], from the steps close to the median [Hz].
fn usual_rate_hz(times_ns: &[i64]) -> Option<f64> {
    let steps = times_ns.windows(2).map(|pair| pair[1].saturating_sub(pair[0]) as f64 / 1e9);
    let mut steps: Vec<f64> = steps.filter(|step| *step > 0.0).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let median = *steps.get(steps.len() / 2)?;
    // Stamps come in whole milliseconds or microseconds: many steps together are more exact than one.
    steps.retain(|step| (step / median - 1.0).abs() < 0.5);
    Some(steps.len() as f64 / steps.iter().sum::<f64>())
}

/// The number of steps needed for an estimate.
const ENOUGH: usize = 30;
/// How many of the longest steps may be gaps in a recording: a number, and a share of all steps.
const GAPS: (usize, f64) = (3, 0.02);
/// Rows come in bursts if their overall rate is below this share of the rate of their usual step.
const SPARSE: f64 = 0.6;
/// Times are coarse if more than this share of rows has the time of the row before.
const SHARED: f64 = 0.25;

/// Why the times of rows are not the times of their samples, so that they give no rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Uneven {
    /// Arrival times, as phones write them: the rate of rows within bursts, and the overall rate without the longest
    /// pauses [Hz].
    Bursts { within_hz: f64, whole_hz: f64 },
    /// Several rows share each time: the overall rate of rows [Hz].
    Coarse { whole_hz: f64 },
}

impl Uneven {
    /// Finds what is wrong with rows at these times [ns]; `None` if there are at most a few gaps.
    pub fn of(times_ns: &[i64]) -> Option<Uneven> {
        let within_hz = usual_rate_hz(times_ns)?;
        let steps = times_ns.windows(2).map(|pair| pair[1].saturating_sub(pair[0]) as f64 / 1e9);
        let mut steps: Vec<f64> = steps.collect();
        steps.sort_unstable_by(f64::total_cmp);
        if steps.len() < ENOUGH {
            return None;
        }
        let shared = steps.iter().filter(|step| **step == 0.0).count() as f64 / steps.len() as f64;
        let gaps = GAPS.0.max((GAPS.1 * steps.len() as f64) as usize);
        let usual = &steps[..steps.len() - gaps];
        let whole_hz = usual.len() as f64 / usual.iter().sum::<f64>();
        match whole_hz {
            _ if shared > SHARED => {
                // How many rows share the last time is not known yet.
                let before =
                    times_ns.iter().filter(|at_ns| Some(at_ns) != times_ns.last().as_ref());
                let whole_hz = before.count() as f64 / steps.iter().sum::<f64>();
                Some(Uneven::Coarse { whole_hz })
            }
            _ if whole_hz > 0.0 && whole_hz < SPARSE * within_hz => {
                Some(Uneven::Bursts { within_hz, whole_hz })
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEC: i64 = 1_000_000_000;

    #[test]
    fn times_are_read_to_the_nanosecond() {
        assert_eq!(nanos("1700000000.123456789", SEC), Ok(Some(1_700_000_000_123_456_789)));
        assert_eq!(nanos("-0.5", SEC), Ok(Some(-500_000_000)));
        assert_eq!(nanos("1700000000,123456789", SEC), Ok(Some(1_700_000_000_123_456_789)));
        assert_eq!(nanos("20.5", 1_000_000), Ok(Some(20_500_000)));
        assert_eq!(nanos("7", 1), Ok(Some(7)));
        assert_eq!(nanos("1.5e0", SEC), Ok(Some(1_500_000_000)));
        assert_eq!(nanos("", SEC), Ok(None));
        for wrong in ["noon", "1e300", "99999999999999999999", ".", "1,000.5"] {
            assert_eq!(nanos(wrong, SEC), Err(()), "{wrong}");
        }
    }

    #[test]
    fn times_of_bursts_and_times_that_rows_share_give_no_rate() {
        let times =
            |at_ms: fn(i64) -> i64| (0..200).map(|k| at_ms(k) * 1_000_000).collect::<Vec<_>>();
        let bursts = Uneven::of(&times(|k| k / 12 * 47 + k % 12));
        let Some(Uneven::Bursts { within_hz, whole_hz }) = bursts else { panic!("{bursts:?}") };
        assert!(
            (within_hz - 1000.0).abs() < 1e-9 && (250.0..330.0).contains(&whole_hz),
            "{whole_hz}"
        );
        let coarse = Uneven::of(&times(|k| k / 4 * 1000));
        let Some(Uneven::Coarse { whole_hz }) = coarse else { panic!("{coarse:?}") };
        assert!((whole_hz - 4.0).abs() < 1e-9, "{whole_hz}");
        // Gaps and uneven stamps are neither bursts nor coarse times.
        assert_eq!(Uneven::of(&times(|k| 4 * k + k / 60 * 5000)), None);
        assert_eq!(Uneven::of(&times(|k| 20 * k + [0, 7, -6, 9][k as usize % 4])), None);
        assert_eq!(Uneven::of(&times(|k| k)[..20]), None);
    }
}
