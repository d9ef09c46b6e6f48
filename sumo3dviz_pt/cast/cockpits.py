"""Opened vehicles for cameras inside them, and the needles on their dashboards."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.cast.bodies import Body
from sumo3dviz_pt.library.vehicles.interior.cutaway import Cabin, cutaway, has_dashboard
from sumo3dviz_pt.library.vehicles.interior.dials import NEEDLE, dial_middles, needle, needle_angles
from sumo3dviz_pt.model.geometry import Floats, Transform
from sumo3dviz_pt.model.scene import Mover, Prototype
from sumo3dviz_pt.model.traffic import RAIL_CLASSES

_UNSTEERED = frozenset({"ship", "aircraft", "drone"})
"""What has neither a dashboard nor mirrors like those of cars and lorries, nor a wiped pane."""

_BOXES = frozenset({"container", "cable_car"})
"""The same, without a deck or nose before the eye."""

_BARS = frozenset({"rickshaw"})
"""What is steered with a handlebar of its own behind a windscreen."""


@dataclass(frozen=True, slots=True, eq=False)
class Cockpit:
    """A body that a camera sits in.

    Attributes:
        body: What is left of it.
        axes: Of the needles on its dashboard, in its frame, unscaled, (n, 3) [m].
    """

    body: Prototype
    axes: Floats

    @property
    def prototypes(self) -> dict[str, Prototype]:
        """What it is drawn with, by name."""
        made = needle() if len(self.axes) else None
        return {self.body.name: self.body, **({} if made is None else {made.name: made})}

    @property
    def names(self) -> tuple[str, ...]:
        """Of the prototypes that it is drawn with, one for each part."""
        return (self.body.name, *[NEEDLE] * len(self.axes))

    def needles(self, cabin: Mover, *, speed: float) -> Iterator[Mover]:
        """Yield the needles, turned as a speed turns them.

        Args:
            cabin: The opened body at its place.
            speed: Of the vehicle [m/s].
        """
        for number, (axis, angle) in enumerate(zip(self.axes, needle_angles(speed), strict=False)):
            placed = cabin.world_from_body @ Transform.from_pose(axis, roll=angle)
            part = f"needle{number}"
            yield replace(cabin, prototype=NEEDLE, part=part, world_from_body=placed)


def cabin_of(body: Body) -> Cabin:
    """Return what stands before who steers a body."""
    if body.vclass in _UNSTEERED:
        return Cabin.NONE
    if body.vclass in _BOXES:
        return Cabin.BOX
    if body.vclass in _BARS:
        return Cabin.BARS
    return Cabin.RAIL if body.vclass in RAIL_CLASSES else Cabin.ROAD


def has_windscreen(body: Body) -> bool:
    """Return whether who steers a body looks through a pane with wipers."""
    cabin = cabin_of(body)
    return cabin is Cabin.BARS or has_dashboard(float(body.size[1]), cabin)


def open_cockpit(body: Body, *, left_hand: bool, wipers: bool) -> Cockpit:
    """Open a vehicle for a camera.

    Args:
        body: What it shows.
        left_hand: Whether traffic keeps left and drivers sit on the right.
        wipers: Whether wipers rest on its windscreen.
    """
    cowl, eye = body.seat.cowl / body.scale, body.seat.eye / body.scale
    eye = eye * [1.0, -1.0 if left_hand else 1.0, 1.0]
    cowl_x, belt = float(cowl[0]), float(cowl[2])
    opened = cutaway(
        body.prototype, cowl=cowl_x, belt=belt, eye=eye, wipers=wipers, cabin=cabin_of(body)
    )
    has_dials = any(lamp.role == "dials" for lamp in opened.lamps)
    return Cockpit(opened, dial_middles(eye) if has_dials else np.zeros((0, 3)))
