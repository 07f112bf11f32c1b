"""What dl-myo reads of a Myo through BlueZ, as a line of JSON."""

import asyncio
import json

from myo import MyoClient
from myo.types import ClassifierMode, EMGMode, IMUMode

EMG, IMU = [], []
ENOUGH = 100


class Reader(MyoClient):
    async def on_emg_data(self, emg):
        EMG.append([list(emg.sample1), list(emg.sample2)])

    async def on_imu_data(self, imu):
        IMU.append(json.loads(json.dumps(imu.to_dict(), default=str)))

    async def on_aggregated_data(self, ad):
        pass

    async def on_classifier_event(self, ce):
        pass

    async def on_emg_data_aggregated(self, emg):
        pass

    async def on_fv_data(self, fvd):
        pass

    async def on_motion_event(self, me):
        pass


async def main() -> None:
    client = await Reader.with_device()
    await client.setup(
        classifier_mode=ClassifierMode.ENABLED, emg_mode=EMGMode.SEND_RAW, imu_mode=IMUMode.SEND_ALL
    )
    await client.start()
    async with asyncio.timeout(30):
        while len(IMU) < ENOUGH or len(EMG) < 2 * ENOUGH:
            await asyncio.sleep(0.05)
    await client.stop()
    await client.disconnect()
    print(json.dumps({"emg": EMG, "imu": IMU}))


asyncio.run(main())
