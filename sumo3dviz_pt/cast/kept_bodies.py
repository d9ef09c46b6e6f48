"""Bodies that take long to build: kept in the user's cache under all that they depend on."""

from __future__ import annotations

import contextlib
import hashlib
import logging
import shutil
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

from sumo3dviz_pt import catalog
from sumo3dviz_pt.files.kept import Files, keep, read_whole

_LOG = logging.getLogger(__name__)

_DIGITS = 16  # of a digest
_KEPT = 30 * 86_400.0  # how long a body of another version stays [s]


def kept_folder(entry: catalog.Entry, family: str) -> Path:
    """Return where a body lies in the cache: its recipe and our code are in the name.

    Args:
        entry: Of the catalogue.
        family: Such as `vehicles`.
    """
    digest = hashlib.blake2b(catalog.code_digest("library"), digest_size=_DIGITS // 2)
    for path in catalog.recipe_files(entry):
        digest.update(path.read_bytes())
    return catalog.cache_root() / family / f"{entry.name}-{digest.hexdigest()}"


def kept_files(folder: Path, build: Callable[[], Files]) -> Files:
    """Return a body's files from the cache; build and keep them if they are not whole.

    Args:
        folder: From `kept_folder`.
        build: Makes the files.
    """
    files = read_whole(folder)
    if files is None:
        files = build()
        try:
            keep(folder, files)
            _forget(folder)
        except OSError as error:
            _say_unkept(folder.parent, error.strerror or str(error))
    return files


@cache
def _say_unkept(root: Path, why: str) -> None:
    """Say once that nothing can be kept."""
    _LOG.warning(
        "%s cannot be written (%s): bodies are built anew each time;"
        " SUMO3DVIZ_PT_CACHE names another folder for them",
        root,
        why,
    )


def _forget(target: Path) -> None:
    """Remove what older recipes, older code or killed processes left; younger may be in use."""
    name = target.name[: -_DIGITS - 1]
    left = [*target.parent.glob(f"{name}-{'?' * _DIGITS}"), *target.parent.glob(".b*-*")]
    for folder in left:
        # Another process may have been faster.
        with contextlib.suppress(FileNotFoundError):
            if folder != target and time.time() - folder.stat().st_mtime > _KEPT:
                shutil.rmtree(folder, ignore_errors=True)
