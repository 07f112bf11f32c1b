"""Checks whether a browser without a GPU still draws 48 charts beside four cameras."""

import json
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

import harness
from cameras import HZ, Cameras, drawn
from figures import Figures
from measure import FLAGS, WATCH, cpu_secs
from playwright.sync_api import sync_playwright

SECONDS = int(os.environ.get("SECONDS_EACH", "10"))
CHARTS = 48
CAMERAS = ("front", "back", "left", "right")
SIZE = (640, 480)
STUDY = f"""
[session]
name = "video"
[[sources]]
type = "people"
namespace = "/humans/persons/*"
[[sources]]
type = "robots"
namespace = "/robot*"
images = {json.dumps([f"{name}/compressed" for name in CAMERAS])}
[simulate]
robots = 2
people = 12
"""
WAVES = {"ecg": "ecg", "ppg": "ppg", "eeg": "AF7", "emg": "emg1"}

# Counts the pictures drawn into each canvas.
COUNT = """
window.pictures = 0;
const paint = CanvasRenderingContext2D.prototype.drawImage;
CanvasRenderingContext2D.prototype.drawImage = function (image, ...rest) {
  if (image instanceof ImageBitmap) pictures += 1;
  return paint.call(this, image, ...rest);
};
"""


def main() -> int:
    figure = Figures()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        stage = harness.Stage(Path(folder), domain=64)
        try:
            study = stage.study(STUDY)
            monitor = stage.teampulse("run", study)
            address = monitor.wait_for(r"dashboard is at (http://\S+)")[1]
            stage.teampulse("simulate", study)
            browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
            artist = browser.new_page()
            artist.goto(address)
            files = drawn(artist, SIZE, 30)
            artist.close()
            with Cameras(stage, [f"/robot1/{name}/compressed" for name in CAMERAS], files):
                page = browser.new_page(viewport={"width": 1920, "height": 3000})
                choices = [{"stream": f"/humans/persons/p{k:03}/simulated/{wave}", "channel": channel} for k in range(1, 13) for wave, channel in WAVES.items()]
                page.add_init_script(f"localStorage.setItem('signals', {json.dumps(json.dumps(choices))})")
                page.add_init_script(WATCH)
                page.add_init_script(COUNT)
                page.goto(f"{address}#/signals")
                page.wait_for_selector(f".rows .sig >> nth={CHARTS - 1}", timeout=60_000)
                page.wait_for_selector(f".videos figure >> nth={len(CAMERAS) - 1}", timeout=60_000)
                page.click("text='10 s'")
                page.wait_for_timeout(11_000)
                page.evaluate("Object.assign(seen, {frames: [], arrived: [], drawn: []}), (window.pictures = 0)")
                before_secs, began_secs = cpu_secs(os.getpid()), time.monotonic()
                page.wait_for_timeout(1000 * SECONDS)
                frames, charts, pictures = page.evaluate("[seen.frames.length, seen.drawn.length, pictures]")
                lasted_secs = time.monotonic() - began_secs
                browser_cores = (cpu_secs(os.getpid()) - before_secs) / lasted_secs
            browser.close()
        finally:
            stage.close()
    frames_hz, charts_hz = frames / lasted_secs, charts / lasted_secs
    each_hz = pictures / lasted_secs / len(CAMERAS)
    kilobytes = sum(map(len, files)) / len(files) / 1000
    figure(f"{CHARTS} charts and {len(CAMERAS)} cameras of {SIZE[0]} x {SIZE[1]} at {HZ} Hz ({kilobytes:.0f} kB each): {frames_hz:.0f} frames/s (bar 30)", frames_hz >= 30)
    figure(f"  each chart drawn {charts_hz:.0f} times/s, each camera {each_hz:.0f}; the browser takes {browser_cores:.0%} of a core", True)
    return figure.exit_code()


if __name__ == "__main__":
    sys.exit(main())
