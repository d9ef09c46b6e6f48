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
        """Show and keep who is where now; call it after every `simulationStep()`.

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
            self._feed.stop(f"SUMO does not answer any more ({error})")
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


def _job_of(scene: str | Path | Scene | None) -> Job:
    """Return the settings of a scene; its simulation plays no part."""
    if isinstance(scene, Scene):
        return scene.job
    return (Scene(scenario={}) if scene is None else load(scene)).job
