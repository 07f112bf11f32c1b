"""What polar-python reads of a Polar Verity Sense through BlueZ, as a line of JSON."""

import asyncio
import json
import sys

from bleak import BleakScanner
from polar_python import PolarDevice
from polar_python.constants import PmdMeasurementType as Kind

FRAMES = 2  # of intervals between pulses: each of 5 s, the first after 25 s


async def find(name: str):
    device = await BleakScanner.find_device_by_filter(
        lambda device, _: (device.name or "").startswith(name), timeout=20
    )
    assert device, f"no {name} in range"
    return device


async def read(device) -> dict:
    heard, enough = {"HR": [], "PPG": [], "ACC": [], "PPI": []}, asyncio.Event()

    def take_intervals(ppi) -> None:
        heard["PPI"].append([vars(sample) for sample in ppi.samples])
        if len(heard["PPI"]) >= FRAMES:
            enough.set()

    async with PolarDevice(device) as polar:
        features = [feature.name for feature in await polar.get_available_features()]
        offered = {}
        for kind in (Kind.PPG, Kind.ACC):
            settings = await polar.request_stream_settings(kind)
            offered[kind.name] = {each.type.name: each.values for each in settings.settings}
        await polar.start_hr_stream(lambda hr: heard["HR"].append((hr.heartrate, hr.rr_intervals)))
        # As its documentation has them for a Verity Sense.
        await polar.start_ppg_stream(
            lambda ppg: heard["PPG"].append((ppg.timestamp, ppg.samples)), 55, 22, 4
        )
        await polar.start_acc_stream(
            lambda acc: heard["ACC"].append((acc.timestamp, acc.data)), 52, 16, 8, 3
        )
        await polar.start_ppi_stream(take_intervals)
        await asyncio.wait_for(enough.wait(), 60)
        for kind in (Kind.PPG, Kind.ACC, Kind.PPI):
            await polar.stop_stream(kind)
    return {"features": features, "settings": offered, **heard}


async def main(name: str) -> None:
    print(json.dumps(await read(await find(name))))


asyncio.run(main(sys.argv[1]))
