"""The dashboard as https, with a certificate: spoken to by Python's ssl, which trusts that certificate only."""

import asyncio
import json
import shutil
import socket
import ssl
import subprocess
import urllib.error
import urllib.request
from pathlib import Path

import pytest
import websockets

from conftest import leave_out

STUDY = """
[session]
name = "test"
[[sources]]
type = "topics"
names = ["/bench*"]
[[sinks]]
type = "dashboard"
port = 0
"""
TOKEN = "control-0123456789abcdef"


def certificate(folder: Path, name: str) -> tuple[Path, Path]:
    """A certificate of this computer that signs itself, and its key."""
    if shutil.which("openssl") is None:
        leave_out("there is no openssl on this system, which makes certificates")
    made, key = folder / f"{name}.pem", folder / f"{name}.key.pem"
    command = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes"]
    command += ["-days", "2", "-subj", "/CN=teampulse", "-addext", "subjectAltName=IP:127.0.0.1,DNS:localhost"]
    subprocess.run([*command, "-out", made, "-keyout", key], check=True, capture_output=True)
    return made, key


def settings(made: Path, key: Path, more: str = "") -> str:
    return f'{STUDY}certificate = "{made}"\nkey = "{key}"\n{more}'


def served(stage, more: str = ""):
    """A session whose dashboard is https, its address, and what trusts its certificate."""
    made, key = certificate(stage.folder, "own")
    monitor = stage.teampulse("run", stage.study(settings(made, key, more)))
    address = monitor.wait_for(r"the dashboard is at (https://\S+)/")[1]
    return monitor, address, ssl.create_default_context(cafile=made)


def test_pages_and_sockets_are_encrypted(stage):
    monitor, address, trust = served(stage)
    with urllib.request.urlopen(address, context=trust) as answer:
        assert answer.status == 200 and b"<html" in answer.read()

    async def joined():
        async with websockets.connect(f"{address.replace('https', 'wss')}/ws", ssl=trust) as browser:
            return json.loads(await browser.recv())

    assert asyncio.run(joined())["session"] == "test"
    with pytest.raises(urllib.error.URLError, match="self-signed"):
        urllib.request.urlopen(address, context=ssl.create_default_context())
    with pytest.raises(urllib.error.HTTPError) as plain:
        urllib.request.urlopen(address.replace("https", "http"))
    assert plain.value.code == 400 and b"open the same address with https://" in plain.value.read()
    assert monitor.interrupt() == 0, monitor.report()


def test_connections_that_never_shake_hands_keep_nobody_out(stage):
    monitor, address, trust = served(stage)
    host, port = address.removeprefix("https://").split(":")
    silent = [socket.create_connection((host, int(port))) for _ in range(100)]
    silent[0].sendall(b"\x16\x03\x01\xff\xff" + b"x" * 1000)
    with urllib.request.urlopen(f"{address}/api/streams", context=trust) as answer:
        assert answer.status == 200
    for each in silent:
        each.close()
    assert monitor.interrupt() == 0, monitor.report()


def test_a_token_is_kept_in_a_cookie_that_is_never_sent_unencrypted(stage):
    tokens = stage.folder / "tokens.txt"
    tokens.write_text(f"control {TOKEN}\n")
    monitor, address, trust = served(stage, f'tokens = "{tokens}"\n')

    class Stay(urllib.request.HTTPRedirectHandler):
        def redirect_request(self, *_):
            return None

    opener = urllib.request.build_opener(Stay, urllib.request.HTTPSHandler(context=trust))
    with pytest.raises(urllib.error.HTTPError) as moved:
        opener.open(f"{address}/?token={TOKEN}")
    assert moved.value.code == 303 and moved.value.headers["Set-Cookie"].endswith("; Secure")
    with pytest.raises(urllib.error.HTTPError) as refused:
        opener.open(f"{address}/api/streams")
    assert refused.value.code == 401
    assert monitor.interrupt() == 0, monitor.report()


def test_files_that_cannot_be_used_are_refused_with_a_remedy_before_anything_starts(stage):
    made, key = certificate(stage.folder, "own")
    other, other_key = certificate(stage.folder, "other")
    nothing = stage.folder / "nothing.pem"
    text = stage.folder / "text.pem"
    text.write_text("no certificate\n")
    broken = stage.folder / "broken.pem"
    broken.write_text("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")
    locked = stage.folder / "locked.pem"
    lock = ["openssl", "pkey", "-in", key, "-aes256", "-passout", "pass:secret", "-out", locked]
    subprocess.run(lock, check=True, capture_output=True)
    wrong = {
        (nothing, key): ("nothing.pem: No such file", "relative to the folder"),
        (text, key): ("it contains no certificate", "BEGIN CERTIFICATE"),
        (broken, key): ("broken.pem: invalid peer certificate", "BEGIN CERTIFICATE"),
        (made, text): ("it contains no private key, or only one with a passphrase", "openssl pkey"),
        (made, locked): ("it contains no private key, or only one with a passphrase", "openssl pkey"),
        (made, other_key): ("it is the key of another certificate", "the certificate must come first"),
        (key, made): ("it contains no certificate", "BEGIN CERTIFICATE"),
    }
    for (one, two), (reason, remedy) in wrong.items():
        ran = stage.ask("run", stage.study(settings(one, two)))
        said = " ".join(ran.stderr.replace("│", " ").split())
        assert ran.returncode != 0 and reason in said and remedy in said, ran.stderr
    alone = stage.ask("run", stage.study(f'{STUDY}certificate = "{made}"\n'))
    assert alone.returncode != 0 and "a certificate needs its private key" in alone.stderr, alone.stderr
