"""A keyboard and a mouse of the kernel (uinput), and somebody who types a password, mends it, and moves and clicks the mouse.

Follows commands on standard input: `plug`, `type`, `point`, `unplug`."""

import fcntl
import os
import struct
import sys
import time

PASSWORD = "xylophonewaltzquick"
ROWS = {"qwertyuiop": 16, "asdfghjkl": 30, "zxcvbnm": 44}
BACKSPACE, LEFT = 14, 0x110
# linux/input-event-codes.h and linux/uinput.h.
EV_SYN, EV_KEY, EV_REL = 0, 1, 2
REL_X, REL_Y, REL_WHEEL = 0, 1, 8
SET_EVENT, SET_KEY, SET_AXIS, SETUP, CREATE, DESTROY = 0x40045564, 0x40045565, 0x40045566, 0x405C5503, 0x5501, 0x5502


class Device:
    """A device of these keys and axes."""

    def __init__(self, name: str, keys, axes=()):
        self.node = os.open("/dev/uinput", os.O_WRONLY)
        for kind in (EV_KEY, *([EV_REL] if axes else [])):
            fcntl.ioctl(self.node, SET_EVENT, kind)
        for request, codes in ((SET_KEY, keys), (SET_AXIS, axes)):
            for code in codes:
                fcntl.ioctl(self.node, request, code)
        fcntl.ioctl(self.node, SETUP, struct.pack("HHHH80sI", 3, 0x1234, 0x5678, 1, name.encode(), 0))
        fcntl.ioctl(self.node, CREATE)

    def send(self, *events: tuple[int, int, int]) -> None:
        for kind, code, value in (*events, (EV_SYN, 0, 0)):
            os.write(self.node, struct.pack("qqHHi", 0, 0, kind, code, value))

    def press(self, code: int, hold_secs=0.05, then_secs=0.09) -> None:
        self.send((EV_KEY, code, 1))
        time.sleep(hold_secs)
        self.send((EV_KEY, code, 0))
        time.sleep(then_secs)

    def close(self) -> None:
        fcntl.ioctl(self.node, DESTROY)
        os.close(self.node)


def code(letter: str) -> int:
    return next(first + row.index(letter) for row, first in ROWS.items() if letter in row)


def main() -> None:
    keyboard = mouse = None
    for line in sys.stdin:
        match line.strip():
            case "plug":
                keyboard = Device("Test keyboard", range(1, 128))
                mouse = Device("Test mouse", [LEFT, LEFT + 1, LEFT + 2], [REL_X, REL_Y, REL_WHEEL])
            case "type":
                for letter in PASSWORD:
                    keyboard.press(code(letter))
                for _ in range(3):
                    keyboard.press(BACKSPACE)
            case "point":
                mouse.send((EV_REL, REL_X, 30), (EV_REL, REL_Y, 40))
                mouse.send((EV_REL, REL_X, -60), (EV_REL, REL_Y, 80))
                mouse.press(LEFT)
                for _ in range(3):
                    mouse.send((EV_REL, REL_WHEEL, 1))
            case "unplug":
                keyboard.close()
                mouse.close()
        print("done", flush=True)


if __name__ == "__main__":
    main()
