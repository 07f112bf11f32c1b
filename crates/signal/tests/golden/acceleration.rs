//! Plain formulas on filters of SciPy 1.17.1, printed by acceleration.py.

/// Of 23 s at 32 Hz.
pub const VALUES: &[(&str, f64)] = &[
    ("ACC_VM_Mean", 0.9838820219615323),
    ("ACC_VM_SD", 0.1854736127786667),
    ("ACC_ENMO", 0.056736871019044614),
    ("ACC_MAD", 0.1108068459617303),
    ("ACC_Tilt", 6.110754654948578),
    ("ACC_Motion", 0.2456318867792591),
    ("ACC_Artefact", 0.5170068027210885),
    ("ACC_Counts causal", 5.222756602040428),
    ("ACC_Counts whole", 4.601408588917007),
];
