"""One page's visit: its orders and pictures, small ones of what moves, large ones that improve.

While nothing moves, a picture is the mean of more and more samples, with its error.

Messages wait to be sent to the page, with back pressure by acknowledgement. A page says when it has
shown a picture. Until then no other one is on its way, and of those that are made meanwhile only
the newest is kept: a slow line sees fewer pictures, never old ones. Notes arrive in their order; of
those that say how things stand now, such as all key frames, a newer one replaces one that still
waits.
"""

from __future__ import annotations

import asyncio
import threading
import time as clock
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import KeyFrame
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.layers import Layers, merged
from sumo3dviz_pt.model.scene import FrameState, View
from sumo3dviz_pt.pipeline.live import Live, Size, encoded, joined
from sumo3dviz_pt.viewer.keyframes import ViewerEye
from sumo3dviz_pt.viewer.messages import Frame, Message, Note, Order, parsed
from sumo3dviz_pt.viewer.state import ViewerState, advanced, said_of


@dataclass(frozen=True, slots=True, eq=False)
class Mean:
    """Samples of one picture, added up in two halves.

    Attributes:
        halves: Sums of samples 0, 2, 4, ... and 1, 3, 5, ...; of a single sample only the first.
        count: Samples that were added.
    """

    halves: tuple[Layers, ...]
    count: int

    @classmethod
    def of(cls, sample: Layers) -> Mean:
        """Begin a picture with a sample."""
        return cls((sample,), 1)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        return self.halves[0].size

    def with_sample(self, sample: Layers) -> Mean:
        """Add a sample to the sums."""
        if self.count == 1:
            return Mean((*self.halves, sample), 2)
        even, odd = self.halves
        halves = (even, added(odd, sample)) if self.count % 2 else (added(even, sample), odd)
        return Mean(halves, self.count + 1)

    @property
    def value(self) -> Layers:
        """The mean of all samples."""
        total = self.halves[0] if self.count == 1 else added(*self.halves)
        return divided(total, self.count)

    def error(self, live: Live, view: View, *, extra: float) -> float | None:
        """Return the standard error of the shown picture [8-bit codes]; None if it is unknown yet.

        Half the difference between the pictures of two independent halves has the same
        variance as their mean.

        Args:
            live: Develops the picture.
            view: Of its camera.
            extra: Further exposure [EV].
        """
        if self.count < 2:
            return None
        counts = (self.count + 1) // 2, self.count // 2
        shown = [
            live.develop(divided(half, count), view, extra=extra).astype(np.float32)
            for half, count in zip(self.halves, counts, strict=True)
        ]
        return float(np.sqrt(np.mean(((shown[0] - shown[1]) / 2.0) ** 2)))


def added(one: Layers, other: Layers) -> Layers:
    """Return the sums of two pictures' layers."""
    return merged((one, other), np.add)


def divided(sums: Layers, count: int) -> Layers:
    """Return the means of sums over a number of samples."""
    return merged((sums,), lambda layer: layer / count)


_STANDS = frozenset({"scene", "busy", "keyframes", "span"})
"""Kinds of notes of which only the newest matters."""

MOST_NOTES = 1000
"""Notes that may wait; beyond that the oldest are lost."""


class Outbox:
    """A queue that the render thread fills and the server's event loop empties.

    Args:
        loop: In which `following` and `acknowledge` are called.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._notes: list[Note] = []
        self._frame: Frame | None = None
        self._under_way: int | None = None
        self._news = asyncio.Event()

    def deliver(self, message: Message) -> None:
        """Leave a message; from any thread, never waits."""
        self._loop.call_soon_threadsafe(self._put, message)

    def acknowledge(self, seq: Any) -> bool:
        """Note that a picture is shown; return whether it was the one under way.

        Args:
            seq: The picture's number as the page gives it, which may be anything.
        """
        if self._under_way is None or type(seq) is not int or seq != self._under_way:
            return False
        self._under_way = None
        self._news.set()
        return True

    async def following(self) -> Message:
        """Wait for the next message that may be sent; a picture is under way from now on."""
        while True:
            if self._notes:
                return self._notes.pop(0)
            if self._frame is not None and self._under_way is None:
                frame, self._frame = self._frame, None
                self._under_way = frame.info["seq"]
                return frame
            self._news.clear()
            await self._news.wait()

    def _put(self, message: Message) -> None:
        if isinstance(message, Frame):
            self._frame = message
        else:
            kind = _kind(message)
            if kind in _STANDS:
                self._notes = [note for note in self._notes if _kind(note) != kind]
            self._notes.append(message)
            del self._notes[:-MOST_NOTES]
        self._news.set()


def _kind(note: Note) -> str:
    """Return what a note is about."""
    return str(note.content["kind"])


_MOST_ORDERS = 20_000
"""Orders that may wait, while a still is taken; beyond that the oldest are dropped."""


@dataclass(frozen=True, slots=True, eq=False)
class Pictured:
    """What a page's last picture shows.

    Attributes:
        time: SUMO's [s].
        view: The camera.
        dynamic: Whether road users are in it.
        shot: What of the built scene does not change; windows of a simulation that runs share it.
    """

    time: float
    view: View
    dynamic: bool
    shot: object


class Client:
    """A page that looks at the scene. Orders come from the server's thread.

    Only the render thread changes the attributes.

    Attributes:
        state: Place, time and switches.
        mean: Samples of the picture that is shown, or None.
        parts: Parts of the next sample of a large picture that are done.
        began: When the first of them was begun [s].
        pictured: What the last picture shows, or None.
        ticked: Until when time has passed for this page [s]; None while nothing happens.
        sent: The key frames that the page was told of.
    """

    def __init__(
        self,
        state: ViewerState,
        deliver: Callable[[Message], None],
        *,
        wake: Callable[[], None],
        leave: Callable[[Client], None],
    ) -> None:
        """Begin a visit.

        Args:
            state: Where it begins.
            deliver: Takes what the page is told.
            wake: Called when there is something to do.
            leave: Called at the end of the visit.
        """
        self.state = state
        self.mean: Mean | None = None
        self.parts: list[Layers] = []
        self.began = 0.0
        self.pictured: Pictured | None = None
        self.ticked: float | None = None
        self.sent: tuple[KeyFrame, ...] = state.frames
        self._deliver, self._wake, self._leave = deliver, wake, leave
        self._lock = threading.Lock()
        self._orders: deque[tuple[float, Order]] = deque(maxlen=_MOST_ORDERS)
        self._sent = self._acknowledged = 0

    def order(self, order: Mapping[str, Any]) -> None:
        """Take a page's message.

        Raises:
            ConfigError: If it is no order.
        """
        wanted = parsed(order)
        with self._lock:
            self._orders.append((clock.perf_counter(), wanted))
        self._wake()

    def acknowledge(self, seq: int) -> None:
        """Note that the page shows a picture, and can take the next."""
        with self._lock:
            self._acknowledged = max(self._acknowledged, seq)
        self._wake()

    def leave(self) -> None:
        """End the visit: the page is gone."""
        self._leave(self)

    def taken(self) -> list[tuple[float, Order]]:
        """Return all orders since the last call, each with the time at which it came [s]."""
        with self._lock:
            orders = list(self._orders)
            self._orders.clear()
        return orders

    @property
    def ready(self) -> bool:
        """Whether the page shows what it was sent last."""
        with self._lock:
            return self._acknowledged >= self._sent

    @property
    def has_orders(self) -> bool:
        """Whether orders wait."""
        with self._lock:
            return bool(self._orders)

    def send(self, info: Mapping[str, Any], jpeg: bytes) -> None:
        """Send a picture."""
        with self._lock:
            self._sent += 1
            seq = self._sent
        self._deliver(Frame({"kind": "frame", "seq": seq, **info}, jpeg))

    def tell(self, kind: str, **content: Any) -> None:
        """Tell the page something."""
        self._deliver(Note({"kind": kind, **content}))

    def warn(self, text: object) -> None:
        """Tell the page what went wrong."""
        self.tell("note", level="error", text=str(text))


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
        passing: Whether in levels of detail for a small picture only.
        cut_open: The vehicle whose body is cut open for the camera in it, or None.
        shot: The built scene.
        place: For which levels of detail were chosen, (3,) [m].
    """

    time: float
    dynamic: bool
    passing: bool
    cut_open: str | None
    shot: object
    place: Floats

    def fits(self, other: _Shown) -> bool:
        """Return whether it is as much as is wanted, wherever that is seen from."""
        if self.passing and not other.passing:
            return False
        seen = (self.time, self.dynamic, self.cut_open)
        return seen == (other.time, other.dynamic, other.cut_open) and self.shot is other.shot


_LATEST = 0.5
"""Longest time between two pictures after which the next one is foreseen [s]."""

_EARLY = 0.25
"""A playing picture may show a time that differs so much from its own [s]: what is there then was
found while the picture before it was traced."""


@dataclass(frozen=True, slots=True, eq=False)
class _Coming:
    """What a playing client's next picture is to show.

    Attributes:
        wanted: As the renderer will hold it.
        frame: Becomes what is on the road then.
    """

    wanted: _Shown
    frame: Future[FrameState]


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
        self._ahead = ThreadPoolExecutor(max_workers=1)
        self._coming: _Coming | None = None
        self._played = 0.0  # how far time had run at the last playing picture [s]
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
            live.show(live.frame_at(time, view))
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
        state = client.state = self._in_step(client.state)
        try:
            view = state.view(live)
        except ConfigError as error:
            client.warn(error)
            before = client.pictured.view if client.pictured else live.home
            eye = replace(ViewerEye.of(before), roll=0.0)
            state = replace(state, eye=eye, ride=None, flying=False, playing=False)
            client.state, view = state, eye.view()
        if moved := self._moved(client, view):
            client.parts, client.mean = [], None
        self._bring(state, view, moved=moved)
        client.pictured = Pictured(state.time, view, state.dynamic, live.shot.data)
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
        if last is None or last.shot is not self._live.shot.data:
            return True
        same = (last.time, last.dynamic) == (state.time, state.dynamic)
        before = last.view.world_from_camera.matrix
        same &= last.view.lens == view.lens
        return not (same and np.array_equal(before, view.world_from_camera.matrix))

    def _bring(self, state: ViewerState, view: View, *, moved: bool) -> None:
        """Bring the road users to a client's time, in levels of detail for its place."""
        cut_open = view.rides_in if view.cutaway else None
        wanted = _Shown(
            state.time, state.dynamic, state.playing, cut_open, self._live.shot.data, view.position
        )
        if self._shown is not None and self._shown.fits(wanted):
            away = float(np.linalg.norm(self._shown.place - view.position))
            if away < (_WALKED if moved else _STOOD):
                return
        frame = self._frame(wanted, view)
        self._foresee(state, wanted)
        self._live.show(frame)
        self._shown = wanted

    def _frame(self, wanted: _Shown, view: View) -> FrameState:
        """Return what is on the road: as it was foreseen, or found now."""
        coming, self._coming = self._coming, None
        if coming is not None and coming.wanted.fits(wanted):
            return coming.frame.result()
        how = {"dynamic": wanted.dynamic, "passing": wanted.passing}
        return self._live.frame_at(wanted.time, view, **how)

    def _foresee(self, state: ViewerState, shown: _Shown) -> None:
        """Begin to find what a playing client's next picture shows, if it is not late."""
        live, played = self._live, state.time + state.ahead
        gap, self._played = played - self._played, played
        after = advanced(state, min(max(gap, 0.0), _LATEST), live)
        if not after.playing or after.time <= state.time:
            return
        how = {"dynamic": shown.dynamic, "passing": shown.passing}

        def found() -> FrameState:
            return live.frame_at(after.time, after.view(live), **how)

        self._coming = _Coming(replace(shown, time=after.time), self._ahead.submit(found))

    def _in_step(self, state: ViewerState) -> ViewerState:
        """Return a state at the time that was foreseen for it, if it plays and that is near."""
        early = 0.0 if self._coming is None else self._coming.wanted.time - state.time
        if not state.playing or abs(early) > _EARLY:
            return state
        return replace(state, time=state.time + early, ahead=state.ahead - early)

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
                "eye": said_of(ViewerEye.of(view).said(self._live.location)),
                "riding": view.rides_in or (state.ride.rides_with if state.ride else None),
                "playing": state.playing,
                "denoised": smooth,
            },
            encoded(pixels),
        )


def part_of(size: Size, cut: int) -> Size:
    """Return the size of each part of a picture that is cut into rows and columns [px]."""
    return max(round(size[0] / cut), 1), max(round(size[1] / cut), 1)
