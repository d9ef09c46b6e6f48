"""Makes a simulation's motion continuous as the scene file asks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.scenario import Scenario

if TYPE_CHECKING:
    from sumo3dviz_pt.motion import LogMotion
    from sumo3dviz_pt.world.shared import Outlook


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """What the shots of a report share; it counts and does not render.

    Attributes:
        outlook: Of the cameras that share a place.
        motion: Of everyone in the log.
    """

    outlook: Outlook
    motion: LogMotion


def motion_of(job: Job, scenario: Scenario, survey: Survey | None = None) -> LogMotion:
    """Return what makes continuous motion of a simulation's log.

    Args:
        job: The scene file.
        scenario: As read, all or a window of it.
        survey: Has the motion of the whole log; what it has smoothed is taken from it.
    """
    from sumo3dviz_pt.motion import LogMotion

    motion = LogMotion.of(
        scenario.traffic,
        smoother=job.motion.smoother,
        network=scenario.network,
        types=scenario.vehicle_types,
        heading=job.motion.heading,
    )
    return motion if survey is None else motion.sharing(survey.motion)
