"""Compares features of simulated operators with the ground truth, phase by phase."""

import math
from collections import defaultdict
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np

import bags
import tables

PHASES = ["baseline", "1-back", "2-back", "3-back"]
# The ends of the names of the topics that are read.
HEARD = ("/truth/beats", "/truth/state", "/truth/breaths", "/responses", "/phases")
NANOS = 1_000_000_000
# The requirements of section 9 of the project's reference.
MOST_RATE_BPM, MOST_BREATHS = 1.0, 0.5
MOST_RMSSD_SHARE, MOST_LEVEL_SHARE, MOST_AMPLITUDE_SHARE = 0.05, 0.10, 0.10
LEAST_FOUND = 0.95
MOST_P = 0.001
# A response counts as certain if it is this high [uS] and no other is within this time [s].
SURE_US, ALONE_SECS = 0.08, 6.0
# The time from its onset to its peak [s], and the tolerance of that.
RISE_SECS, RISE_OFF_SECS = 1.13, 1.0


class Session:
    """The truth and the features of each person and phase of a bag."""

    def __init__(self, bag: Path, people: int, phase_secs: int):
        self.phase_secs = phase_secs
        self.people = [f"p{number:03}" for number in range(1, people + 1)]
        streams = tables.described(bag)
        self.channels = {name: list(stream.channels) for name, stream in streams.items()}
        self.heard = defaultdict(list)
        for each in bags.messages(bag, HEARD):
            self.heard[each.topic].append((tables.stamp_ns(each) / NANOS, each.content))

    def phases(self, person: str) -> dict[str, tuple[float, float]]:
        """Returns when each phase of a person began and ended [s]."""
        begun = {event.label: secs for secs, event in self.heard[of(person, "task/phases")]}
        return {name: (begun[name], begun[name] + self.phase_secs) for name in PHASES}

    def values(self, person: str, family: str, value: str) -> dict[str, float]:
        """Returns the value of a feature in each phase; NaN if it has a reason instead."""
        topic = of(person, f"simulated/{family}/phases")
        place, found = self.channels[topic].index(value), {}
        for name, (begin, _) in self.phases(person).items():
            windows = self.heard[topic]
            about = (content for end, content in windows if abs(end - content.window_secs - begin) < 1)
            found[name] = next((content.values[place] for content in about), math.nan)
        return found

    def truth(self, person: str, leaf: str) -> list:
        return self.heard[of(person, f"truth/{leaf}")]

    def rows(self, family: str, value: str) -> np.ndarray:
        """Returns the values of a feature, with a row per person and a column per phase."""
        rows = (self.values(person, family, value) for person in self.people)
        return np.array([[each[name] for name in PHASES] for each in rows])

    def true_rows(self, of_span: Callable) -> np.ndarray:
        """Returns the ground truth: `of_span(person, begin, end)`, with a row per person and a column per phase."""
        spans = ([self.phases(person)[name] for name in PHASES] for person in self.people)
        people = zip(self.people, spans, strict=True)
        return np.array([[of_span(person, *span) for span in each] for person, each in people])

    def true_beats(self, person: str, begin: float, end: float) -> np.ndarray:
        return np.array([secs for secs, _ in self.truth(person, "beats") if begin <= secs < end])

    def true_state(self, person: str, begin: float, end: float, channel: str) -> float:
        place = self.channels[of(person, "truth/state")].index(channel)
        states = self.truth(person, "state")
        return float(np.mean([each.values[place] for at, each in states if begin <= at < end]))


def of(person: str, leaf: str) -> str:
    return f"/humans/persons/{person}/{leaf}"


def worst(what: str, off: np.ndarray, most: float, unit: str = "") -> tuple[bool, str]:
    """Returns whether the 95th percentile of the errors and the share of values found meet their bars, and a text."""
    found = np.isfinite(off)
    p95 = float(np.quantile(np.abs(off[found]), 0.95)) if found.any() else math.inf
    shown = f"{p95:.2f}{unit}" if unit else f"{p95:.1%}"
    bar = f"{most}{unit}" if unit else f"{most:.0%}"
    met = p95 <= most and found.mean() >= LEAST_FOUND
    return met, f"{what} off by {shown} at the 95th percentile (bar {bar}), found {found.mean():.0%}"


# --- what is found


def heart_rate(session: Session) -> tuple[bool, str]:
    found = session.rows("ecg/heart", "ECG_Rate_Mean")

    def true_bpm(*span) -> float:
        return 60 / np.mean(np.diff(session.true_beats(*span)))

    return worst("heart rate", found - session.true_rows(true_bpm), MOST_RATE_BPM, "/min")


def rmssd(session: Session) -> tuple[bool, str]:
    found = session.rows("ecg/heart", "HRV_RMSSD")
    # The features correct extrasystoles, but the truth contains them, so such phases are left out.
    found[session.rows("ecg/heart", "HRV_Corrected") > 0] = math.nan

    def true_ms(*span) -> float:
        intervals_ms = 1e3 * np.diff(session.true_beats(*span))
        return math.sqrt(np.mean(np.diff(intervals_ms) ** 2))

    off = found / session.true_rows(true_ms) - 1
    return worst("RMSSD of phases without extrasystoles", off[np.isfinite(off)], MOST_RMSSD_SHARE)


def skin_level(session: Session) -> tuple[bool, str]:
    found = session.rows("eda_fingers/skin", "EDA_Tonic_Mean")

    def level_us(*span) -> float:
        return session.true_state(*span, "skin_conductance_level")

    return worst("skin conductance level", found / session.true_rows(level_us) - 1, MOST_LEVEL_SHARE)


def breathing_rate(session: Session) -> tuple[bool, str]:
    found = session.rows("respiration/breath", "RSP_Rate_Mean")

    def breaths_per_min(person, begin, end) -> float:
        breaths = [at for at, _ in session.truth(person, "breaths") if begin <= at < end]
        return 60 / np.mean(np.diff(breaths))

    off = found - session.true_rows(breaths_per_min)
    return worst("breathing rate", off, MOST_BREATHS, "/min")


def responses(session: Session) -> tuple[bool, str]:
    sure, hits, offs = 0, 0, []
    for person in session.people:
        begin = session.phases(person)["baseline"][0] + session.phase_secs / 2
        end = session.phases(person)["3-back"][1] - ALONE_SECS
        found = session.heard[of(person, "simulated/eda_fingers/responses")]
        true = [(at, event.value) for at, event in session.truth(person, "responses")]
        for at, height_us in true:
            is_alone = sum(abs(other - at) < ALONE_SECS for other, _ in true) == 1
            if begin < at < end and height_us > SURE_US and is_alone:
                peak = at + RISE_SECS
                hit = [event.value for secs, event in found if abs(secs - peak) < RISE_OFF_SECS]
                sure, hits = sure + 1, hits + bool(hit)
                offs += [value / height_us - 1 for value in hit[:1]]
    off, share = float(np.median(offs)), hits / sure
    met = share >= LEAST_FOUND and abs(off) <= MOST_AMPLITUDE_SHARE
    text = f"{share:.1%} of {sure} sure skin responses (bar {LEAST_FOUND:.0%})"
    return met, f"{text}, their heights off by {off:+.1%} (bar {MOST_AMPLITUDE_SHARE:.0%})"


FOUND = [heart_rate, rmssd, skin_level, responses, breathing_rate]


# --- in which order


def page(rows: np.ndarray) -> float:
    """Returns the p of Page's test that values rise along the columns, by its normal approximation."""
    people, count = rows.shape
    ranks = rows.argsort(axis=1).argsort(axis=1) + 1
    weighed = float((ranks.sum(axis=0) * np.arange(1, count + 1)).sum())
    mean = people * count * (count + 1) ** 2 / 4
    variance = people * (count**3 - count) ** 2 / (144 * (count - 1))
    return math.erfc((weighed - mean) / math.sqrt(2 * variance)) / 2


def ordered(what: str, rows: np.ndarray, sign: int, digits: int) -> tuple[bool, str]:
    """Returns whether the means of all people rise (or fall) from phase to phase, and how significantly."""
    whole = rows[np.isfinite(rows).all(axis=1)]
    means, p = whole.mean(axis=0), page(sign * whole)
    is_ordered = all(sign * after > sign * before for before, after in pairwise(means))
    met = is_ordered and p < MOST_P and len(whole) >= LEAST_FOUND * len(rows)
    shown = " → ".join(f"{mean:.{digits}f}" for mean in means)
    return met, f"{what} {shown}, Page p {p:.1e} of {len(whole)} (bar {MOST_P})"


def heart_rate_rises(session: Session) -> tuple[bool, str]:
    return ordered("heart rate [/min]", session.rows("ecg/heart", "ECG_Rate_Mean"), 1, 1)


def rmssd_falls(session: Session) -> tuple[bool, str]:
    return ordered("RMSSD [ms]", session.rows("ecg/heart", "HRV_RMSSD"), -1, 1)


def skin_level_rises(session: Session) -> tuple[bool, str]:
    return ordered("skin level [µS]", session.rows("eda_fingers/skin", "EDA_Tonic_Mean"), 1, 2)


def responses_rise(session: Session) -> tuple[bool, str]:
    return ordered("responses [/min]", session.rows("eda_fingers/skin", "SCR_Peaks_Rate"), 1, 1)


ORDERS = [heart_rate_rises, rmssd_falls, skin_level_rises, responses_rise]
