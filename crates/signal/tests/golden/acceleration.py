"""Prints acceleration.rs: values of a made-up movement, by plain formulas on SciPy's filters."""
import numpy as np, scipy.signal as ss

fs, k = 32, np.arange(32 * 23, dtype=np.int64)
noise = lambda a, b: (k * k * a % 977 * 31 % b) / b - 0.5
loud = np.where((k // 160) % 2 == 1, 1.0, 0.05)
axes = np.array([0.1 + loud * noise(1, 1009), loud * noise(3, 1013), 0.95 + loud * noise(5, 1019)])
vm = np.sqrt((axes**2).sum(0))
epochs = [vm[i:i + 5 * fs] for i in range(0, len(vm), 5 * fs)]
mad = sum(np.sum(abs(e - e.mean())) for e in epochs) / len(vm)
sos = ss.butter(2, [.25, 2.5], 'band', fs=fs, output='sos')
counts = lambda moved: 60 * np.sqrt((moved**2).sum(0)).mean()
zi = ss.sosfilt_zi(sos)
causal = np.array([ss.sosfilt(sos, a, zi=zi * a[0])[0] for a in axes])
mean = axes.mean(1)
level = lambda n: np.sqrt(axes[:, max(0, n - fs + 1):n + 1].var(axis=1, ddof=1).sum())
levels = np.array([level(n) for n in range(1, len(vm))])

print('//! Plain formulas on filters of SciPy 1.17.1, printed by acceleration.py.\n')
print('/// Of 23 s at 32 Hz.\npub const VALUES: &[(&str, f64)] = &[')
for name, value in (('ACC_VM_Mean', vm.mean()), ('ACC_VM_SD', vm.std(ddof=1)), ('ACC_ENMO', np.maximum(vm - 1, 0).mean()),
                    ('ACC_MAD', mad), ('ACC_Tilt', np.degrees(np.arccos(mean[2] / np.sqrt((mean**2).sum())))),
                    ('ACC_Motion', levels.mean()), ('ACC_Artefact', (levels > .1).mean()),
                    ('ACC_Counts causal', counts(causal)), ('ACC_Counts whole', counts(ss.sosfiltfilt(sos, axes)))):
    print(f'    ("{name}", {float(value)!r}),')
print('];')
