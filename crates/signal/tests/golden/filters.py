"""Prints filters.rs: designs and filtered signals of SciPy 1.17.1 (python filters.py > filters.rs)."""
import numpy as np
from scipy import signal as ss

DESIGNS = [  # name, arguments of butter
    ("low_pass(2, 40.0, 250.0)", (2, 40, "low", 250)),
    ("low_pass(5, 3.0, 128.0)", (5, 3, "low", 128)),
    ("low_pass(1, 0.4, 4.0)", (1, 0.4, "low", 4)),
    ("high_pass(5, 0.5, 130.0)", (5, 0.5, "high", 130)),
    ("high_pass(2, 0.05, 4.0)", (2, 0.05, "high", 4)),
    ("high_pass(4, 20.0, 1000.0)", (4, 20, "high", 1000)),
    ("band_pass(1, 5.0, 15.0, 360.0)", (1, (5, 15), "band", 360)),
    ("band_pass(3, 0.5, 8.0, 64.0)", (3, (0.5, 8), "band", 64)),
    ("band_pass(3, 1.0, 90.0, 200.0)", (3, (1, 90), "band", 200)),
    ("band_pass(4, 20.0, 95.0, 200.0)", (4, (20, 95), "band", 200)),
    ("band_pass(2, 0.1, 0.35, 50.0)", (2, (0.1, 0.35), "band", 50)),
    ("band_stop(2, 48.0, 52.0, 250.0)", (2, (48, 52), "bandstop", 250)),
    ("band_stop(3, 45.0, 55.0, 1000.0)", (3, (45, 55), "bandstop", 1000)),
    ("band_stop(1, 0.2, 20.0, 100.0)", (1, (0.2, 20), "bandstop", 100)),
]
COUNT = 200
k = np.arange(COUNT)
x = (k * 7919 % 1000) / 500 - 1 + k / 100


def row(values):
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"


def b_and_a(sos):
    return "&[" + ", ".join(f"({row(s[:3])}, {row(s[4:])})" for s in sos) + "]"


def print_const(doc, name, kind, value):
    print(f"/// {doc}\npub const {name}: {kind} = {value};\n")


print("//! SciPy 1.17.1, printed by filters.py.\n")
rows = "".join(
    f"    ({name!r}, {b_and_a(ss.butter(a[0], a[1], a[2], fs=a[3], output='sos'))}),\n".replace("'", '"')
    for name, a in DESIGNS
)
kind = "&[(&str, &[([f64; 3], [f64; 2])])]"
print_const("Sections of `butter(..., output=\"sos\")`: name, and b and a of each.", "BUTTERWORTH", kind, f"&[\n{rows}]")
b, a = ss.iirnotch(50, 30, 250)
print_const("`iirnotch(50, 30, fs=250)`.", "NOTCH", "([f64; 3], [f64; 2])", f"({row(b)}, {row(a[1:])})")
sos = ss.butter(3, (0.5, 8), "band", fs=64, output="sos")
zi = ss.sosfilt_zi(sos)
print_const("`sosfilt_zi` of the band-pass of order 3.", "SETTLED", "&[[f64; 2]]", "&[" + ", ".join(map(row, zi)) + "]")
rest, _ = ss.sosfilt(sos, x, zi=0 * zi)
settled, zf = ss.sosfilt(sos, x, zi=zi * x[0])
every = slice(None, None, 20)
print_const("Every 20th sample of `sosfilt(sos, x)`.", "AT_REST", "&[f64]", "&" + row(rest[every]))
print_const("The same with `zi=sosfilt_zi(sos) * x[0]`.", "FROM_SETTLED", "&[f64]", "&" + row(settled[every]))
print_const("`zf` after it.", "LAST_STATES", "&[[f64; 2]]", "&[" + ", ".join(map(row, zf)) + "]")
both = ss.sosfiltfilt(sos, x)
print_const("Every 20th sample of `sosfiltfilt(sos, x)`.", "ZERO_PHASE", "&[f64]", "&" + row(both[every]))
one = ss.butter(1, 0.4, "low", fs=4, output="sos")
print_const("The same for the low-pass of order 1.", "ZERO_PHASE_FIRST_ORDER", "&[f64]", "&" + row(ss.sosfiltfilt(one, x)[every]))
f = np.array([0.7, 1, 2, 4, 7, 20])
gd = sum(ss.group_delay((s[:3], s[3:]), f, fs=64)[1] for s in sos)  # of the product it loses digits
_, h = ss.sosfreqz(sos, f, fs=64)
print_const("Frequency [Hz], sum of the sections' `group_delay` [samples] and |`sosfreqz`| of the band-pass.", "RESPONSE", "&[[f64; 3]]", "&[" + ", ".join(map(row, zip(f, gd, abs(h)))) + "]")
