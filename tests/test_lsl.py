"""Lab Streaming Layer: PyPI's `pylsl` (liblsl) sends to us and receives from us. Nothing of liblsl is ours."""

import json
import socket
import sys
import textwrap
import time

import bags
import harness

SOURCES = {
    "markers": '[[sources]]\ntype = "lsl"\nname = "PsychoPyMarkers"\n',
    "eeg": '[[sources]]\ntype = "lsl"\nperson = "p001"\nstream_type = "EEG"\n',
}


def session(stage, *sources: str, settings: str = "", **options):
    """A session with these sources; gives the program and the folder of its bag."""
    out = stage.folder / "sessions"
    study = '[session]\nname = "lsl"\n' + "".join(sources) + '[[sinks]]\ntype = "bag"\n' + settings
    return stage.teampulse("run", stage.study(study), "--out", out, **options), out


def python(stage, program: str, *arguments) -> harness.Program:
    """A Python program with `pylsl`, in a process of its own."""
    return stage.start(sys.executable, "-u", "-c", textwrap.dedent(program), *arguments)


def events(bag, topic: str) -> list:
    return [each.content for each in bags.messages(bag, topic)]


def secs(stamp) -> float:
    return stamp.sec + stamp.nanosec * 1e-9


def values(bag, topic: str) -> list[list[float]]:
    """Every sample of a topic of waves, in their order."""
    found = []
    for wave in (each.content for each in bags.messages(bag, topic)):
        found += [list(wave.samples[at : at + wave.channels]) for at in range(0, len(wave.samples), wave.channels)]
    return found


# The call that PsychoPy's documentation has for its markers: one channel of texts, pushed without a stamp.
PSYCHOPY = """
    import sys, time, pylsl
    info = pylsl.StreamInfo("PsychoPyMarkers", "Markers", 1, 0, "string", "psychopy-1")
    outlet = pylsl.StreamOutlet(info)
    outlet.wait_for_consumers(30)
    time.sleep(3)
    for number in range(400):
        # The true time, by the clock of this computer, on both sides of the call.
        before = time.time()
        outlet.push_sample([f"stimulus {number}"])
        print(number, before, time.time())
        time.sleep(0.011 + number % 7 * 0.003)
    time.sleep(1)
    print("done")
"""


def test_markers_of_psychopy_are_events_within_two_milliseconds(stage, figure):
    monitor, out = session(stage, SOURCES["markers"])
    sender = python(stage, PSYCHOPY)
    sender.wait_for("done", "stdout", within_secs=60)
    assert monitor.interrupt() == 0, monitor.report()
    truth = [line.split() for line in sender.stdout.splitlines() if line[0].isdigit()]
    marked = events(harness.the_bag(out), "/session/psychopymarkers/markers")
    assert [(each.kind, each.label) for each in marked] == [("marker", f"stimulus {k}") for k in range(400)]
    # Off by how much its time lies outside of the call.
    off_ms = []
    for event, (_, before, after) in zip(marked, truth):
        at = secs(event.header.stamp)
        off_ms.append(1e3 * max(float(before) - at, at - float(after), 0.0))
    figure(f"markers of pylsl on this computer: 400 of 400, worst {max(off_ms):.3f} ms off (bar: 2 ms)")
    assert max(off_ms) < 2.0


# Markers and numbers that are sent as soon as there is somebody to take them, beside a regular stream.
AT_ONCE = """
    import time, pylsl
    regular = pylsl.StreamOutlet(pylsl.StreamInfo("Regular", "AtOnce", 1, 50, "double64", "regular-1"))
    def send_at_once(name, format):
        outlet = pylsl.StreamOutlet(pylsl.StreamInfo(name, "AtOnce", 1, 0, format, name))
        number = 0
        while number < 100:
            regular.push_sample([time.time()])
            if outlet.have_consumers():
                before = time.time()
                outlet.push_sample([f"{number}" if format == "string" else number])
                print(name, number, before, time.time())
                number += 1
            time.sleep(0.02)
        return outlet
    kept = [send_at_once("first", "string"), send_at_once("numbers", "double64"), send_at_once("second", "string")]
    time.sleep(1)
    print("done")
"""


def test_what_is_sent_at_once_keeps_its_time(stage, figure):
    monitor, out = session(stage, '[[sources]]\ntype = "lsl"\nperson = "p001"\nstream_type = "AtOnce"\n')
    sender = python(stage, AT_ONCE)
    sender.wait_for("done", "stdout", within_secs=60)
    assert monitor.interrupt() == 0, monitor.report()
    truth = {}
    for name, number, before, after in (line.split() for line in sender.stdout.splitlines() if line != "done"):
        truth[name, int(number)] = float(before), float(after)
    bag, off_ms, received = harness.the_bag(out), [], 0
    for name, leaf in (("first", "markers"), ("numbers", "atonce"), ("second", "markers")):
        for each in events(bag, f"/humans/persons/p001/{name}/{leaf}"):
            number = int(each.label) if leaf == "markers" else int(each.values[0])
            (before, after), at = truth[name, number], secs(each.header.stamp)
            off_ms.append(1e3 * max(before - at, at - after, 0.0))
            received += 1
    figure(f"LSL samples sent when a stream opens: {received} of {len(truth)}, worst {max(off_ms):.3f} ms off (bar: 2 ms)")
    assert received == len(truth) == 300
    assert max(off_ms) < 2.0


AMPLIFIERS = """
    import time, pylsl
    RATE, CHANNELS, SECS = 500, 32, 12
    outlets = []
    for amplifier in ("left", "right"):
        info = pylsl.StreamInfo(f"Amp {amplifier}", "EEG", CHANNELS, RATE, "float32", f"amp-{amplifier}")
        channels = info.desc().append_child("channels")
        for number in range(CHANNELS):
            channel = channels.append_child("channel")
            channel.append_child_value("label", f"E{number}")
            channel.append_child_value("unit", "microvolts")
            channel.append_child_value("type", "EEG")
        outlets.append(pylsl.StreamOutlet(info, chunk_size=10))
    for outlet in outlets:
        outlet.wait_for_consumers(30)
    began, sent = pylsl.local_clock(), 0
    while sent < RATE * SECS:
        due = int((pylsl.local_clock() - began) * RATE)
        while sent < min(due, RATE * SECS):
            for outlet in outlets:
                outlet.push_sample([sent] * (CHANNELS - 1) + [sent / 7], began + sent / RATE)
            sent += 1
        time.sleep(0.004)
    time.sleep(2)
    print("sent", sent)
"""


def test_two_amplifiers_lose_nothing(stage, figure):
    monitor, out = session(stage, SOURCES["eeg"])
    sender = python(stage, AMPLIFIERS)
    sender.wait_for("^sent 6000$", "stdout", within_secs=60)
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    for amplifier in ("left", "right"):
        topic = f"/humans/persons/p001/amp_{amplifier}/eeg"
        samples = values(bag, topic)
        assert [sample[0] for sample in samples] == list(range(6000)), amplifier
        assert all(abs(sample[31] - sample[0] / 7) < 1e-3 for sample in samples)
        waves = [each.content for each in bags.messages(bag, topic)]
        starts = [secs(wave.header.stamp) for wave in waves]
        counts = [len(wave.samples) // 32 for wave in waves]
        # Where each wave begins, by the number of its first sample.
        firsts = [sum(counts[:place]) for place in range(len(counts))]
        rate_hz = (firsts[-1] - firsts[0]) / (starts[-1] - starts[0])
        assert abs(rate_hz / 500 - 1) < 1e-3, rate_hz
    described = [each.content for each in bags.messages(bag, "/teampulse/streams")]
    [eeg] = [each for each in described if each.name == "/humans/persons/p001/amp_left/eeg"][-1:]
    assert (eeg.signal, eeg.channels[1], eeg.units[0], eeg.rate_hz) == ("eeg", "E1", "uV", 500.0)
    statuses = [each.content for each in bags.messages(bag, "/teampulse/status") if each.content.name.endswith("/eeg")]
    assert statuses[-1].clock == 2 and statuses[-1].lost_source == 0, statuses[-1]
    assert not [each for each in statuses if "simulated" in each.reason or " off" in each.reason]
    figure(f"2 EEG streams of 500 Hz x 32 channels over LSL: 0 of 12000 lost, clock ± {statuses[-1].sigma_secs * 2e3:.3f} ms")


FORMATS = """
    import time, pylsl
    outlets = []
    for place, word in enumerate(("float32", "double64", "int32", "int16", "int8", "int64")):
        info = pylsl.StreamInfo(f"Numbers {word}", "Numbers", 2, 0, word, f"numbers-{word}")
        outlets.append(pylsl.StreamOutlet(info))
    texts = pylsl.StreamOutlet(pylsl.StreamInfo("Texts", "Numbers", 2, 0, "string", "texts"))
    for outlet in outlets + [texts]:
        outlet.wait_for_consumers(30)
    time.sleep(3)
    # In the past: nothing is placed after its arrival.
    now = pylsl.local_clock() - 0.3
    for outlet in outlets:
        # A chunk, each with a stamp of its own.
        outlet.push_chunk([[k, -k] for k in range(50)], [now + k * 0.001 * (1 + k % 3) for k in range(50)])
    texts.push_sample(["µ" * 200, "second"])
    time.sleep(1)
    print("done")
"""


def test_numbers_of_all_formats_and_texts_arrive_as_they_were_sent(stage):
    monitor, out = session(stage, '[[sources]]\ntype = "lsl"\nperson = "p001"\nstream_type = "Numbers"\n')
    sender = python(stage, FORMATS)
    sender.wait_for("done", "stdout", within_secs=60)
    assert monitor.interrupt() == 0, monitor.report()
    bag = harness.the_bag(out)
    for word in ("float32", "double64", "int32", "int16", "int8", "int64"):
        samples = events(bag, f"/humans/persons/p001/numbers_{word}/numbers")
        assert [list(each.values) for each in samples] == [[k, -k] for k in range(50)], word
        stamps = [secs(each.header.stamp) for each in samples]
        for k, stamp in enumerate(stamps):
            assert abs(stamp - stamps[0] - k * 0.001 * (1 + k % 3)) < 1e-4, (word, k)
    [text] = events(bag, "/humans/persons/p001/texts/markers")
    assert text.label == "µ" * 200 + ", second"


STEADY = """
    import sys, time, pylsl
    info = pylsl.StreamInfo("Steady", "EEG", 1, 100, "double64", "steady-1")
    outlet = pylsl.StreamOutlet(info)
    print("open")
    taken = 0
    while True:
        outlet.push_sample([time.time()])
        taken += outlet.have_consumers()
        if taken == 300:
            print("read")
        time.sleep(0.01)
"""


def test_a_sender_that_was_killed_is_read_again_when_it_is_back(stage):
    monitor, out = session(stage, '[[sources]]\ntype = "lsl"\nperson = "p001"\nsource_id = "steady-1"\n')
    first = python(stage, STEADY)
    first.wait_for("read", "stdout")
    first.signal(9)
    monitor_said = "is read again when its sender is back"
    monitor.wait_for(monitor_said)
    # The gap that is to be found.
    time.sleep(2)
    second = python(stage, STEADY)
    second.wait_for("read", "stdout")
    assert monitor.interrupt() in (0, 3), monitor.report()
    bag = harness.the_bag(out)
    waves = events(bag, "/humans/persons/p001/steady/eeg")
    stamps = [secs(wave.header.stamp) for wave in waves]
    gaps = [after - before for before, after in zip(stamps, stamps[1:]) if after - before > 0.5]
    assert len(gaps) == 1, gaps
    # Its own clock, before and after: the same computer's.
    assert all(abs(wave.samples[0] - stamp) < 0.02 for wave, stamp in zip(waves, stamps))
    labels = [each.label for each in events(bag, "/session/events")]
    assert [label for label in labels if monitor_said in label], labels
    statuses = [each.content for each in bags.messages(bag, "/teampulse/status") if each.content.name.endswith("/eeg")]
    missing = round(gaps[0] * 100)
    assert abs(statuses[-1].lost_source - missing) < 0.1 * missing + 5, (statuses[-1].lost_source, missing)


HOSTILE = [b"", b"\x00" * 70_000, b"LSL/110 200 OK\r\n\r\n" + b"\xff" * 50_000, b"HTTP/1.1 200 OK\r\n\r\n", b"<" * 100_000]


def test_a_hostile_sender_leaves_the_session_unharmed(stage):
    """One that says that it has a stream, and serves anything but."""
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    udp.bind(("127.0.0.1", 16600))
    tcp = socket.create_server(("127.0.0.1", 0))
    port = tcp.getsockname()[1]
    monitor, out = session(stage, SOURCES["eeg"])
    udp.settimeout(0.05)
    tcp.settimeout(0.05)
    document = (
        "<?xml version='1.0'?><info><name>Evil</name><type>EEG</type><channel_count>4</channel_count>"
        "<channel_format>float32</channel_format><nominal_srate>100</nominal_srate><version>1.1</version>"
        "<uid>{uid}</uid><v4data_port>{port}</v4data_port><v4service_port>16600</v4service_port></info>"
    )
    served, deadline = 0, time.monotonic() + 20
    while served < 3 * len(HOSTILE) and time.monotonic() < deadline:
        try:
            request, peer = udp.recvfrom(4096)
            if request.startswith(b"LSL:shortinfo"):
                to, number = request.split(b"\r\n")[2].split()
                reply = number + b"\r\n" + document.format(uid=f"u{served}", port=port).encode()
                for garbage in (reply, number + b"\r\n<info>", b"\xff" * 1000, number):
                    udp.sendto(garbage, (peer[0], int(to)))
            else:
                udp.sendto(b" 1 nan inf -inf", peer)
        except TimeoutError:
            pass
        try:
            connection, _ = tcp.accept()
            with connection:
                asked = connection.recv(4096)
                if asked.startswith(b"LSL:fullinfo") and served % 2:
                    connection.sendall(document.format(uid=f"u{served - 1}", port=port).encode())
                else:
                    connection.sendall(HOSTILE[served % len(HOSTILE)])
                served += 1
        except (TimeoutError, OSError):
            pass
    assert served >= len(HOSTILE), served
    sender = python(stage, AMPLIFIERS)
    sender.wait_for("^sent 6000$", "stdout", within_secs=60)
    assert monitor.interrupt() == 0, monitor.report()
    assert len(values(harness.the_bag(out), "/humans/persons/p001/amp_left/eeg")) == 6000


def test_a_stream_that_is_not_there_is_named(stage):
    monitor, out = session(stage, SOURCES["markers"])
    monitor.wait_for("no stream with name='PsychoPyMarkers' is found")
    assert monitor.interrupt() == 0, monitor.report()
    labels = [each.label for each in events(harness.the_bag(out), "/session/events")]
    assert [label for label in labels if "no stream with name='PsychoPyMarkers' is found" in label], labels


def study_of_outlets(streams: list[str], settings: str = "") -> str:
    return f'[[sinks]]\ntype = "lsl"\nstreams = {streams}\n{settings}'


# What an inlet of liblsl receives of the session's ECG and its markers, by liblsl's own time correction.
INLETS = """
    import json, sys, time, pylsl
    def inlet(name):
        [info] = pylsl.resolve_byprop("name", name, 1, 60)
        return pylsl.StreamInlet(info, recover=True)
    ecg, events = inlet("/humans/persons/p001/amp_left/eeg"), inlet("/session/psychopymarkers/markers")
    described = ecg.info()
    print(json.dumps({"type": described.type(), "rate": described.nominal_srate(), "channels": described.channel_count(),
        "labels": described.get_channel_labels()[:2], "units": described.get_channel_units()[:2]}))
    print("correction", ecg.time_correction(), events.time_correction())
    samples, marks, until = [], [], time.time() + 60
    while time.time() < until and not (marks and marks[-1][1] == ["stimulus 399"]):
        chunk, stamps = ecg.pull_chunk(0.1)
        samples += zip(stamps, chunk)
        while True:
            text, stamp = events.pull_sample(0.0)
            if text is None:
                break
            marks.append((stamp, text))
    # By the clock that time.time() reads.
    ahead = time.time() - pylsl.local_clock()
    print(json.dumps({"samples": [(stamp, value[0], value[31]) for stamp, value in samples],
        "marks": [(stamp + ahead, text[0]) for stamp, text in marks]}))
"""


def test_inlets_of_liblsl_receive_what_the_session_offers(stage, figure):
    offered = ["/humans/persons/p001/amp_left/eeg", "/session/psychopymarkers/markers"]
    monitor, _ = session(stage, SOURCES["eeg"], SOURCES["markers"], settings=study_of_outlets(offered))
    inlets = python(stage, INLETS)
    # Each goes on once the session reads it, and the outlets appear with what it reads.
    python(stage, AMPLIFIERS.replace("SECS = 500, 32, 12", "SECS = 500, 32, 20"))
    markers = python(stage, PSYCHOPY.replace("time.sleep(3)", "sys.stdin.readline()"))
    inlets.wait_for("^correction", "stdout", within_secs=60)
    markers.say("begin")
    markers.wait_for("done", "stdout", within_secs=60)
    received = inlets.answer("samples", within_secs=90)
    described = json.loads(inlets.stdout.splitlines()[0])
    assert (described["type"], described["rate"], described["channels"]) == ("EEG", 500.0, 32)
    assert (described["labels"], described["units"]) == (["E0", "E1"], ["uV", "uV"])
    numbers = [number for _, number, _ in received["samples"]]
    assert len(numbers) > 2000
    assert numbers == list(range(int(numbers[0]), int(numbers[0]) + len(numbers))), "one was lost"
    assert all(abs(last - number / 7) < 1e-3 for _, number, last in received["samples"])
    stamps = [stamp for stamp, _, _ in received["samples"]]
    assert abs((stamps[-1] - stamps[0]) * 500 - (len(stamps) - 1)) < 5
    truth = {f"stimulus {line.split()[0]}": line.split()[1:] for line in markers.stdout.splitlines() if line[0].isdigit()}
    assert [text for _, text in received["marks"]][-300:] == [f"stimulus {k}" for k in range(100, 400)]
    off_ms = [
        1e3 * max(float(truth[text][0]) - stamp, stamp - float(truth[text][1]), 0.0) for stamp, text in received["marks"]
    ]
    assert max(off_ms) < 5.0, max(off_ms)
    figure(f"liblsl inlets of our outlets: {len(numbers)} samples without a loss, markers at most {max(off_ms):.3f} ms off")
    assert monitor.interrupt() == 0, monitor.report()


# Prints the texts of a session's events, for which it looks before the first one.
LISTENER = """
    import pylsl
    [info] = pylsl.resolve_byprop("name", "/session/events", 1, 60)
    inlet = pylsl.StreamInlet(info)
    inlet.open_stream()
    print("open")
    text = None
    while text != ["marker go"] and text != ["go"]:
        text, _ = inlet.pull_sample(60)
        print(text)
"""


def test_events_are_offered_before_the_first_and_another_session_reads_them_by_name(stage):
    listen = "127.0.0.1:5016"
    offers = '[[sources]]\ntype = "marker_lines"\nlisten = "' + listen + '"\n' + study_of_outlets(["/session/events"])
    offering, _ = session(stage, offers)
    listener = python(stage, LISTENER)
    listener.wait_for("^open", "stdout", within_secs=60)
    by_type, by_name = ('[[sources]]\ntype = "lsl"\n' + line for line in ('stream_type = "Markers"\n', 'name = "/session/events"\n'))
    checked = stage.ask("check", stage.study('[session]\nname = "a"\n' + by_type), "--seconds", 2)
    assert "1 stream with type='Markers' from teampulse itself" in checked.stdout, checked.stdout
    assert checked.returncode == 5, checked.stdout
    checked = stage.ask("check", stage.study('[session]\nname = "a"\n' + by_name), "--seconds", 2)
    assert "lsl      ok    /session/events (Markers)" in checked.stdout and checked.returncode == 0, checked.stdout
    study = stage.study('[session]\nname = "reading"\n' + by_type + by_name + '[[sinks]]\ntype = "bag"\n')
    reading = stage.teampulse("run", study, "--out", stage.folder / "reading")
    reading.wait_for("only teampulse itself offers streams with type='Markers'")
    address, port = listen.split(":")
    with socket.create_connection((address, int(port))) as link:
        link.sendall(b"go\n")
    listener.wait_for("go", "stdout")
    reading.wait_for("go")
    assert reading.interrupt() == 0, reading.report()
    assert offering.interrupt() == 0, offering.report()
    labels = [each.label for each in events(harness.the_bag(stage.folder / "reading"), "/session/session_events/markers")]
    assert [label for label in labels if label.endswith("go")], labels


OUTLET_PROBES = [
    b"\x00" * 5000,
    b"LSL:streamfeed/110 x\r\n\r\n",
    b"LSL:streamfeed/99999999999999 \r\n\r\n",
    b"LSL:shortinfo\r\n" + b"(" * 3000 + b"\r\n",
    b"GET / HTTP/1.1\r\n\r\n",
    b"LSL:streamfeed/110\r\n" + b"a: b\r\n" * 5000,
]


def test_hostile_clients_of_our_outlets_leave_the_session_unharmed(stage):
    offered = ["/humans/persons/p001/amp_left/eeg"]
    monitor, out = session(stage, SOURCES["eeg"], settings=study_of_outlets(offered))
    sender = python(stage, AMPLIFIERS)
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    deadline = time.monotonic() + 60
    while "sent 6000" not in sender.stdout and time.monotonic() < deadline:
        for port in [*range(16571, 16580)]:
            for garbage in OUTLET_PROBES:
                udp.sendto(garbage[:8000], ("127.0.0.1", port))
                try:
                    with socket.create_connection(("127.0.0.1", port), timeout=0.2) as client:
                        client.sendall(garbage)
                except OSError:
                    pass
        time.sleep(0.2)
    assert monitor.interrupt() == 0, monitor.report()
    assert len(values(harness.the_bag(out), "/humans/persons/p001/amp_left/eeg")) == 6000


def test_scan_lists_streams_and_check_finds_them(stage):
    sender = python(stage, STEADY)
    sender.wait_for("open", "stdout")
    scanned = stage.ask("scan", "--seconds", 2)
    assert "Steady" in scanned.stdout and "100 Hz" in scanned.stdout, scanned.stdout
    lines = scanned.stdout[scanned.stdout.index('[[sources]]\ntype   = "lsl"') :]
    source = "\n".join(lines.splitlines()[:4]) + "\n"
    [of_lsl] = [each["lsl"] for each in json.loads(stage.ask("scan", "--seconds", 2, "--json").stdout) if "lsl" in each]
    assert (of_lsl[0]["name"], of_lsl[0]["channels"], of_lsl[0]["source_id"]) == ("Steady", 1, "steady-1")
    checked = stage.ask("check", stage.study('[session]\nname = "a"\n' + source), "--seconds", 4)
    assert "lsl      ok    Steady (EEG) 100 Hz" in checked.stdout, checked.stdout
    assert checked.returncode == 0 and "note     LSL" not in checked.stdout, checked.stdout
    absent = source.replace("Steady", "Absent")
    checked = stage.ask("check", stage.study('[session]\nname = "a"\n' + absent), "--seconds", 2)
    assert "missing  an LSL stream with name='Absent'" in checked.stdout and checked.returncode == 5, checked.stdout
