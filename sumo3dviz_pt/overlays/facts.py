"""What overlays are drawn from: the views, road users and lanes of a film, as values and JSON.

They lie beside the stored frames, so that a film can be developed again with its overlays and
without its simulation.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sumo3dviz_pt.job.overlays import OverlaySettings
from sumo3dviz_pt.model.geometry import Floats, Ints, Transform, frozen
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View

_DIGITS = 4  # of metres and radians: a tenth of a millimetre
_EXACT = 12  # of a camera's direction


@dataclass(frozen=True, slots=True, eq=False)
class FrameFacts:
    """What one frame shows.

    Attributes:
        time: SUMO's [s].
        view: The camera.
        users: Rows of `FilmFacts.keys`, (n,).
        poses: Front's middle on the ground [m], yaw, pitch [rad] and speed [m/s], (n, 6).
        around: Everyone on the map: x, y [m], yaw [rad], length, width [m], speed [m/s], (k, 6).
    """

    time: float
    view: View
    users: Ints
    poses: Floats
    around: Floats


@dataclass(frozen=True, slots=True, eq=False)
class FilmFacts:
    """What a film shows.

    Attributes:
        settings: Which overlays it has.
        size: Width, height [px].
        rate: Frames per second of film.
        keys: Of all road users that a frame names, such as `vehicle:flow_0.3`.
        sizes: Their length, width and height, (v, 3) [m].
        ridden: Key of the road user that the camera rides with, or empty.
        frames: All of the film's.
        paths: Where those with trails drove, by key: time [s], place [m], speed [m/s], (n, 5).
        lanes: Centre lines of the map, (n, 2) each [m].
        widths: Of these lanes [m].
        inside: Whether the camera sits in the one that it rides with.
    """

    settings: OverlaySettings
    size: tuple[int, int]
    rate: float
    keys: Sequence[str]
    sizes: Floats
    ridden: str
    frames: Sequence[FrameFacts]
    paths: Mapping[str, Floats] = field(default_factory=dict)
    lanes: Sequence[Floats] = ()
    widths: Sequence[float] = ()
    inside: bool = False

    @property
    def seconds(self) -> float:
        """Length of the film, without what stands before and after [s]."""
        return len(self.frames) / self.rate

    def film_time(self, number: int) -> float:
        """Return the film's time of a frame [s]."""
        return number / self.rate


def named(key: str) -> str:
    """Return SUMO's id of a road user's key."""
    return key.partition(":")[2] or key


def facts_text(film: FilmFacts) -> str:
    """Return facts as JSON."""
    return json.dumps(
        {
            "settings": film.settings.model_dump(mode="json", by_alias=True),
            "size": list(film.size),
            "rate": film.rate,
            "keys": list(film.keys),
            "sizes": _rounded(film.sizes),
            "ridden": film.ridden,
            "inside": film.inside,
            "frames": [_plain(frame) for frame in film.frames],
            "paths": {key: _rounded(path) for key, path in film.paths.items()},
            "lanes": [_rounded(lane, 2) for lane in film.lanes],
            "widths": [round(width, 2) for width in film.widths],
        }
    )


def facts_of(text: str | bytes) -> FilmFacts:
    """Return facts from their JSON.

    Raises:
        ValueError: If the text is damaged.
    """
    try:
        said = json.loads(text)
        width, height = said["size"]
        return FilmFacts(
            OverlaySettings.model_validate(said["settings"]),
            (int(width), int(height)),
            float(said["rate"]),
            tuple(map(str, said["keys"])),
            frozen(said["sizes"]).reshape(-1, 3),
            str(said["ridden"]),
            tuple(_frame(frame) for frame in said["frames"]),
            {key: frozen(path).reshape(-1, 5) for key, path in said["paths"].items()},
            tuple(frozen(lane).reshape(-1, 2) for lane in said["lanes"]),
            tuple(map(float, said["widths"])),
            bool(said["inside"]),
        )
    except (KeyError, TypeError) as error:
        raise ValueError(f"does not say what overlays show ({error})") from error


def _plain(frame: FrameFacts) -> dict[str, Any]:
    """Return what a frame shows as plain values."""
    return {
        "time": frame.time,
        "camera": _rounded(frame.view.world_from_camera.matrix[:3], _EXACT),
        "lens": frame.view.lens.as_dict(),
        "users": frame.users.tolist(),
        "poses": _rounded(frame.poses),
        "around": _rounded(frame.around, 2),
    }


def _frame(said: Mapping[str, Any]) -> FrameFacts:
    """Return a frame from plain values."""
    matrix = np.eye(4)
    matrix[:3] = said["camera"]
    return FrameFacts(
        float(said["time"]),
        View(Transform(matrix), Lens.from_dict(said["lens"])),
        frozen(said["users"], np.int64),
        frozen(said["poses"]).reshape(-1, 6),
        frozen(said["around"]).reshape(-1, 6),
    )


def _rounded(values: Floats, digits: int = _DIGITS) -> list[Any]:
    """Return numbers without more digits than they need."""
    plain: list[Any] = np.round(values, digits).tolist()
    return plain
