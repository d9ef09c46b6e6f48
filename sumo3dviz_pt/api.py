"""The Python API: the same jobs and the same pixels as the command line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sumo3dviz_pt.film import FrameDone
    from sumo3dviz_pt.job import Job
    from sumo3dviz_pt.still import Still
    from sumo3dviz_pt.viewer.notebook import Viewer

_Remade = Callable[[Mapping[str, str]], "Job"]

_SCENARIO_KEYS = frozenset(
    {"sumocfg", "folder", "network", "trajectories", "signals", "additional", "vehicle_types"}
)


class Scene:
    """A scene to take pictures of.

    Args:
        settings: The keys of a scene file. Those of `scenario` may stand by themselves:
            `Scene(network="a.net.xml", trajectories="fcd.xml", sky={...})`; a list or a
            path under `signals` means the signal log, a mapping the looks of signals.

    Raises:
        ConfigError: If a setting is wrong.
    """

    def __init__(self, **settings: Any) -> None:
        from sumo3dviz_pt.jobfile import make_job

        gathered = _gathered(settings)
        self.job: Job = make_job(gathered)
        self._file: Path | None = None
        self._remade: _Remade | None = lambda choices: make_job({**gathered, **choices})

    @classmethod
    def of(cls, job: Job) -> Scene:
        """Wrap a validated job."""
        scene = cls.__new__(cls)
        scene.job, scene._file, scene._remade = job, None, None
        return scene

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

        Returns:
            An image with `.radiance` (h, w, 3), `.save(path)` and `.develop()`.
        """
        from sumo3dviz_pt.pipeline import Request, render_still

        return render_still(self.job, Request(camera, quality, size, spp, seed, variant), time)

    def render(
        self,
        path: str | Path,
        *,
        camera: str | None = None,
        start: float | None = None,
        end: float | None = None,
        progress: bool | Callable[[FrameDone], None] = False,
        **choices: Any,
    ) -> list[Path]:
        """Render a film, or one for each shot.

        Args:
            path: The film; several shots need `{shot}` in its name.
            camera: A name from `cameras`; default all shots.
            start: First frame's time [s]; default the shot's.
            end: Time after the last frame [s]; default the shot's.
            progress: True logs every frame; or a function to call.
            choices: `quality`, `size`, `spp`, `seed`, `variant` as in `still`; `fps`,
                `frames`, `resume`, `discard_frames` as on the command line.

        Returns:
            The films, or the folders of frames if only `frames` were asked for.
        """
        from sumo3dviz_pt.film import FilmOrder, render_film
        from sumo3dviz_pt.pipeline import Request

        asked = {key: choices.pop(key) for key in _REQUEST_KEYS & set(choices)}
        order = FilmOrder(Path(path), start=start, end=end, **choices)
        on_frame = progress if callable(progress) else (_log_frame if progress else None)
        reports = render_film(self.job, Request(camera=camera, **asked), order, on_frame=on_frame)
        return [report.film or report.folder for report in reports]

    def view(
        self,
        *,
        size: tuple[int, int] = (480, 270),
        start: float | None = None,
        end: float | None = None,
        variant: str = "llvm",
        port: int = 0,
        height: int | None = None,
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

        Returns:
            A viewer with `.address` and `.close()`; it can stand in a `with` statement.

        Raises:
            ConfigError: If the extra `viewer` is not installed, or a choice is wrong.
            InputError: If a file of the simulation is wrong.
        """
        from sumo3dviz_pt.viewer.notebook import Choices, Viewer
        from sumo3dviz_pt.viewer.studio import Studio

        studio = Studio(
            self.job,
            scene_file=self._file,
            size=size,
            window=(start, end),
            variant=variant,
            reload=self._remade,
        )
        return Viewer(studio, size=size, choices=Choices(port, height=height))


_REQUEST_KEYS = frozenset({"quality", "size", "spp", "seed", "variant"})


def load(path: str | Path, overrides: Mapping[str, str] | None = None) -> Scene:
    """Read a scene file.

    Args:
        path: The YAML file.
        overrides: YAML values by dotted key; they win over the file.

    Raises:
        ConfigError: If the file or a setting in it is wrong.
    """
    from sumo3dviz_pt.jobfile import load_job

    file, given = Path(path), dict(overrides or {})
    scene = Scene.of(load_job(file, given))
    scene._file = file
    scene._remade = lambda choices: load_job(file, {**given, **choices})
    return scene


def _gathered(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with the loose keys of `scenario` put in their place."""
    loose = {
        key: value
        for key, value in settings.items()
        if key in _SCENARIO_KEYS and not (key == "signals" and isinstance(value, Mapping))
    }
    rest = {key: value for key, value in settings.items() if key not in loose}
    if loose:
        rest["scenario"] = {**rest.get("scenario", {}), **loose}
    return rest


def _log_frame(news: FrameDone) -> None:
    """Log how far a film is."""
    import logging

    logging.getLogger(__name__).info(
        "frame %d of %d, %.0f s left", news.done, news.total, news.seconds_left
    )
