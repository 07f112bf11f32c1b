"""Synthetic voices whose pitch, voicing, jitter and shimmer are known, and speech of espeak-ng with known pauses."""

import subprocess
import wave

import numpy as np
from scipy.signal import lfilter, resample_poly

RATE_HZ = 16_000
FINER = 6
"""The oversampling of the source, so that its edges are band-limited."""

VOWELS = {
    "a": (730, 1090, 2440, 3400),
    "i": (270, 2290, 3010, 3700),
    "u": (300, 870, 2240, 3300),
    "e": (530, 1840, 2480, 3500),
    "o": (570, 840, 2410, 3300),
}
BANDWIDTHS = (80, 100, 140, 200)


def vowel(source, formants, rate_hz, scale=1.0):
    for centre, width in zip(formants, BANDWIDTHS):
        radius = np.exp(-np.pi * width / rate_hz)
        turn = 2 * np.cos(2 * np.pi * centre * scale / rate_hz) * radius
        source = lfilter([1 - turn + radius**2], [1, -turn, radius**2], source)
    return source


def glottal_flow(phase, open_share):
    """Returns the derivative of Rosenberg's pulse at a phase of the period."""
    opening, closing = 0.67 * open_share, 0.33 * open_share
    rising = np.pi / 2 / opening * np.sin(np.pi * phase / opening)
    falling = -np.pi / 2 / closing * np.sin(np.pi / 2 * (phase - opening) / closing)
    return np.where(phase < opening, rising, np.where(phase < open_share, falling, 0.0))


def voiced(pitch_hz, jitter, shimmer, rng):
    """Returns a voiced source at the finer rate, and the true mean jitter and shimmer of its periods."""
    rate = RATE_HZ * FINER
    source, at = np.zeros(len(pitch_hz)), 0.0
    periods, amplitudes = [], []
    while at < len(source) - 1:
        period = rate / pitch_hz[int(at)] * (1 + jitter * rng.standard_normal())
        amplitude = 1 + shimmer * rng.standard_normal()
        k = np.arange(int(np.ceil(at)), min(int(np.ceil(at + period)), len(source)))
        # A longer period closes at the same phase.
        source[k] = amplitude * glottal_flow((k - at) / period, 0.6)
        periods.append(period)
        amplitudes.append(amplitude)
        at += period
    return source, np.array(periods) / rate, np.array(amplitudes)


def local(values):
    return np.mean(np.abs(np.diff(values))) / np.mean(values)


def ramped(sound, rate, secs=0.01):
    length = int(secs * rate)
    ramp = 0.5 - 0.5 * np.cos(np.pi * np.arange(length) / length)
    sound = sound.copy()
    sound[:length] *= ramp
    sound[-length:] *= ramp[::-1]
    return sound


def utterances(seed, snr_db=20.0, secs=12.0):
    """Returns vowels that glide between pauses and whispers: samples, and the pitch at each (0 if there is none)."""
    rng = np.random.default_rng(seed)
    rate = RATE_HZ * FINER
    centre = 80 * 5 ** rng.random()
    jitter, shimmer = rng.uniform(0, 0.01), rng.uniform(0, 0.05)
    scale = 1.0 + 0.15 * np.log2(max(centre, 100) / 100) / 2
    sound, pitch = [], []

    def add(piece, hz):
        sound.append(piece)
        pitch.append(hz)

    while sum(map(len, sound)) < secs * rate:
        pause = int(rng.uniform(0.15, 0.6) * rate)
        add(np.zeros(pause), np.zeros(pause))
        length = int(rng.uniform(0.4, 1.2) * rate)
        formants = VOWELS[rng.choice(list(VOWELS))]
        if rng.random() < 0.2:
            whisper = vowel(rng.standard_normal(length), formants, rate, scale)
            add(ramped(0.3 * whisper / np.std(whisper), rate), np.zeros(length))
            continue
        begin, end = np.clip(centre * 2 ** rng.uniform(-0.35, 0.35, 2), 80, 400)
        wobble = 1 + 0.02 * np.sin(2 * np.pi * 5 * np.arange(length) / rate)
        hz = np.clip(np.geomspace(begin, end, length) * wobble, 80, 400)
        source, _, _ = voiced(hz, jitter, shimmer, rng)
        voice = vowel(source, formants, rate, scale)
        add(ramped(voice / np.std(voice), rate), hz)
    fine, hz = np.concatenate(sound), np.concatenate(pitch)
    samples = resample_poly(fine, 1, FINER)
    hz = hz[::FINER][: len(samples)]
    level = np.sqrt(np.mean(samples[hz > 0] ** 2))
    noisy = samples + level * 10 ** (-snr_db / 20) * rng.standard_normal(len(samples))
    return 0.1 * noisy / level, hz


def sustained(seed, jitter, shimmer):
    """Returns a vowel of 4 s at a steady pitch, with the jitter and shimmer of its source."""
    rng = np.random.default_rng(seed)
    rate = RATE_HZ * FINER
    hz = np.full(4 * rate, rng.uniform(90, 260))
    source, periods, amplitudes = voiced(hz, jitter, shimmer, rng)
    samples = resample_poly(vowel(source, VOWELS["a"], rate), 1, FINER)
    samples = 0.1 * samples / np.std(samples) + 1e-4 * rng.standard_normal(len(samples))
    return samples, local(periods), local(amplitudes)


PHRASES = [
    "robot", "the red box", "please go back", "stop", "battery", "turn left now", "on my way", "seven",
    "send the other one", "wait a moment", "yes", "follow me", "look behind you", "good", "open that door",
]
VOICES = ["en-us", "en-gb+f3", "de", "en-us+m3", "en-gb+f2", "fr", "es", "en-us+f5"]


def spoken(text, voice, speed, path):
    """Returns a phrase of espeak-ng at 16 kHz, without the silence around it."""
    command = ["espeak-ng", "-v", voice, "-s", str(speed), "-w", str(path), text]
    subprocess.run(command, check=True, capture_output=True)
    with wave.open(str(path)) as file:
        rate = file.getframerate()
        samples = np.frombuffer(file.readframes(file.getnframes()), "<i2") / 32768
    heard = np.nonzero(np.abs(samples) > 0.003)[0]
    samples = samples[heard[0] : heard[-1] + 1]
    return resample_poly(samples, RATE_HZ // 50, rate // 50)


def conversation(seed, folder, snr_db=20.0):
    """Returns phrases between pauses of known length in noise: samples, and whether each is speech."""
    rng = np.random.default_rng(seed)
    voice = VOICES[seed % len(VOICES)]
    pieces, labels = [], []
    for text in rng.permutation(PHRASES)[:8]:
        pause = int(rng.uniform(0.4, 2.0) * RATE_HZ)
        phrase = spoken(str(text), voice, int(rng.integers(130, 200)), folder / "phrase.wav")
        pieces += [np.zeros(pause), phrase]
        labels += [np.zeros(pause, bool), np.ones(len(phrase), bool)]
    samples, labels = np.concatenate(pieces), np.concatenate(labels)
    level = np.sqrt(np.mean(samples[labels] ** 2))
    noisy = samples + level * 10 ** (-snr_db / 20) * rng.standard_normal(len(samples))
    return noisy, labels
