"""What `render` is to do: which shots, when, and where their films go.

A film's pace is its frames per second, and SUMO's seconds in a second of film.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.errors import settle
from sumo3dviz_pt.job.settings import Job, ShotSettings
from sumo3dviz_pt.job.values import AskedRatio, Seconds, Target, Whole, asked_rate, asked_speed
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.numbers import Ratio
from sumo3dviz_pt.pipeline.production import Request, frame_times


@dataclass(frozen=True, slots=True)
class Pace:
    """Frame n of a shot shows its first time + n speed / fps.

    Attributes:
        fps: Frames per second of film.
        speed: SUMO's seconds per second of film: below 1 is slow motion, above time-lapse.
    """

    fps: Fraction
    speed: Fraction = Fraction(1)

    @classmethod
    def of(
        cls,
        job: Job,
        shot: ShotSettings,
        *,
        fps: Ratio | None = None,
        speed: Ratio | None = None,
    ) -> Pace:
        """Return a shot's pace, unless a command says another.

        Args:
            job: The scene file.
            shot: Whose speed it is.
            fps: Frames per second instead of the scene file's.
            speed: SUMO's time per film's instead of the shot's.

        Raises:
            ConfigError: If what the command says is out of range.
        """
        return cls(
            job.output.fps if fps is None else asked_rate(fps),
            shot.speed if speed is None else asked_speed(speed),
        )

    def times(self, shot: ShotSettings) -> Floats:
        """Return the times of a shot's frames, (n,) [s]."""
        return frame_times(shot.start, shot.end, self.fps, self.speed)

    def account(self) -> dict[str, Any]:
        """For the JSON beside a film; `frame_rate` is exact."""
        return {
            "fps": float(self.fps),
            "frame_rate": str(self.fps),
            "speed": float(self.speed),
        }


_NO_NAME = re.compile(r'[<>:"/\\|?*\x00-\x1f]')
"""What may not stand in a file's name on some system."""


@dataclass(frozen=True, slots=True)
class FilmOrder:
    """What `render` is to make.

    Attributes:
        path: The film.
        start: First frame's time [s]; None is the shot's.
        end: After the last frame [s]; None is the shot's.
        fps: A number or a ratio such as `30000/1001`; None is the scene file's.
        frames: First and after-last frame to render; None is all, and makes a film.
        resume: Whether matching frames are kept, and all others and the film replaced.
        discard_frames: Whether frames go as soon as no other one needs them.
        speed: SUMO's time per film's; None is the shot's.
        overwrite: Whether a film and frames that exist are replaced.
        final_exr: Whether finished frames are written as EXR files, too.
        shot: Only this shot of the scene file, counted from 1; None is all.
        mix_devices: Whether frames that another device traced are kept, too.
    """

    path: Target
    start: Seconds | None = None
    end: Seconds | None = None
    fps: AskedRatio | None = None
    frames: tuple[Whole, Whole] | None = None
    resume: bool = False
    discard_frames: bool = False
    speed: AskedRatio | None = None
    overwrite: bool = False
    final_exr: bool = False
    shot: Whole | None = None
    mix_devices: bool = False

    def __post_init__(self) -> None:
        """Refuse what is no choice."""
        settle(self)

    def pace(self, job: Job, shot: ShotSettings) -> Pace:
        """Return how a shot's time runs.

        Raises:
            ConfigError: If frame rate or speed are out of range.
        """
        return Pace.of(job, shot, fps=self.fps, speed=self.speed)


class ShotFilm(NamedTuple):
    """A shot and where its film goes."""

    shot: ShotSettings
    path: Path


def shots_of(job: Job, request: Request, order: FilmOrder) -> list[ShotFilm]:
    """Return the shots to render, each with its film's path.

    Args:
        job: The scene file.
        request: The command's choices.
        order: Which shots, when, and where to.

    Raises:
        ConfigError: If times or cameras are missing, or several shots share a name.
    """
    if request.camera is not None or order.start is not None:
        if order.shot is not None:
            raise ConfigError("give a shot's number, or --camera, --from and --to", key="shot")
        shot = _ordered_shot(job, request, order)
        return [ShotFilm(shot, _film_path(order.path, job, shot))]
    if not job.shots:
        raise ConfigError(
            "the scene has no shots; add one or give --camera, --from and --to", key="shots"
        )
    if len(job.shots) > 1 and "{shot}" not in order.path.name:
        raise ConfigError(
            f"the scene has {len(job.shots)} shots; put {{shot}} into the name of the output",
            key="output",
        )
    films = [ShotFilm(shot, _film_path(order.path, job, shot)) for shot in job.shots]
    if order.shot is None:
        return films
    if not 1 <= order.shot <= len(films):
        raise ConfigError(
            f"there is no shot {order.shot}; the scene's are 1 to {len(films)}", key="shot"
        )
    return [films[order.shot - 1]]


def _film_path(path: Path, job: Job, shot: ShotSettings) -> Path:
    """Return a shot's film: `{shot}` is its number in the scene file and its camera's name."""
    cameras = [other.camera for other in job.shots]
    number = next((n for n, other in enumerate(job.shots, start=1) if other is shot), None)
    if number is None and shot.camera in cameras:
        number = cameras.index(shot.camera) + 1
    name = shot.camera if number is None else f"{number}_{shot.camera}"
    return path.with_name(path.name.replace("{shot}", _NO_NAME.sub("-", name)))


def _ordered_shot(job: Job, request: Request, order: FilmOrder) -> ShotSettings:
    """Return the shot that the command describes."""
    from sumo3dviz_pt.pipeline.scene_file import camera_settings

    name, _ = camera_settings(job, request.camera)
    of_file = next((shot for shot in job.shots if shot.camera == name), None)
    start = order.start if order.start is not None else (of_file.start if of_file else None)
    end = order.end if order.end is not None else (of_file.end if of_file else None)
    if start is None or end is None:
        raise ConfigError(f"the scene has no shot of {name!r}; give --from and --to", key="shots")
    if end <= start:
        text = f"{end:.12g} s must be later than --from, {start:.12g} s"
        raise ConfigError(text, key="to")
    speed = of_file.speed if of_file else 1
    return ShotSettings.model_validate({"camera": name, "from": start, "to": end, "speed": speed})


def wanted_frames(frames: tuple[int, int] | None, count: int) -> range:
    """Return the frame numbers to render."""
    first, after = frames if frames is not None else (0, count)
    if not 0 <= first < after <= count:
        raise ConfigError(f"{first}:{after} does not lie within 0:{count}", key="frames")
    return range(first, after)
