"""The one thread that renders, for all pages in turn.

Mitsuba's state belongs to a thread, and two cores gain nothing from two of them. A client that
moves gets small pictures of one sample a pixel; a client that stands still gets a large one that
improves. Where a client stands for long and the scene lacks detail, it is built again.
"""

from __future__ import annotations

import logging
import threading
import time as clock
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import singledispatchmethod
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError, Sumo3dvizError
from sumo3dviz_pt.job.settings import Job, SkySettings
from sumo3dviz_pt.pipeline.accounts import preset_weather
from sumo3dviz_pt.pipeline.live import Ground, Live, Size, encoded_still
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.viewer import messages
from sumo3dviz_pt.viewer.client import HALVES, Client, Projector, part_of
from sumo3dviz_pt.viewer.keyframes import ViewerEye, camera_yaml, path_yaml, save_camera
from sumo3dviz_pt.viewer.messages import Message
from sumo3dviz_pt.viewer.running import News, Running, WindowThread, first_ground, span_said
from sumo3dviz_pt.viewer.state import ViewerState, advanced, frames_said, obeyed, within

log = logging.getLogger(__name__)

MOST_SPP = 512
"""Samples a pixel after which a standing picture is not improved any more."""

_LONGEST = 1.0
"""Longest time that passes in one step [s]: slow pictures show traffic as fast as it is, and after
a pause no client jumps."""

_RESTING = 8
"""Samples a pixel of a place without detail, after which the scene is built again there."""

_TURN = 1.0
"""A standing client is served for this long before it is the next one's turn [s]."""

_STILLS = 20
"""Number of stills that are kept."""


class RenderThread:
    """Renders for clients until it is closed."""

    def __init__(
        self,
        job: Job,
        *,
        scene_file: Path | None = None,
        size: Size = (480, 270),
        window: tuple[float | None, float | None] | Running = (None, None),
        variant: str = "llvm",
        reload: Callable[[Mapping[str, str]], Job] | None = None,
    ) -> None:
        """Read the simulation.

        Args:
            job: The scene.
            scene_file: Where key frames are saved; None shows them as text.
            size: Of pictures while nothing moves [px].
            window: First and last time to show [s], where None is the log's; or a simulation
                that still runs, to be shown instead of the log.
            variant: `llvm` or `cuda`.
            reload: Makes the job again with other settings by dotted key, such as another
                template; default reads the scene file.

        Raises:
            InputError: If a file is wrong.
            ConfigError: If a choice does not exist, or a variant cannot be held open.
        """
        if variant == "scalar":
            raise ConfigError("the viewer needs llvm or cuda", key="variant")
        self._job, self._file, self._size, self._variant = job, scene_file, size, variant
        self._reload = reload
        if reload is None and scene_file is not None:
            self._reload = lambda choices: load_job(scene_file, choices)
        self._running = window if isinstance(window, Running) else None
        self._windows: WindowThread | None = None
        self._ground = (
            window.ground
            if isinstance(window, Running)
            else Ground.of(job, begin=window[0], end=window[1])
        )
        self._template: str | None = None
        self._trouble = ""
        self._clients: list[Client] = []
        self._stills: dict[int, bytes] = {}
        self._changed = threading.Condition()
        self._closing = False
        self._opened = threading.Event()
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="render thread", daemon=True)
        self._turn: tuple[Client | None, float] = None, 0.0
        self._live: Live | None = None
        self._opened_projector: Projector | None = None

    # For the server -----------------------------------------------------------------------

    @property
    def about(self) -> dict[str, Any]:
        """What a page is told of the scene."""
        job, ground = self.live.job, self.live.ground
        return {
            "title": self._title,
            "cameras": list(job.cameras),
            "begin": ground.begin,
            "end": ground.end,
            "fps": float(job.output.fps),
            "skies": list(catalog.template_names("sky")),
            "sky": job.sky.preset,
            "weathers": list(catalog.template_names("weather")),
            "weather": job.weather.preset or "" if job.weather is not None else "",
            "templates": list(catalog.template_names("scene")) if self._reload else [],
            "template": self._template or job.template,
            "qualities": list(catalog.template_names("quality")),
            "size": list(self._projector.size),
            "views": list(catalog.template_names("camera")),
            "exposure": job.output.exposure,
            "saves": self._file is not None,
            "stride": max(round(ground.scenario.traffic.step * float(job.output.fps)), 1)
            if ground.growing
            else 1,
            "running": ground.growing,
            "trouble": self._trouble,
        }

    @property
    def _title(self) -> str:
        """What pages are called."""
        if self._running is not None:
            return self._running.title
        return self._file.parent.name if self._file else "sumo3dviz_pt"

    @property
    def live(self) -> Live:
        """The open scene."""
        assert self._live is not None, "start the render thread first"
        return self._live

    @property
    def _projector(self) -> Projector:
        """The projector of the open scene, which takes pictures."""
        assert self._opened_projector is not None
        return self._opened_projector

    def start(self) -> None:
        """Open the scene, and render from now on.

        Raises:
            Sumo3dvizError: If the scene cannot be built or rendered.
        """
        self._thread.start()
        self._opened.wait()
        if self._failure is not None:
            raise self._failure

    def close(self) -> None:
        """Stop rendering and wait until the thread has ended."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        if self._thread.is_alive():
            self._thread.join()

    def join(self, deliver: Callable[[Message], None]) -> Client:
        """Begin a page's visit.

        Args:
            deliver: Takes what the page is told; called from the render thread, too.
        """
        live = self.live
        ground = live.ground
        behind = ground.growing and ground.behind < np.inf
        state = ViewerState(ViewerEye.of(live.home), ground.end if behind else ground.begin)
        client = Client(state, deliver, wake=self._wake, leave=self._forget)
        with self._changed:  # what is told to all from now on is told to this one, too
            client.tell("scene", **self.about)
            self._clients.append(client)
            self._changed.notify_all()
        return client

    def still(self, number: int) -> bytes | None:
        """Return a still that was taken, as a PNG file."""
        return self._stills.get(number)

    def _wake(self) -> None:
        """Tell the thread that there is something to do."""
        with self._changed:
            self._changed.notify_all()

    def _forget(self, client: Client) -> None:
        """Forget a page that is gone."""
        with self._changed:
            self._clients = [other for other in self._clients if other is not client]

    # The render thread --------------------------------------------------------------------

    def _run(self) -> None:
        """Open the scene, serve clients in turn, close it."""
        try:
            self._live = self._opened_live()
            self._opened_projector = Projector(self._live, self._size)
        except BaseException as error:  # noqa: BLE001 - raised again in `start`
            self._failure = error
            return
        finally:
            self._opened.set()
        if self._running is not None:
            self._windows = WindowThread(self._running.feed, self._live, wake=self._wake)
        while (client := self._next()) is not None:
            try:
                self._serve(client)
            except Sumo3dvizError as error:
                client.warn(error)
            except Exception as error:
                # One page's trouble must not end the others' visits.
                log.exception("the viewer failed")
                client.warn(f"the viewer failed: {error}")
        if self._windows is not None:
            self._windows.close()
        self._live.close()

    def _opened_live(self) -> Live:
        """Open the scene, with the first window of a running simulation."""
        ground, first = self._ground, None
        if self._running is not None:
            first = first_ground(self._running, lambda: self._closing)
            ground = first if first is not None and not ground.trajectories else ground
        size = part_of(self._size, HALVES)
        live = Live(self._job, ground, size=size, variant=self._variant)
        if first is not None and live.carry_on(live.carried_on(first)):
            live.rebuild()
        return live

    def _next(self) -> Client | None:
        """Wait for the next client with something to do; None at the end."""
        while not self._closing:
            self._renew()
            with self._changed:
                if (chosen := self._choice()) is not None:
                    return chosen
                self._changed.wait(timeout=0.2)
        return None

    def _renew(self) -> None:
        """Put the next window of a running simulation in place, if it is ready."""
        if self._windows is None or self._running is None:
            return
        self._heed(self._running.feed.trouble)
        states = [client.state for client in self._clients]
        if states:
            shown = max(state.time + state.ahead for state in states)
            speed = max((state.speed for state in states if state.playing), default=1.0)
            self._windows.follow(shown, speed=speed)
        news = self._windows.taken()
        if news is not None:
            self._take(news)

    def _take(self, news: News) -> None:
        """Put a window in place, and say so to all pages."""
        if self.live.carry_on(news.window):
            try:
                self._rebuild("making room for more road users")
            except Sumo3dvizError as error:
                self._tell_all("note", level="error", text=str(error))
        for client in self._clients:
            client.state = replace(client.state, time=within(client.state.time, self.live))
        self._pass_on(news)

    def _pass_on(self, news: News) -> None:
        """Tell all pages of a window that is in place."""
        with self._changed:
            if news.level == "error":
                self._trouble = self._trouble or news.stopped
            self._tell_all("span", **span_said(self.live.ground, trouble=self._trouble))
            if news.stopped:
                text = f"{news.stopped}; what is there can still be seen"
                self._tell_all("note", level=news.level, text=text)

    def _heed(self, trouble: str) -> None:
        """Tell all pages, once, what went wrong, before they come to the end."""
        if trouble and not self._trouble:
            log.warning("%s", trouble)
            with self._changed:
                self._trouble = trouble
                self._tell_all("span", **span_said(self.live.ground, trouble=trouble))
                self._tell_all("note", level="error", text=trouble)

    def _choice(self) -> Client | None:
        """Choose the next client: moving ones first; standing ones keep their turn for a while.

        Each change of client may have to move all traffic.
        """
        waiting = [c for c in self._clients if c.has_orders or (c.ready and self._wanting(c))]
        waiting = [c for c in waiting if c.has_orders or c.state.moves] or waiting
        if not waiting:
            return None
        now, (current, since) = clock.perf_counter(), self._turn
        if current in waiting and now - since < _TURN:
            return current
        after = [c for c in waiting if c is not current] or waiting
        self._clients.remove(after[0])
        self._clients.append(after[0])
        self._turn = after[0], now
        return after[0]

    def _wanting(self, client: Client) -> bool:
        """Return whether another picture would differ."""
        mean, state = client.mean, client.state
        if state.moves or mean is None or mean.count < MOST_SPP:
            return True
        client.ticked = None
        return False

    def _serve(self, client: Client) -> None:
        """Follow a client's orders, let time pass, send it a picture."""
        for came, order in client.taken():
            self._tick(client, came)
            try:
                self._follow(order, client)
            except ConfigError as error:
                client.warn(error)
        self._tick(client, clock.perf_counter())
        if client.state.frames is not client.sent:
            # Once for all orders, so that many added key frames do not make as many notes.
            client.sent = client.state.frames
            client.tell("keyframes", frames=frames_said(client.sent))
        if client.ready:
            self._projector.picture(client)
            self._detail(client)

    def _tick(self, client: Client, now: float) -> None:
        """Let time pass until a moment: a key counts from when it came."""
        if client.ticked is None:
            client.ticked = now
        seconds = min(max(now - client.ticked, 0.0), _LONGEST)
        client.state = advanced(client.state, seconds, self.live)
        client.ticked = max(now, client.ticked)

    def _detail(self, client: Client) -> None:
        """Build the scene again around clients that have stood for long where it is coarse."""
        stands = client.mean is not None and client.mean.count >= _RESTING
        if stands and self.live.lacks_detail(client.state.view(self.live).position):
            seen = [other.pictured for other in self._clients if other.pictured]
            eyes = np.stack([each.view.position for each in seen])
            self._rebuild("bringing detail here", eyes=eyes)

    def _rebuild(self, text: str, **choices: Any) -> None:
        """Build the scene again while all pages wait."""
        self._tell_all("busy", text=text)
        try:
            self.live.rebuild(**choices)
            self._projector.warm_up()
        finally:
            for client in self._clients:
                client.mean = client.pictured = client.ticked = None
                client.parts = []
            self._tell_all("busy", text=None)

    def _tell_all(self, kind: str, **content: Any) -> None:
        """Tell all pages something."""
        for client in self._clients:
            client.tell(kind, **content)

    # Orders -------------------------------------------------------------------------------

    @singledispatchmethod
    def _follow(self, order: Any, client: Client) -> None:
        """Follow an order: most only move the client."""
        client.state = obeyed(order, client.state, self.live)
        ride = client.state.ride
        if ride is not None and self.live.sits_closed(ride):
            self._rebuild(f"opening the cabin of {ride.rides_with}", riding=ride)

    @_follow.register
    def _(self, order: messages.Pick, client: Client) -> None:
        live, state = self.live, client.state
        seen = None if client.mean is None else client.mean.value
        vehicle = live.pick(state.time, state.view(live), (order.x, order.y), seen)
        if vehicle is None:
            client.tell("note", level="info", text="nobody is there")
            return
        self._follow(messages.Ride(do="ride", vehicle=vehicle), client)

    @_follow.register
    def _(self, order: messages.UnderSky, client: Client) -> None:
        catalog.template("sky", order.preset)
        job = self.live.job.model_copy(update={"sky": SkySettings(preset=order.preset)})
        self._rebuild(f"putting up {order.preset}", job=job)
        self._tell_all("scene", **self.about)

    @_follow.register
    def _(self, order: messages.InWeather, client: Client) -> None:
        weather = preset_weather(order.preset) if order.preset else self._job.weather
        job = self.live.job.model_copy(update={"weather": weather})
        self._rebuild(f"making it {order.preset or 'as the scene file says'}", job=job)
        self._tell_all("scene", **self.about)

    @_follow.register
    def _(self, order: messages.Template, client: Client) -> None:
        if self._reload is None:
            raise ConfigError("only a scene file can change its template", key="template")
        catalog.template("scene", order.name)
        job = self._reload({"template": order.name})
        self._rebuild(f"building {order.name}", job=job)
        self._template = order.name
        self._tell_all("scene", **self.about)

    @_follow.register
    def _(self, order: messages.TakeStill, client: Client) -> None:
        state = client.state
        catalog.template("quality", order.quality)

        def progress(done: int, total: int) -> None:
            client.tell("busy", text=f"taking a still: pass {done} of {total}")

        self._tell_all("busy", text="taking a still")
        try:
            pixels = self.live.still(
                state.time,
                state.view(self.live),
                quality=order.quality,
                extra=state.exposure,
                dynamic=state.dynamic,
                after_pass=progress,
            )
        finally:
            self._projector.forget()
            self._tell_all("busy", text=None)
        number = max(self._stills, default=0) + 1
        self._stills[number] = encoded_still(pixels)
        self._stills.pop(number - _STILLS, None)
        size = f"{pixels.shape[1]}x{pixels.shape[0]}"
        client.tell("still", url=f"stills/{number}.png", text=f"still {number}, {size}")

    @_follow.register
    def _(self, order: messages.AskYaml, client: Client) -> None:
        client.tell("yaml", text=camera_yaml(client.state.said(self.live)))

    @_follow.register
    def _(self, order: messages.SaveView, client: Client) -> None:
        text = camera_yaml(client.state.said(self.live), order.name)
        self._save(order.name, text, client)

    @_follow.register
    def _(self, order: messages.KeyFrameOrder, client: Client) -> None:
        if order.act == "save":
            if len(client.state.frames) < 2:
                raise ConfigError("drop at least two key frames first")
            self._save(order.name, path_yaml(order.name, client.state.frames), client)
            return
        client.state = obeyed(order, client.state, self.live)

    def _save(self, name: str, text: str, client: Client) -> None:
        """Put a camera into the scene file, and tell all pages."""
        if self._file is None:
            client.tell("yaml", text=text)
            return
        try:
            save_camera(self._file, name, text)
        except ConfigError as error:
            client.tell("yaml", text=text, why=str(error))
            return
        assert self._reload is not None
        cameras = self._reload({}).cameras
        self.live.job = self.live.job.model_copy(update={"cameras": cameras})
        self._tell_all("scene", **self.about)
        saved = f"saved as camera {name} in {self._file.name}"
        client.tell("note", level="info", text=saved)
