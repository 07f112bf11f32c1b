"""What bleakheart and polar-python read of a Polar H10 through BlueZ, as a line of JSON."""

import asyncio
import json
import sys

import bleakheart
from bleak import BleakClient, BleakScanner
from polar_python import PolarDevice
from polar_python.constants import PmdMeasurementType


async def find(name: str):
    device = await BleakScanner.find_device_by_filter(
        lambda device, _: (device.name or "").startswith(name), timeout=20
    )
    assert device, f"no {name} in range"
    return device


async def with_bleakheart(device, measurements: int) -> dict:
    heard = {"HR": [], "ECG": [], "ACC": []}
    async with BleakClient(device) as client:
        battery = await bleakheart.BatteryLevel(client).read()
        queue = asyncio.Queue()
        heart = bleakheart.HeartRate(client, queue=queue, unpack=False)
        await heart.start_notify()
        sensor = bleakheart.PolarMeasurementData(client, ecg_queue=queue, acc_queue=queue)
        available = await sensor.available_measurements()
        settings = {kind: await sensor.available_settings(kind) for kind in available}
        starts = [
            (await sensor.start_streaming("ECG"))[0],
            (await sensor.start_streaming("ACC", RANGE=8, SAMPLE_RATE=50))[0],
        ]
        enough = lambda: len(heard["HR"]) >= measurements and len(heard["ACC"]) >= 2
        while not enough():
            kind, stamp, values, *_ = await asyncio.wait_for(queue.get(), 20)
            heard[kind].append((stamp, values))
        stops = [(await sensor.stop_streaming(kind))[0] for kind in ("ECG", "ACC")]
        await heart.stop_notify()
    return {"battery": battery, "settings": settings, "starts": starts, "stops": stops, **heard}


async def with_polar_python(device, frames: int) -> dict:
    heard, enough = {"HR": [], "ECG": []}, asyncio.Event()

    def take_ecg(ecg) -> None:
        heard["ECG"].append((ecg.timestamp, ecg.data))
        if len(heard["ECG"]) >= frames:
            enough.set()

    async with PolarDevice(device) as polar:
        features = [feature.name for feature in await polar.get_available_features()]
        await polar.start_hr_stream(lambda hr: heard["HR"].append((hr.heartrate, hr.rr_intervals)))
        await polar.start_ecg_stream(take_ecg, 130, 14)
        await asyncio.wait_for(enough.wait(), 30)
        await polar.stop_stream(PmdMeasurementType.ECG)
    return {"features": features, **heard}


async def main(name: str) -> None:
    bleakheart_read = await with_bleakheart(await find(name), measurements=12)
    polar_python_read = await with_polar_python(await find(name), frames=6)
    print(json.dumps({"bleakheart": bleakheart_read, "polar_python": polar_python_read}))


asyncio.run(main(sys.argv[1]))
