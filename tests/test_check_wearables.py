"""What `check` says of wearables that would spoil a recording."""

import shutil

import pytest

STRAP = """
[[sources]]
type   = "heart_rate"
person = "p001"
[[phases]]
name      = "baseline"
from_secs = 0
to_secs   = 60
[[simulate.wearables]]
type   = "heart_rate"
person = "p001"
device = {{ {device} }}
"""


@pytest.mark.parametrize(
    ("device", "code", "said"),
    [
        ("battery_percent = 70", 0, "contact  ok    heart_rate_strap of p001 touches the skin"),
        ("battery_percent = 12", 5, "missing  battery of heart_rate_strap of p001: 12 %"),
        ('faults = [{ at_secs = 0, fault = "off" }]', 5, "missing  heart_rate_strap of p001 has no skin contact"),
    ],
    ids=["a strap that is worn", "a battery that is low", "a strap that is off"],
)
def test_a_strap_is_go_when_it_is_worn_and_charged(stage, monkeypatch, device, code, said):
    if not shutil.which("dbus-daemon"):
        pytest.skip("dbus-daemon is not installed")
    study = stage.study(STRAP.format(device=device))
    emulation = stage.teampulse("emulate", study)
    bus = emulation.wait_for(r"DBUS_SYSTEM_BUS_ADDRESS=(\S+)", pipe="stdout")[1]
    monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", bus)
    answer = stage.ask("check", study, "--seconds", 10)
    assert answer.returncode == code, answer.stdout + answer.stderr
    assert said in answer.stdout, answer.stdout
