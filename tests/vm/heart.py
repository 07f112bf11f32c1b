"""What the straps send, and where they are reached: known to the straps and to the test."""

import math

H10 = "A0:9E:1A:00:00:01"
OTHER = "C4:00:00:00:00:02"
FRAME_SAMPLES = 73
BEAT_SAMPLES = 104


def ecg_uv(sample: int) -> int:
    """The ECG of a steady heart [µV]: R waves of 1.2 mV, and a wave of 3 s that no two beats share."""
    from_r = (sample % BEAT_SAMPLES) - 20
    return round(1200 * math.exp(-(from_r**2) / 8) + 90 * math.sin(sample / 62))


def interval_steps(beat: int) -> int:
    """The interval before a beat [1/1024 s]: no two neighbours are equal."""
    return 819 + (beat * 7) % 23 - 11
