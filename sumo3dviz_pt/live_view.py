"""Shows somebody's simulation in the viewer while it runs in a loop of their own."""

from __future__ import annotations

import tempfile
import threading
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.api import Scene, load
from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.recording.recorder import Recorder

if TYPE_CHECKING:
    from sumo3dviz_pt.job.settings import Job
    from sumo3dviz_pt.model.scene import View
    from sumo3dviz_pt.pipeline.live import Live, Pixels
    from sumo3dviz_pt.pipeline.reading import Ground
    from sumo3dviz_pt.recording.live_log import LiveLog


class LiveView:
    """The viewer beside a loop with libsumo or TraCI, which never waits for pictures.

    It asks and changes nothing. The page shows the simulation a little late, as pictures between
    two steps need later steps; its scene takes a minute to build, while the loop goes on::

        libsumo.start(["sumo", "-c", "city.sumocfg"])
        with sv.LiveView(libsumo) as live:
            print(live.address)
            while libsumo.simulation.getMinExpectedNumber() > 0:
                libsumo.simulationStep()
                live.step()

    Args:
        connection: The module `libsumo` or `traci`, or a connection of `traci`.
        scene: A scene file, or a `Scene`, whose cameras and looks are used; its simulation is not.
            None is a plain scene, seen from above.
        choices: `keep`, the folder of a recording of all steps, as `Recorder` makes it, which
            `overwrite` lets replace one that is there; `delay`, how far pictures are behind the
            last step, 0..16 s: with 12 they are those of films, with 2, the default, places
            differ by some centimetres where somebody changes lanes or stops; `port`, `size` and
            `variant` as in `Scene.view`.

    Attributes:
        address: Of the page.

    Raises:
        ConfigError: If the extra `viewer` is not installed, the port is taken, a recording is
            there already, or a choice is wrong.
        InputError: If a file of the simulation is wrong.
    """

    def __init__(
        self,
        connection: Any,
        *,
        scene: str | Path | Scene | None = None,
        **choices: Any,
    ) -> None:
        from sumo3dviz_pt.job.errors import made
        from sumo3dviz_pt.recording.feeds import LoopFeed, loop_ground
        from sumo3dviz_pt.recording.live_log import LiveLog
        from sumo3dviz_pt.viewer.choices import LiveChoices
        from sumo3dviz_pt.viewer.render_thread import RenderThread
        from sumo3dviz_pt.viewer.running import Running
        from sumo3dviz_pt.viewer.server import Server

        wish, job = made(LiveChoices, choices), _job_of(scene)
        ground = loop_ground(connection, job)
        self._feed = LoopFeed(LiveLog(job, ground, delay=wish.delay))
        self._failure: BaseException | None = None
        with ExitStack() as held:
            folder = wish.keep or held.enter_context(tempfile.TemporaryDirectory())
            self._recorder = Recorder(connection, folder, overwrite=wish.overwrite)
            held.callback(self._finished)
            window = Running(ground, self._feed)
            render_thread = RenderThread(job, size=wish.size, window=window, variant=wish.variant)
            self._server = Server(render_thread, port=wish.port)
            self._held = held.pop_all()
        self.address = self._server.address
        self._opening = threading.Thread(target=self._open, name="opening", daemon=True)
        self._opening.start()

    def _open(self) -> None:
        """Build the scene and answer pages; what fails is told at the next step."""
        try:
            self._server.start()
        except BaseException as error:  # noqa: BLE001 - raised again in `step`
            self._failure = error

    def step(self) -> None:
        """Show and keep where everybody is now; call it after every `simulationStep()`.

        Raises:
            ConfigError: If it was closed, or finished.
            Sumo3dvizError: Once, if the scene cannot be built or rendered.
        """
        if self._failure is not None:
            failure, self._failure = self._failure, None
            raise failure
        try:
            step = self._recorder.step()
        except ConfigError:
            raise
        except Exception as error:
            # The connection's own kinds of errors; the loop is told, and so are the pages.
            self._feed.stop(f"SUMO does not answer any more ({error})", trouble=True)
            raise
        self._feed.put(step)

    def _finished(self) -> None:
        """Finish the recording; one without any step leaves nothing."""
        with suppress(InputError):
            self._recorder.close()

    def finish(self) -> None:
        """Finish the recording: no step follows. What is there can still be looked at."""
        self._feed.stop("the loop has ended")
        self._held.close()

    def close(self) -> None:
        """End the viewer and finish the recording; a second time does nothing."""
        self.finish()
        self._opening.join()
        if self._failure is None:
            self._server.close()

    def __enter__(self) -> LiveView:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<LiveView at {self.address}>"


class Observer:
    """Pictures of somebody's simulation as it stands, such as observations of an agent.

    It asks and changes nothing. The first picture builds the scene, which takes a while::

        observer = sv.Observer(libsumo, scene="scene.yaml", camera="corner", size=(160, 90))
        libsumo.simulationStep()
        pixels = observer.render_array()

    Everybody is where the last step has them. A simulation that begins anew is followed.

    Args:
        connection: The module `libsumo` or `traci`, or a connection of `traci`.
        scene: A scene file, or a `Scene`, whose cameras and looks are used; its simulation is not.
            None is a plain scene, seen from above.
        camera: A name from its cameras; default the first one, or from above.
        size: Width, height [px].
        samples: Of a pixel.
        variant: `llvm` or `cuda`.

    Raises:
        ConfigError: If there is no such camera, or a choice is wrong.
        InputError: If a file of the simulation is wrong.
    """

    def __init__(
        self,
        connection: Any,
        *,
        scene: str | Path | Scene | None = None,
        camera: str | None = None,
        size: tuple[int, int] = (160, 90),
        samples: int = 4,
        variant: str = "llvm",
    ) -> None:
        from sumo3dviz_pt.job.errors import asked, made
        from sumo3dviz_pt.job.values import Whole
        from sumo3dviz_pt.pipeline.scene_file import camera_settings
        from sumo3dviz_pt.recording.feeds import loop_ground
        from sumo3dviz_pt.recording.recorder import StepReader, settings_of
        from sumo3dviz_pt.viewer.choices import LiveChoices

        wish = made(LiveChoices, {"size": size, "variant": variant, "delay": 0.0})
        self._samples = max(asked(Whole, samples, key="samples"), 1)
        job = _job_of(scene)
        output = job.output.model_copy(update={"size": wish.size})
        self._job, self._wish = job.model_copy(update={"output": output}), wish
        named = camera is not None or bool(job.cameras)
        self._camera = camera_settings(self._job, camera)[1] if named else None
        self._ground = loop_ground(connection, self._job)
        self._reader = StepReader(connection, settings_of(connection))
        self._seen: float | None = None
        self._log = self._new_log()
        self._live: Live | None = None

    def render_array(self) -> Pixels:
        """Return a picture of the last step, 8-bit sRGB, (h, w, 3).

        Raises:
            ConfigError: If the road user that the camera rides with is not there.
        """
        time = self._reader.time
        if self._log.newest is not None and time < self._log.newest:
            self._log = self._new_log()
        if time != self._log.newest:
            self._log.take([self._reader.read()])
        ground = self._log.ground()
        assert ground is not None, "a step was taken"
        live = self._opened(ground)
        return live.picture(time, self._view(live, time), samples=self._samples)

    def _view(self, live: Live, time: float) -> View:
        """Return what the camera sees at the last step.

        Raises:
            ConfigError: If the road user that it rides with is not there.
        """
        if self._camera is None:
            return live.home
        name, seen = self._camera.rides_with, self._seen
        try:
            view = live.view_of(self._camera, time)
        except ConfigError as error:
            if not name or seen is None or seen >= time:
                raise
            # The window forgets when it came, and at last that it was there at all.
            text = f"{name!r} is not on the road at {time:.12g} s; last seen at {seen:.12g} s"
            raise ConfigError(text, key="camera") from error
        self._seen = time
        return view

    def close(self) -> None:
        """Give the renderer's memory back."""
        if self._live is not None:
            self._live.close()
        self._live = None

    def __enter__(self) -> Observer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _new_log(self) -> LiveLog:
        """Return a window in which nothing is yet."""
        from sumo3dviz_pt.recording.live_log import LiveLog

        self._seen = None
        return LiveLog(self._job, self._ground, delay=0.0)

    def _opened(self, ground: Ground) -> Live:
        """Return the open scene with a window's traffic in it."""
        from sumo3dviz_pt.pipeline.live import Live
        from sumo3dviz_pt.pipeline.production import ready_renderer

        live = self._live
        if live is None:
            ready_renderer(self._wish.variant)
            wish = self._wish
            live = Live(self._job, ground, size=wish.size, variant=wish.variant)
        elif live.carry_on(live.carried_on(ground)):
            live.rebuild()
        self._live = live
        return live


def _job_of(scene: str | Path | Scene | None) -> Job:
    """Return the settings of a scene; its simulation plays no part."""
    if isinstance(scene, Scene):
        return scene.job
    return (Scene(scenario={}) if scene is None else load(scene)).job
