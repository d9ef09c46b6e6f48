"""How a film's time runs: frames per second of film, and SUMO's seconds in them."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from sumo3dviz_pt.job.settings import Job, ShotSettings
from sumo3dviz_pt.job.values import asked_rate, asked_speed
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.ratios import Ratio
from sumo3dviz_pt.pipeline.production import frame_times


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
