"""The Python API: the same jobs and the same pixels as the command line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sumo3dviz_pt.film import FrameDone
    from sumo3dviz_pt.job import Job
    from sumo3dviz_pt.pipeline import Still

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

        self.job: Job = make_job(_gathered(settings))

    @classmethod
    def of(cls, job: Job) -> Scene:
        """Wrap a validated job."""
        scene = cls.__new__(cls)
        scene.job = job
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

    return Scene.of(load_job(Path(path), overrides))


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
