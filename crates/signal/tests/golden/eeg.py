"""Prints golden/eeg.rs: bands, indices and cleaned samples of made-up EEGs, by SciPy and NumPy."""
import numpy as np
import scipy
from scipy import signal

BANDS = ((1, 4), (4, 8), (8, 13), (13, 30), (30, 45))


def made_up(count, rate):
    k = np.arange(count)
    noise = (k * 7919 % 1009) / 504.5 - 1
    wave = lambda hz: np.sin(2 * np.pi * hz * k / rate)
    return 4000 + 0.01 * k + 30 * noise + 25 * wave(9.6) + 40 * wave(2.2) + 60 * wave(50)


def numbers(name, what, values):
    print(f"\n/// {what}.")
    print(f"pub const {name}: &[f64] = &[")
    for value in values:
        print(f"    {float(value)!r},")
    print("];")


def bands(x, rate):
    nperseg = round(4 * rate)
    f, p = signal.welch(x, rate, nperseg=nperseg, noverlap=nperseg // 2)
    inside = lambda low, high: (f >= low) & (f <= high)
    powers = [np.trapezoid(p[inside(*band)], f[inside(*band)]) for band in BANDS]
    alpha = inside(7, 13)
    centre = (f[alpha] * p[alpha]).sum() / p[alpha].sum()
    line = inside(2, 40) & ~inside(7, 14)
    slope = np.polyfit(np.log(f[line]), np.log(p[line]), 1)[0]
    return [*powers, f[alpha][p[alpha].argmax()], centre, slope]


print(f"//! SciPy {scipy.__version__}, printed by eeg.py.")
what = "The five bands [µV²], peak and centre of alpha [Hz], and slope, at {} Hz"
numbers("AT_256_HZ", what.format(256), bands(made_up(7000, 256), 256))
numbers("AT_125_HZ", what.format(125), bands(made_up(3333, 125), 125))
numbers("AT_130_4_HZ", what.format(130.4), bands(made_up(3333, 130.4), 130.4))
x = made_up(2000, 256)
sos = np.vstack([
    signal.butter(2, 1, "high", fs=256, output="sos"),
    signal.tf2sos(*signal.iirnotch(50, 30, fs=256)),
])
causal, _ = signal.sosfilt(sos, x, zi=signal.sosfilt_zi(sos) * x[0])
numbers("CAUSAL", "Every 200th sample, cleaned causally", causal[::200])
numbers("WHOLE", "Every 200th sample, cleaned with zero phase", signal.sosfiltfilt(sos, x)[::200])
