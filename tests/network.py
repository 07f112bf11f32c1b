"""A network of one's own for each process that runs tests."""

import ctypes
import os
import subprocess

CLONE_NEWNET = 0x40000000


def enter_own() -> None:
    """Moves this thread, and all that it starts from now on, to a network that has a loopback alone."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(CLONE_NEWNET) != 0:
        raise OSError(ctypes.get_errno(), "unshare: no network of one's own can be had here")
    for command in ("ip link set lo up multicast on", "ip route add 224.0.0.0/4 dev lo"):
        subprocess.run(command.split(), check=True)


def is_isolated() -> bool:
    """Whether tests run on a network of their own, as `tests/isolated` gives them."""
    return bool(os.environ.get("TEST_ISOLATED"))
