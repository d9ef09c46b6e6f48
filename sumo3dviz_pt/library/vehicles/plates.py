"""Number plates: what they say, where they are on a body, and the letters on them.

A plate says two letters, three digits and three letters, as in no country, and follows from its
vehicle's id alone. I, O and Q are left out, which look like 1 and 0.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from sumo3dviz_pt.library.street.lettering import lettering
from sumo3dviz_pt.model.geometry import Floats, Mesh, Transform
from sumo3dviz_pt.model.scene import Part, Poses, Prototype

LETTER = "plate letter"
"""Name of the body that shows one character of a plate, as one of its poses."""

LETTERS = 8
"""On each plate."""

_ABC, _DIGITS = "ABCDEFGHJKLMNPRSTUVWXYZ", "0123456789"
_FORMAT = (_ABC, _ABC, _DIGITS, _DIGITS, _DIGITS, _ABC, _ABC, _ABC)
_CHARACTERS = _ABC + _DIGITS
_CENTRES = np.array([-4.0, -3.0, -1.5, -0.5, 0.5, 2.0, 3.0, 4.0])  # of the letters, in steps
_STEPS = 9.0  # that a line of letters takes
_WIDE, _SHIFT = 0.86, 0.035  # width of the line and its middle to the right, shares of the plate's
_TALL, _TALLEST = 0.66, 0.22  # height of letters: share of the plate's height, and of its width
_BROAD = 0.82  # width of the broadest letter, in steps
_OUT = 0.0012  # of letters before the plate [m]
_WIDEST = 0.7  # a plate [m]
_MATERIAL = "plate"


@dataclass(frozen=True, slots=True, eq=False)
class Plate:
    """A number plate on a body.

    Attributes:
        middle: Of its face, in the body's frame, (3,) [m].
        forward: Whether it looks ahead; else back.
        size: Width and height [m].
    """

    middle: Floats
    forward: bool
    size: tuple[float, float]

    def letters(self) -> Iterator[Transform]:
        """Yield where its letters are in the body's frame, as a reader reads them."""
        width, height = self.size
        step = _WIDE * width / _STEPS
        tall = min(_TALL * height, _TALLEST * width)
        for centre in _CENTRES:
            aside = _SHIFT * width + centre * step
            # Seen from ahead, the reader's right is the vehicle's left.
            at = (_OUT, aside, 0.0)
            turned = Transform.from_pose(self.middle, yaw=0.0 if self.forward else np.pi)
            yield turned @ Transform.from_pose(at, scale=(1.0, _BROAD * step, tall))


def plate_text(name: str) -> str:
    """Return what the plate of a vehicle says.

    Args:
        name: The vehicle's id; nothing else counts.
    """
    number = int.from_bytes(hashlib.blake2b(name.encode("utf-8"), digest_size=12).digest(), "big")
    text = []
    for characters in _FORMAT:
        number, place = divmod(number, len(characters))
        text.append(characters[place])
    return "".join(text)


def letter_phase(character: str) -> float:
    """Return the phase at which the body of a letter shows a character, [0, 1)."""
    return _CHARACTERS.index(character) / len(_CHARACTERS)


@cache
def letter() -> Prototype:
    """Build the body that shows a character: one wide and high, upright, it faces +x."""
    drawn = [lettering(c, height=1.0, weight=0.15, gap=0.3) for c in _CHARACTERS]
    broadest = max(float(np.ptp(shape[..., 0])) for shape in drawn)
    most = max(len(shape) for shape in drawn)
    # All have as many triangles; those that a character does not need have no area.
    poses = np.stack([_placed(shape / [broadest, 1.0], most) for shape in drawn])
    normals = np.broadcast_to([1.0, 0.0, 0.0], poses.shape[1:])
    faces = np.arange(3 * most).reshape(-1, 3)
    parts = (Part(Mesh(poses[0], faces, normals.copy()), "plate_ink"),)
    shapes = np.concatenate([poses[:1], poses])
    turned = np.broadcast_to(normals, shapes.shape).copy()
    return Prototype(LETTER, parts, (), poses=Poses(shapes, turned, steady=True))


def _placed(triangles: Floats, count: int) -> Floats:
    """Corners of a character around the origin, as if it had `count` triangles, (3 count, 3)."""
    flat = triangles.reshape(-1, 2)
    flat = flat - 0.5 * (flat.min(axis=0) + flat.max(axis=0))
    flat = np.concatenate([flat, np.repeat(flat[-1:], 3 * count - len(flat), axis=0)])
    return np.column_stack([np.zeros(len(flat)), flat])


def plates_of(prototype: Prototype) -> tuple[Plate, ...]:
    """Find the number plates of a body: what is made of their material at its front and rear."""
    points = [part.mesh.vertices for part in prototype.parts if part.material == _MATERIAL]
    if not points:
        return ()
    bounds = np.stack([p.mesh.bounds[:, 0] for p in prototype.parts if len(p.mesh.vertices)])
    middle = 0.5 * (bounds[:, 0].min() + bounds[:, 1].max())
    corners = np.concatenate(points)
    ahead = corners[:, 0] > middle
    ends = ((corners[ahead], True), (corners[~ahead], False))
    plates = (_plate(some, forward) for some, forward in ends if len(some))
    return tuple(plate for plate in plates if plate.size[0] < _WIDEST)


def _plate(corners: Floats, forward: bool) -> Plate:
    """The plate that has some corners, (n, 3) [m]."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle = 0.5 * (low + high)
    middle[0] = high[0] if forward else low[0]
    return Plate(middle, forward, (float(high[1] - low[1]), float(high[2] - low[2])))
