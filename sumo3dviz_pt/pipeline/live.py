"""Holds a scene open for cameras that go anywhere, at any time of the log.

Files are read and motion is smoothed once; the shot is built again only where detail is
needed elsewhere or the look of the scene changes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import CameraSettings, Job, LagrangianCamera
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.scenario import Scenario, ScenarioFiles
from sumo3dviz_pt.model.scene import FrameState, View
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.pipeline.metering import exposure_of, manual_exposure
from sumo3dviz_pt.pipeline.production import check_tone, read
from sumo3dviz_pt.pipeline.scene_file import quality_preset
from sumo3dviz_pt.pipeline.worlds import world_of

if TYPE_CHECKING:
    from sumo3dviz_pt.render.passes.quick import Quick
    from sumo3dviz_pt.render.session import Session
    from sumo3dviz_pt.shot.build import Shot

Size = tuple[int, int]
Pixels = np.ndarray[Any, np.dtype[np.uint8]]

_FURTHER = 150.0
"""Farther than this from all places that it was built around, a scene lacks detail [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """A simulation as it was read.

    Attributes:
        files: Where it lies.
        scenario: Network, objects, types and the log.
        trajectories: Its smoothed motion.
        begin: First time that can be shown [s].
        end: Last one [s].
    """

    files: ScenarioFiles
    scenario: Scenario
    trajectories: tuple[Trajectory, ...]
    begin: float
    end: float

    @classmethod
    def of(cls, job: Job, *, begin: float | None = None, end: float | None = None) -> Ground:
        """Read a job's simulation, or a window of it.

        Args:
            job: The scene file.
            begin: First time to show [s]; None is the log's.
            end: Last time to show [s]; None is the log's.

        Raises:
            InputError: If a file is wrong.
            ConfigError: If the log has nothing in the window.
        """
        files, scenario, trajectories = read(job, begin=begin, end=end)
        log = scenario.traffic
        first = log.begin if begin is None else max(begin, log.begin)
        last = log.end if end is None else min(end, log.end)
        if not first <= last:
            raise ConfigError(
                f"the log goes from {log.begin:.12g} s to {log.end:.12g} s:"
                " nothing lies in the window",
                key="from",
            )
        return cls(files, scenario, trajectories, first, last)


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
        step = 1.0 / float(job.output.fps)
        count = int((ground.end - ground.begin) / step) + 1
        self._frames = ground.begin + step * np.arange(count, dtype=np.float64)
        self._eyes: Floats | None = None
        self._riding: tuple[LagrangianCamera, ...] = ()
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
        said = None if first is None else first.exposure
        # Nothing is metered here: the page has a slider.
        sky = self.shot.data.sky.exposure
        by_hand = sky
        if first is not None and said is not None and said.mode == "manual":
            step = 1.0 / float(self.job.output.fps)
            by_hand = manual_exposure(first, step=step, name=next(iter(self.job.cameras)))
        own = exposure_of(said, sky=sky, metered=None, by_hand=by_hand)
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
        from sumo3dviz_pt.shot.roaming import camera_view

        left_hand = self.ground.scenario.network.left_hand
        return camera_view(self.shot, camera, time, left_hand=left_hand)

    def sits_closed(self, camera: LagrangianCamera) -> bool:
        """Return whether a camera sits in a vehicle that cannot be opened yet."""
        from sumo3dviz_pt.cast.fleet import find_rider

        if not catalog.template("camera", camera.view).get("cutaway"):
            return False
        return find_rider(self.shot.fleet, camera.vehicle).key not in self.shot.fleet.cockpits

    def life_of(self, camera: LagrangianCamera) -> tuple[float, float]:
        """Return the first and last time at which the road user a camera rides with is there [s].

        Raises:
            ConfigError: If there is no road user of that name.
        """
        from sumo3dviz_pt.cast.fleet import find_rider

        pieces = find_rider(self.shot.fleet, camera.vehicle).pieces
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
        riding: LagrangianCamera | None = None,
    ) -> None:
        """Build the scene again; the old one stays if that fails.

        Args:
            job: Another look.
            eyes: Places with detail, (n, 3) [m].
            riding: A camera in a vehicle whose cabin is still closed.

        Raises:
            ConfigError: If a choice does not exist.
        """
        job, eyes = job or self.job, self._eyes if eyes is None else eyes
        seats = self._riding if riding is None else (*self._riding, riding)
        kept = eyes is self._eyes and seats is self._riding
        shot = (self._under_sky_of(job) if kept else None) or self._built(job, eyes, seats)
        self.job, self._eyes, self._riding, self.shot = job, eyes, seats, shot
        self._open()

    def _under_sky_of(self, job: Job) -> Shot | None:
        """Return the same shot under a job's sky, if only that differs and lamps need no change."""
        if self.job.model_copy(update={"sky": job.sky}) != job:
            return None
        return self.shot.under_sky(job.sky, job.lights)

    def _built(self, job: Job, eyes: Floats | None, riding: tuple[LagrangianCamera, ...]) -> Shot:
        """Return the shot of some choices."""
        from sumo3dviz_pt.shot.roaming import build_roam

        ground = self.ground
        world = world_of(ground.scenario, job, ground.files)
        return build_roam(
            world,
            ground.trajectories,
            times=(ground.begin, ground.end),
            frames=self._frames,
            eyes=eyes,
            riding=riding,
        )

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

    def show(self, time: float, view: View, *, dynamic: bool = True) -> None:
        """Bring all road users to a time, in levels of detail for a view.

        Args:
            time: SUMO's [s].
            view: The camera.
            dynamic: Whether road users are shown at all.
        """
        self._renderer.show(self._frame(time, view, dynamic=dynamic))

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
        from sumo3dviz_pt.render.passes.build import frame_seed, pass_seed
        from sumo3dviz_pt.render.passes.quick import parts_of

        index, count = part
        seed = pass_seed(frame_seed(self.job.seed, time), number * count**2 + index)
        return self._renderer.glimpse(view, seed=seed, part=parts_of(count)[index])

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
        frame = self._frame(time, view, dynamic=dynamic)
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

    def _frame(self, time: float, view: View, *, dynamic: bool) -> FrameState:
        """Return what is on the road at a time; without road users unless `dynamic`."""
        frame = self.shot.frame_of(time, view)
        return frame if dynamic else replace(frame, movers=(), far=(), deforming=())


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
