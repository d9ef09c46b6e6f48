"""What SUMO makes of the names of files: variables are replaced, and outputs get affixes."""

from __future__ import annotations

import glob
import os
import re
from dataclasses import dataclass
from pathlib import Path

_CLOCK = "TIME"
"""A word in what is added that SUMO replaces by the date and time of its run."""

_ANY = "*"
"""What stands for something that each run of SUMO has anew."""

_VARIABLE = re.compile(r"\$\{(.+?)\}")
_OF_A_RUN = frozenset({"LOCALTIME", "UTC", "PID"})


def replaced(text: str) -> str:
    """Return a file's name with variables replaced as SUMO does it.

    `~` is the user's folder, `${NAME}` a variable of the environment and nothing where it is not
    set, and `${LOCALTIME}`, `${UTC}` and `${PID}`, which each run has anew, are `*`.
    """
    if text.startswith("~"):
        text = "${HOME}" + text[1:]
    return _VARIABLE.sub(lambda match: _ANY if match[1] in _OF_A_RUN else _value(match[1]), text)


def not_set(text: str) -> list[str]:
    """Return the variables that a file's name holds and that the environment does not."""
    names = [name for name in _VARIABLE.findall(text) if name not in _OF_A_RUN]
    return [name for name in names if name not in os.environ]


def _value(name: str) -> str:
    """Return the value of a variable, or nothing."""
    if name == "HOME" and name not in os.environ:
        return os.environ.get("USERPROFILE", "")
    return os.environ.get(name, "")


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
        if not self.prefix and not self.suffix and _ANY not in str(path):
            return path
        added = [text.replace(_CLOCK, _ANY) for text in (self.prefix, self.suffix)]
        wanted = path.parent / (added[0] + _before_extension(path, added[1]))
        base = next(folder for folder in wanted.parents if _ANY not in str(folder))
        rest = str(wanted.relative_to(base))
        pattern = _ANY.join(glob.escape(part) for part in rest.split(_ANY))
        files = sorted(base.glob(pattern), key=lambda file: (file.stat().st_mtime, file))
        if files:
            return files[-1]
        return path if path.is_file() else wanted


def _before_extension(path: Path, suffix: str) -> str:
    """Return a file's name with something before its extension, as SUMO puts it."""
    extension = "".join(path.suffixes[-2:] if path.suffix == ".gz" else path.suffixes[-1:])
    return path.name.removesuffix(extension) + suffix + extension
