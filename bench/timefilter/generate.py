"""Writes the arrivals of a mixed set of sensors: `generate.py SCENARIO SECONDS SEED > FILE`.

One line per sample, in order of arrival: topic, arrival, device clock, true time (all in ns), the number of
samples of its stream that arrived together, and its place among those.

Bluetooth: 50 ms and a log-normal tail, at most 300 ms, on a connection interval of 30 ms, in order;
Wi-Fi: 3 ms and a log-normal tail; USB: a fixed delay and 2 ms of noise. Device clocks drift by
15 to 60 ppm and start at any time.
"""

import sys

import numpy as np

BASE_SECS = 1000.0
CONNECTION_INTERVAL_SECS = 0.03
BLUETOOTH, WIFI, USB = "bluetooth", "wifi", "usb"

# For each stream: rate [Hz], transport, batch size or fixed delay [s], drift [ppm].
SCENARIOS = {
    "2": [(130, BLUETOOTH, 1, 40), (30, USB, 0.033, 0)],
    "5": [(130, BLUETOOTH, 1, 40), (64, BLUETOOTH, 1, -60), (4, BLUETOOTH, 1, -60),
          (30, USB, 0.033, 0), (10, WIFI, 0, 25)],
    "5b": [(130, BLUETOOTH, 73, 40), (64, BLUETOOTH, 6, -60), (4, BLUETOOTH, 1, -60),
           (30, USB, 0.033, 0), (10, WIFI, 0, 25)],
    "9": [(512, BLUETOOTH, 1, 30), (256, BLUETOOTH, 1, -20), (130, BLUETOOTH, 1, 40),
          (64, BLUETOOTH, 1, -60), (4, BLUETOOTH, 1, -60), (30, USB, 0.033, 0),
          (30, USB, 0.045, 10), (10, WIFI, 0, 25), (1, WIFI, 0, 15)],
    "2eq": [(100, WIFI, 0, 0)] * 2,
    "5eq": [(30, WIFI, 0, 0)] * 5,
    "9eq": [(30, WIFI, 0, 0)] * 9,
}


def bluetooth(true, batch, rng):
    """Returns the arrivals, each with the number of samples that arrived together and its place among them."""
    number = np.arange(len(true))
    first = number // batch * batch
    last = np.minimum(first + batch - 1, len(true) - 1)
    delay = np.minimum(0.05 + rng.lognormal(np.log(0.03), 0.8, len(true)), 0.3)[first]
    slot = np.ceil((true[last] + delay) / CONNECTION_INTERVAL_SECS) * CONNECTION_INTERVAL_SECS
    arrival = np.maximum.accumulate(slot)
    if batch == 1:
        arrival = np.maximum.accumulate(arrival + rng.uniform(0, 0.002, len(true)))
    return arrival, last - first + 1, number - first


def alone(true, delay):
    ones = np.ones(len(true), int)
    return np.maximum.accumulate(true + delay), ones, ones * 0


def stream(rate, transport, detail, drift_ppm, duration, rng):
    count = int(duration * rate)
    true = np.arange(count) / rate + rng.uniform(0, 1 / rate)
    if rate < 100:
        true = np.sort(true + rng.normal(0, 0.0005, count))
    if transport == BLUETOOTH:
        arrival, together, place = bluetooth(true, detail, rng)
    elif transport == WIFI:
        delay = np.minimum(0.003 + rng.lognormal(np.log(0.004), 1.0, count), 0.25)
        arrival, together, place = alone(true, delay)
    else:
        delay = detail + np.abs(rng.normal(0, 0.002, count))
        arrival, together, place = alone(true, delay)
    device = true * (1 + drift_ppm * 1e-6) + rng.uniform(0, 1000)
    rng.uniform(size=count)  # which samples are lost: none, but the next stream's random numbers follow these
    return arrival, device, true, together, place


def nanos(secs):
    return np.round(secs * 1e9).astype(np.int64)


def main(scenario, duration, seed):
    rng = np.random.default_rng(seed)
    rows = []
    for topic, settings in enumerate(SCENARIOS[scenario]):
        arrival, device, true, together, place = stream(*settings, duration, rng)
        columns = (nanos(arrival + BASE_SECS), nanos(device), nanos(true + BASE_SECS), together, place)
        rows.append(np.stack([np.full(len(true), topic), *columns], 1))
    rows = np.concatenate(rows)
    rows = rows[np.argsort(rows[:, 1], kind="stable")]
    np.savetxt(sys.stdout, rows, fmt="%d")


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]), int(sys.argv[3]))
