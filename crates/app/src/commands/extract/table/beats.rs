//! Tables of heartbeats without column names: the time of each beat and the interval before it, in the form that Kubios
//! HRV reads and our `intervals.txt` has.

use super::line::number;

/// The number of intervals that suffices to recognise such a table.
const ENOUGH: usize = 3;
/// The largest combined rounding error of a time and an interval [s].
const ROUNDING_SECS: f64 = 0.002;
/// The shortest and the longest interval of a heart [s].
const INTERVALS_SECS: (f64, f64) = (0.2, 3.0);

/// Returns the units of the times and intervals in these rows if they form such a table: most intervals equal the time
/// since the previous beat, or are shorter where data are missing.
pub fn units(rows: &[Vec<String>]) -> Option<[&'static str; 2]> {
    let pair = |cells: &Vec<String>| match &cells[..] {
        [time, interval] => number(time).zip(number(interval)),
        _ => None,
    };
    let rows: Vec<(f64, f64)> = rows.iter().map(pair).collect::<Option<_>>()?;
    let all = [("s", 1.0), ("ms", 1e-3)];
    all.iter().flat_map(|time| all.map(|interval| (*time, interval))).find_map(
        |((time, of_time), (interval, of_interval))| {
            let fits = |pair: &&[(f64, f64)]| {
                let interval_secs = pair[1].1 * of_interval;
                let since_secs = (pair[1].0 - pair[0].0) * of_time;
                (INTERVALS_SECS.0..=INTERVALS_SECS.1).contains(&interval_secs)
                    && (since_secs - interval_secs).abs() <= ROUNDING_SECS
            };
            let fitting = rows.windows(2).filter(fits).count();
            (fitting >= ENOUGH && 2 * fitting > rows.len() - 1).then_some([time, interval])
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Option<[&'static str; 2]> {
        let cells = |line: &str| line.split(' ').map(str::to_owned).collect();
        units(&text.lines().map(cells).collect::<Vec<_>>())
    }

    #[test]
    fn times_and_the_intervals_before_them_are_recognised_in_any_unit() {
        assert_eq!(of("1.512 0.812\n2.300 0.788\n3.1 0.8\n9.05 0.85\n9.85 0.8"), Some(["s", "s"]));
        assert_eq!(of("1.512 812\n2.300 788\n3.1 800\n3.9 800"), Some(["s", "ms"]));
        assert_eq!(of("1512 812\n2300 788\n3100 800\n3900 800"), Some(["ms", "ms"]));
        assert_eq!(of("1512 .812\n2300 .788\n3100 .8\n3900 .8"), Some(["ms", "s"]));
    }

    #[test]
    fn other_pairs_of_numbers_are_not_beats() {
        for text in [
            "1.512 0.812\n2.300 0.788",
            "0 0.004\n0.004 0.004\n0.008 0.004\n0.012 0.004",
            "0 1.2\n0.25 1.3\n0.5 1.2\n0.75 1.3",
            "1 2 3\n2 3 4\n3 4 5\n4 5 6",
            "a 1\nb 2\nc 3\nd 4",
        ] {
            assert_eq!(of(text), None, "{text}");
        }
    }
}
