"""Cameras that stand still."""

from __future__ import annotations

from dataclasses import dataclass

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.job.settings import EulerianCamera
from sumo3dviz_pt.model.network import UNPLACED, Location
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.shutter import INSTANT, Shutter
from sumo3dviz_pt.shot.cameras.aiming import aim_of
from sumo3dviz_pt.shot.cameras.build import ALWAYS, Camera, build_camera
from sumo3dviz_pt.shot.cameras.lenses import lens_of


@dataclass(frozen=True, slots=True, eq=False)
class StandingCamera:
    """An Eulerian camera: the same view at all times.

    Attributes:
        view: Where it stands and what it sees.
        shutter: When it lets light in.
    """

    view: View
    shutter: Shutter = INSTANT

    def view_at(self, time: float) -> View:
        """Return the view, whatever the time."""
        return self.view

    def moments(self, times: tuple[float, float] = ALWAYS) -> tuple[float, ...]:
        """Return a single time, as all views are the same."""
        return (0.0,)


def standing_view(settings: EulerianCamera, location: Location = UNPLACED) -> View:
    """Return what a camera that stands still sees.

    Args:
        settings: In SUMO's coordinates.
        location: From where ours are counted.

    Raises:
        ConfigError: If it looks at the point where it stands.
    """
    placed = aim_of(settings, location).placed(location.inside(settings.position))
    return View(placed, lens_of(settings.lens))


@build_camera.register
def _(settings: EulerianCamera, *, fleet: Fleet, left_hand: bool = False) -> Camera:
    """Build a camera that stands still."""
    return StandingCamera(standing_view(settings, fleet.location))
