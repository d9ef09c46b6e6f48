"""Names of SUMO's output files, to which a configuration can add something."""

from __future__ import annotations

import glob
from dataclasses import dataclass
from pathlib import Path

_CLOCK = "TIME"
"""A word in what is added that SUMO replaces by the date and time of its run."""


@dataclass(frozen=True, slots=True)
class Affixes:
    """What SUMO adds to the names of all outputs.

    Attributes:
        prefix: Before the name (`--output-prefix`).
        suffix: Before the extension (`--output-suffix`).
    """

    prefix: str = ""
    suffix: str = ""

    def written(self, path: Path) -> Path:
        """Return the file that SUMO writes for a name; of several runs, that of the last.

        Where it does not exist but a file of the plain name does, that is returned.
        """
        if not self.prefix and not self.suffix:
            return path
        name = self.prefix + _before_extension(path, self.suffix)
        pattern = "*".join(glob.escape(part) for part in name.split(_CLOCK))
        found = sorted(path.parent.glob(pattern), key=lambda file: (file.stat().st_mtime, file))
        if found:
            return found[-1]
        return path if path.is_file() else path.parent / name


def _before_extension(path: Path, suffix: str) -> str:
    """Return a file's name with something before its extension, as SUMO puts it."""
    extension = "".join(path.suffixes[-2:] if path.suffix == ".gz" else path.suffixes[-1:])
    return path.name.removesuffix(extension) + suffix + extension
