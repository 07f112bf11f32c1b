"""The dashboard's server: what is done there is in the bag at its moment, and programs read what there is."""

import asyncio
import json
import re
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request

import bags
import harness
import websockets
from prometheus_client.parser import text_string_to_metric_families

STUDY = """
[session]
name = "test"
[[sources]]
type = "topics"
names = ["/bench*"]
[[phases]]
name = "baseline"
[[sinks]]
type = "bag"
tidy = false
"""


def started(stage, settings: str = "", *arguments):
    """A session with a dashboard, its address, and where it is recorded."""
    out = stage.folder / "sessions"
    monitor = stage.teampulse("run", stage.study(STUDY + settings), "--out", out, *arguments)
    address = monitor.wait_for(r"the dashboard is at (http://\S+)/")[1]
    return monitor, address, out


def post(address: str, event: dict, **headers) -> tuple[int, dict]:
    """The answer to an event that is posted."""
    headers = {"Content-Type": "application/json", **headers}
    request = urllib.request.Request(f"{address}/api/events", json.dumps(event).encode(), headers)
    try:
        with urllib.request.urlopen(request) as answer:
            return answer.status, json.load(answer)
    except urllib.error.HTTPError as refused:
        return refused.code, json.loads(refused.read() or b"{}") if refused.code == 422 else {}


class Browser:
    """A browser on its WebSocket."""

    def __init__(self, socket):
        self._socket = socket

    async def say(self, kind: str, **content) -> None:
        await self._socket.send(json.dumps({"type": kind, **content}))

    async def hear(self, kind: str, **content) -> dict:
        """The next message of a kind with this content."""
        async with asyncio.timeout(harness.PATIENCE_SECS):
            while True:
                text = await self._socket.recv()
                message = json.loads(text) if isinstance(text, str) else {"type": "wave"}
                if message["type"] == kind and content.items() <= message.items():
                    return message
                if message["type"] == "refused":
                    raise AssertionError(message)

    async def session_time(self, began_ms: float) -> tuple[float, float]:
        """The session's time now, and how uncertain it is, as a browser finds it by a probe [s]."""
        sent = time.time()
        await self.say("ping", sent=sent)
        pong = await self.hear("pong", sent=sent)
        back = time.time()
        offset = (pong["received"] + pong["replied"]) / 2 - (sent + back) / 2
        return time.time() + offset, (back - sent) / 2


def events(bag, kind: str) -> list[tuple[float, str]]:
    """When, by the session's clock, something of a kind happened, and its label."""
    happened = bags.messages(bag, "/session/events")
    stamp = lambda header: header.stamp.sec + header.stamp.nanosec * 1e-9
    return [
        (stamp(each.content.header), each.content.label)
        for each in happened
        if each.content.kind == kind
    ]


def test_what_is_done_in_a_browser_is_in_the_bag_at_its_moment(stage):
    monitor, address, out = started(stage)

    async def act():
        async with websockets.connect(f"{address.replace('http', 'ws')}/ws") as socket:
            browser = Browser(socket)
            hello = await browser.hear("hello")
            await browser.hear("ready")
            clicked, uncertain = await browser.session_time(hello["began_unix_ms"])
            await browser.say("command", reference="a", text="mark robot <2> lost", at=clicked)
            first = await browser.hear("echo", reference="a")
            assert first["on_disk"] is False and abs(first["off_secs"]) < 1e-3, first
            await browser.hear("echo", reference="a", on_disk=True)
            await browser.say("note", reference="b", text="the lights were off", at=clicked)
            await browser.say("report", reference="c", subject="p001", scale="isa", value=3, at=None)
            await browser.say("command", reference="d", text="next_phase", at=None)
            for reference in "bcd":
                await browser.hear("echo", reference=reference)
            await browser.say("command", reference="e", text="stop", at=None)
            refused = await browser.hear("refused", reference="e")
            assert "add `stop` to `dashboard` below [commands]" in refused["reason"]
            return hello["began_unix_ms"] / 1e3, clicked

    began, clicked = asyncio.run(act())
    status, answer = post(address, {"label": "posted"})
    assert status == 200, answer
    assert monitor.interrupt() == 0, monitor.report()

    bag = harness.the_bag(out)
    (marked, label), (posted, also) = events(bag, "marker")
    assert (label, also) == ("robot <2> lost", "posted")
    assert abs(marked - (began + clicked)) < 1e-3
    assert abs(posted - (began + answer["t"])) < 0.1
    reports = bags.messages(bag, "/session/events")
    reports = {each.content.label: each.content.value for each in reports if each.content.kind == "report"}
    assert "dashboard note the lights were off" in reports
    assert reports["isa p001"] == 3
    asked = [label for _, label in events(bag, "command")]
    assert asked == ["dashboard mark robot <2> lost", "dashboard next_phase", "dashboard mark posted"]
    assert [label for _, label in events(bag, "phase")] == ["baseline"]


def test_a_span_is_a_marker_from_its_begin_to_its_end_in_the_bag_and_the_tables(stage):
    out = stage.folder / "sessions"
    study = stage.study(STUDY.replace("tidy = false", "tidy = true"))
    monitor = stage.teampulse("run", study, "--out", out)
    address = monitor.wait_for(r"the dashboard is at (http://\S+)/")[1]

    async def act():
        async with websockets.connect(f"{address.replace('http', 'ws')}/ws") as socket:
            browser = Browser(socket)
            hello = await browser.hear("hello")
            await browser.hear("ready")
            now, _ = await browser.session_time(hello["began_unix_ms"])
            await browser.say("annotate", reference="a", text="talks aloud", **{"from": now / 2, "to": 0.75 * now})
            echo = await browser.hear("echo", reference="a", on_disk=True)
            assert echo["label"] == "talks aloud" and abs(echo["off_secs"]) < 1e-3
            wrong = {"backwards": (now - 1, now - 2), "ahead": (now, now + 60), "of old": (now - 700, now - 650)}
            for text, (begin, end) in wrong.items():
                await browser.say("annotate", reference=text, text=text, **{"from": begin, "to": end})
                try:
                    await browser.hear("echo", reference=text)
                    raise RuntimeError(f"{text} was recorded")
                except AssertionError as refused:
                    assert "the span" in str(refused), refused
            return hello["began_unix_ms"] / 1e3, now

    began, now = asyncio.run(act())
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    marked = [each.content for each in bags.messages(bag, "/session/events") if each.content.kind == "marker"]
    [span] = marked
    begin = span.header.stamp.sec + span.header.stamp.nanosec * 1e-9
    assert abs(begin - began - now / 2) < 1e-3 and abs(span.duration_secs - now / 4) < 1e-3
    rows = [line.split("\t") for line in (bag / "events.tsv").read_text().splitlines()]
    head, *rows = rows
    [row] = [dict(zip(head, each)) for each in rows if "talks aloud" in each]
    assert row["trial_type"] == "marker" and abs(float(row["duration"]) - now / 4) < 1e-3


def test_a_session_is_stopped_from_a_browser_where_the_study_allows_it(stage):
    monitor, address, out = started(stage, '[commands]\ndashboard = ["stop"]\n')

    async def stop():
        async with websockets.connect(f"{address.replace('http', 'ws')}/ws") as socket:
            browser = Browser(socket)
            await browser.hear("ready")
            await browser.say("command", reference="a", text="mark x", at=None)
            assert "[commands]" in (await browser.hear("refused", reference="a"))["reason"]
            await browser.say("command", reference="b", text="stop", at=None)
            return await browser.hear("ended")

    assert asyncio.run(stop())["reason"] == "the session is over"
    assert monitor.ended() == 0, monitor.report()
    assert bags.counts(harness.the_bag(out))


def test_programs_read_metrics_and_the_example_runs(stage):
    monitor, address, out = started(stage)
    peer = stage.cyclone("send", "/bench", "--type", "std_msgs/msg/String", "--subscribers", 1)
    peer.answer("matched")
    peer.say((b"\0\1\0\0" + (2).to_bytes(4, "little") + b"x\0").hex())

    def metrics():
        with urllib.request.urlopen(f"{address}/metrics") as answer:
            text = answer.read().decode()
        families = {family.name: family for family in text_string_to_metric_families(text)}
        received = families["teampulse_stream_received"].samples
        return families if any(each.labels["stream"] == "/bench" for each in received) else None

    families = harness.eventually(metrics)
    assert families["teampulse_viewers"].samples[0].value == 0
    assert families["teampulse_stream_received"].type == "counter"
    example = harness.ROOT / "examples/dashboard_api.py"
    ran = subprocess.run([sys.executable, example, address], capture_output=True, text=True, timeout=30)
    assert ran.returncode == 0 and "marked at" in ran.stdout, ran.stderr
    assert monitor.interrupt() == 0, monitor.report()
    assert [label for _, label in events(harness.the_bag(out), "marker")] == ["from Python"]


def test_a_page_of_another_site_sets_no_marker(stage):
    monitor, address, out = started(stage)
    for headers in ({"Origin": "http://evil.example"}, {"Host": "evil.example"}, {"Sec-Fetch-Site": "cross-site"}):
        assert post(address, {"label": "evil"}, **headers)[0] == 403, headers
    assert post(address, {"label": "evil"}, **{"Content-Type": "text/plain"})[0] == 415
    assert post(address, {"label": "good"})[0] == 200
    assert monitor.interrupt() == 0, monitor.report()
    assert [label for _, label in events(harness.the_bag(out), "marker")] == ["good"]


def test_requests_that_never_end_keep_nobody_out_for_long(stage):
    monitor, address, _ = started(stage)
    host, port = address.removeprefix("http://").split(":")
    unfinished = []
    for _ in range(300):
        each = socket.create_connection((host, int(port)))
        each.sendall(b"GET /api/streams HTTP/1.1\r\nHost: 127")
        unfinished.append(each)

    def is_served() -> bool:
        try:
            with urllib.request.urlopen(f"{address}/api/streams", timeout=5) as answer:
                return answer.status == 200
        except OSError:
            return False

    # They have 10 s.
    harness.eventually(is_served, 40)
    for each in unfinished:
        each.close()
    # No topic of the study was published for 10 s.
    assert monitor.interrupt() == 5, monitor.report()


def test_a_time_outside_of_the_last_minute_and_a_label_of_nothing_are_answered_with_what_is_expected(stage):
    monitor, address, out = started(stage)
    for at in (-5, -1e300, 3600, 1e300):
        status, answer = post(address, {"label": "never", "at": at})
        assert status == 422 and "expected seconds since the session began, 0.0 to" in answer["hint"], answer
    status, answer = post(address, {"label": "never", "unix": time.time() + 3600})
    assert status == 422 and "not within the last minute" in answer["error"], answer
    status, answer = post(address, {"label": ""})
    assert (status, answer) == (422, {"error": "the text is empty", "hint": "write 1 to 1000 bytes"})
    assert post(address, {"label": "now", "at": post(address, {"note": "begun"})[1]["t"]})[0] == 200
    assert monitor.interrupt() == 0, monitor.report()
    assert [label for _, label in events(harness.the_bag(out), "marker")] == ["now"]


def test_a_session_without_a_dashboard_listens_nowhere(stage):
    out = stage.folder / "sessions"
    study = stage.study("dashboard = false\n" + STUDY)
    monitor = stage.teampulse("run", study, "--out", out)
    harness.eventually(lambda: list(out.glob("*/*.mcap")))
    assert monitor.interrupt() == 0, monitor.report()
    assert "dashboard" not in monitor.stderr


def test_the_printed_addresses_open_a_dashboard_that_listens_on_all(stage):
    tokens = stage.folder / "tokens.txt"
    tokens.write_text("mark mark0123456789abcd\n")
    monitor, address, out = started(stage, f'[[sinks]]\ntype = "dashboard"\nlisten = "0.0.0.0"\ntokens = "{tokens}"\n')
    assert address.startswith("http://localhost:"), address
    monitor.wait_for(f"with a token from {tokens}")
    assert post(address, {"label": "here"}, Authorization="Bearer mark0123456789abcd")[0] == 200
    others = re.findall(r"(http://[0-9.]+:[0-9]+)/\?token=…", monitor.stderr)
    for other in others:
        assert post(other, {"label": "there"}, Authorization="Bearer mark0123456789abcd")[0] == 200
    assert monitor.interrupt() == 0, monitor.report()
    labels = [label for _, label in events(harness.the_bag(out), "marker")]
    assert labels == ["here", *(["there"] * len(others))]


def test_no_other_address_without_a_token(stage):
    study = stage.study(STUDY + '[[sinks]]\ntype = "dashboard"\nlisten = "0.0.0.0"\n')
    ran = stage.ask("run", study)
    assert ran.returncode != 0 and "could see the team at 0.0.0.0" in ran.stderr, ran.stderr
