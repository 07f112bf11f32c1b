"""The dashboard's pages in a real browser, Debian's Chromium without a screen, driven by PyPI's Playwright."""

import gzip
import json
import re
import shutil
from itertools import takewhile

import pytest
from playwright import sync_api
from websockets.sync import client as sync_client

import bags
import harness
from conftest import leave_out


WEB = harness.ROOT / "web"
AXE = WEB / "node_modules/axe-core/axe.min.js"
# Looked at by people: every page in each size and theme.
SHOTS = harness.TESTS / "build/dashboard_pages"
PAGES = ("team", "signals", "session", "health")
SIZES = {"1280x720": (1280, 720), "1920x1080": (1920, 1080), "390x844": (390, 844)}
JAVASCRIPT_BYTES = 150_000
# What a page that joins gets of each of the demo's streams [bytes].
STREAM_BYTES = 350
CHROMIUM_FLAGS = [
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
name = "pages"
[[sources]]
type = "robots"
namespace = "/robot*"
required = ["battery", "link"]
[[sources]]
type = "people"
namespace = "/humans/persons/*"
[commands]
dashboard = ["mark", "next_phase", "split", "stop", "start_recording", "stop_recording", "snapshot"]
[[phases]]
name = "baseline"
[[phases]]
name = "task"
[[alerts]]
stream = "/robot2/wifi"
channel = "signal_level"
below = 0
tier = "note"
text = "robot2 is linked"
[[sinks]]
type = "bag"
tidy = false
[simulate]
robots = 2
people = 1
seed = 3
"""


@pytest.fixture(scope="module")
def chromium():
    path = shutil.which("chromium")
    if path is None:
        leave_out("there is no Chromium on this system")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=CHROMIUM_FLAGS)
        yield browser
        browser.close()


class Screen:
    """A page of the dashboard, what it asked for, and what went wrong on it."""

    def __init__(self, browser, address: str, size=(1280, 720), theme="light", linked="live"):
        self.address, self.requests, self.errors = address, [], []
        self.linked = linked
        self.context = browser.new_context(viewport=dict(zip(("width", "height"), size)), color_scheme=theme)
        self.page = self.context.new_page()
        self.page.set_default_timeout(1000 * harness.PATIENCE_SECS)
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("websocket", lambda socket: self.requests.append(socket.url.replace("ws://", "http://")))
        self.page.on("console", lambda said: said.type == "error" and self.errors.append(said.text))
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.go("team")

    def go(self, page: str) -> None:
        self.page.goto(f"{self.address}#/{page}")
        self.page.wait_for_selector("h1", state="attached")
        self.page.wait_for_selector(f".cell.link >> text={self.linked}", state="attached")

    def close(self) -> None:
        assert self.errors == []
        elsewhere = [url for url in self.requests if not url.startswith(self.address)]
        assert elsewhere == []
        self.context.close()


@pytest.fixture
def screens(chromium):
    """Opens pages; each is checked for errors and requests to elsewhere when the test ends."""
    opened = []

    def open_one(address: str, **options) -> Screen:
        opened.append(Screen(chromium, address, **options))
        return opened[-1]

    yield open_one
    for screen in opened:
        screen.close()


def photograph(page, name: str, size: tuple[int, int]) -> None:
    """Keeps a picture of a page; on a phone of all of it, as what is not in view is not drawn."""
    SHOTS.mkdir(parents=True, exist_ok=True)
    if size[0] < 640:
        page.set_viewport_size({"width": size[0], "height": page.evaluate("document.documentElement.scrollHeight")})
        page.wait_for_timeout(400)
    page.screenshot(path=SHOTS / name)
    page.set_viewport_size(dict(zip(("width", "height"), size)))


def address_of(program) -> str:
    return program.wait_for(r"dashboard is at (http://\S+)")[1]


def watched(stage):
    """A session that watches, another process that simulates, and the dashboard's address."""
    study, out = stage.study(STUDY), stage.folder / "sessions"
    monitor = stage.teampulse("run", study, "--out", out)
    return monitor, stage.teampulse("simulate", study), address_of(monitor), out


def serious(page) -> list[str]:
    """What axe-core calls serious or critical."""
    page.evaluate(AXE.read_text())
    found = page.evaluate("axe.run().then((result) => result.violations)")
    bad = [each for each in found if each["impact"] in ("serious", "critical")]
    return [f"{each['id']}: {json.dumps(each['nodes'][0]['html'])[:200]}" for each in bad]


def test_every_page_shows_real_data_in_each_size_and_theme(stage, screens, figure):
    if not AXE.exists():
        leave_out("axe-core is not installed: `npm ci` in web/")
    demo = stage.teampulse("demo", "--out", stage.folder / "sessions", "--seed", 7)
    address = address_of(demo)
    SHOTS.mkdir(parents=True, exist_ok=True)
    for name, size in SIZES.items():
        for theme in ("light", "dark"):
            screen = screens(address, size=size, theme=theme)
            for each in PAGES:
                screen.go(each)
                shows = {
                    "team": ".robot[data-state=online] >> nth=4",
                    "signals": ".sig .now b:not(:text('–')) >> nth=4",
                    "session": ".check li >> nth=3",
                    "health": "td:text-matches('^ecg|/ecg$') >> nth=0",
                }
                screen.page.wait_for_selector(shows[each], state="attached")
                if each == "team":
                    screen.page.wait_for_selector(".stat .v b:text-matches('^[0-9]') >> nth=0", state="attached", timeout=90_000)
                photograph(screen.page, f"{each}-{name}-{theme}.png", size)
                if name != "1920x1080":
                    assert serious(screen.page) == [], f"{each}, {name}, {theme}"
    with sync_client.connect(f"{address.replace('http', 'ws')}ws", max_size=None) as socket:
        joined = iter(lambda: socket.recv(timeout=harness.PATIENCE_SECS), None)
        texts = takewhile(lambda text: '{"type":"ready"' not in text, (text for text in joined if isinstance(text, str)))
        declared = [text for text in texts if text.startswith('{"type":"streams"')]
    size, count = sum(map(len, declared)), sum(len(json.loads(text)["streams"]) for text in declared)
    figure(f"{count} streams of the demo are {size / 1000:.0f} kB for a page that joins, {size / count:.0f} bytes each (bar {STREAM_BYTES})")
    assert count > 100 and size <= STREAM_BYTES * count
    assert demo.interrupt() == 0, demo.report()


def test_a_number_is_opened_with_its_recipe(stage, screens):
    monitor, _, address, _ = watched(stage)
    page = screens(address).page
    page.click("text=Signals")
    page.click(".sig .lab:has-text('heart rate')")
    dialog = page.locator("dialog, [role=dialog]").first
    sync_api.expect(dialog.locator("dl.facts")).to_contain_text(re.compile("recipe.*causal", re.DOTALL))
    sync_api.expect(dialog.locator("dl.facts")).to_contain_text("/ecg")
    assert monitor.interrupt() == 0, monitor.report()


def test_a_clicked_marker_is_in_the_bag_at_the_moment_of_the_click(stage, screens, figure):
    monitor, _, address, out = watched(stage)
    page = screens(address).page
    page.click("text=Session")
    page.wait_for_selector(".mark:enabled")
    page.evaluate(
        "addEventListener('click', (event) => (window.clicked = performance.timeOrigin + event.timeStamp), true)"
    )
    label = page.inner_text(".mark >> nth=0 >> .clip")
    page.click(".mark >> nth=0")
    clicked_secs = page.evaluate("window.clicked") / 1000
    page.wait_for_selector(".echoes >> text=/in the bag, ± /")
    assert monitor.interrupt() == 0, monitor.report()
    marked = [
        each.content
        for each in bags.messages(harness.the_bag(out), "/session/events")
        if each.content.kind == "marker" and each.content.label == label
    ]
    [marker] = marked
    stamp = marker.header.stamp
    off_ms = 1000 * (stamp.sec + stamp.nanosec / 1e9 - clicked_secs)
    figure(f"a clicked marker is {off_ms:+.1f} ms off in the bag")
    assert abs(off_ms) <= 20


def test_what_is_switched_off_is_seen_with_its_reason_and_when_it_returns(stage, screens, figure):
    monitor, simulator, address, out = watched(stage)
    page = screens(address).page
    ecg = ".light[data-sensor$='/ecg']"
    page.wait_for_selector(".robot[data-subject=robot1][data-state=online]")
    page.wait_for_selector(f"{ecg}[data-state=ok]")
    simulator.kill()
    page.wait_for_selector(".robot[data-subject=robot1][data-state=offline]")
    seen_secs = page.evaluate("Date.now()") / 1000
    page.wait_for_selector(f"{ecg}.red[data-state=dead]", timeout=90_000)
    assert "silent for" in page.get_attribute(ecg, "title")
    assert page.inner_text(".alerts >> text=/ECG is silent/") != ""
    stage.teampulse("simulate", stage.folder / "study.toml")
    page.wait_for_selector(".robot[data-subject=robot1][data-state=online]", timeout=60_000)
    page.wait_for_selector(f"{ecg}[data-state=ok]", timeout=60_000)
    assert monitor.interrupt() == 0, monitor.report()
    judged = [
        each.log_secs
        for each in bags.messages(harness.the_bag(out), "/robot1/deployment/events")
        if each.content.label == "robot1 offline"
    ]
    figure(f"offline on the screen {seen_secs - judged[0]:+.1f} s after teampulse judged so")
    assert seen_secs - judged[0] <= 3


def test_one_sensor_that_is_unplugged_turns_red_with_its_reason_and_returns(stage, screens):
    port = stage.folder / "shimmer"
    worn = {
        "shimmer3": f'[[simulate.wearables]]\ntype = "shimmer3"\nperson = "p001"\nport = "{port}"\n',
        "empatica_e4": '[[simulate.wearables]]\ntype = "empatica_e4"\nperson = "p001"\n',
    }
    emulated = {}

    def plug(device: str) -> str:
        study = stage.study(f'[session]\nname = "{device}"\n{worn[device]}', f"{device}.toml")
        emulated[device] = stage.teampulse("emulate", study)
        emulated[device].wait_for("emulating wearables")
        return emulated[device].sources(1)

    sources = "\n".join(map(plug, worn))
    study = stage.study(f'[session]\nname = "worn"\n{sources}\n')
    monitor = stage.teampulse("run", study, "--out", stage.folder / "sessions")
    page = screens(address_of(monitor)).page
    unplugged, other = (f".light[data-sensor$='/{device}/eda']" for device in worn)
    page.wait_for_selector(f"{unplugged}[data-state=ok]")
    page.wait_for_selector(f"{other}[data-state=ok]")
    emulated["shimmer3"].kill()
    page.wait_for_selector(f"{unplugged}.red[data-state=dead]", timeout=90_000)
    assert "silent for" in page.get_attribute(unplugged, "title")
    assert page.inner_text(".alerts >> text=/EDA is silent/") != ""
    assert page.get_attribute(other, "data-state") == "ok"
    plug("shimmer3")
    page.wait_for_selector(f"{unplugged}[data-state=ok]", timeout=60_000)
    assert monitor.interrupt() in (0, 3), monitor.report()


def test_an_alert_of_the_study_is_listed_with_its_tier_and_can_be_acknowledged(stage, screens):
    monitor, simulator, address, out = watched(stage)
    page = screens(address).page
    alert = page.locator(".alerts li", has_text="robot2 is linked").first
    alert.wait_for()
    assert "signal_level below 0 dBm" in alert.inner_text()
    assert alert.locator("svg[aria-label='note']").count() == 1
    alert.get_by_role("button", name="Acknowledge").click()
    page.wait_for_selector("text=/\\d seen or over/")
    assert simulator.interrupt() == 0, simulator.report()
    assert monitor.interrupt() == 0, monitor.report()
    events = [each.content.label for each in bags.messages(harness.the_bag(out), "/session/events")]
    assert any(label.startswith("dashboard acknowledge robot2 is worth a look: robot2 is linked") for label in events)


def test_clocks_of_computers_and_buses_are_listed_on_the_health_page(stage, screens):
    monitor, simulator, address, _ = watched(stage)
    screen = screens(address)
    screen.go("health")
    page = screen.page
    # The simulator answers probes of its clock, which is this machine's.
    row = page.locator(".computers tr[data-computer]", has_text="round trip").first
    sync_api.expect(row.locator(".why")).to_have_text(re.compile("^probed, "))
    # Known with the first status of a stream that it stamps.
    ahead = row.locator("td").nth(1)
    sync_api.expect(ahead).to_have_text(re.compile(" ms$"))
    assert abs(float(ahead.inner_text().removesuffix(" ms").replace("−", "-"))) < 200
    bus = page.locator(".buses tbody tr").first
    sync_api.expect(bus.locator("td").nth(0)).to_have_text(f"ROS domain {stage.domain}")
    assert int(bus.locator("td").nth(1).inner_text()) >= 1
    sync_api.expect(bus.locator("td").nth(4)).not_to_have_text("0")
    sync_api.expect(bus.locator("td").nth(5)).to_have_text(re.compile("^0"))
    SHOTS.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=SHOTS / "network.png")
    if AXE.exists():
        assert serious(page) == []
    assert simulator.interrupt() == 0, simulator.report()
    assert monitor.interrupt() == 0, monitor.report()


def test_what_the_study_requires_is_a_no_go_until_it_comes(stage, screens):
    study, out = stage.study(STUDY), stage.folder / "sessions"
    monitor = stage.teampulse("run", study, "--out", out)
    screen = screens(address_of(monitor))
    screen.go("session")
    screen.page.wait_for_selector(".check-panel >> text=/No-go/")
    screen.page.wait_for_selector(".check-panel li.act >> text=no robot matches /robot*")
    simulator = stage.teampulse("simulate", study)
    screen.page.wait_for_selector(".check-panel li.ok >> text=Required by the study")
    assert simulator.interrupt() == 0, simulator.report()
    screen.page.wait_for_selector(".check-panel li.act >> text=battery of robot robot1")
    assert monitor.interrupt() == 0, monitor.report()


def test_ending_the_session_takes_a_second_click_and_leaves_a_valid_bag(stage, screens):
    monitor, _, address, out = watched(stage)
    page = screens(address).page
    page.click("text=Session")
    page.wait_for_selector("[data-testid=recording].rec-on")
    end = page.locator("[data-testid=end]")
    end.click()
    sync_api.expect(end).to_have_text("Click again to end")
    assert monitor.is_running()
    end.click()
    assert monitor.ended() == 0, monitor.report()
    bag = harness.the_bag(out)
    assert bags.messages(bag, "/session/events"), "a bag that rosbags reads"
    info = stage.ask("info", bag)
    assert info.returncode == 0, info.stderr


def test_a_recording_is_stopped_and_started_from_the_page_and_each_bag_is_whole(stage, screens):
    monitor, simulator, address, out = watched(stage)
    page = screens(address).page
    page.click("text=Session")
    page.wait_for_selector("[data-testid=recording].rec-on")
    mark = page.locator(".mark", has_text="question")
    mark.click()
    page.wait_for_selector(".echoes li >> text=/in the bag, ± /")
    stop = page.locator("[data-testid=stop]")
    stop.click()
    sync_api.expect(stop).to_have_text("Click again to stop")
    stop.click()
    page.wait_for_selector("[data-testid=recording] >> text=Not recording")
    page.wait_for_selector("[data-testid=recording] >> text=/paused, last [1-9][0-9]* s kept/")
    mark.click()
    page.wait_for_selector(".echoes li >> text=not in a bag: nothing is recorded now")
    SHOTS.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=SHOTS / "paused.png")
    if AXE.exists():
        assert serious(page) == []
    page.click("[data-testid=snapshot]")
    monitor.wait_for("the last [0-9.]+ s are in")
    page.click("[data-testid=start]")
    page.wait_for_selector("[data-testid=recording].rec-on")
    mark.click()
    page.wait_for_selector(".echoes li:first-child >> text=/in the bag, ± /")
    assert simulator.interrupt() == 0, simulator.report()
    assert monitor.interrupt() == 0, monitor.report()

    recorded = sorted(out.iterdir(), key=lambda folder: (len(folder.name), folder.name))
    events = [bags.messages(bag, "/session/events") for bag in recorded]
    commands = [[each.content.label for each in bag if each.content.kind == "command"] for bag in events]
    asked = [[label.split(" ")[1] for label in bag if " mark " not in label] for bag in commands]
    marked = [sum(each.content.kind == "marker" for each in bag) for bag in events]
    kept = ["snapshot", "start_recording"]
    assert (asked, marked) == ([["stop_recording"], kept[:1], kept], [1, 1, 2])
    # What was kept joins the bag before without a gap.
    ecg = [[each.log_secs for each in bags.messages(bag, "/humans/persons/p001/simulated/ecg")] for bag in recorded]
    assert 0 < ecg[2][0] - ecg[0][-1] < 1.0
    assert max(later - earlier for earlier, later in zip(ecg[2], ecg[2][1:])) < 1.0
    for bag in recorded:
        info = stage.ask("info", bag)
        assert info.returncode == 0 and "ended early" not in info.stdout, info.stdout + info.stderr


def test_a_span_is_labelled_on_the_signals_and_seen_again_in_the_recording(stage, screens):
    monitor, simulator, address, out = watched(stage)
    page = screens(address).page
    page.click("text=Signals")
    page.click("text='10 s'")
    page.wait_for_selector(".pad >> text=/[1-9][0-9]* beats/")
    strip = page.locator(".rows .cv").first.bounding_box()
    across = lambda share: (strip["x"] + strip["width"] * share, strip["y"] + strip["height"] / 2)
    page.mouse.move(*across(0.6))
    page.mouse.down()
    page.mouse.move(*across(0.85), steps=4)
    page.mouse.up()
    page.keyboard.press("Enter")
    sync_api.expect(page.locator("#span-label")).to_be_focused()
    page.keyboard.type("talks <b>aloud</b>")
    page.keyboard.press("Enter")
    page.wait_for_selector("[data-testid=span-echo] >> text=/in the bag, ± /")
    seen = ".selection >> text=/markers?: .*talks <b>aloud<.b>/"
    page.wait_for_selector(seen)
    SHOTS.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=SHOTS / "span.png")
    page.click("text=Session")
    page.wait_for_selector(".timeline canvas")
    page.screenshot(path=SHOTS / "span-session.png")
    assert simulator.interrupt() == 0, simulator.report()
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    marked = [each.content for each in bags.messages(bag, "/session/events") if each.content.kind == "marker"]
    [(label, duration)] = [(each.label, each.duration_secs) for each in marked]
    assert label == "talks <b>aloud</b>" and 1 < duration < 10

    player = stage.teampulse("play", bag, "--no-ros")
    page = screens(address_of(player), linked="connected").page
    page.click("text=Signals")
    page.wait_for_selector("[data-testid=player] >> text='click or drag to go there'")
    page.keyboard.press("Space")
    page.click("text='5 min'")
    page.keyboard.press("End")
    page.wait_for_selector(seen)
    page.screenshot(path=SHOTS / "span-replay.png")
    assert page.locator("#span-label").count() == 0


# How many points of the strips' pixels differ much after all of them are drawn anew, and how many there are.
DRAWN_ANEW = """
async () => {
  const frames = async (count) => { for (let k = 0; k < count; k += 1) await new Promise(requestAnimationFrame); };
  const read = () => [...document.querySelectorAll(".rows canvas")].map((canvas) => {
    const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
    copy.drawImage(canvas, 0, 0);
    return copy.getImageData(0, 0, canvas.width, canvas.height).data;
  });
  const theme = document.querySelector("[title='Light or dark']");
  await frames(8);
  const before = read();
  for (let k = 0; k < 2; k += 1) { theme.click(); await frames(8); }
  const after = read();
  let [off, all] = [0, 0];
  before.forEach((pixels, k) => pixels.forEach((each, at) => { all += 1; if (Math.abs(each - after[k][at]) > 64) off += 1; }));
  return [off, all];
}
"""


def test_a_strip_that_was_shifted_is_the_same_when_it_is_drawn_anew(stage, screens):
    monitor, _, address, _ = watched(stage)
    page = screens(address).page
    page.click("text=Signals")
    page.click("text='10 s'")
    page.wait_for_selector(".sig .now b:not(:text('–')) >> nth=4", state="attached")
    page.wait_for_selector(".pad >> text=/[1-9][0-9]* beats/")
    page.keyboard.press("Space")
    for _ in range(20):  # a beat that is found late is drawn late: then once more
        off, total = page.evaluate(DRAWN_ANEW)
        if off <= total / 2000:
            break
    else:
        pytest.fail(f"{off} of {total} differ")
    assert total > 100_000
    assert monitor.interrupt() == 0, monitor.report()


def test_names_and_notes_are_text_never_markup(stage, screens):
    monitor, _, address, _ = watched(stage)
    page = screens(address).page
    page.click("text=Session")
    page.wait_for_selector("#note:enabled")
    page.fill("#note", "<img src=x onerror=alert(1)>")
    page.keyboard.press("Enter")
    page.wait_for_selector(".notes-panel >> text=<img src=x onerror=alert(1)>")
    assert page.query_selector("main img") is None
    assert monitor.interrupt() == 0, monitor.report()


def test_the_javascript_is_small_and_nothing_is_inline():
    assets = harness.ROOT / "crates/dashboard/assets"
    assert len(gzip.compress((assets / "app.js").read_bytes())) <= JAVASCRIPT_BYTES
    index = (assets / "index.html").read_text()
    assert not re.search(r"<script(?![^>]*src=)|<style|style=|://", index)
