"""Holds a shot, or a whole scene, open in the renderer for pictures at any time.

Opening costs seconds (reading, building, loading), a further picture only what it renders. A time
within a shot of the scene file is pictured with that shot's plan, so that a still is the film's
frame; any other time has a plan of its own.

An open scene is for cameras that go anywhere, at any time of the log. Files are read and motion is
smoothed once; the shot is built again only where detail is needed elsewhere or the look of the
scene changes.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.settings import CameraSettings, Job
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.layers import Layers, merged
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.model.scene import FrameState, SceneData, View
from sumo3dviz_pt.pipeline.films.orders import Pace
from sumo3dviz_pt.pipeline.films.pilot import piloted
from sumo3dviz_pt.pipeline.metering import exposure_of, manual_exposure, metered
from sumo3dviz_pt.pipeline.production import (
    Production,
    Request,
    check_tone,
    get_ready,
    opened,
    prepare,
)
from sumo3dviz_pt.pipeline.reading import Ground as Ground
from sumo3dviz_pt.pipeline.scene_file import camera_settings, quality_preset
from sumo3dviz_pt.pipeline.still import Still
from sumo3dviz_pt.pipeline.worlds import roam_around, world_of

if TYPE_CHECKING:
    from sumo3dviz_pt.render.passes.quick import Quick
    from sumo3dviz_pt.render.session import Session
    from sumo3dviz_pt.shot.build import Shot


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


def _holds(production: Production, time: float) -> bool:
    """Return whether a shot has room at a time [s]: between its frames it may lack some."""
    return production.shot.data.slots.hold(production.frame_at(time))


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
        if not _holds(made, time):
            made = prepare(job, request, np.array([float(time)]))
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
        changed = request.applied(job)
        same = changed.model_copy(update={"quality": mine.job.quality}) == mine.job
        name, _ = camera_settings(changed, request.camera)
        if not same or name != mine.camera or request.variant != mine.variant:
            return False
        planned = np.array_equal(plan_times(changed, request, time), mine.times)
        return planned and _holds(mine, time)

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


Size = tuple[int, int]
Pixels = np.ndarray[Any, np.dtype[np.uint8]]

_FURTHER = 150.0
"""Farther than this from all places that it was built around, a scene lacks detail [m]."""

_FILM_WIDTH = 960
"""Width of a picture with detail as far as films have it [px]; in one half as wide, things are as
small at half the distance. (For films 1920 wide it reaches twice as far as here: in one of 240,
a lorry 35 m away was seen to change where detail ended at 31 m.)"""


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """A window of a running simulation, ready to be shown.

    Attributes:
        ground: The simulation in it.
        shot: The scene with its traffic; None where that lacks room for somebody.
        built: What of the scene does not change, as it was built then.
    """

    ground: Ground
    shot: Shot | None
    built: SceneData | None


class Live:
    """A scene that is open: one thread may use it. Close it after use."""

    def __init__(self, job: Job, ground: Ground, *, size: Size, variant: str) -> None:
        """Build the scene around the job's cameras and open it.

        Args:
            job: The scene file.
            ground: Its simulation.
            size: Width, height of a picture, or of each part of a larger one [px].
            variant: `llvm`, `cuda`.

        Raises:
            ConfigError: If a choice does not exist.
        """
        check_tone(job.output.tone)
        self.ground, self._size, self._variant = ground, size, variant
        self.location = ground.scenario.network.location
        self.job = job
        self._frames = ground.frames(float(job.output.fps))
        self._eyes: Floats | None = None
        self._riding: tuple[CameraSettings, ...] = ()
        self._session: Session | None = None
        self._quick: Quick | None = None
        self.shot: Shot = self._built(job, None, ())
        self._open()

    # The scene ----------------------------------------------------------------------------

    @property
    def home(self) -> View:
        """Where the scene's first camera stands."""
        return self.shot.camera.view_at(self.ground.begin)

    @property
    def exposure(self) -> float:
        """EV between radiance and the picture: as the scene file's first camera says it."""
        first = next(iter(self.job.cameras.values()), None)
        settings = None if first is None else first.exposure
        # Nothing is metered here: the page has a slider.
        sky = self.shot.data.sky.exposure
        by_hand = sky
        if first is not None and settings is not None and settings.mode == "manual":
            step = 1.0 / float(self.job.output.fps)
            by_hand = manual_exposure(first, step=step, name=next(iter(self.job.cameras)))
        own = exposure_of(settings, sky=sky, metered=None, by_hand=by_hand)
        return own + self.job.output.exposure

    def frame_before(self, time: float) -> float:
        """Return the time of the last of the film's frames that is not after a time [s]."""
        number = int(np.searchsorted(self._frames, time, side="right")) - 1
        return float(self._frames[max(number, 0)])

    def view_of(self, camera: CameraSettings, time: float) -> View:
        """Return what a camera sees at a time [s].

        Raises:
            ConfigError: If it rides with a road user that is not there then.
        """
        from sumo3dviz_pt.shot.picking import camera_view

        left_hand = self.ground.scenario.network.left_hand
        return camera_view(self.shot, camera, time, left_hand=left_hand)

    def sits_closed(self, camera: CameraSettings) -> bool:
        """Return whether a camera sits in a vehicle that cannot be opened yet."""
        from sumo3dviz_pt.cast.fleet import find_rider

        if not (camera.preset and catalog.template("camera", camera.preset).get("cutaway")):
            return False
        return find_rider(self.shot.fleet, camera.rides_with).key not in self.shot.fleet.cockpits

    def life_of(self, camera: CameraSettings) -> tuple[float, float]:
        """Return the first and last time at which the road user a camera rides with is there [s].

        Raises:
            ConfigError: If there is no road user of that name.
        """
        from sumo3dviz_pt.cast.fleet import find_rider

        pieces = find_rider(self.shot.fleet, camera.rides_with).pieces
        return pieces[0].begin, pieces[-1].end

    def ground_at(self, position: Floats) -> float:
        """Return the height of the ground at a place, (3,) [m]."""
        return float(self.shot.footway(np.asarray(position, dtype=np.float64)[None, :2])[0])

    def lacks_detail(self, position: Floats) -> bool:
        """Return whether nothing near a place, (3,) [m], was built in detail."""
        places = self.shot.places
        assert places is not None
        return bool(np.linalg.norm(places - position, axis=1).min() > _FURTHER)

    def rebuild(
        self,
        *,
        job: Job | None = None,
        eyes: Floats | None = None,
        riding: CameraSettings | None = None,
    ) -> None:
        """Build the scene again; the old one stays if that fails.

        Args:
            job: Another look; None makes room for the traffic of now.
            eyes: Places with detail, (n, 3) [m].
            riding: A camera in a vehicle whose cabin is still closed.

        Raises:
            ConfigError: If a choice does not exist.
        """
        shot = self._under_sky_of(job) if job and eyes is None and riding is None else None
        job, eyes = job or self.job, self._eyes if eyes is None else eyes
        seats = self._riding if riding is None else (*self._riding, riding)
        shot = shot or self._built(job, eyes, seats)
        self.job, self._eyes, self._riding, self.shot = job, eyes, seats, shot
        self._open()

    def carried_on(self, ground: Ground) -> Window:
        """Make another window of the same simulation ready to be shown; from any thread."""
        from sumo3dviz_pt.shot.picking import with_traffic

        shot, world = self.shot, world_of(ground.scenario, self.job, ground.files)
        frames = ground.frames(float(self.job.output.fps))
        carried = with_traffic(shot, world, ground.trajectories, frames=frames)
        return Window(ground, carried, shot.data)

    def carry_on(self, window: Window) -> bool:
        """Show a window from now on; return whether the scene must be built again before."""
        ground = self.ground = window.ground
        self._frames = ground.frames(float(self.job.output.fps))
        if window.built is not self.shot.data:  # it was built again meanwhile
            window = self.carried_on(ground)
        if window.shot is not None:
            self.shot = window.shot
        return window.shot is None

    def _under_sky_of(self, job: Job) -> Shot | None:
        """Return the same shot under a job's sky, if only that differs and lamps need no change."""
        if self.job.model_copy(update={"sky": job.sky}) != job:
            return None
        return self.shot.under_sky(job.sky, job.lights)

    def _built(self, job: Job, eyes: Floats | None, riding: tuple[CameraSettings, ...]) -> Shot:
        """Return the shot of some choices."""
        return roam_around(job, self.ground, frames=self._frames, eyes=eyes, riding=riding)

    def _open(self) -> None:
        """Give the shot to the renderer."""
        from sumo3dviz_pt.render.backend import choose_backend
        from sumo3dviz_pt.render.passes.quick import Quick
        from sumo3dviz_pt.render.session import RenderSettings, Session

        self.close()
        output = self.job.output
        settings = RenderSettings(
            output.size,
            quality_preset("preview"),
            self.job.seed,
            white=2.0**-self.exposure,
            pixel=self.home.pixel_angle(output.size[0]),
        )
        self._session = Session(self.shot.data, choose_backend(self._variant), settings)
        self._quick = Quick(self._session, self._size)

    def close(self) -> None:
        """Give the renderer's memory back."""
        self._quick = None
        if self._session is not None:
            self._session.__exit__()
            self._session = None

    # Pictures -----------------------------------------------------------------------------

    def frame_at(
        self, time: float, view: View, *, dynamic: bool = True, passing: bool = False
    ) -> FrameState:
        """Return what is on the road at a time, in levels of detail for a view; from any thread.

        Args:
            time: SUMO's [s].
            view: The camera.
            dynamic: Whether there are road users at all.
            passing: Whether only a small picture is taken, where less is drawn in detail.
        """
        detail = self._size[0] / _FILM_WIDTH if passing else 1.0
        frame = self.shot.frame_of(time, view, detail=detail)
        return frame if dynamic else replace(frame, movers=(), far=(), deforming=())

    def show(self, frame: FrameState) -> None:
        """Bring all road users to where they are in a frame."""
        self._renderer.show(frame)

    def resize(self, size: Size) -> None:
        """Take pictures, and parts of them, of another width and height from now on [px]."""
        from sumo3dviz_pt.render.passes.quick import Quick

        assert self._session is not None
        self._size = size
        self._quick = Quick(self._session, size)

    def glimpse(
        self, time: float, view: View, *, number: int, part: tuple[int, int] = (0, 1)
    ) -> Layers:
        """Return one sample a pixel of what was last shown, the n-th of a picture.

        Args:
            time: That was shown [s].
            view: The camera.
            number: Of the sample.
            part: Which part, row by row, of a picture that is cut into how many rows and
                columns.
        """
        from sumo3dviz_pt.render.passes.quick import parts_of
        from sumo3dviz_pt.render.passes.samples import frame_seed, pass_seed

        index, count = part
        seed = pass_seed(frame_seed(self.job.seed, time), number * count**2 + index)
        return self._renderer.glimpse(view, seed=seed, part=parts_of(count)[index])

    def picture(self, time: float, view: View, *, samples: int) -> Pixels:
        """Return a small picture without noise, 8-bit sRGB, (h, w, 3).

        Args:
            time: SUMO's [s].
            view: The camera.
            samples: Of a pixel.
        """
        self.show(self.frame_at(time, view))
        seen = [self.glimpse(time, view, number=number) for number in range(samples)]
        mean = merged(seen, lambda *each: np.mean(each, axis=0, dtype=np.float32))
        return self.develop(mean, view, smooth=True)

    def develop(
        self, seen: Layers, view: View, *, extra: float = 0.0, smooth: bool = False
    ) -> Pixels:
        """Return a picture as it is shown, 8-bit sRGB, (h, w, 3).

        Args:
            seen: Mean of samples.
            view: Of their camera.
            extra: Further exposure [EV].
            smooth: Whether noise is removed.
        """
        from sumo3dviz_pt.image.tonemap import develop

        if smooth:
            seen = self._renderer.smooth(seen, view, seed=self.job.seed)
        output = self.job.output
        radiance = self._renderer.hazed(seen, view)
        exposure = self.exposure + extra
        return develop(radiance, exposure=exposure, tone=output.tone, glare=output.glare)

    def still(
        self,
        time: float,
        view: View,
        *,
        quality: str,
        extra: float = 0.0,
        dynamic: bool = True,
        after_pass: Callable[[int, int], None] | None = None,
    ) -> Pixels:
        """Return a picture at a preset's quality and the scene file's size, (h, w, 3).

        Args:
            time: SUMO's [s].
            view: The camera.
            quality: A preset's name.
            extra: Further exposure [EV].
            dynamic: Whether road users are shown.
            after_pass: Called with the passes that are done and all there are.

        Raises:
            ConfigError: If there is no such preset.
        """
        from sumo3dviz_pt.image.tonemap import develop

        assert self._session is not None
        self._session.retune(quality_preset(quality), seed=self.job.seed)
        frame = self.frame_at(time, view, dynamic=dynamic)
        rendered = self._session.render(frame, after_pass=after_pass)
        output, exposure = self.job.output, self.exposure + extra
        return develop(rendered.radiance, exposure=exposure, tone=output.tone, glare=output.glare)

    def pick(
        self, time: float, view: View, point: tuple[float, float], seen: Layers | None
    ) -> str | None:
        """Return the road user that is seen at a point of the picture, or None.

        Args:
            time: SUMO's [s].
            view: The camera.
            point: From the left and from the top, in [0, 1].
            seen: The picture, if there is one: its depths tell what is hidden.
        """
        from sumo3dviz_pt.shot.picking import pick

        width, height = self._size
        return pick(
            self.shot.present_at(time),
            self.shot.fleet,
            view,
            point,
            aspect=height / width,
            distance=np.inf if seen is None else _distance(seen, point),
        )

    @property
    def _renderer(self) -> Quick:
        """What takes quick pictures."""
        assert self._quick is not None
        return self._quick


def joined(parts: Sequence[Layers]) -> Layers:
    """Return all parts of a picture, row by row, as one."""
    from sumo3dviz_pt.render.passes.quick import joined as whole

    return whole(parts)


def encoded(pixels: Pixels) -> bytes:
    """Encode pixels, (h, w, 3), as a JPEG file."""
    from sumo3dviz_pt.render.passes.quick import jpeg

    return jpeg(pixels)


def encoded_still(pixels: Pixels) -> bytes:
    """Encode pixels, (h, w, 3), as a PNG file."""
    from sumo3dviz_pt.image.png import encoded as png

    return png(pixels, level=6)


def _distance(seen: Layers, point: tuple[float, float]) -> float:
    """Return how far what a picture shows at a point is [m]; infinite in the sky."""
    width, height = seen.size
    column, row = min(int(point[0] * width), width - 1), min(int(point[1] * height), height - 1)
    depth, hit = float(seen["depth"][row, column]), float(seen["hit"][row, column])
    return depth / hit if hit > 0.5 else float("inf")
