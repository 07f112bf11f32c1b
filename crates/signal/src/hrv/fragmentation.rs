use super::measure::Measure;
use super::series::differences;

/// How often the heart's acceleration changes sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragmentation {
    /// Share of intervals at which the direction changes [0..1].
    pub inflection_points: f64,
    /// The reciprocal of the mean length of runs in one direction.
    pub inverse_run_length: f64,
    /// Share of runs shorter than three [0..1].
    pub short_runs: f64,
    /// Share of alternating runs of four beats or more [0..1].
    pub alternation: f64,
}

/// Heart rate fragmentation of intervals [ms].
///
/// Costa et al. (2017), doi:10.3389/fphys.2017.00255, counted as in NeuroKit2: PSS and PAS are shares of
/// runs, whereas the paper counts intervals. Window: 5 minutes. `None` without a change of direction.
pub fn fragmentation(intervals_ms: &[f64]) -> Option<Fragmentation> {
    let steps = differences(intervals_ms);
    let sign = |step: &f64| if step.abs() == 0.0 { 0.0 } else { step.signum() };
    let signs: Vec<f64> = steps.iter().map(sign).collect();
    let moving = |run: &&[f64]| run.first().is_some_and(|sign| sign.abs() > 0.0);
    let lengths: Vec<usize> =
        signs.chunk_by(|a, b| (a - b).abs() == 0.0).filter(moving).map(<[f64]>::len).collect();
    let turns: Vec<bool> = signs.windows(2).map(|pair| (pair[0] - pair[1]).abs() > 0.0).collect();
    let turning: Vec<usize> =
        turns.chunk_by(|a, b| a == b).filter(|run| run[0]).map(<[bool]>::len).collect();
    let share = |of: &[usize], meant: &dyn Fn(usize) -> bool| {
        of.iter().filter(|&&length| meant(length)).count() as f64 / of.len() as f64
    };
    (!lengths.is_empty() && !turning.is_empty()).then(|| Fragmentation {
        inflection_points: turning.iter().sum::<usize>() as f64 / (steps.len() as f64 + 1.0),
        inverse_run_length: lengths.len() as f64 / lengths.iter().sum::<usize>() as f64,
        short_runs: share(&lengths, &|length| length < 3),
        alternation: share(&turning, &|length| length >= 4),
    })
}

impl Fragmentation {
    /// The features by name.
    pub fn measures(&self) -> Vec<Measure> {
        Measure::all([
            ("HRV_PIP", "1", self.inflection_points),
            ("HRV_IALS", "1", self.inverse_run_length),
            ("HRV_PSS", "1", self.short_runs),
            ("HRV_PAS", "1", self.alternation),
        ])
    }
}
