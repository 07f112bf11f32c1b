"""Emulated wearables on their transports: programs that others wrote read them, and so does a session."""

import subprocess
import sys
import textwrap

import bags
import harness

PEER_SECS = 60


def emulate(stage, wearables: str) -> harness.Program:
    """The wearables of a study, when all of them can be reached."""
    study = stage.study("[session]\nname = \"emulated\"\n" + wearables, "emulated.toml")
    program = stage.teampulse("emulate", study)
    program.wait_for("emulating wearables")
    program.sources(wearables.count("[[simulate.wearables]]"))
    return program


def shimmer(port) -> str:
    return f'[[simulate.wearables]]\ntype = "shimmer3"\nperson = "p001"\nport = "{port}"\n'


E4 = '[[simulate.wearables]]\ntype = "empatica_e4"\nperson = "p001"\n'


def ask(program: str, *arguments) -> str:
    """What a Python program prints, in a process of its own: these libraries leave threads behind."""
    command = [sys.executable, "-c", textwrap.dedent(program), *map(str, arguments)]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=PEER_SECS)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout


PYSHIMMER = """
    import sys, threading
    from pyshimmer import DEFAULT_BAUDRATE, EChannelType, ShimmerBluetooth
    from pyshimmer.dev.channels import ESensorGroup
    from serial import Serial
    packets, enough = [], threading.Event()
    def take(packet):
        packets.append([packet[each] for each in (EChannelType.TIMESTAMP, EChannelType.GSR_RAW, EChannelType.INTERNAL_ADC_13)])
        if len(packets) == 256:
            enough.set()
    with ShimmerBluetooth(Serial(sys.argv[1], DEFAULT_BAUDRATE)) as device:
        device.set_sampling_rate(128.0)
        device.set_sensors([ESensorGroup.GSR, ESensorGroup.CH_A13])
        print("rate", device.get_inquiry()[0])
        device.add_stream_callback(take)
        device.start_streaming()
        enough.wait(30)
        device.stop_streaming()
    for packet in packets[:256]:
        print("packet", *packet)
"""


def test_pyshimmer_reads_the_emulated_shimmer(stage):
    port = stage.folder / "shimmer"
    emulated = emulate(stage, shimmer(port))
    lines = [line.split() for line in ask(PYSHIMMER, port).splitlines()]
    assert [float(words[1]) for words in lines if words[0] == "rate"] == [128]
    packets = [[int(float(number)) for number in words[1:]] for words in lines if words[0] == "packet"]
    assert len(packets) == 256
    steps = {(after[0] - before[0]) % (1 << 24) for before, after in zip(packets, packets[1:])}
    assert steps == {256}, steps
    for _, gsr, ppg in packets:
        volts, kohm = (gsr & 0xFFF) * 3 / 4095, (40.2, 287, 1000, 3300)[gsr >> 14]
        conductance_us = 1000 / (kohm / (volts / 0.5 - 1))
        assert 0.2 < conductance_us < 40, conductance_us
        assert 0 < ppg < 4095
    assert emulated.interrupt() == 0, emulated.report()


BRAINFLOW = """
    import sys, time
    from brainflow import BoardIds, BoardShim, BrainFlowInputParams
    BoardShim.disable_board_logger()
    params = BrainFlowInputParams()
    params.serial_port = sys.argv[1]
    board = BoardShim(BoardIds.SHIMMER3_BOARD, params)
    board.prepare_session()
    board.start_stream()
    deadline = time.monotonic() + 30
    while board.get_board_data_count() < 256 and time.monotonic() < deadline:
        time.sleep(0.05)
    board.stop_stream()
    data = board.get_board_data()
    board.release_session()
    eda = data[BoardShim.get_eda_channels(BoardIds.SHIMMER3_BOARD)[0]]
    print(len(eda), min(eda), max(eda))
"""


def test_brainflow_reads_the_emulated_shimmer(stage):
    port = stage.folder / "shimmer"
    emulated = emulate(stage, shimmer(port))
    count, least_us, most_us = map(float, ask(BRAINFLOW, port).split()[-3:])
    assert count >= 256
    assert 0.2 < least_us <= most_us < 40
    assert emulated.interrupt() == 0, emulated.report()


PYEMPATICA = """
    import os, time
    from pyempatica.empaticae4 import EmpaticaClient, EmpaticaDataStreams, EmpaticaE4
    def until(is_so):
        deadline = time.monotonic() + 30
        while not is_so() and time.monotonic() < deadline:
            time.sleep(0.05)
    client = EmpaticaClient()
    client.list_connected_devices()
    until(lambda: client.device_list)
    e4 = EmpaticaE4(client.device_list[0])
    for stream in EmpaticaDataStreams.ALL_STREAMS:
        e4.subscribe_to_stream(stream)
        until(lambda: e4.subscribed_streams.get(stream.decode()))
    e4.start_streaming()
    until(lambda: len(e4.bvp) >= 512 and e4.ibi and e4.bat)
    e4.suspend_streaming()
    print(e4.client.errors["EmpaticaCommandError"] + e4.client.errors["EmpaticaDataError"])
    for numbers in (e4.bvp_timestamps, e4.acc_timestamps, e4.gsr_timestamps, e4.tmp_timestamps, e4.gsr, e4.tmp, e4.ibi):
        print(*numbers)
    os.sys.stdout.flush()
    os._exit(0)
"""


def test_pyempatica_reads_the_emulated_e4(stage):
    emulated = emulate(stage, E4)
    errors, *lines = ask(PYEMPATICA).splitlines()
    assert errors == "[]", errors
    *stamps, eda, temperature, intervals = [[float(number) for number in line.split()] for line in lines]
    # It takes what it reads for one line, and so may lose the next: what arrives has its place in time.
    for stream, rate_hz in zip(stamps, (64, 32, 4, 4)):
        places = [(stamp - stream[0]) * rate_hz for stamp in stream]
        assert len(places) > 2 and places[-1] > 2, rate_hz
        assert all(abs(place - round(place)) < 1e-3 for place in places), rate_hz
    assert all(0.2 < each < 40 for each in eda)
    assert all(20 < each < 45 for each in temperature)
    assert all(0.4 < each < 1.6 for each in intervals) and intervals
    assert emulated.interrupt() == 0, emulated.report()


def test_a_session_records_both_by_the_lines_that_emulate_prints(stage):
    port = stage.folder / "shimmer"
    emulated = emulate(stage, shimmer(port) + E4)
    out = stage.folder / "sessions"
    study = '[session]\nname = "worn"\n' + emulated.stdout + '\n[[sinks]]\ntype = "bag"\n'
    monitor = stage.teampulse("run", stage.study(study), "--out", out, "--duration", 12)
    assert monitor.ended(within_secs=60) == 0, monitor.report()
    assert emulated.interrupt() == 0, emulated.report()
    bag = harness.the_bag(out)
    people = "/humans/persons/p001"
    for topic, rate_hz in (
        (f"{people}/shimmer3/eda", 128),
        (f"{people}/shimmer3/ppg", 128),
        (f"{people}/empatica_e4/eda", 4),
        (f"{people}/empatica_e4/ppg", 64),
        (f"{people}/empatica_e4/acceleration", 32),
    ):
        samples = bags.messages(bag, topic)
        numbers = [each.content.index for each in samples]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers))), topic
        stamps = [each.content.header.stamp for each in samples]
        secs = [stamp.sec + stamp.nanosec * 1e-9 for stamp in stamps]
        measured_hz = (len(secs) - 1) / (secs[-1] - secs[0])
        assert abs(measured_hz / rate_hz - 1) < 0.02, (topic, measured_hz)
    assert bags.messages(bag, f"{people}/empatica_e4/ibi")
    # What arrives is what features work with, and stamps are those of this computer.
    topics = bags.counts(bag)
    assert f"{people}/shimmer3/eda/skin/w30" in topics and f"{people}/empatica_e4/eda/skin/w30" in topics
    assert not [topic for topic in topics if topic.endswith("/refused")]
    reasons = {each.content.reason for each in bags.messages(bag, "/teampulse/status")}
    assert not [reason for reason in reasons if "believed" in reason], reasons
