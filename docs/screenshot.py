#!/usr/bin/env python3
"""Draws the screen of `teampulse demo` as docs/demo.svg.

    docs/screenshot.py [--at SECS] [--size COLUMNSxROWS] [--out FILE]

Runs the demo (`TEAMPULSE`, else target/release/teampulse) in a terminal of tmux, waits until its clock
shows SECS, and draws what the terminal shows then: text as text, with the colours of its styles.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from xml.sax.saxutils import escape

ROOT = Path(__file__).resolve().parent.parent
TITLE = (
    "teampulse demo in a terminal: it records; first what needs somebody; then an operator's heart, breath "
    "and skin, each with window, quality and age; five robots with power, battery and link; the log"
)
PLAIN = {"fill": "#d8dee6"}
# By parameter of the sequence, as the terminal's palette has it.
STYLES = {
    "1": {"font-weight": "bold", "fill": "#ffffff"},
    "2": {"fill": "#8b98a7"},
    "31": {"fill": "#ff7b72"},
    "33": {"fill": "#e3b341"},
    "7": {"fill": "#1c2128", "background": "#d8dee6"},
}
CELL, ROW, EDGE, BAR = 7.83, 17, 18, 34


def spans(line):
    """The pieces of a line with their styles."""
    style = {}
    for part in re.split(r"(\x1b\[[0-9;]*m)", line):
        if part.startswith("\x1b["):
            for code in part[2:-1].split(";"):
                style = {**style, **STYLES[code]} if code in STYLES else {} if code in ("", "0") else style
        elif part:
            yield part, style


def drawn(lines, columns, rows):
    width, height = round(columns * CELL + 2 * EDGE), BAR + rows * ROW + 22
    svg = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        f'viewBox="0 0 {width} {height}" role="img" aria-labelledby="title">',
        f'<title id="title">{TITLE}</title>',
        f'<rect width="{width}" height="{height}" rx="9" fill="#1c2128"/>',
        f'<path d="M0 34V9a9 9 0 0 1 9-9H{width - 9}a9 9 0 0 1 9 9V34z" fill="#2d333b"/>',
        '<circle cx="20" cy="17" r="6" fill="#e5534b"/><circle cx="40" cy="17" r="6" fill="#c69026"/>'
        '<circle cx="60" cy="17" r="6" fill="#57ab5a"/>',
        f'<text x="{width / 2:.0f}" y="22" text-anchor="middle" font-family="sans-serif" font-size="13" '
        'fill="#adbac7">teampulse demo</text>',
        '<g font-family="DejaVu Sans Mono, Menlo, Consolas, monospace" font-size="13">',
    ]
    for row, line in enumerate(lines[:rows]):
        column, y = 0, BAR + 26 + row * ROW
        for text, style in spans(line):
            look = {**PLAIN, **style}
            x, length = EDGE + column * CELL, len(text) * CELL
            if background := look.pop("background", None):
                svg.append(f'<rect x="{x:.1f}" y="{y - 13}" width="{length:.1f}" height="{ROW}" fill="{background}"/>')
            if text.strip():
                attributes = " ".join(f'{name}="{value}"' for name, value in look.items())
                svg.append(
                    f'<text x="{x:.1f}" y="{y}" textLength="{length:.1f}" {attributes} '
                    f'xml:space="preserve">{escape(text)}</text>'
                )
            column += len(text)
    return "\n".join([*svg, "</g>", "</svg>", ""])


def captured(binary, at, columns, rows):
    """What the terminal shows when the session is so old, line by line, with the sequences of styles."""
    with tempfile.TemporaryDirectory() as folder:
        tmux = ["tmux", "-S", f"{folder}/socket"]
        demo = f"exec {binary} demo --out {folder}/sessions"
        environment = {**os.environ, "TERM": "xterm-256color", "NO_COLOR": ""}
        new = [*tmux, "-f", "/dev/null", "new-session", "-d", "-x", str(columns), "-y", str(rows), demo]
        subprocess.run(new, check=True, env=environment)
        try:
            shown = []
            for _ in range(10 * (at + 120)):
                time.sleep(0.1)
                pane = subprocess.run(
                    [*tmux, "capture-pane", "-p", "-e", "-N"], check=True, capture_output=True, text=True
                )
                shown = pane.stdout.split("\n")
                elapsed = re.search(r"REC\S* (?:(\d+):)?(\d+):(\d\d)", re.sub(r"\x1b\[[0-9;]*m", "", shown[0]))
                if elapsed:
                    hours, minutes, secs = (int(part or 0) for part in elapsed.groups())
                    if 3600 * hours + 60 * minutes + secs >= at:
                        return shown
            sys.exit("the demo did not get that far:\n" + "\n".join(shown))
        finally:
            subprocess.run([*tmux, "send-keys", "C-c"], check=False)
            for _ in range(100):
                if subprocess.run([*tmux, "has-session"], check=False, capture_output=True).returncode:
                    break
                time.sleep(0.1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--at", type=int, default=124, help="the age of the session [s]")
    parser.add_argument("--size", default="98x32", help="the terminal's size")
    parser.add_argument("--out", type=Path, default=ROOT / "docs/demo.svg")
    given = parser.parse_args()
    columns, rows = (int(number) for number in given.size.split("x"))
    binary = os.environ.get("TEAMPULSE", ROOT / "target/release/teampulse")
    given.out.write_text(drawn(captured(binary, given.at, columns, rows), columns, rows))


if __name__ == "__main__":
    main()
