"""A recording on the dashboard: a click lands where it was made, with what was known at that moment and nothing later."""

import asyncio
import json
import signal

import harness
import pytest
import websockets
from test_dashboard_pages import AXE, chromium, screens, serious  # noqa: F401
from test_dashboard_server import Browser, post

NEVER_SECS = 1e9


def shown(stage, bag, *arguments):
    """A bag that is only shown, and the address of its page."""
    player = stage.teampulse("play", bag, "--no-ros", *arguments)
    return player, player.wait_for(r"the dashboard is at (http://\S+)/")[1]


def watching(address: str, act):
    """Acts as a browser that looks at a recording."""

    async def look():
        async with websockets.connect(f"{address.replace('http', 'ws')}/ws", max_size=None) as socket:
            browser = Browser(socket)
            hello = await browser.hear("hello")
            assert hello["mode"] == "replay"
            await browser.hear("ready")
            return await act(browser, hello)

    return asyncio.run(look())


async def moved_to(browser: Browser, t: float, within_secs=1.0) -> tuple[dict, dict[str, list]]:
    """Moves to a time; what is then known, by the kind of message."""
    await browser.say("play", reference="a", t=t, rate=None, paused=None)
    # The present moment is shown again when the timeline of the whole bag is read: that may come first.
    while True:
        moved = await browser.hear("moved")
        if abs(moved["t"] - min(max(t, 0.0), moved["length"])) < within_secs:
            break
    heard: dict[str, list] = {"features": [], "events": [], "samples": []}
    reports = 0
    async with asyncio.timeout(harness.PATIENCE_SECS):
        # The recording is reported once a second, and the states of a moment may wait behind one report.
        while reports < 2:
            text = await browser._socket.recv()
            message = json.loads(text) if isinstance(text, str) else {"type": "wave"}
            if message["type"] in heard:
                heard[message["type"]] += message[message["type"]]
            reports += message["type"] == "recording"
    return moved, heard


def test_a_jump_shows_what_was_known_then_and_nothing_later(stage, demo_bag):
    player, address = shown(stage, demo_bag)
    duration = json.loads(stage.ask("info", demo_bag, "--json").stdout)["duration_secs"]

    async def act(browser, hello):
        await browser.say("play", reference="p", t=None, rate=None, paused=True)
        length = (await browser.hear("playback", paused=True))["length"]
        assert length == pytest.approx(duration, abs=1.0)
        seen = {}
        for t in (18.0, 6.0, 12.0, -NEVER_SECS, NEVER_SECS):
            moved, heard = await moved_to(browser, t)
            at = min(max(t, 0.0), length)
            assert moved["t"] == pytest.approx(at, abs=1e-3) and moved["paused"]
            for kind in ("features", "events", "samples"):
                late = [each for each in heard[kind] if each["t"] > at + 1.0]
                assert not late, (t, kind, late[:3])
            seen[t] = heard
            if at > 5:
                assert heard["features"] and max(each["t"] for each in heard["features"]) > at - 3
        # A moment is shown again when the timeline of the whole bag is read.
        beats = {t: len({(e["stream"], e["t"]) for e in seen[t]["events"] if e["kind"] == "beat"}) for t in (6.0, 12.0, 18.0)}
        assert 0 < beats[6.0] < beats[12.0] < beats[18.0], beats
        await browser.say("play", reference="r", t=1.0, rate=20.0, paused=False)
        await browser.hear("playback", paused=False, rate=20.0)
        # At the end it stands, and can be moved again.
        while (await browser.hear("playback"))["t"] < length:
            pass
        assert (await moved_to(browser, 3.0, within_secs=12))[0]["t"] < length

    watching(address, act)
    player.wait_for("the bag has ended; choose another time")
    assert post(address, {"kind": "marker", "label": "x"})[0] == 422
    player.signal(signal.SIGINT)
    assert player.ended() == 0


def test_what_is_done_on_a_recording_is_refused_and_what_is_wrong_is_harmless(stage, demo_bag):
    _, address = shown(stage, demo_bag)

    async def act(browser, hello):
        for content in (
            {"type": "command", "reference": "x", "text": "mark a", "at": None},
            {"type": "note", "reference": "x", "text": "a", "at": None},
            {"type": "play", "t": 1.0, "rate": None, "paused": None},
            {"type": "play", "reference": "x", "t": "soon", "rate": None, "paused": None},
        ):
            await browser._socket.send(json.dumps(content))
            async with asyncio.timeout(harness.PATIENCE_SECS):
                refused = None
                while refused is None:
                    text = await browser._socket.recv()
                    refused = text if isinstance(text, str) and '"type":"refused"' in text else None
            assert "this is a recording" in refused or "failed to read" in refused
        await browser.say("play", reference="x", t=None, rate=1e300, paused=None)
        assert (await browser.hear("playback", rate=20.0))["rate"] == 20
        for t in (1e300, -1e300):
            await browser.say("play", reference="x", t=t, rate=None, paused=None)
            await browser.hear("moved")

    watching(address, act)


@pytest.mark.parametrize("what", ["cut off", "of others"])
def test_a_recording_that_is_cut_off_or_of_others_is_shown(stage, demo_bag, what):
    folder = stage.folder / "odd"
    folder.mkdir()
    (part,) = demo_bag.glob("*.mcap")
    if what == "cut off":
        content = part.read_bytes()
        (folder / "cut.mcap").write_bytes(content[: len(content) * 2 // 3])
    else:
        bags_of_others(part, folder / "theirs.mcap")
    player, address = shown(stage, next(folder.glob("*.mcap")))

    async def act(browser, hello):
        moved, heard = await moved_to(browser, 8.0)
        assert moved["t"] == pytest.approx(8, abs=1.0)
        assert heard["samples"], "the robots' numbers are read"

    watching(address, act)


def bags_of_others(part, out) -> None:
    """The robots' messages of a recording as any other recorder writes them."""
    from mcap.reader import make_reader
    from mcap.writer import Writer

    with part.open("rb") as stream, out.open("wb") as written:
        writer = Writer(written)
        writer.start(profile="ros2")
        schemas, channels = {}, {}
        for schema, channel, message in make_reader(stream).iter_messages():
            if schema.name.startswith("teampulse_msgs/"):
                continue
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, schemas[schema.id])
            writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
        writer.finish()


def test_a_click_on_the_timeline_lands_where_it_was_made(stage, demo_bag, screens, figure):  # noqa: F811
    _, address = shown(stage, demo_bag)
    page = screens(f"{address}/", linked="connected").page
    page.goto(f"{address}/#/session")
    page.wait_for_selector("text='click or drag to go there'")
    page.keyboard.press("Space")
    page.wait_for_selector("button[aria-label=Play]")
    slider = page.locator(".player canvas")
    length = float(slider.get_attribute("aria-valuemax"))

    def position() -> float:
        minutes, secs = page.locator("[data-testid=position] b").inner_text().split(":")
        return 60 * int(minutes) + float(secs)

    worst = 0.0
    for share in (0.8, 0.25, 0.5):
        box = slider.bounding_box()
        page.mouse.click(box["x"] + 88 + (box["width"] - 88) * share, box["y"] + box["height"] / 2)
        harness.eventually(lambda: abs(position() - share * length) < 0.6)
        worst = max(worst, abs(position() - share * length))
    figure(f"a click on the timeline of a replay lands {worst:.2f} s from it at most")
    before = position()
    page.keyboard.press("ArrowRight")
    harness.eventually(lambda: abs(position() - before - 1) < 0.15)
    # Nothing is offered that a recording can't do; every page shows that moment.
    for name in ("team", "signals", "session", "health"):
        page.goto(f"{address}/#/{name}")
        page.wait_for_selector("[data-testid=player]")
        assert page.locator("text='Replay, not live'").count() == 1
        for offered in ("Acknowledge", "End session…", "Keep", "Set marker"):
            assert page.locator(f"button:has-text('{offered}')").count() == 0, (name, offered)
        if AXE.exists():
            assert serious(page) == [], name
    page.goto(f"{address}/#/team")
    page.wait_for_selector(".robot[data-state=online]")
