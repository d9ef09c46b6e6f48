"""Holds a shot open in the renderer, for pictures at any of its times.

Opening costs seconds (reading, building, loading), a further picture only what it renders. A
time within a shot of the scene file is pictured with that shot's plan, so that a still is the
film's frame; any other time has a plan of its own.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt.model.news import Doing, announce
from sumo3dviz_pt.pipeline.films.pace import Pace
from sumo3dviz_pt.pipeline.metering import metered
from sumo3dviz_pt.pipeline.pilot import piloted
from sumo3dviz_pt.pipeline.production import (
    Production,
    Request,
    check_tone,
    get_ready,
    opened,
    prepare,
)
from sumo3dviz_pt.pipeline.scene_file import camera_settings, quality_preset
from sumo3dviz_pt.pipeline.stills.still import Still

if TYPE_CHECKING:
    from sumo3dviz_pt.job.settings import Job
    from sumo3dviz_pt.model.geometry import Floats


def plan_times(job: Job, request: Request, time: float) -> Floats:
    """Return the times of all frames of the shot that a still belongs to, (n,) [s].

    Args:
        job: The scene file.
        request: The command's choices; the first shot's camera if it names none.
        time: The still's [s].

    Returns:
        Those of the scene file's first shot of that camera whose frames reach from before
        `time` to after it; `time` alone where there is none.
    """
    name, _ = camera_settings(job, request.camera)
    for shot in job.shots:
        if shot.camera == name and shot.start <= time <= shot.end:
            times = Pace.of(job, shot).times(shot)
            if times[0] <= time <= times[-1]:
                return times
    return np.array([float(time)])


class OpenShot:
    """A shot in the renderer. Use it in a `with` statement, or close it after use.

    Args:
        production: What to show.
    """

    def __init__(self, production: Production) -> None:
        self.production = production
        self._held = ExitStack()
        # This also closes it when a program ends, while the renderer still exists.
        self._close = weakref.finalize(self, self._held.close)
        self._session = self._held.enter_context(opened(production))

    @classmethod
    def of(cls, job: Job, request: Request, time: float) -> OpenShot:
        """Open the shot that a still belongs to.

        Args:
            job: The scene file.
            request: The command's choices.
            time: SUMO's time of the still [s].

        Raises:
            ConfigError: If a choice does not exist or the window holds nothing.
            InputError: If a file is wrong.
            InstallationError: If the renderer cannot be loaded; nothing was read then.
        """
        check_tone(job.output.tone)
        get_ready(job, request)
        made = prepare(job, request, plan_times(job, request, time))
        return cls(piloted(metered(made, request.metered), request))

    def __enter__(self) -> OpenShot:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the renderer's memory back; again does nothing."""
        self._close()

    def shows(self, job: Job, request: Request, time: float) -> bool:
        """Return whether what is open is just what a still would open, quality aside.

        Args:
            job: The scene file.
            request: The command's choices.
            time: SUMO's time of the still [s].
        """
        mine = self.production
        if request.wish:
            return False
        asked = request.applied(job)
        same = asked.model_copy(update={"quality": mine.job.quality}) == mine.job
        name, _ = camera_settings(asked, request.camera)
        if not same or name != mine.camera or request.variant != mine.variant:
            return False
        return np.array_equal(plan_times(asked, request, time), mine.times)

    def retune(self, request: Request, *, quality: str) -> None:
        """Take pictures in another quality from now on.

        Args:
            request: Its samples per pixel win over the preset's.
            quality: A preset's name.

        Raises:
            ConfigError: If there is no such preset.
        """
        tuned = quality_preset(quality, spp=request.spp)
        job = self.production.job.model_copy(update={"quality": quality})
        if (job.quality, tuned) != (self.production.job.quality, self.production.quality):
            self.production = replace(self.production, job=job, quality=tuned)
        self._session.retune(tuned, seed=job.seed)

    def still(self, time: float) -> Still:
        """Take a picture.

        Args:
            time: SUMO's time [s], within the shot.

        Raises:
            ConfigError: If the camera rides with a road user that is not there then.
            RenderError: If it cannot be rendered.
        """
        made = self.production
        self._session.activate()
        # Files are hashed before the long work, not when somebody may have changed them.
        number = int(np.searchsorted(made.times, time - 1e-9))
        account = {**made.account, "frame": number, "time": time}
        frame = made.frame_at(time)
        announce(Doing.RENDER)
        rendered = self._session.render(frame, after_pass=partial(announce, Doing.RENDER))
        output = made.job.output
        # Layers are read-only, but a user may change this picture, and save it then.
        radiance = rendered.radiance.copy()
        layers = rendered.layers | {"radiance": radiance}
        return Still(
            radiance,
            made.exposure,
            output.tone,
            output.glare,
            output.half,
            account,
            replace(rendered, layers=layers),
            made.optics,
            tuple(made.inputs.names),
        )

    def frames(self) -> Iterator[Still]:
        """Yield all frames of the shot, in order."""
        for time in self.production.times:
            yield self.still(float(time))


def render_still(job: Job, request: Request, time: float) -> Still:
    """Render one image.

    Args:
        job: The scene file.
        request: The command's choices.
        time: SUMO's time [s].

    Raises:
        ConfigError: If a choice does not exist or the window holds nothing.
        InputError: If a file is wrong.
    """
    with OpenShot.of(job, request, float(time)) as shot:
        return shot.still(float(time))
