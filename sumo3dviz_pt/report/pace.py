"""Times frames of a bundled example on this machine, each rendered for itself."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.pipeline.costs import spent
from sumo3dviz_pt.pipeline.films.orders import FilmOrder
from sumo3dviz_pt.pipeline.live import OpenShot
from sumo3dviz_pt.pipeline.production import Request

PICTURE = Request("overview", "preview", (640, 360))
"""What is rendered of `ronda`."""

_BEGIN, _FRAMES, _COUNTED = 492.0, 6, 3


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast a variant renders here.

    Attributes:
        variant: What renders.
        first: Time to the first picture, from the command on [s].
        later: The same of a later picture [s].
        cpu: CPU-seconds of that.
    """

    variant: str
    first: float
    later: float
    cpu: float

    def __str__(self) -> str:
        size = "x".join(map(str, PICTURE.size or ()))
        return (
            f"{self.variant}: a frame of {size} in {PICTURE.quality} takes {self.later:.2g} s"
            f" ({self.cpu:.2g} CPU-seconds), the first one {self.first:.0f} s"
        )


def pace_of(job: Job, variant: str) -> Pace:
    """Render some frames of an example: trace, denoise and develop each.

    Args:
        job: Of `ronda`.
        variant: `llvm`, `cuda` or `scalar`.

    Raises:
        InstallationError: If a package cannot be loaded.
        RenderError: If the variant cannot work here.
    """
    from sumo3dviz_pt.pipeline.films.film import prepared

    request = Request(PICTURE.camera, PICTURE.quality, PICTURE.size, variant=variant)
    order = FilmOrder(Path("frames.mp4"), start=_BEGIN, end=_BEGIN + _FRAMES / 25, fps=25)
    began = time.perf_counter()
    walls, costs = [], []
    with OpenShot(prepared(job, request, order)) as shot:
        # Where there is no libLLVM, it is not what was asked for.
        variant = shot.production.variant
        for still in shot.frames():
            still.develop()
            walls.append(time.perf_counter() - began)
            costs.append(spent())
    later, cpu = (float(np.median(np.diff(each)[-_COUNTED:])) for each in (walls, costs))
    return Pace(variant, walls[0], later, cpu)
