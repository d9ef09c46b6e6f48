"""Takes pictures for pages: small ones of what moves, large ones that improve of what stands."""

from __future__ import annotations

import time as clock
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.pipeline.live import Live, Size, encoded, joined
from sumo3dviz_pt.viewer.client import Client, Pictured
from sumo3dviz_pt.viewer.mean import Mean
from sumo3dviz_pt.viewer.state import ViewerState, said_of
from sumo3dviz_pt.viewer.walk import Eye

_ROUNDS = 3
"""Number of times to take pictures of until kernels are compiled and recorded."""

_SLOW = 0.15
"""Where a moving picture of half the size takes longer than this, it gets a quarter [s]."""

HALVES, QUARTERS = 2, 4
"""Rows and columns into which a large picture is cut; a small picture has the size of a part."""

_WALKED, _STOOD = 100.0, 20.0
"""Distances after which levels of detail are chosen anew: while a client moves, and while it
stands [m]. Choosing takes as long as a step of traffic."""


@dataclass(frozen=True, slots=True, eq=False)
class _Shown:
    """What the renderer holds now.

    Attributes:
        time: SUMO's [s].
        dynamic: Whether road users are shown.
        cut_open: The vehicle whose body is cut open for the camera in it, or None.
        shot: The built scene.
        place: For which levels of detail were chosen, (3,) [m].
    """

    time: float
    dynamic: bool
    cut_open: str | None
    shot: object
    place: Floats

    def fits(self, other: _Shown) -> bool:
        """Return whether both are the same, wherever they are seen from."""
        seen = (self.time, self.dynamic, self.cut_open)
        return seen == (other.time, other.dynamic, other.cut_open) and self.shot is other.shot


class Projector:
    """Takes pictures of an open scene; one thread may use it."""

    def __init__(self, live: Live, size: Size) -> None:
        """Compile and record what is needed.

        Args:
            live: The scene.
            size: Of large pictures [px].
        """
        self._live, self._size, self._cut = live, size, HALVES
        self._shown: _Shown | None = None
        self.warm_up()

    @property
    def size(self) -> Size:
        """Of large pictures [px]: a multiple of the small ones'."""
        width, height = part_of(self._size, self._cut)
        return self._cut * width, self._cut * height

    def warm_up(self) -> None:
        """Compile and record after the scene was built; choose smaller pictures if that is slow."""
        if self._warmed() > _SLOW and self._cut == HALVES:
            self._cut = QUARTERS
            self._live.resize(part_of(self._size, self._cut))
            self._warmed()
        self._shown = None

    def _warmed(self) -> float:
        """Compile and record all that a small picture needs; return what the last one takes [s].

        A recording is final after two pictures of each of two times (docs/internals/viewer.md).
        """
        live, spent = self._live, 0.0
        view, begin = live.home, live.ground.begin
        for step in range(_ROUNDS):
            time = begin + step / float(live.job.output.fps)
            live.show(time, view)
            for number in range(2):
                began = clock.perf_counter()
                live.develop(live.glimpse(time, view, number=number), view)
                spent = clock.perf_counter() - began
        return spent

    def forget(self) -> None:
        """Forget what the renderer holds: something else was shown."""
        self._shown = None

    def picture(self, client: Client) -> None:
        """Take one more sample of what a client sees, and send it."""
        live, began = self._live, clock.perf_counter()
        state = client.state
        try:
            view = state.view(live)
        except ConfigError as error:
            client.warn(error)
            before = client.pictured.view if client.pictured else live.home
            eye = replace(Eye.of(before), roll=0.0)
            state = replace(state, eye=eye, ride=None, flying=False, playing=False)
            client.state, view = state, eye.view()
        if moved := self._moved(client, view):
            client.parts, client.mean = [], None
        self._bring(state, view, moved=moved)
        client.pictured = Pictured(state.time, view, state.dynamic, live.shot)
        if moved or state.moves:
            sample = live.glimpse(state.time, view, number=0)
            client.mean = Mean.of(sample)
            self._send(client, view, still=False, began=began)
            return
        client.began = client.began if client.parts else began
        self._add_part(client, view)
        if not client.parts:
            self._send(client, view, still=True, began=client.began)

    def _add_part(self, client: Client, view: View) -> None:
        """Take one more part of a large picture's next sample; orders are read between parts."""
        mean, parts = client.mean, client.parts
        if mean is not None and mean.size != self.size:
            mean = None
        part, number = (len(parts), self._cut), 0 if mean is None else mean.count
        parts.append(self._live.glimpse(client.state.time, view, number=number, part=part))
        if len(parts) == self._cut**2:
            sample, client.parts = joined(parts), []
            mean = Mean.of(sample) if mean is None else mean.with_sample(sample)
        client.mean = mean

    def _moved(self, client: Client, view: View) -> bool:
        """Return whether a client sees something else than its last picture shows."""
        last, state = client.pictured, client.state
        if last is None or last.shot is not self._live.shot:
            return True
        same = (last.time, last.dynamic) == (state.time, state.dynamic)
        before = last.view.world_from_camera.matrix
        same &= last.view.lens == view.lens
        return not (same and np.array_equal(before, view.world_from_camera.matrix))

    def _bring(self, state: ViewerState, view: View, *, moved: bool) -> None:
        """Bring the road users to a client's time, in levels of detail for its place."""
        cut_open = view.rides_in if view.cutaway else None
        wanted = _Shown(state.time, state.dynamic, cut_open, self._live.shot, view.position)
        if self._shown is not None and self._shown.fits(wanted):
            away = float(np.linalg.norm(self._shown.place - view.position))
            if away < (_WALKED if moved else _STOOD):
                return
        self._live.show(state.time, view, dynamic=state.dynamic)
        self._shown = wanted

    def _send(self, client: Client, view: View, *, still: bool, began: float) -> None:
        """Develop what was sampled and send it to the page, with what it shows."""
        state, mean = client.state, client.mean
        assert mean is not None
        often = mean.count & (mean.count - 1) == 0
        smooth = state.denoise and still
        if smooth and not often and mean.count % 32:
            return
        pixels = self._live.develop(mean.value, view, extra=state.exposure, smooth=smooth)
        error = None
        if still and (often or mean.count % 16 == 0):
            error = mean.error(self._live, view, extra=state.exposure)
        client.send(
            {
                "id": state.heard,
                "spp": mean.count,
                "error": error,
                "ms": round(1e3 * (clock.perf_counter() - began), 1),
                "time": state.time,
                "size": list(mean.size),
                "eye": said_of(Eye.of(view).said(self._live.location)),
                "riding": view.rides_in or (state.ride.vehicle if state.ride else None),
                "playing": state.playing,
                "denoised": smooth,
            },
            encoded(pixels),
        )


def part_of(size: Size, cut: int) -> Size:
    """Return the size of each part of a picture that is cut into rows and columns [px]."""
    return max(round(size[0] / cut), 1), max(round(size[1] / cut), 1)
