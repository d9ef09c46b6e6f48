"""What there is of a film's frame to compare: its layers, its light, and its picture as it is seen.

Layers are of the rays through the pixels' centres, so that they are the same bytes wherever two
scenes are the same. Radiance is as it is stored: with one seed, pixels are the same bytes where
no light path met anything else. The picture is the film's own, as people see it but for
overlays.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.job.settings import LayerName
from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.pipeline.films.frames import frame_file, frames_folder
from sumo3dviz_pt.pipeline.layers.places import beside
from sumo3dviz_pt.pipeline.layers.read import Camera, read_frame
from sumo3dviz_pt.pipeline.overlays.files import plain_twin

COUNTED: LayerName = "instance"
"""The layer that says which thing each pixel shows."""

LAYERS: tuple[LayerName, ...] = (COUNTED, "depth", "normals", "albedo")
"""The layers that are compared, as a scene file asks for them."""

SKY = "sky"
"""What pixels show that show no thing."""


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """A frame of a film.

    Attributes:
        things: What each pixel shows, as numbers that are the same in all films, (h, w).
        names: Of those numbers.
        labels: Of those names, such as `vegetation`.
        layers: `depth` (h, w) [m], `normals` and `albedo` (h, w, 3).
        radiance: With lamps that are seen directly, in units of white, (h, w, 3); None if the frame
            is gone.
        picture: Of the film, (h, w, 3) in 0 .. 255.
        rays: Unit vectors from the eye, east, north and up, (h, w, 3).
        clear: Whether nothing in the air scatters light: no fog, rain or snowfall.
        overlaid: The same picture with overlays, (h, w, 3) in 0 .. 255; None where it has none.
    """

    things: NDArray[np.int64]
    names: Mapping[int, str]
    labels: Mapping[str, str]
    layers: Mapping[str, Image]
    radiance: Image | None
    picture: NDArray[np.uint8]
    rays: Floats
    clear: bool = True
    overlaid: NDArray[np.uint8] | None = None

    @property
    def delivered(self) -> NDArray[np.uint8]:
        """The picture that people see, (h, w, 3) in 0 .. 255."""
        return self.picture if self.overlaid is None else self.overlaid


def read_evidence(
    film: Path, number: int, account: Mapping[str, Any], *, unexposed: bool = False
) -> Evidence:
    """Return what there is of a frame.

    Args:
        film: The film.
        number: The frame's.
        account: The film's.
        unexposed: Whether light is told before exposure, because that may differ.

    Raises:
        InputError: If layers or the film's picture are missing or damaged.
    """
    from sumo3dviz_pt.video.picture import film_picture

    seen = read_frame(beside(frames_folder(film)), number)
    things = np.asarray(seen.layers[COUNTED], dtype=np.int64)
    height, width = things.shape
    rate = Fraction(str(account["frame_rate"]))
    plain, overlays = without_overlays(film), account.get("overlays")
    before = int(overlays["frames_before"]) if overlays else 0
    names = {int(key): thing.name for key, thing in seen.things.items()} | {0: SKY}
    return Evidence(
        things,
        names,
        {SKY: SKY, **{thing.name: thing.label for thing in seen.things.values()}},
        {name: seen.layers[name] for name in LAYERS if name != COUNTED},
        _radiance(film, number, 0.0 if unexposed else float(account["exposure"])),
        film_picture(plain, float(number / rate), size=(width, height)),
        _rays(seen.camera),
        _is_clear(account),
        film_picture(film, float((number + before) / rate), size=(width, height))
        if plain != film
        else None,
    )


def _is_clear(account: Mapping[str, Any]) -> bool:
    """Return whether a film's air scatters no light that is seen before the sky."""
    weather = account.get("scene", {}).get("weather") or {}
    return not any(weather.get(key) for key in ("fog", "rain", "snow", "course", "preset"))


def _rays(camera: Camera) -> Floats:
    """Return unit vectors from the eye through the pixels' centres, (h, w, 3)."""
    (width, height), (across, down) = camera.size, camera.centre
    columns, rows = np.meshgrid(np.arange(width), np.arange(height))
    left, up = (across - columns) / camera.focal, (down - rows) / camera.focal
    rays = np.stack([np.ones_like(left), left, up], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    return np.asarray(rays @ camera.world_from_camera.matrix[:3, :3].T)


def without_overlays(film: Path) -> Path:
    """Return the film whose pictures are its frames: the twin without overlays, if it has one."""
    twin = plain_twin(film)
    return twin if twin.is_file() else film


def _radiance(film: Path, number: int, exposure: float) -> Image | None:
    """Return a stored frame's radiance in units of white; None if it is gone."""
    from sumo3dviz_pt.image.exr import read_layers

    path = frame_file(frames_folder(film), number)
    if not path.is_file():
        return None
    layers, _ = read_layers(path)
    # Light of lamps that are seen directly is stored apart where frames help each other.
    radiance = layers["radiance"] + layers.get("excess", np.float32(0.0))
    return np.asarray(radiance * np.float32(2.0**exposure))


def compared_frames(count: int, wanted: int) -> list[int]:
    """Return the numbers of frames that are compared, evenly over a film, ends included.

    Args:
        count: Of the film's frames, at least 1.
        wanted: How many, at least 1.
    """
    if wanted == 1:
        return [count // 2]
    return sorted({round(n) for n in np.linspace(0, count - 1, min(wanted, count)).tolist()})


def check_same_size(one: Evidence, other: Evidence, film: Path) -> None:
    """Refuse pictures that cannot be laid one over the other.

    Raises:
        InputError: If they differ in size.
    """
    if one.things.shape != other.things.shape:
        raise InputError("has layers of another size than its partner", file=film)
