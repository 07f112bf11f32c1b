"""Whether a browser without a GPU still draws 48 charts with four cameras beside them."""

import base64
import json
import os
import shutil
import struct
import sys
import tempfile
import threading
import time
from pathlib import Path

import harness
from measure import FLAGS, WATCH, cpu_secs
from playwright.sync_api import sync_playwright

SECONDS = int(os.environ.get("SECONDS_EACH", "10"))
CHARTS = 48
CAMERAS = ("front", "back", "left", "right")
SIZE = (640, 480)
PICTURES_HZ = 30
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

# A moving disc in front of noise, as JPEG of the size that a camera makes.
DRAW = """async ([width, height, count]) => {
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d");
  const files = [];
  for (let k = 0; k < count; k += 1) {
    for (let x = 0; x < width; x += 8) for (let y = 0; y < height; y += 8) {
      context.fillStyle = `hsl(${(x + y) / 4} 30% ${30 + 40 * Math.random()}%)`;
      context.fillRect(x, y, 8, 8);
    }
    context.fillStyle = "#c22";
    context.beginPath();
    context.arc(100 + (400 * k) / count, 240, 60, 0, 7);
    context.fill();
    const blob = await canvas.convertToBlob({type: "image/jpeg", quality: 0.75});
    const bytes = new Uint8Array(await blob.arrayBuffer());
    files.push(btoa(String.fromCharCode(...bytes)));
  }
  return files;
}"""
# How many pictures are drawn into each canvas.
COUNT = """
window.pictures = 0;
const paint = CanvasRenderingContext2D.prototype.drawImage;
CanvasRenderingContext2D.prototype.drawImage = function (image, ...rest) {
  if (image instanceof ImageBitmap) pictures += 1;
  return paint.call(this, image, ...rest);
};
"""


def compressed(file: bytes) -> str:
    """A `sensor_msgs/CompressedImage` as hexadecimal."""
    head = struct.pack("<4s iI I5s3x I5s3x I", b"\0\1\0\0", 0, 0, 5, b"cam1\0", 5, b"jpeg\0", len(file))
    return (head + file).hex()


def film(sender, pictures: list[str], over: threading.Event) -> None:
    began_secs, sent = time.monotonic(), 0
    while not over.is_set():
        time.sleep(max(0.0, began_secs + sent / PICTURES_HZ - time.monotonic()))
        sender.say(pictures[sent % len(pictures)])
        sent += 1


def main() -> int:
    over, films = threading.Event(), []
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
            files = [base64.b64decode(each) for each in artist.evaluate(DRAW, [*SIZE, 30])]
            artist.close()
            for name in CAMERAS:
                sender = stage.cyclone("send", f"/robot1/{name}/compressed", "--type", "sensor_msgs/msg/CompressedImage", "--subscribers", 1)
                sender.answer("matched")
                films.append(threading.Thread(target=film, args=(sender, [compressed(each) for each in files], over)))
                films[-1].start()
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
            frames, drawn, pictures = page.evaluate("[seen.frames.length, seen.drawn.length, pictures]")
            lasted_secs = time.monotonic() - began_secs
            browser_cores = (cpu_secs(os.getpid()) - before_secs) / lasted_secs
            browser.close()
        finally:
            over.set()
            for each in films:
                each.join()
            stage.close()
    frames_hz, charts_hz = frames / lasted_secs, drawn / lasted_secs
    each_hz = pictures / lasted_secs / len(CAMERAS)
    kilobytes = sum(map(len, files)) / len(files) / 1000
    is_met = frames_hz >= 30
    text = f"{CHARTS} charts and {len(CAMERAS)} cameras of {SIZE[0]} x {SIZE[1]} at {PICTURES_HZ} Hz ({kilobytes:.0f} kB each): {frames_hz:.0f} frames/s (bar 30)"
    print(text if is_met else f"{text}  MISSED")
    print(f"  each chart drawn {charts_hz:.0f} times/s, each camera {each_hz:.0f}; the browser takes {browser_cores:.0%} of a core")
    return 0 if is_met else 1


if __name__ == "__main__":
    sys.exit(main())
