use super::MOST_PERCENT;
use super::artefacts::{Artefact, Artefacts, Kind};
use super::beats::Beats;

/// Most passes: each must find fewer artefacts than the last, so there are seldom more than three.
const MOST_PASSES: usize = 20;

/// How often artefacts are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Passes {
    /// Until a pass finds as many as the last, as NeuroKit2 by default: a large artefact hides small
    /// ones.
    #[default]
    UntilSteady,
    /// Once, as in the paper.
    Once,
}

/// Corrects beats by the artefacts among them, as Lipponen and Tarvainen (2019) do.
///
/// An extra beat is removed; a missed one is put in the middle of its long interval; ectopic, long and
/// short ones are spread evenly between the right beats on both sides, so that the time of the recording
/// stays. Differences. The paper interpolates the intervals of the last kinds, which shifts everything
/// behind them against other signals. NeuroKit2 moves each of them to the middle between its neighbours,
/// the same for a single one, but wrong where the neighbour is wrong, too; it also loses count of places
/// when several beats are added or removed, and rounds to samples. The first beat and the last are never
/// moved.
///
/// ```
/// use teampulse_signal::intervals::{Beats, Correction, Kind};
/// // A beat each 0.8 s, give or take; the 40th was missed.
/// let time_secs = |k: u32| 0.8 * f64::from(k) + 0.02 * f64::from(k * k % 7);
/// let times_secs: Vec<f64> = (0..100).filter(|&k| k != 40).map(time_secs).collect();
/// let corrected = Correction::default().correct(&Beats::detected(&times_secs));
/// assert_eq!(corrected.count(Kind::Missed), 1);
/// assert_eq!(corrected.beats.times_secs().len(), 100);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Correction {
    /// How often artefacts are looked for.
    pub passes: Passes,
}

/// Beats after correction, and what was done.
#[derive(Clone, Debug, PartialEq)]
pub struct Corrected {
    /// The beats as they should have been.
    pub beats: Beats,
    /// What was corrected in each pass; places are those before the pass.
    pub passes: Vec<Artefacts>,
    /// What was corrected where [s], pass by pass.
    pub corrections: Vec<(f64, Kind)>,
    /// How many beats there were.
    pub detected: usize,
}

impl Corrected {
    /// How many of a kind were corrected.
    pub fn count(&self, kind: Kind) -> usize {
        self.passes.iter().map(|pass| pass.count(kind)).sum()
    }

    /// Corrected beats in all beats detected [%]; 0 of none. A beat corrected in two passes counts
    /// twice.
    pub fn percent(&self) -> f64 {
        let total: usize = self.passes.iter().map(Artefacts::total).sum();
        100.0 * total as f64 / self.detected.max(1) as f64
    }

    /// Whether more was corrected than should be without a person's look.
    pub fn is_doubtful(&self) -> bool {
        self.percent() > MOST_PERCENT
    }
}

impl Correction {
    /// Corrects beats; those that a person decided on stay.
    pub fn correct(&self, beats: &Beats) -> Corrected {
        let most = match self.passes {
            Passes::UntilSteady => MOST_PASSES,
            Passes::Once => 1,
        };
        let mut corrected = Corrected {
            beats: beats.clone(),
            passes: Vec::new(),
            corrections: Vec::new(),
            detected: beats.times_secs().len(),
        };
        for _ in 0..most {
            let artefacts = undecided(&corrected.beats);
            let fewer = |last: &Artefacts| artefacts.total() < last.total();
            if artefacts.total() == 0 || !corrected.passes.last().is_none_or(fewer) {
                break;
            }
            let times_secs = corrected.beats.times_secs();
            let places = artefacts.found.iter().map(|each| (times_secs[each.beat], each.kind));
            corrected.corrections.extend(places);
            corrected.beats = applied(&corrected.beats, &artefacts.found);
            corrected.passes.push(artefacts);
        }
        corrected
    }
}

/// The artefacts that no person has decided on.
fn undecided(beats: &Beats) -> Artefacts {
    let mut artefacts = Artefacts::among(beats.times_secs());
    artefacts.found.retain(|each| !beats.decided()[each.beat]);
    artefacts
}

/// A beat with what is wrong with it.
#[derive(Clone, Copy)]
struct Judged {
    at_secs: f64,
    decided: bool,
    kind: Option<Kind>,
}

fn applied(beats: &Beats, artefacts: &[Artefact]) -> Beats {
    let mut judged: Vec<Judged> = beats
        .times_secs()
        .iter()
        .zip(beats.decided())
        .map(|(&at_secs, &decided)| Judged { at_secs, decided, kind: None })
        .collect();
    for each in artefacts {
        judged[each.beat].kind = Some(each.kind);
    }
    judged.retain(|each| each.kind != Some(Kind::Extra));
    let mut whole: Vec<Judged> = Vec::with_capacity(judged.len());
    for each in judged {
        let before = whole.last().filter(|_| each.kind == Some(Kind::Missed));
        if let Some(at_secs) = before.map(|before| before.at_secs.midpoint(each.at_secs)) {
            whole.push(Judged { at_secs, decided: false, kind: None });
        }
        whole.push(each);
    }
    spread(&mut whole);
    Beats::ordered(whole.iter().map(|each| (each.at_secs, each.decided)))
}

/// Spreads each run of ectopic, long and short beats evenly between the right beats on both sides.
fn spread(beats: &mut [Judged]) {
    let is_right = |&beat: &usize| beats[beat].kind.is_none_or(|kind| kind == Kind::Missed);
    let right: Vec<usize> = (0..beats.len()).filter(is_right).collect();
    for pair in right.windows(2) {
        let (first, last) = (pair[0], pair[1]);
        let (from_secs, to_secs) = (beats[first].at_secs, beats[last].at_secs);
        for (wrong, beat) in beats[first + 1..last].iter_mut().zip(1..) {
            let share = f64::from(beat) / (last - first) as f64;
            wrong.at_secs = from_secs + share * (to_secs - from_secs);
        }
    }
}
