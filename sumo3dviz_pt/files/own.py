"""Folders that nobody but the user can have written to."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from sumo3dviz_pt.errors import ConfigError


def own_folder(path: Path) -> Path:
    """Make a folder that only this user reads and writes, or make sure that it is one.

    Args:
        path: In a folder that others may write to, such as the temporary one.

    Raises:
        ConfigError: If somebody else made it, or may have written to it.
        OSError: If it cannot be made.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    path.mkdir(mode=0o700, exist_ok=True)
    if os.name == "nt":  # temporary folders are the user's own there
        return path
    found = path.lstat()
    if not stat.S_ISDIR(found.st_mode):
        why = "it is a link"
    elif found.st_uid != os.getuid():
        why = "it belongs to somebody else"
    elif found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        why = "others may write to it"
    else:
        path.chmod(0o700)
        return path
    raise ConfigError(f"the folder {path} is not used, because {why}", key="folder")
