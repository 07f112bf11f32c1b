"""Prints spectra.rs: spectra and splines of SciPy 1.17.1 and astropy 8.0.2 (python spectra.py > spectra.rs)."""
import numpy as np
from astropy.timeseries import LombScargle
from scipy import signal as ss
from scipy.integrate import simpson, trapezoid
from scipy.interpolate import CubicSpline

k = np.arange(1000)
x = (k * 7919 % 1000) / 500 - 1 + k / 100
n = np.arange(60)
t = n + (n * 7919 % 100) / 150  # ascending, uneven
y = (n * 4547 % 97) / 10


def print_const(doc, name, values):
    numbers = ", ".join(repr(float(v)) for v in values)
    print(f"/// {doc}\npub const {name}: &[f64] = &[{numbers}];\n")


print("//! SciPy 1.17.1 and astropy 8.0.2, printed by spectra.py.\n")
for doc, name, kw in [
    ("`welch(x, 250)`", "DEFAULTS", {}),
    ("`nperseg=200, noverlap=150, nfft=333, window=\"hamming\", detrend=\"linear\"`", "OPTIONS", dict(nperseg=200, noverlap=150, nfft=333, window="hamming", detrend="linear")),
    ("`nperseg=128, scaling=\"spectrum\", average=\"median\", window=\"blackman\", detrend=False`", "MEDIAN", dict(nperseg=128, scaling="spectrum", average="median", window="blackman", detrend=False)),
    ("`nperseg=2000, window=\"boxcar\"` (longer than the signal)", "WHOLE", dict(nperseg=2000, window="boxcar")),
]:
    f, p = ss.welch(x, 250, **kw)
    print_const(f"Every 10th bin of {doc}.", name, p[::10])
f, p = ss.welch(x, 250)
for name, (low, high) in {"ODD": (8, 13), "EVEN": (8, 14)}.items():
    m = (f >= low) & (f < high)
    print_const(f"`trapezoid` and `simpson` over {low} to {high} Hz ({m.sum()} bins).", name, [trapezoid(p[m], f[m]), simpson(p[m], x=f[m])])
freqs = np.array([0.013, 0.05, 0.1, 0.15, 0.25, 0.4, 0.5])
w = 2 * np.pi * freqs
print_const("`lombscargle(t, y, w)`.", "LOMB", ss.lombscargle(t, y, w))
print_const("`lombscargle(t, y - y.mean(), w, normalize=True)`.", "LOMB_CENTRED", ss.lombscargle(t, y - y.mean(), w, normalize=True))
print_const("`lombscargle(t, y, w, floating_mean=True)`.", "LOMB_FLOATING", ss.lombscargle(t, y, w, floating_mean=True))
print_const("astropy's `LombScargle(t, y).power(f, method=\"slow\")`.", "ASTROPY", LombScargle(t, y).power(freqs, method="slow"))
grid = t[0] + np.arange(0, 58, 4) / 1.0
print_const("`CubicSpline(t, y)` every 4 s.", "NOT_A_KNOT", CubicSpline(t, y)(grid))
print_const("`CubicSpline(t, y, bc_type=\"natural\")` every 4 s.", "NATURAL", CubicSpline(t, y, bc_type="natural")(grid))
for name, count in {"FOUR": 4, "THREE": 3, "TWO": 2}.items():
    s = t[:count]
    for bc in ["not-a-knot", "natural"]:
        doc = f"The first {count} points, {bc}, at 0.3 and 0.9 of their span."
        print_const(doc, f"{name}_{bc.replace('-', '_').upper()}", CubicSpline(s, y[:count], bc_type=bc)(s[0] + (s[-1] - s[0]) * np.array([0.3, 0.9])))
