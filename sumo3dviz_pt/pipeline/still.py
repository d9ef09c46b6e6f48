"""A rendered picture: developed, saved, shown in notebooks."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.files.atomic import check_place, check_spared
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.random import frame_seed

if TYPE_CHECKING:
    from sumo3dviz_pt.image.optics import Optics
    from sumo3dviz_pt.image.response import Response
    from sumo3dviz_pt.render.session import Rendered


@dataclass(frozen=True, slots=True, eq=False)
class Still:
    """A picture.

    Attributes:
        radiance: Linear sRGB primaries, scene units, (h, w, 3).
        exposure: EV at which to develop it.
        tone: Tone curve's name.
        glare: Share of light that the lens spreads.
        half: Whether an EXR of it is stored in half precision.
        provenance: What it was made from.
        rendered: The renderer's own account.
        optics: What happens to light in the camera; None is nothing.
        reads: The files that it was made from.
    """

    radiance: Image
    exposure: float
    tone: str
    glare: float
    half: bool
    provenance: dict[str, Any]
    rendered: Rendered
    optics: Optics | None = None
    reads: tuple[Path, ...] = ()

    @property
    def time(self) -> float:
        """What it shows: SUMO's time [s]."""
        return float(self.provenance["time"])

    def __repr__(self) -> str:
        height, width = self.radiance.shape[:2]
        made = self.provenance
        return f"<Still {width}x{height}, {made['camera']} at {made['time']:g} s>"

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray[Any, Any]:
        """The developed picture, as `plt.imshow(still)` takes it, (h, w, 3)."""
        return np.array(self.develop(), dtype=dtype)

    def develop(self) -> np.ndarray[Any, np.dtype[np.uint8]]:
        """8-bit sRGB pixels, (h, w, 3)."""
        from sumo3dviz_pt.image.tonemap import develop

        radiance = self.radiance
        if self.optics is not None:
            seed = frame_seed(int(self.provenance["seed"]), self.time)
            radiance = self.optics.on(radiance, exposure=self.exposure, seed=seed)
        return develop(
            radiance,
            exposure=self.exposure,
            tone=self.tone,
            glare=self.glare,
            response=response_of(self.provenance),
        )

    def save(self, path: str | Path, *, overwrite: bool = True) -> None:
        """Write a .png (developed) or an .exr (radiance).

        Args:
            path: Where to.
            overwrite: Whether a picture that exists there may go, as everywhere in Python.

        Raises:
            ConfigError: As `still -o` refuses a place: the suffix is another one, the folder is
                missing, something that may not go has that name, or the scene reads that file.
        """
        from sumo3dviz_pt.job.yaml12 import as_path

        path = as_path(path, key="path")
        check_target(path, suffixes=(".png", ".exr"), overwrite=True)
        if not overwrite:
            check_free(path, option="overwrite=True")
        check_spared(path, self.reads)
        if path.suffix.lower() == ".exr":
            from sumo3dviz_pt.image.exr import PROVENANCE, write_exr

            attributes = {PROVENANCE: self._account}
            write_exr(path, self.rendered.layers, half=self.half, attributes=attributes)
        else:
            from sumo3dviz_pt.image.png import write_png

            write_png(path, self.develop(), text={"provenance": self._account})

    @property
    def _account(self) -> str:
        """What it was made from, as text."""
        return json.dumps(self.provenance, sort_keys=True)

    def _repr_png_(self) -> bytes:
        """A PNG file, which is how notebooks show it."""
        from sumo3dviz_pt.image.png import encoded

        return encoded(self.develop(), text={"provenance": self._account}, level=6)


def response_of(account: Mapping[str, Any], name: str | None = None) -> Response | None:
    """Return what a camera adds to a picture, with the picture's own seed; None adds nothing.

    Corners get darker only where a picture is what one eye sees through a perspective lens:
    others have no corners of their own, or several of them.

    Args:
        account: What the picture was made from.
        name: The response, instead of the account's own.

    Raises:
        ConfigError: If there is none of that name.
    """
    from sumo3dviz_pt.image.response import response_named

    response = response_named(str(account.get("response", "none")) if name is None else name)
    if response is None:
        return None
    cameras = (account.get("scene") or {}).get("cameras") or {}
    lens = (cameras.get(account.get("camera")) or {}).get("lens") or {}
    plain = lens.get("projection", "perspective") == "perspective"
    single = plain and lens.get("stereo", "none") == "none"
    seed = frame_seed(int(account.get("seed", 0)), float(account.get("time", 0.0)))
    return replace(response, seed=seed, fall=response.fall if single else 0.0)


def check_target(path: Path, *, suffixes: tuple[str, ...], overwrite: bool = False) -> None:
    """Refuse a place that cannot or must not be written to, before any work is done.

    Args:
        path: What will be written.
        suffixes: One of them it must have.
        overwrite: Whether a file that exists may go.

    Raises:
        ConfigError: If suffix or folder is wrong, the folder cannot be written to, or the file
            exists and may not go.
    """
    if path.suffix.lower() not in suffixes:
        raise ConfigError(f"{path} must end in {' or '.join(suffixes)}", key="output")
    check_writable(path)
    if not overwrite:
        check_free(path)


def check_writable(path: Path) -> None:
    """Refuse a file that cannot be written, before any work is done.

    Raises:
        ConfigError: If its folder is missing or read-only, or a folder has its name.
    """
    if not path.parent.is_dir():
        raise ConfigError(f"there is no folder {path.parent}; create it first", key="output")
    if path.is_dir():
        raise ConfigError(f"{path} cannot be written to", key="output")
    check_place(path)


def check_free(*paths: Path, option: str = "--overwrite") -> None:
    """Refuse to overwrite anything that exists.

    Args:
        paths: What will be written.
        option: Of the command line that allows it, for the message.

    Raises:
        ConfigError: If one of them exists.
    """
    for path in paths:
        if path.exists():
            raise ConfigError(
                f"{path} exists already; give another name, or {option} to replace it",
                key="output",
            )
