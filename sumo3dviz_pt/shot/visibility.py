"""Decides which road users a shot draws, and how: what a camera sees, or casts light into it.

Everything here is a pure function of the whole shot, never of what was rendered
before, so that any part of a film can be rendered alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.camera_path import CameraPath, in_picture, in_view
from sumo3dviz_pt.model.geometry import Bools, Floats, settled

FAR_END = 3000.0
"""Road users farther than this are smaller than a pixel in haze [m]."""

NEAR_END = 250.0
"""Farther road users are drawn by their stand-ins, through a lens of 50 degrees or wider [m]."""

FULL_END = 32.0
"""Nearer road users are drawn in full detail through a lens of 50 degrees [m]."""

_LENS = float(np.tan(np.radians(25.0)) * np.hypot(1.0, 9 / 16))
_LONGEST = 14.0  # reach of most bodies from their front bumper [m]
_SHADOW = 40.0  # reach of most bodies and, at most hours, their shadows [m]
_CAST = 25.0  # reach of shadows beyond the rear of longer bodies [m]

MOST_NEAR = 120
"""Road users in detail in one frame, at most."""

MOST_FULL = 16
"""Road users in full detail in one frame, at most: wheels are parts of their own."""

MOST_LETTERED = 24
"""Road users whose number plates can be read in one frame, at most."""

_LEGIBLE = 1.5
"""Plates can be read up to this many times as far as there is full detail: farther letters are
lower than three pixels of a picture 1920 wide."""

_CHUNK = 200


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """How road users are drawn, (k, n) each; each in one way at most.

    Attributes:
        near: In detail.
        far: By their stand-ins.
        full: In full detail.
        lettered: With number plates that can be read, near or in full detail.
    """

    near: Bools
    far: Bools
    full: Bools
    lettered: Bools


def choose(
    camera_path: CameraPath,
    alive: Bools,
    positions: Floats,
    *,
    limit: int,
    can_be_full: Bools | None = None,
    lengths: Floats | None = None,
) -> Choice:
    """Choose the nearest visible road users for detail and the others for stand-ins.

    Args:
        camera_path: n times.
        alive: (k, n).
        positions: (k, n, 3) [m]; anything where not alive.
        limit: How many are drawn in detail at once, at most.
        can_be_full: Which road users can be drawn in full detail, (k,); None is none.
        lengths: Of their bodies, (k,) [m]: a train is seen long after its front; None is 0.
    """
    long = np.zeros(len(alive)) if lengths is None else lengths
    places = np.where(alive[..., None], positions, 1e9)
    # Measure distances; a long road user may be near although its front is not.
    beyond = np.maximum(long - _LONGEST, 0.0)[:, None]
    distance = settled(np.maximum(camera_path.away(places) - beyond, 0.0))
    reach = np.maximum(_SHADOW, long + _CAST)[:, None]
    # Choose levels from the coarsest to the finest.
    shown = alive & (distance < FAR_END) & in_view(camera_path, places, radius=reach)
    near = _nearest(distance, among=shown & (distance < near_end(camera_path)), limit=limit)
    full_end = _full_end(camera_path)
    close = near & (distance < _LEGIBLE * full_end)
    close &= in_picture(camera_path, places, radius=np.maximum(_LONGEST, long)[:, None])
    able = close & (distance < full_end)
    able &= False if can_be_full is None else can_be_full[:, None]
    full = _nearest(distance, among=able, limit=MOST_FULL)
    lettered = _nearest(distance, among=close, limit=MOST_LETTERED)
    return Choice(near & ~full, shown & ~near, full, lettered)


def _nearest(distance: Floats, *, among: Bools, limit: int) -> Bools:
    """The nearest few of those that qualify, at each time, (k, n)."""
    ranked = np.where(among, distance, np.inf)
    order = np.argsort(ranked, axis=0, kind="stable")
    rank = np.empty_like(order)
    np.put_along_axis(rank, order, np.arange(len(order))[:, None], axis=0)
    return np.asarray(among & (rank < limit))


def _full_end(camera_path: CameraPath) -> Floats:
    """Where full detail ends, (n,) [m]: a telephoto lens shows it from farther away."""
    return np.clip(FULL_END * _LENS / _slopes(camera_path), 12.0, 120.0)


def reach(length: float) -> float:
    """Return the radius around a front that holds a body of a length [m] and its shadow [m]."""
    return max(_SHADOW, length + _CAST)


def near_end(camera_path: CameraPath) -> Floats:
    """Return where the middle level ends, (n,) [m]: a telephoto lens shows it from farther away."""
    return np.clip(NEAR_END * _LENS / _slopes(camera_path), NEAR_END, 6.0 * NEAR_END)


def _slopes(camera_path: CameraPath) -> Floats:
    """Half the diagonal of what cameras show one metre ahead, (n,) [m]; infinite all around."""
    narrow = camera_path.half_angles < np.pi / 2.0
    slopes = np.where(narrow, np.tan(np.where(narrow, camera_path.half_angles, 0.0)), np.inf)
    if camera_path.parallel is None:
        return slopes
    # How large things look through such a lens is measured by `CameraPath.away` already.
    return np.where(camera_path.parallel > 0.0, _LENS, slopes)


def chunks(count: int) -> Iterator[slice]:
    """Yield stretches of a shot of so many frames that fit into memory."""
    for first in range(0, count, _CHUNK):
        yield slice(first, min(first + _CHUNK, count))
