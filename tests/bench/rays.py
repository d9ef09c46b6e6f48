"""Which rays our kernel traces, and how near to Embree's own pace it traces each kind.

Scenes are watched from outside: a stand-in for what rays may meet counts the rays that paths ask it
for and keeps them, so normal renders pay nothing. The kept rays are then traced once more by
Embree alone, which is the limit that no kernel can pass. What the kernel needs for a kind comes
from renders that leave it out: those of one segment have primary rays only, and those in which
nothing hides sky or lamps have no shadow rays to them; neither changes how paths go on.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

PRIMARY, BOUNCE, TO_SKY, TO_LAMPS = KINDS = (
    "primary",
    "bounce",
    "shadow, to sky and sun",
    "shadow, to lamps",
)
_KEPT = 3
"""How many rays of a kind are kept for each sample."""

_RUNS = 5
_FIELDS = 7


@dataclass(frozen=True)
class RayRow:
    """Rays of one kind in one frame.

    Attributes:
        scene: What is shown.
        kind: One of `KINDS`, all of them, or those to lamps that are seen directly.
        count: How many.
        raw: CPU-seconds that Embree alone needs for them.
        ours: CPU-seconds that the kernel needs for them, with all that it does between rays.
    """

    scene: str
    kind: str
    count: int
    raw: float
    ours: float

    @property
    def share(self) -> float:
        """Share of Embree's raw limit that they reach; NaN where leaving them out saved nothing.

        It may pass 1: Embree alone reads its rays from memory, where the kernel has them at hand.
        """
        return self.raw / self.ours if self.ours > 0 else float("nan")


class Watched:
    """Stands in for `Solids`: counts rays by kind, and keeps them.

    Args:
        solids: What rays may meet.
        samples: Of the whole picture.
    """

    def __init__(self, solids: Any, samples: int) -> None:
        import drjit as dr
        import mitsuba as mi

        self._solids, self._room = solids, _KEPT * samples
        self._counts = {kind: dr.zeros(mi.UInt32, 1) for kind in KINDS}
        # A place that was drawn can be written to only once, so every field has its own memory.
        self._kept = {
            kind: [dr.zeros(mi.Float, self._room) for _ in range(_FIELDS)] for kind in KINDS
        }
        # Recorded loops write only to what lies in memory already.
        dr.make_opaque(self._counts, self._kept)

    def nearest(self, ray: Any, coherent: Any, active: Any = True) -> Any:
        """Find what rays meet first."""
        import mitsuba as mi

        first, active = mi.Bool(coherent), mi.Bool(active)
        self._keep(PRIMARY, ray, active & first)
        self._keep(BOUNCE, ray, active & ~first)
        return self._solids.nearest(ray, coherent, active)

    def hide(self, ray: Any, active: Any) -> Any:
        """Find whether rays meet anything."""
        import mitsuba as mi

        from sumo3dviz_pt.render.kernel.lights import FAR

        near, active = ray.maxt < FAR, mi.Bool(active)
        self._keep(TO_LAMPS, ray, active & near)
        self._keep(TO_SKY, ray, active & ~near)
        return self._solids.hide(ray, active)

    def _keep(self, kind: str, ray: Any, active: Any) -> None:
        """Count rays, and keep those that there is room for."""
        import drjit as dr
        import mitsuba as mi

        place = dr.scatter_inc(self._counts[kind], mi.UInt32(0), active)
        active &= place < self._room
        for field, value in enumerate((*ray.o, *ray.d, ray.maxt)):
            dr.scatter(self._kept[kind][field], value, place, active)

    def count(self, kind: str) -> int:
        """Return how many rays of a kind there were."""
        return int(self._counts[kind][0])

    def rays(self, kind: str) -> Any:
        """Return those that were kept."""
        import drjit as dr
        import mitsuba as mi

        index = dr.arange(mi.UInt32, min(self.count(kind), self._room))
        fields = [dr.gather(mi.Float, kept, index) for kept in self._kept[kind]]
        ray = mi.Ray3f(mi.Point3f(*fields[:3]), mi.Vector3f(*fields[3:6]))
        ray.maxt = fields[6]
        dr.eval(ray)
        return ray

    def raw(self, kind: str) -> float:
        """Return the CPU-seconds that Embree alone needs for all rays of a kind."""
        import drjit as dr

        count = self.count(kind)
        if not count:
            return 0.0
        ray = self.rays(kind)
        nearest = kind in (PRIMARY, BOUNCE)

        def trace() -> None:
            found = (
                self._solids.nearest(ray, kind == PRIMARY).t
                if nearest
                else self._solids.hide(ray, True)
            )
            dr.eval(found)
            dr.sync_thread()

        return seconds_of(trace) * count / min(count, self._room)


class Unhidden:
    """Stands in for `Solids`: nothing hides some lights, whose rays are not traced.

    Args:
        solids: What rays may meet.
        sky: Whether sky and sun are hidden as ever, and only lamps are not.
    """

    def __init__(self, solids: Any, *, sky: bool) -> None:
        self._solids, self._sky = solids, sky
        self.nearest = solids.nearest

    def hide(self, ray: Any, active: Any) -> Any:
        """Find whether rays to the sky meet anything, if those are traced."""
        import mitsuba as mi

        from sumo3dviz_pt.render.kernel.lights import FAR

        if not self._sky:
            return mi.Bool(False) & active
        return self._solids.hide(ray, mi.Bool(active) & (ray.maxt >= FAR))


def seconds_of(work: Callable[[], Any]) -> float:
    """Return CPU-seconds of all threads, the median of five after one that compiles."""
    work()
    seconds = []
    for _ in range(_RUNS):
        started = time.process_time()
        work()
        seconds.append(time.process_time() - started)
    return float(np.median(seconds))


@contextmanager
def through(kernel: Any, solids: Any) -> Iterator[None]:
    """Let a kernel ask other solids for as long as it lasts."""
    place = kernel._place
    kernel._place = replace(place, solids=solids)
    try:
        yield
    finally:
        kernel._place = place


def rays_of(scene: str, session: Any, state: Any) -> list[RayRow]:
    """Return the rays of a frame by kind, with their shares of the raw limit.

    Args:
        scene: Its name.
        session: That renders it.
        state: The frame.
    """
    from sumo3dviz_pt.render.kernel.by_kernel import GLOW_SPP
    from sumo3dviz_pt.render.kernel.integrator import Limits

    session.show(state)
    kernel, quality = session.by_kernel.followed(), session.settings.quality
    sensor, (width, height) = session.loaded.scene.sensors()[0], session.settings.size
    eye, apart = kernel.eye(sensor, state.view), session.loaded.aimed and quality.cap is not None
    whole = Limits(quality.max_depth, quality.rr_depth, session.limit, direct=not apart)

    def trace(limits: Limits) -> Callable[[], Any]:
        return lambda: kernel.trace(sensor, eye, spp=quality.spp, seed=1, limits=limits)

    solids = kernel._place.solids
    watched = Watched(solids, width * height * quality.spp)
    with through(kernel, watched):
        trace(whole)()
    costs = [seconds_of(trace(replace(whole, most=1)))]
    for sky in (False, True):
        with through(kernel, Unhidden(solids, sky=sky)):
            costs.append(seconds_of(trace(whole)))
    costs.append(seconds_of(trace(whole)))
    raw = {kind: watched.raw(kind) for kind in KINDS}
    rows = [
        RayRow(scene, kind, watched.count(kind), raw[kind], own)
        for kind, own in zip(KINDS, np.diff(costs, prepend=0.0), strict=True)
        if watched.count(kind)
    ]
    every = sum(row.count for row in rows)
    rows.append(RayRow(scene, "all", every, sum(raw.values()), costs[-1]))
    if not apart:
        return rows
    seen = Watched(solids, width * height * quality.spp)

    def glow() -> None:
        kernel.glow(sensor, state.view, spp=GLOW_SPP, few=GLOW_SPP, seed=1)

    with through(kernel, seen):
        glow()
    seconds = seconds_of(glow)
    name = "lamps that are seen directly"
    return [*rows, RayRow(scene, name, seen.count(PRIMARY), seen.raw(PRIMARY), seconds)]


def table(rows: Sequence[RayRow]) -> list[str]:
    """Return rays as Markdown."""
    lines = [
        "| scene | rays | thousands | Embree alone, million a CPU-second | Embree alone [CPU-s]"
        " | our kernel [CPU-s] | share of the limit |",
        "|---|---|" + "--:|" * 5,
    ]
    for row in rows:
        pace = f"{row.count / row.raw / 1e6:.1f}" if row.raw > 0 else "-"
        share = f"{row.share:.0%}" if row.share == row.share else "-"
        lines.append(
            f"| {row.scene} | {row.kind} | {row.count / 1e3:,.0f} | {pace} | {row.raw:.3f}"
            f" | {row.ours:.3f} | {share} |"
        )
    return lines
