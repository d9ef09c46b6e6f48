"""Films on the command line, and their frames, for tests that compare them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.image.exr import read_exr
from sumo3dviz_pt.model.geometry import Image


def run(*arguments: object) -> None:
    """Run a command that succeeds."""
    assert main([str(argument) for argument in arguments]) == 0


def frames_in(folder: Path) -> dict[str, Image]:
    """Return the radiance of all frames in a folder by the names of their files."""
    return {path.name: read_exr(path)[0] for path in sorted(folder.glob("*.exr"))}


def frames_of(film: Path) -> dict[str, Image]:
    """Return the radiance of the frames beside a film by the names of their files."""
    return frames_in(film.with_suffix(".frames"))


def assert_equal_frames(some: Mapping[str, Image], others: Mapping[str, Image]) -> None:
    """Assert that there are frames, and that others have the same ones to the bit."""
    assert some and set(some) <= set(others)
    for name, picture in some.items():
        np.testing.assert_array_equal(picture, others[name], err_msg=name)
