"""Prints emg.rs: features of frames of a made-up signal, by plain formulas on SciPy's filters."""
import numpy as np, scipy.signal as ss

def signal(n):
    k = np.arange(n, dtype=np.int64)
    return (k * k % 977 * 31 % 1009) / 1009 - 0.5 + 3.0 + 0.25 * (k // 300 % 2) * ((k * 7919 % 1000) / 500 - 1)

def frames(x, fs, threshold):
    high = min(450, fs / 2 * .95)
    y = ss.sosfiltfilt(ss.butter(4, [20, high], 'band', fs=fs, output='sos'), x - x.mean())
    w, h = int(.25 * fs), int(.125 * fs)
    for k in range(0, len(y) - w + 1, h):
        f = y[k:k + w]
        d = np.diff(f)
        freq, p = ss.periodogram(f, fs, window='hann', detrend='constant')
        c = p.cumsum()
        cross = (f[:-1] * f[1:] < 0) & (abs(d) >= threshold)
        turn = (d[:-1] * d[1:] < 0) & (np.maximum(abs(d[:-1]), abs(d[1:])) >= threshold)
        yield [np.sqrt(np.mean(f**2)), np.mean(abs(f)), np.sum(abs(f)) / fs, np.sum(f**2) / (w - 1), np.sum(abs(d)),
               cross.sum(), turn.sum(), (freq * p).sum() / p.sum(), np.interp(c[-1] / 2, c, freq)]

print('//! Plain formulas on filters of SciPy 1.17.1, printed by emg.py.\n')
print('/// Rate [Hz], threshold, and of each frame RMS, MAV, IEMG, VAR, WL, ZC, SSC, MNF and MDF.')
print('pub const FRAMES: &[(f64, f64, &[[f64; 9]])] = &[')
for fs, n, threshold in ((1000, 800, 0.0), (200, 200, 0.2), (500, 400, 0.1)):
    print(f'    ({fs}.0, {threshold}, &[')
    for row in frames(signal(n), fs, threshold):
        print('        [' + ', '.join(repr(float(v)) for v in row) + '],')
    print('    ]),')
print('];')
