"""Prints peaks.rs: find_peaks of SciPy 1.17.1 (python peaks.py > peaks.rs)."""
import numpy as np
from scipy.signal import find_peaks

k = np.arange(150)
x = ((k * 7919 % 101) // 9) + ((k * 31 % 300) // 40) * 2.0  # small whole numbers: plateaus and ties


def print_const(doc, name, values):
    rows = ", ".join("[" + ", ".join(repr(float(v)) for v in row) + "]" for row in values)
    print(f"/// {doc}\npub const {name}: &[[f64; 7]] = &[{rows}];\n")


print("//! Index, prominence, bases, width and crossings of SciPy 1.17.1, printed by peaks.py.\n")
for name, kw in {
    "ALL": {},
    "HIGH": dict(height=(12, 20)),
    "APART": dict(distance=7, prominence=3),
    "NARROW": dict(prominence=(2, 15), width=(1.2, 4)),
    "AT_THE_FOOT": dict(width=2.5, rel_height=1.0, prominence=4),
}.items():
    kw = {"prominence": 0, "width": 0, **kw}
    # Among equal peaks that are too close SciPy keeps any: here are none.
    p, q = find_peaks(x + k / 1000 if name == "APART" else x, **kw)
    rows = np.column_stack([p, *(q[c] for c in ["prominences", "left_bases", "right_bases", "widths", "left_ips", "right_ips"])])
    print_const(f"`find_peaks(x, **{kw})`.".replace("'", ""), name, rows)
