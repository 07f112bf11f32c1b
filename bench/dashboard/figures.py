"""Figures with their bars."""


class Figures:
    """Prints a line per figure, and remembers whether one missed its bar."""

    def __init__(self):
        self.is_missed = False

    def __call__(self, text: str, is_met: bool) -> None:
        print(text if is_met else f"{text}  MISSED", flush=True)
        self.is_missed |= not is_met

    def exit_code(self) -> int:
        return int(self.is_missed)
