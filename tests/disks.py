"""A disk that stands still or refuses, for one program: see `disk/trouble.c`."""

import errno
import subprocess
from pathlib import Path

SOURCE = Path(__file__).parent / "disk/trouble.c"


class Disk:
    """What lies below a folder, for the programs that are started with its `env`."""

    def __init__(self, library: Path, below: Path, flags: Path):
        below.mkdir(parents=True)
        flags.mkdir()
        self.below, self._flags = below, flags
        self.env = {
            "LD_PRELOAD": str(library),
            "TROUBLE_BELOW": str(below.resolve()),
            "TROUBLE_FLAGS": str(flags),
        }

    def stall(self) -> None:
        """From now on whoever writes there waits."""
        (self._flags / "stalls").touch()

    def refuse(self, number: int = errno.EIO) -> None:
        """From now on writing there fails with this error."""
        complete = self._flags / "refuses.new"
        complete.write_text(str(number))
        complete.rename(self._flags / "refuses")

    def work(self) -> None:
        """From now on it is as any disk."""
        for flag in ("stalls", "refuses"):
            (self._flags / flag).unlink(missing_ok=True)


def built(folder: Path) -> Path:
    """The library, compiled."""
    library = folder / "trouble.so"
    command = ["cc", "-shared", "-fPIC", "-O1", "-o", library, SOURCE, "-ldl"]
    subprocess.run(command, check=True)
    return library
