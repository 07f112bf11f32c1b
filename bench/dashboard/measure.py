"""Measures what it costs a browser without a GPU to draw 24 charts: frames, latency, processor, and how soon a page has
data."""

import json
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path
from statistics import quantiles

import harness
from figures import Figures
from playwright.sync_api import sync_playwright

SECONDS = int(os.environ.get("SECONDS_EACH", "10"))
CHARTS = 24
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
STUDY = """
[session]
name = "charts"
[[sources]]
type = "people"
namespace = "/humans/persons/*"
[[sources]]
type = "robots"
namespace = "/robot*"
[simulate]
robots = 5
people = 6
"""
WAVES = ("ecg", "ppg", "eeg", "emg")

# Records when frames occur, when waves arrive, and when they are drawn, unknown to the page.
WATCH = """
window.seen = {frames: [], arrived: [], drawn: [], waiting: null};
const Socket = WebSocket;
window.WebSocket = class extends Socket {
  constructor(...all) {
    super(...all);
    this.addEventListener("message", ({data}) => {
      if (typeof data === "string") return;
      const at = performance.now();
      seen.waiting ??= [];
      seen.waiting.push(at);
    });
  }
};
const stroke = CanvasRenderingContext2D.prototype.stroke;
let drawing = false;
CanvasRenderingContext2D.prototype.stroke = function (...all) { drawing = true; return stroke.apply(this, all); };
const frame = (at) => {
  seen.frames.push(at);
  requestAnimationFrame(frame);
  if (!drawing) return;
  drawing = false;
  const now = performance.now();
  seen.drawn.push(now);
  for (const arrived of seen.waiting ?? []) seen.arrived.push(now - arrived);
  seen.waiting = [];
};
requestAnimationFrame(frame);
"""


def cpu_secs(ancestor: int) -> float:
    """Returns the processor time of all Chromium processes below one process."""
    parents, names = {}, {}
    for each in Path("/proc").glob("[0-9]*"):
        try:
            name, _, rest = (each / "stat").read_text().partition(" (")[2].rpartition(") ")
        except OSError:
            continue
        fields = rest.split()
        parents[int(each.name)] = int(fields[1])
        names[int(each.name)] = (name, (int(fields[11]) + int(fields[12])) / harness.CLOCK_TICKS)
    total = 0.0
    for pid, (name, secs) in names.items():
        above = pid
        while above in parents and above != ancestor:
            above = parents[above]
        if above == ancestor and name.startswith("chrom"):
            total += secs
    return total


def charts(page, address: str) -> dict:
    """Draws 24 waves over 10 s for a while."""
    names = [f"/humans/persons/p00{k}/simulated/{wave}" for k in range(1, 7) for wave in WAVES]
    channels = {"ecg": "ecg", "ppg": "ppg", "eeg": "AF7", "emg": "emg1"}
    choices = [{"stream": name, "channel": channels[name.rsplit("/", 1)[1]]} for name in names]
    page.add_init_script(f"localStorage.setItem('signals', {json.dumps(json.dumps(choices))})")
    page.add_init_script(WATCH)
    page.goto(f"{address}#/signals")
    page.wait_for_selector(f".rows .sig >> nth={CHARTS - 1}", timeout=60_000)
    page.click("text='10 s'")
    page.wait_for_timeout(11_000)
    page.evaluate("Object.assign(seen, {frames: [], arrived: [], drawn: [], waiting: null})")
    before_secs, began_secs = cpu_secs(os.getpid()), time.monotonic()
    page.wait_for_timeout(1000 * SECONDS)
    seen = page.evaluate("seen")
    lasted_secs = time.monotonic() - began_secs
    return {**seen, "cpu": (cpu_secs(os.getpid()) - before_secs) / lasted_secs, "secs": lasted_secs}


def first_data_secs(browser, address: str) -> tuple[float, float]:
    """Returns how soon the Team page is painted, and how soon it shows a number."""
    page = browser.new_page()
    page.goto(address, wait_until="commit")
    page.wait_for_selector(".robot[data-state=online]", timeout=30_000)
    paint_ms, data_ms = page.evaluate(
        "[performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? performance.now(), performance.now()]"
    )
    page.close()
    return paint_ms / 1000, data_ms / 1000


def main() -> int:
    figure = Figures()

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        stage = harness.Stage(Path(folder), domain=61)
        try:
            study = stage.study(STUDY)
            monitor = stage.teampulse("run", study)
            address = monitor.wait_for(r"dashboard is at (http://\S+)")[1]
            stage.teampulse("simulate", study)
            browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
            page = browser.new_page(viewport={"width": 1280, "height": 2200})
            seen = charts(page, address)
            page.close()
            paint_secs, data_secs = first_data_secs(browser, address)
            server_before_secs = monitor.cpu_secs()
            pages = [browser.new_page() for _ in range(2)]
            for each in pages:
                each.goto(address)
            time.sleep(3)
            server = (monitor.cpu_secs() - server_before_secs) / 3
            browser.close()
        finally:
            stage.close()
    frames_hz, draws_hz = len(seen["frames"]) / seen["secs"], len(seen["drawn"]) / seen["secs"]
    cuts = quantiles(seen["arrived"], n=100)
    figure(f"{CHARTS} charts of 10 s: {frames_hz:.0f} frames/s (bar 55), each chart drawn {draws_hz:.0f} times/s", frames_hz >= 55)
    figure(f"the browser takes {seen['cpu']:.0%} of a core (bar 40 %)", seen["cpu"] <= 0.4)
    figure(f"from arrival to drawn: p50 {cuts[49]:.0f} ms (bar 60), p99 {cuts[98]:.0f} ms (bar 200)", cuts[49] <= 60 and cuts[98] <= 200)
    figure(f"Team page painted after {paint_secs:.2f} s (bar 1), with data after {data_secs:.2f} s (bar 1.5)", paint_secs <= 1 and data_secs <= 1.5)
    figure(f"teampulse with two viewers: {server:.0%} of a core", True)
    return figure.exit_code()


if __name__ == "__main__":
    sys.exit(main())
