"""Measures how much memory eight accelerated hours leave in use in the dashboard and in a browser that views it."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import urllib.request
from pathlib import Path

import harness
from figures import Figures
from measure import FLAGS
from websockets.sync.client import connect

HOURS, SPEED = 8, 240
DEMO_SECS = 185
# From the end of this hour on, memory may grow by at most this share.
SETTLED_HOUR, MOST_GROWN = 2, 0.05
# The number of times that a page is measured in each hour.
LOOKS = 5


class Browser:
    """Chromium with a page for each address, used only to measure the memory of the pages."""

    def __init__(self, folder: Path, addresses: list[str]):
        flags = [*FLAGS, "--headless", "--remote-debugging-port=0", f"--user-data-dir={folder}", "--window-size=1280,720"]
        # Chromium slows down pages in the background, so each is treated as visible.
        flags += ["--disable-backgrounding-occluded-windows", "--disable-renderer-backgrounding"]
        self._process = subprocess.Popen([shutil.which("chromium"), *flags], stderr=subprocess.DEVNULL)
        said = folder / "DevToolsActivePort"
        harness.eventually(lambda: said.exists() and said.read_text().count("\n") >= 1)
        self._port = said.read_text().split()[0]
        self._pages = [self._open(address) for address in addresses]

    def _open(self, address: str) -> str:
        request = urllib.request.Request(f"http://127.0.0.1:{self._port}/json/new?{address}", method="PUT")
        return json.load(urllib.request.urlopen(request))["webSocketDebuggerUrl"]

    def heaps_mib(self) -> list[float]:
        """Returns the memory of each page after a garbage collection: the smallest of several measurements, between two
        batches of messages."""
        looks = [[self._heap_mib(page) for page in self._pages] for _ in range(LOOKS)]
        return [min(page) for page in zip(*looks)]

    def _heap_mib(self, page: str) -> float:
        with connect(page, max_size=None) as socket:
            for number, method in enumerate(("HeapProfiler.collectGarbage", "Performance.enable", "Performance.getMetrics")):
                socket.send(json.dumps({"id": number, "method": method}))
                while (answer := json.loads(socket.recv(timeout=60))).get("id") != number:
                    pass
        metrics = {each["name"]: each["value"] for each in answer["result"]["metrics"]}
        return metrics["JSHeapUsedSize"] / (1 << 20)

    def close(self) -> None:
        self._process.terminate()
        self._process.wait()


def figure_of(figure: Figures, what: str, mib: list[float]) -> None:
    grown = mib[-1] / mib[SETTLED_HOUR - 1] - 1
    text = f"{what}: {' '.join(f'{each:.1f}' for each in mib)} MiB in each hour; {grown:+.1%} from hour {SETTLED_HOUR} (bar {MOST_GROWN:+.0%})"
    figure(text, grown <= MOST_GROWN)


def main() -> int:
    figure = Figures()
    pages = ("team", "signals")
    with tempfile.TemporaryDirectory() as folder:
        bag = os.environ.get("BAG") or harness.Stage(Path(folder), domain=77).demo(DEMO_SECS)
        # It runs for another hour, so that the last measurements are of a running session, too.
        soak = harness.Program([os.environ["BENCH_SOAK"], "watched", bag, HOURS + 1, SPEED], domain=65)
        try:
            address = soak.wait_for(r"(http://[^\"]+)", pipe="stdout")[1]
            browser = Browser(Path(folder) / "browser", [f"{address}#/{page}" for page in pages])
            server, heaps = [], []
            for hour in range(1, HOURS + 1):
                line = soak.wait_for(rf'"hour": {hour},.*"most_kib": (\d+)', pipe="stdout", within_secs=3600)
                server.append(int(line[1]) / 1024)
                heaps.append(browser.heaps_mib())
            browser.close()
        finally:
            soak.close()
    figure_of(figure, "the dashboard with two viewers", server)
    for page, *mib in zip(pages, *heaps, strict=True):
        figure_of(figure, f"a browser on the page {page}", mib)
    return figure.exit_code()


if __name__ == "__main__":
    sys.exit(main())
