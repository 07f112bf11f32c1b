"""Golden values of an ECG's quality parts: the same made-up ECG, by numpy and SciPy."""
import numpy as np
from scipy import signal as ss
RATE = 200.0
WAVES = [(-0.16, 0.12, 0.025), (-0.03, -0.12, 0.008), (0.0, 1.0, 0.01), (0.03, -0.25, 0.01), (0.25, 0.3, 0.05)]
k = np.arange(int(20 * RATE)); t = k / RATE
beats = np.array([0.6 + 0.82 * j + 0.04 * np.sin(0.7 * j) for j in range(24)])
x = 0.2 * np.sin(1.3 * t)
for b in beats:
    near = abs(t - b) < 1.0
    for o, h, w in WAVES:
        x += near * h * np.exp(-(((t - b - o) / w) ** 2) / 2)
sos = np.vstack([ss.butter(2, 0.5, 'highpass', fs=RATE, output='sos'), ss.tf2sos(*ss.iirnotch(50, 30, RATE))])
clean = ss.sosfiltfilt(sos, x)
pieces = [slice(i, i + 800) for i in range(0, len(x) - 799, 400)]
def kurt(c): d = c - c.mean(); return (d**4).mean() / (d**2).mean() ** 2
def power(p, lo, hi):
    f, P = ss.periodogram(p, RATE, 'hann', detrend='constant', scaling='spectrum')
    return P[(f >= lo) & (f < hi)].sum()
print(repr(np.median([kurt(clean[s]) for s in pieces])))
print(repr(np.median([power(x[s], 5, 15) / power(x[s], 5, 40) for s in pieces])))
print(repr(np.median([power(x[s], 0, 1) / power(x[s], 0, 40) for s in pieces])))
