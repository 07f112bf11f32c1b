use super::measure::Measure;
use super::series::pairs;

/// Asymmetry between decelerations and accelerations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asymmetry {
    /// Guzik's index: the share of decelerations in the distances from the line of identity [%].
    pub guzik_percent: f64,
    /// Slope index: the share of decelerations in the angles [%].
    pub slope_percent: f64,
    /// Area index: the share of decelerations in the sector areas [%].
    pub area_percent: f64,
    /// Porta's index: the share of accelerations in all changes [%].
    pub porta_percent: f64,
    /// Share of decelerations in the short-term variance SD1² [0..1].
    pub c1d: f64,
    /// Share of decelerations in the long-term variance SD2² [0..1].
    pub c2d: f64,
    /// Share of decelerations in the total variance [0..1].
    pub cd: f64,
}

/// Heart rate asymmetry of intervals [ms], from the Poincaré plot.
///
/// Guzik et al. (2006), doi:10.1515/BMT.2006.054; Porta et al. (2008), doi:10.1152/ajpregu.00129.2008;
/// Yan et al. (2017), doi:10.1186/s12938-017-0402-3; Piskorski & Guzik (2011),
/// doi:10.1007/s11517-011-0834-z; as in NeuroKit2. Window: as for RMSSD. `None` without a change.
pub fn asymmetry(intervals_ms: &[f64]) -> Option<Asymmetry> {
    let pairs = pairs(intervals_ms);
    let n = pairs.len() as f64;
    let centre = pairs.iter().map(|(x, y)| x + y).sum::<f64>() / n;
    let share = |of: &dyn Fn(f64, f64) -> f64, still: f64| {
        let sum = |sign: f64| {
            let meant = pairs.iter().filter(|(x, y)| (y - x) * sign > 0.0);
            meant.map(|&(x, y)| of(x, y)).sum::<f64>()
        };
        let unchanged = pairs.iter().filter(|(x, y)| (y - x).abs() == 0.0);
        let unchanged: f64 = unchanged.map(|&(x, y)| of(x, y)).sum::<f64>() * still;
        let (slower, faster) = (sum(1.0) + unchanged, sum(-1.0) + unchanged);
        (slower / (slower + faster), slower, faster)
    };
    let angle = |x: f64, y: f64| (std::f64::consts::FRAC_PI_4 - (y / x).atan()).abs();
    let across = |x: f64, y: f64| (y - x).powi(2) / 2.0;
    let along = |x: f64, y: f64| (x + y - centre).powi(2) / 2.0;
    let (c1d, short_slower, short_faster) = share(&across, 0.0);
    let (c2d, long_slower, long_faster) = share(&along, 0.5);
    let (slower, faster) = (short_slower + long_slower, short_faster + long_faster);
    let all = [
        share(&|x, y| (y - x).abs(), 0.0).0,
        share(&angle, 0.0).0,
        share(&|x, y| angle(x, y) * (x * x + y * y), 0.0).0,
        1.0 - share(&|_, _| 1.0, 0.0).0,
        c1d,
        c2d,
        slower / (slower + faster),
    ];
    all.iter().all(|each| each.is_finite()).then(|| Asymmetry {
        guzik_percent: 100.0 * all[0],
        slope_percent: 100.0 * all[1],
        area_percent: 100.0 * all[2],
        porta_percent: 100.0 * all[3],
        c1d: all[4],
        c2d: all[5],
        cd: all[6],
    })
}

impl Asymmetry {
    /// The features by name.
    pub fn measures(&self) -> Vec<Measure> {
        Measure::all([
            ("HRV_GI", "%", self.guzik_percent),
            ("HRV_SI", "%", self.slope_percent),
            ("HRV_AI", "%", self.area_percent),
            ("HRV_PI", "%", self.porta_percent),
            ("HRV_C1d", "1", self.c1d),
            ("HRV_C1a", "1", 1.0 - self.c1d),
            ("HRV_C2d", "1", self.c2d),
            ("HRV_C2a", "1", 1.0 - self.c2d),
            ("HRV_Cd", "1", self.cd),
            ("HRV_Ca", "1", 1.0 - self.cd),
        ])
    }
}
