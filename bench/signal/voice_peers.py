"""Compares our frames of voices with the truth, librosa's pyin and Praat (parselmouth); prints a line per figure.

Called with the program that makes frames and a scratch folder. Settings were chosen on the first seeds, and are judged
on the others, on which nothing was chosen."""

import json
import subprocess
import sys
import time
from pathlib import Path

import librosa
import numpy as np
import parselmouth
from parselmouth.praat import call

from voices import RATE_HZ, conversation, sustained, utterances

CHOSEN, JUDGED = range(0, 12), range(100, 124)
LOWEST_HZ, HIGHEST_HZ = 65.0, 500.0
WORST_PITCH, WORST_VOICING, LEAST_ACTIVITY = 0.01, 0.03, 0.95
COLUMNS = 16
SPEECH, PITCH = 3, 5
"""The numbers of a frame, after its time."""

missed = []


def show(name, figure, bar="", ok=True):
    print(f"{name:<58} {figure:<26} {bar:<22} {'' if not bar else 'ok' if ok else 'MISSED'}")
    if not ok:
        missed.append(name)


def ours(program, folder, sounds):
    folder.mkdir(parents=True, exist_ok=True)
    for name, samples in sounds.items():
        samples.astype("<f8").tofile(folder / f"{name}.f64")
    begin = time.perf_counter()
    run = subprocess.run([program, "voice", folder, str(RATE_HZ)], check=True, capture_output=True)
    took = time.perf_counter() - begin
    frames = {name: np.fromfile(folder / f"{name}.frames").reshape(-1, COLUMNS) for name in sounds}
    values = map(json.loads, run.stdout.splitlines())
    return frames, {each["file"]: each["values"] for each in values}, took


def of_praat(samples):
    sound = parselmouth.Sound(samples, RATE_HZ)
    pitch = sound.to_pitch_ac(time_step=0.01, pitch_floor=LOWEST_HZ, pitch_ceiling=HIGHEST_HZ)
    hz = pitch.selected_array["frequency"]
    return pitch.xs(), np.where(hz > 0, hz, np.nan)


def of_pyin(samples, length):
    hz, _, _ = librosa.pyin(
        samples, fmin=LOWEST_HZ, fmax=HIGHEST_HZ, sr=RATE_HZ, frame_length=length, hop_length=160
    )
    return np.arange(len(hz)) * 0.01, hz


def errors(at_secs, hz, truth):
    """Returns the relative errors of pitch where both are voiced, and whether voicing is wrong."""
    places = np.round(at_secs * RATE_HZ).astype(int)
    inside = (places >= 0) & (places < len(truth))
    true, hz = truth[places[inside]], hz[inside]
    both = (true > 0) & np.isfinite(hz)
    return np.abs(hz[both] / true[both] - 1), (true > 0) != np.isfinite(hz)


def score(found, truths):
    """Returns the mean error of pitch, the share of errors over 20 %, and voicing errors, over all frames of all
    sounds."""
    pairs = [errors(*found[name], truth) for name, truth in truths.items()]
    pitch, voicing = (np.concatenate(each) for each in zip(*pairs))
    fine = pitch[pitch < 0.2]
    return fine.mean(), np.quantile(fine, 0.95), np.mean(pitch >= 0.2), voicing.mean()


def pitches(program, scratch, seeds, label, judged):
    made = {f"voice{seed}": utterances(seed) for seed in seeds}
    sounds = {name: samples for name, (samples, _) in made.items()}
    truths = {name: truth for name, (_, truth) in made.items()}
    frames, _, took = ours(program, scratch / label, sounds)
    found = {"teampulse": {name: (each[:, 0], each[:, PITCH]) for name, each in frames.items()}}
    found["Praat"] = {name: of_praat(samples) for name, samples in sounds.items()}
    found["pyin"] = {name: of_pyin(samples, 1024) for name, samples in sounds.items()}
    scores = {who: score(each, truths) for who, each in found.items()}
    best = np.min([scores["Praat"], scores["pyin"]], axis=0)
    secs = sum(map(len, sounds.values())) / RATE_HZ
    show(f"{label}: {len(made)} voices, {secs:.0f} s", f"{took / secs * 100:.2f} % of real time")
    for who, (mean, most, gross, voicing) in scores.items():
        is_judged = judged and who == "teampulse"
        bars = [f"≤ 1 %, peers {best[0]:.2%}", f"peers {best[2]:.2%}", f"≤ 3 %, peers {best[3]:.2%}"]
        oks = [mean <= min(WORST_PITCH, best[0]), gross <= best[2], voicing <= min(WORST_VOICING, best[3])]
        if not is_judged:
            bars, oks = [""] * 3, [True] * 3
        show(f"{label}: pitch of {who}, mean error", f"{mean:.2%} (95 %: {most:.2%})", bars[0], oks[0])
        show(f"{label}: pitch of {who}, off by 20 % or more", f"{gross:.2%}", bars[1], oks[1])
        show(f"{label}: voicing errors of {who}", f"{voicing:.2%}", bars[2], oks[2])


def activity(program, scratch, seeds, label, judged):
    made = {f"talk{seed}": conversation(seed, scratch) for seed in seeds}
    frames, _, _ = ours(program, scratch / label, {name: each[0] for name, each in made.items()})
    right = []
    for name, (_, labels) in made.items():
        places = np.round(frames[name][:, 0] * RATE_HZ).astype(int)
        right.append(labels[places] == (frames[name][:, SPEECH] > 0.5))
    share, worst = np.concatenate(right).mean(), min(each.mean() for each in right)
    bar = f"≥ {LEAST_ACTIVITY:.0%}" if judged else ""
    name = f"{label}: voice activity in speech of espeak-ng, frames"
    show(name, f"{share:.2%} (worst {worst:.2%})", bar, not judged or share >= LEAST_ACTIVITY)


def of_praats_pulses(samples):
    sound = parselmouth.Sound(samples, RATE_HZ)
    pulses = call(sound, "To PointProcess (periodic, cc)", LOWEST_HZ, HIGHEST_HZ)
    jitter = call(pulses, "Get jitter (local)", 0, 0, 1e-4, 0.02, 1.3)
    return jitter, call([sound, pulses], "Get shimmer (local)", 0, 0, 1e-4, 0.02, 1.3, 1.6)


def perturbations(program, scratch, seeds, label, judged):
    grid = [(0.0, 0.0), (0.005, 0.02), (0.01, 0.04), (0.02, 0.08)]
    made = {f"vowel{seed}": sustained(seed, *grid[seed % len(grid)]) for seed in seeds}
    sounds = {name: each[0] for name, each in made.items()}
    _, values, _ = ours(program, scratch / f"{label}-vowels", sounds)
    praat = {name: of_praats_pulses(samples) for name, samples in sounds.items()}
    for index, (what, column) in enumerate([("jitter", "VOICE_Jitter"), ("shimmer", "VOICE_Shimmer")]):
        truth = np.array([each[1 + index] for each in made.values()])
        own = np.array([values[name][column] or np.nan for name in made])
        peer = np.array([each[index] for each in praat.values()])
        own, peer = (np.mean(np.abs(each - truth)) for each in (own, peer))
        bar = f"≤ Praat {peer:.3%} + 0.2 %" if judged else ""
        ok = not judged or own <= peer + 0.002
        show(f"{label}: {what} of vowels, mean error", f"{own:.3%} (Praat {peer:.3%})", bar, ok)


def main():
    program, scratch = sys.argv[1], Path(sys.argv[2])
    for label, seeds, judged in [("chosen", CHOSEN, False), ("judged", JUDGED, True)]:
        pitches(program, scratch, seeds, label, judged)
        activity(program, scratch, seeds, label, judged)
        perturbations(program, scratch, seeds, label, judged)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
