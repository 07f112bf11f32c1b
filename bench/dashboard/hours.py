"""What eight hours leave in the memory of the dashboard and of a browser that looks at it, accelerated."""

import json
import os
import shutil
import sys
import tempfile
from pathlib import Path

import harness
from measure import FLAGS
from playwright.sync_api import sync_playwright

HOURS, SPEED = 8, 240
DEMO_SECS = 185
# From the end of this hour on memory may grow by this share at most.
SETTLED_HOUR, MOST_GROWN = 2, 0.05


def heap_mib(page) -> float:
    """What the page holds after its garbage was collected."""
    client = page.context.new_cdp_session(page)
    client.send("HeapProfiler.collectGarbage")
    client.send("Performance.enable")
    metrics = {each["name"]: each["value"] for each in client.send("Performance.getMetrics")["metrics"]}
    client.detach()
    return metrics["JSHeapUsedSize"] / (1 << 20)


def demo(folder: Path) -> Path:
    """A recording of the demo."""
    program = harness.Program([harness.TEAMPULSE, "demo", "--duration", DEMO_SECS, "--out", folder], domain=77)
    code = program.ended(DEMO_SECS + 60)
    if code != 0:
        sys.exit(f"the demo ended with {code}\n{program.report()}")
    return harness.the_bag(folder)


def main() -> int:
    missed = []

    def figure(what: str, mib: list[float]) -> None:
        grown = mib[-1] / mib[SETTLED_HOUR - 1] - 1
        text = f"{what}: {' '.join(f'{each:.1f}' for each in mib)} MiB in each hour; {grown:+.1%} from hour {SETTLED_HOUR} (bar {MOST_GROWN:+.0%})"
        is_met = grown <= MOST_GROWN
        print(text if is_met else f"{text}  MISSED", flush=True)
        missed.extend([] if is_met else [text])

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        bag = os.environ.get("BAG") or demo(Path(folder))
        soak = harness.Program([os.environ["BENCH_SOAK"], "watched", bag, HOURS + 0.01, SPEED], domain=65)
        try:
            address = soak.wait_for(r"(http://[^\"]+)", pipe="stdout")[1]
            browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
            pages = {name: browser.new_page(viewport={"width": 1280, "height": 720}) for name in ("team", "signals")}
            for name, page in pages.items():
                page.goto(f"{address}#/{name}")
            heaps = {name: [] for name in pages}
            server = []
            for hour in range(1, HOURS + 1):
                line = soak.wait_for(rf'"hour": {hour},.*"most_kib": (\d+)', pipe="stdout", within_secs=3600)
                server.append(int(line[1]) / 1024)
                for name, page in pages.items():
                    heaps[name].append(heap_mib(page))
            browser.close()
        finally:
            soak.close()
    figure("the dashboard with two viewers", server)
    for name, mib in heaps.items():
        figure(f"a browser on the page {name}", mib)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
