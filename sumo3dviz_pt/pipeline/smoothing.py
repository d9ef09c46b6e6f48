"""Makes a simulation's motion continuous as the scene file asks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.scenario import Scenario

if TYPE_CHECKING:
    from sumo3dviz_pt.motion import LogMotion


def motion_of(job: Job, scenario: Scenario) -> LogMotion:
    """Return what makes continuous motion of a simulation's log."""
    from sumo3dviz_pt.motion import LogMotion

    return LogMotion.of(
        scenario.traffic,
        smoother=job.motion.smoother,
        network=scenario.network,
        types=scenario.vehicle_types,
        heading=job.motion.heading,
    )
