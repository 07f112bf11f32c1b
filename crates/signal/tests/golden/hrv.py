"""Prints the golden values of ../hrv.rs and ../intervals.rs.

python 3.11 with neurokit2 0.2.13, scipy 1.17.1, numpy 2.4.6
"""
import warnings
import neurokit2 as nk, numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import lombscargle, welch

warnings.filterwarnings("ignore")


def intervals(count):
    """The same in the tests: two waves and noise from a linear congruential generator, in whole ms."""
    state, rr = 1, []
    for k in range(count):
        state = (state * 1664525 + 1013904223) % 2**32
        noise = (state >> 8) / 2**23 - 1
        rr.append(round(850 + 40 * np.sin(0.55 * k) + 25 * np.sin(0.09 * k) + 30 * noise))
    return np.array(rr, float)


def burg(values, order):
    """Coefficients (the first is 1), those of statsmodels 0.15 negated, and Burg's variance."""
    forward = backward = values - values.mean()
    coefficients, variance = np.ones(1), np.mean(forward**2)
    for _ in range(order):
        f, b = forward[1:], backward[:-1]
        reflection = -2 * f @ b / (f @ f + b @ b)
        coefficients = np.append(coefficients, 0)
        coefficients = coefficients + reflection * coefficients[::-1]
        forward, backward = f + reflection * b, b + reflection * f
        variance *= 1 - reflection**2
    return coefficients, variance


def show(name, *values):
    print(name, " ".join(repr(float(v)) for v in values))


rr = intervals(350)
d = np.diff(rr)
show("sum", rr.sum())
show("formulas", rr.mean(), np.median(rr), rr.std(ddof=1), np.sqrt(np.mean(d**2)), d.std(ddof=1), (abs(d) > 50).sum(),
     100 * (abs(d) > 50).mean(), 100 * (abs(d) > 20).mean(), (60000 / rr).mean(), (60000 / rr).std(ddof=1), 60000 / rr.mean())
show("poincare", np.sqrt(np.var(d, ddof=1) / 2), np.sqrt(2 * np.var(rr, ddof=1) - np.var(d, ddof=1) / 2))
peaks = np.concatenate([[0], np.cumsum(rr)]).astype(int)
out = {**nk.hrv_time(peaks, 1000).iloc[0], **nk.hrv_nonlinear(peaks, 1000).iloc[0]}
for name in ("CVNN CVSD SDRMSSD MadNN MCVNN IQRNN Prc20NN Prc80NN MinNN MaxNN HTI TINN PIP IALS PSS PAS GI SI AI PI "
             "C1d C1a C2d C2a Cd Ca ApEn SampEn DFA_alpha1 DFA_alpha2").split():
    show("HRV_" + name, out["HRV_" + name])
r = 0.2 * rr.std(ddof=1)
show("FuzzyEn", nk.entropy_fuzzy(rr, delay=1, dimension=2, tolerance=r)[0])
show("MSEn", nk.entropy_multiscale(rr, dimension=2, tolerance=r, method="MSEn")[0])
for low, high in ((4, 16), (16, 64), (4, 11)):
    show(f"dfa {low} {high}", nk.fractal_dfa(rr, scale=np.arange(low, high + 1))[0])
ends = np.cumsum(rr) / 1000
even = CubicSpline(ends, rr)(np.arange(ends[0], ends[-1] + 1e-9, 0.25))
for segment in (128, 64):
    f, p = welch(even, 4, nperseg=4 * segment)
    bands = [p[(f >= low) & (f < high)].sum() * f[1] for low, high in ((0.0033, 0.04), (0.04, 0.15), (0.15, 0.4))]
    show(f"welch {segment}", *bands)
model, variance = burg(even, 16)
f = np.arange(2049) / 1024
p = variance / 2 / abs(sum(c * np.exp(-0.5j * np.pi * f * k) for k, c in enumerate(model))) ** 2
show("burg", *[p[(f >= low) & (f < high)].sum() * f[1] for low, high in ((0.04, 0.15), (0.15, 0.4))])
for secs in (60, 120):
    parts = [rr[(ends // secs).astype(int) == k] for k in range(int(ends[-1] // secs) + 1)]
    parts = [part for part in parts if part.sum() >= 500 * secs]
    show(f"segments {secs}", np.std([part.mean() for part in parts], ddof=1), np.mean([part.std(ddof=1) for part in parts]))
span = ends[-1] - ends[0]
f = np.arange(1, int(0.4 * span) + 1) / span
p = lombscargle(ends, rr - rr.mean(), 2 * np.pi * f) * 2 * span / (len(rr) - 1)
show("lomb", *[p[(f >= low) & (f < high)].sum() / span for low, high in ((0.0033, 0.04), (0.04, 0.15), (0.15, 0.4))])
gap = rr.copy()
gap[[50, 51, 200]] = np.nan
e = np.diff(gap)
e = e[np.isfinite(e)]
g = gap[np.isfinite(gap)]
show("gap", np.nanmean(gap), np.nanstd(gap, ddof=1), np.sqrt(np.mean(e**2)), e.std(ddof=1))

clean = peaks.copy()
times = list(clean)
times[200] -= 190                      # an ectopic beat
times[300] += 170                      # another, late
times.insert(120, (times[119] + times[120]) // 2 + 40)  # an extra beat
del times[60]                          # a missed one
times = np.array(times[:240] + [t + 650 for t in times[240:]])  # a long interval
for iterative in (False, True):
    info, fixed = nk.signal_fixpeaks(times, 1000, iterative=iterative, method="kubios")
    for kind in ("ectopic", "missed", "extra", "longshort"):
        print("kubios", iterative, kind, [int(k) for k in info[kind]])
info, fixed = nk.signal_fixpeaks(clean, 1000, iterative=False, method="kubios")
print("normal", [(k, [int(i) for i in info[k]]) for k in ("ectopic", "missed", "extra", "longshort")])
print("normal fixed", fixed[263:268], np.flatnonzero(fixed != clean))
