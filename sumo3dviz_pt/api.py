"""The Python API: the same jobs and the same pixels as the command line.

`Scene` makes pictures and films of a scene file. `Films` lists what was rendered, and notebooks
show it. `Study` makes the same films and files as the command `study`. `read_layers` reads again
what `render` wrote beside a film.
"""

from __future__ import annotations

import base64
import html
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sumo3dviz_pt.inspection.roster import Cameras, Roster
    from sumo3dviz_pt.job.settings import Job
    from sumo3dviz_pt.model.numbers import Ratio
    from sumo3dviz_pt.pipeline.conditions import SunReport
    from sumo3dviz_pt.pipeline.films.film import FilmOrder, FrameDone
    from sumo3dviz_pt.pipeline.films.stored_layers import FrameLayers
    from sumo3dviz_pt.pipeline.live import OpenShot
    from sumo3dviz_pt.pipeline.production import Request
    from sumo3dviz_pt.pipeline.steps import WorkStep
    from sumo3dviz_pt.pipeline.still import Still
    from sumo3dviz_pt.studies.certificate.certificate import Certificate
    from sumo3dviz_pt.studies.plan import StudyPlan
    from sumo3dviz_pt.viewer.notebook import Viewer


_LARGEST = 20_000_000
"""Films up to this size are put into the notebook itself [bytes]."""

_TYPES = {".mp4": "video/mp4", ".mov": "video/mp4", ".webm": "video/webm", ".gif": "image/gif"}


class Films(list[Path]):
    """Paths of films; the last line of a notebook's cell shows them."""

    def _repr_html_(self) -> str:
        """Return every film as a player, or as its name if it is too large or is no film."""
        return "\n".join(map(_shown, self))


def _shown(path: Path) -> str:
    """Return one film in HTML."""
    kind, name = _TYPES.get(path.suffix.lower()), html.escape(str(path))
    if kind is None or not path.is_file() or path.stat().st_size > _LARGEST:
        return f"<p><code>{name}</code></p>"
    data = f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode()}"
    if kind.startswith("image"):
        return f'<img src="{data}" alt="{name}" style="max-width: 100%">'
    return f'<video src="{data}" title="{name}" controls loop style="max-width: 100%"></video>'


_SCENARIO_KEYS = frozenset(
    {"sumocfg", "folder", "network", "trajectories", "signals", "additional", "vehicle_types"}
)


@dataclass(frozen=True, slots=True)
class _SceneSource:
    """Where the settings of a scene come from.

    Attributes:
        file: The scene file, if there is one.
        settings: Values that win over it, by dotted key; all of them if there is no file.
    """

    file: Path | None
    settings: Mapping[str, Any]

    def job(self, choices: Mapping[str, str]) -> Job:
        """Read it with further choices, by dotted key."""
        from sumo3dviz_pt.pipeline.scene_file import load_job, make_job

        together = {**self.settings, **choices}
        return make_job(together) if self.file is None else load_job(self.file, together)


class Scene:
    """A scene to take pictures of.

    The renderer stays open after a still: further ones of the same shot need no set-up.
    `close()` gives its memory back, as does the end of a `with` statement.

    Args:
        settings: The keys of a scene file. Those of `scenario` may stand by themselves:
            `Scene(network="a.net.xml", trajectories="fcd.xml", sky={...})`; a list or a
            path under `signals` means the signal log, a mapping the looks of signals.

    Raises:
        ConfigError: If a setting is wrong.
    """

    def __init__(self, **settings: Any) -> None:
        from sumo3dviz_pt.job.yaml12 import plain

        self._source = _SceneSource(None, _gathered(plain(settings)))
        self.job: Job = self._source.job({})
        self._open: OpenShot | None = None

    @classmethod
    def _of(cls, source: _SceneSource) -> Scene:
        """Return a scene from where it stands written."""
        scene = cls.__new__(cls)
        scene._source, scene.job, scene._open = source, source.job({}), None
        return scene

    def __repr__(self) -> str:
        named = self._source.file or "from Python"
        cameras, count = ", ".join(self.job.cameras) or "none", len(self.job.shots)
        shots = "1 shot" if count == 1 else f"{count} shots"
        return f"<Scene {named}: cameras {cameras}; {shots}; {self.job.quality}>"

    def __getstate__(self) -> dict[str, Any]:
        """Return what pickle keeps: the renderer is opened anew where it is needed."""
        return {"_source": self._source, "job": self.job, "_open": None}

    def __enter__(self) -> Scene:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the renderer's memory back; the scene can be used again."""
        if self._open is not None:
            self._open.close()
            self._open = None

    @property
    def cameras(self) -> Cameras:
        """The scene's cameras: settings by name."""
        from sumo3dviz_pt.inspection.roster import Cameras

        return Cameras(self.job.cameras)

    @property
    def sun(self) -> SunReport | None:
        """Where the sun stands, and when that is; None for a user's radiance map."""
        from sumo3dviz_pt.pipeline.conditions import sun_report

        return sun_report(self.job)

    @property
    def vehicles(self) -> Roster:
        """All road users in the log, with times, ways, speeds and lanes."""
        return self.find_vehicles()

    def find_vehicles(
        self,
        *,
        type: str = "*",  # noqa: A002 (SUMO's word)
        at: float | None = None,
        near: str | tuple[float, float] | None = None,
        radius: float | None = None,
        sort: str | None = None,
    ) -> Roster:
        """Look for road users; the log is read once, in one pass.

        Args:
            type: Pattern of a vType's id, a vClass or a kind such as `person`.
            at: Only those that are there at this time [s]; each then has a `place`.
            near: Only those that pass x, y [m] or a standing camera of the scene, at that time
                if one is given; each then has a `passage` with times and distance.
            radius: What counts as near [m]; default 30.
            sort: `begin`, `end`, `id`, `type`, `length`, `duration`, `mean`, `max` or
                `distance`.

        Returns:
            A list that shows itself as a table.

        Raises:
            ConfigError: If a choice is wrong.
            InputError: If a file is missing or damaged.
        """
        from sumo3dviz_pt.inspection.roster import RosterQuery, point_near, roster

        point = None if near is None else point_near(self.job, near, radius=radius)
        return roster(self.job, RosterQuery(type, at, point, sort))

    def still(
        self,
        *,
        time: float,
        camera: str | None = None,
        quality: str | None = None,
        size: tuple[int, int] | None = None,
        spp: int | None = None,
        seed: int | None = None,
        variant: str = "llvm",
        progress: bool | None = None,
        time_budget: float | None = None,
        target_error: float | None = None,
    ) -> Still:
        """Render one image.

        Args:
            time: SUMO's time [s].
            camera: A name from `cameras`; default the first shot's.
            quality: A preset's name; default the scene's.
            size: Width, height [px].
            spp: Samples per pixel instead of the preset's.
            seed: Instead of the scene's.
            variant: `llvm`, `cuda` or `scalar`.
            progress: Whether a bar or lines say how far it is; default on terminals and in
                notebooks.
            time_budget: CPU-seconds that a later picture may take; a pilot chooses the samples.
            target_error: FLIP that a picture may have; a pilot chooses the samples.

        Returns:
            An image with `.radiance` (h, w, 3), `.save(path)`, which overwrites a picture that
            exists, as everywhere in Python, and `.develop()`.
        """
        from sumo3dviz_pt.job.errors import asked
        from sumo3dviz_pt.job.values import Seconds
        from sumo3dviz_pt.pipeline.live import OpenShot
        from sumo3dviz_pt.pipeline.production import Request
        from sumo3dviz_pt.pipeline.steps import still_steps

        request = Request(camera, quality, size, spp, seed, variant, "", time_budget, target_error)
        time = asked(Seconds, time, key="time")
        with _followed(
            f"still at {time:.12g} s", progress, partial(still_steps, self.job, request)
        ):
            if self._open is not None and self._open.shows(self.job, request, time):
                self._open.retune(request, quality=quality or self.job.quality)
            else:
                self.close()
                self._open = OpenShot.of(self.job, request, time)
            return self._open.still(time)

    def frames(
        self,
        *,
        camera: str | None = None,
        start: float | None = None,
        end: float | None = None,
        fps: Ratio | None = None,
        speed: Ratio | None = None,
        progress: bool | None = None,
        **choices: Any,
    ) -> Iterator[Still]:
        """Render a film's frames, one after the other, without storing any.

        Args:
            camera: A name from `cameras`; default the first shot's.
            start: First frame's time [s]; default the shot's.
            end: Time after the last frame [s]; default the shot's.
            fps: Frames per second, a number or a ratio such as `30000/1001`; default the scene's.
            speed: SUMO's seconds per second of film; default the shot's.
            progress: Whether it is said what is done until the first; as in `still`.
            choices: `quality`, `size`, `spp`, `seed`, `variant` and so on, as in `still`.

        Yields:
            Images as `still` returns them: without the help that frames of a film give each other.

        Raises:
            ConfigError: Before the first, if a choice is wrong.
            RenderError: If one fails.
        """
        from sumo3dviz_pt.job.errors import made
        from sumo3dviz_pt.pipeline.films.film import FilmOrder
        from sumo3dviz_pt.pipeline.production import Request

        order = FilmOrder(Path("frames.mp4"), start=start, end=end, fps=fps, speed=speed)
        request = made(Request, {"camera": camera, **choices})
        return self._frames(request, order, progress)

    def _frames(self, request: Request, order: FilmOrder, progress: bool | None) -> Iterator[Still]:
        """Yield a film's frames."""
        from sumo3dviz_pt.pipeline.films.film import prepared
        from sumo3dviz_pt.pipeline.live import OpenShot
        from sumo3dviz_pt.pipeline.steps import opening_steps

        self.close()
        with _followed("frames", progress, partial(opening_steps, self.job)):
            opened = OpenShot(prepared(self.job, request, order))
        with opened as shot:
            yield from shot.frames()

    def render(
        self,
        path: str | Path,
        *,
        camera: str | None = None,
        start: float | None = None,
        end: float | None = None,
        progress: bool | Callable[[FrameDone], None] | None = None,
        **choices: Any,
    ) -> Films:
        """Render a film, or one for each shot.

        Args:
            path: The film; several shots need `{shot}` in its name.
            camera: A name from `cameras`; default all shots.
            start: First frame's time [s]; default the shot's.
            end: Time after the last frame [s]; default the shot's.
            progress: Whether a bar or lines say how far it is, or a function to call after
                every frame; default a bar on terminals and in notebooks.
            choices: `quality`, `size`, `spp`, `seed`, `variant`, `time_budget`, `target_error`
                as in `still`; `fps`, `speed`, `frames`, `resume`, `overwrite`, `discard_frames`,
                `mix_devices` as on the command line.

        Returns:
            The films, or the folders of frames if only `frames` were asked for: a list of
            paths that notebooks show as films.

        Raises:
            ConfigError: If a choice is wrong, or a film or frames exist and neither `resume`
                nor `overwrite` is true.
            InputError: If a file of the simulation is wrong.
            RenderError: If a frame fails; finished frames are kept.
        """
        from sumo3dviz_pt.job.errors import split
        from sumo3dviz_pt.pipeline.films.film import FilmOrder, render_film
        from sumo3dviz_pt.pipeline.production import Request
        from sumo3dviz_pt.pipeline.steps import film_steps

        own = {"camera": camera, "path": path, "start": start, "end": end}
        request, order = split(Request, FilmOrder, {**choices, **own})
        on_frame, shown = (progress, False) if callable(progress) else (None, progress)
        self.close()
        with _followed(order.path.name, shown, partial(film_steps, self.job, request, order)):
            reports = render_film(self.job, request, order, on_frame=on_frame)
        return Films(report.film or report.folder for report in reports)

    def export(
        self,
        path: str | Path,
        *,
        time: float | None = None,
        start: float | None = None,
        end: float | None = None,
        fps: float = 10.0,
        overwrite: bool = True,
        progress: bool | None = None,
    ) -> Path:
        """Export the scene for other tools, around its cameras.

        Args:
            path: A .glb, .usd, .usda, .usdc or .usdz file, or a folder for a page.
            time: One moment [s]; or a stretch by `start` and `end`.
            start: First time [s].
            end: Last time [s].
            fps: Times per second of a stretch.
            overwrite: Whether what exists there may go.
            progress: Whether a bar or lines say how far it is; default on terminals and in
                notebooks.

        Returns:
            The path.

        Raises:
            ConfigError: If times or place are wrong.
            InstallationError: If USD is asked for without the extra `usd`.
        """
        from sumo3dviz_pt.errors import ConfigError
        from sumo3dviz_pt.exports.order import ExportOrder, export
        from sumo3dviz_pt.job.errors import asked
        from sumo3dviz_pt.job.values import Seconds
        from sumo3dviz_pt.job.yaml12 import as_path
        from sumo3dviz_pt.pipeline.reading import spare_inputs
        from sumo3dviz_pt.pipeline.steps import export_steps

        first, last = (start, end) if time is None else (time, time)
        if first is None or last is None:
            raise ConfigError("give time, or start and end", key="time")
        first, last = asked(Seconds, first, key="start"), asked(Seconds, last, key="end")
        order = ExportOrder(as_path(path, key="path"), first, last, fps, overwrite)
        order.check()
        spare_inputs(self.job, order.path)
        with _followed(order.path.name, progress, partial(export_steps, self.job, order.count)):
            export(self.job, order)
        return order.path

    def view(
        self,
        *,
        size: tuple[int, int] = (480, 270),
        start: float | None = None,
        end: float | None = None,
        variant: str = "llvm",
        port: int = 0,
        height: int | None = None,
        proxy: str | None = None,
    ) -> Viewer:
        """Open the viewer; as the last line of a notebook's cell it shows the page.

        It takes a while until the scene is built. A scene that `load` has read can save key
        frames into its file. Close the viewer when it is no longer needed: it holds memory.

        Args:
            size: Width, height of its pictures [px].
            start: First time of its slider [s]; default the log's.
            end: Last time [s]; default the log's.
            variant: `llvm` or `cuda`.
            port: To listen on, on this machine only; 0 takes a free one.
            height: Of the frame in a notebook [px]; default as the picture needs.
            proxy: Where the notebook's server passes this machine's ports on, such as
                `/proxy/{port}/`; default JupyterHub's own address, where it runs one.

        Returns:
            A viewer with `.address` and `.close()`; it can stand in a `with` statement.

        Raises:
            ConfigError: If the extra `viewer` is not installed, or a choice is wrong.
            InputError: If a file of the simulation is wrong.
        """
        from sumo3dviz_pt.viewer.choices import Choices, ViewerOutlook
        from sumo3dviz_pt.viewer.notebook import Viewer
        from sumo3dviz_pt.viewer.render_thread import RenderThread

        looks = ViewerOutlook(size, start, end, variant)
        choices = Choices(port, height=height, proxy=proxy)
        render_thread = RenderThread(
            self.job,
            scene_file=self._source.file,
            size=looks.size,
            window=(looks.start, looks.end),
            variant=looks.variant,
            reload=self._source.job,
        )
        return Viewer(render_thread, size=looks.size, choices=choices)


def load(path: str | Path, overrides: Mapping[str, Any] | None = None) -> Scene:
    """Read a scene file.

    Args:
        path: The YAML file.
        overrides: Values by dotted key; they win over the file: `{"output.fps": 30,
            "output": {"size": (640, 360)}, "sky": {"file": Path("sky.hdr")}}`. Text is YAML,
            as with `--set`; text inside of lists and mappings is just text.

    Raises:
        ConfigError: If the file or a setting in it is wrong.
    """
    from sumo3dviz_pt.job.yaml12 import as_path
    from sumo3dviz_pt.pipeline.scene_file import checked_overrides

    return Scene._of(_SceneSource(as_path(path, key="path"), dict(checked_overrides(overrides))))


def example(name: str) -> Path:
    """Return a bundled example's scene file: `ronda`, a motorway, or `crossing`, a town's junction.

    Raises:
        ConfigError: If there is no such example.
    """
    from sumo3dviz_pt.pipeline import production

    return production.example(name)


def _gathered(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with the loose keys of `scenario` put in their place."""
    loose = {
        key: value
        for key, value in settings.items()
        if key in _SCENARIO_KEYS and not (key == "signals" and isinstance(value, Mapping))
    }
    rest = {key: value for key, value in settings.items() if key not in loose}
    named = rest.get("scenario", {})
    if loose and isinstance(named, Mapping):
        rest["scenario"] = {**named, **loose}
    return rest


def _followed(
    name: str, wanted: bool | None, steps: Callable[[], tuple[WorkStep, ...]]
) -> AbstractContextManager[None]:
    """Show how far work is; None shows it only where lines can be redrawn."""
    from sumo3dviz_pt.pipeline.steps import can_redraw, followed

    if wanted is None:
        wanted = can_redraw(sys.stderr)
    return followed(name, steps()) if wanted else nullcontext()


class Study:
    """Films that differ by design; printed, it says which, what differs and what they cost.

    Args:
        path: The study file.
        overrides: Values of the scene file by dotted key, for all films.

    Attributes:
        plan: What it shows: profiles, trials, films, pairs of films, playlists.
        certificate: What was found on the pairs of films, once they are rendered; None before,
            and where the study file asks for none.

    Raises:
        ConfigError: If the study file, a level or the design is wrong.
        InputError: If a design table is wrong, or the simulation's files are not there.
    """

    def __init__(self, path: str | Path, overrides: Mapping[str, Any] | None = None) -> None:
        from sumo3dviz_pt.pipeline.scene_file import override_values
        from sumo3dviz_pt.studies.file import load_study
        from sumo3dviz_pt.studies.plan import plan_study

        self.certificate: Certificate | None = None
        self.plan: StudyPlan = plan_study(load_study(Path(path)), override_values(overrides))

    def __str__(self) -> str:
        from sumo3dviz_pt.studies.run import plan_in_words

        return plan_in_words(self.plan, self.plan.stimuli)

    def __repr__(self) -> str:
        plan = self.plan
        return (
            f"<Study {plan.file.path}: {len(plan.stimuli)} films, {len(plan.trials)} trials,"
            f" {len(plan.playlists)} playlists>"
        )

    def render(self, folder: str | Path, *, progress: bool | None = None, **choices: Any) -> Films:
        """Render the films, and write the files of all tools beside them.

        Args:
            folder: Of all that comes out.
            progress: Whether a bar or lines say how far it is; default on terminals and in
                notebooks.
            choices: `resume`, `overwrite`, `discard_frames` and `variant` as on the command line.

        Returns:
            All films, those that were there already among them: a list of paths that notebooks
            show as films.

        Raises:
            ConfigError: If a choice is wrong, or films exist and neither `resume` nor `overwrite`
                is true.
            RenderError: If a frame fails; finished films and frames are kept.
        """
        from sumo3dviz_pt.job.errors import made
        from sumo3dviz_pt.pipeline.steps import can_redraw, film_steps, followed
        from sumo3dviz_pt.studies.records import film_path
        from sumo3dviz_pt.studies.run import (
            StudyOrder,
            check_study,
            film_tasks,
            finish_study,
            render_task,
        )

        order = made(StudyOrder, {**choices, "folder": folder})
        check_study(self.plan, order)
        shown = can_redraw(sys.stderr) if progress is None else progress
        for task in film_tasks(self.plan, order):
            steps = film_steps(task.stimulus.job, task.request, task.order)
            with followed(task.order.path.name, steps) if shown else nullcontext():
                render_task(self.plan, order, task)
        self.certificate = finish_study(self.plan, order).certificate
        return Films(film_path(order.folder, self.plan, each) for each in self.plan.stimuli)


def read_layers(film: Path | str, frame: int) -> FrameLayers:
    """Return the layers of a film's frame.

    Args:
        film: The film, or its folder of layers.
        frame: The frame's number, from 0.

    Raises:
        InputError: If they are missing, damaged or of another form.
    """
    from sumo3dviz_pt.pipeline.films.frames import film_name
    from sumo3dviz_pt.pipeline.films.layers import beside
    from sumo3dviz_pt.pipeline.films.stored_layers import read_frame

    path = Path(film)
    return read_frame(path if path.is_dir() else beside(film_name(path)), frame)
