"""The edges at which `check --stress` looks: cases as values, and where their cameras stand.

A case says how it differs from the user's shot, and `facts_of` what a scene has to offer to it. A
new case is a line in `all_cases`; a new place for the camera is a function in `SPOTS`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.settings import EulerianCamera, LensSettings
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scene import Mover, Prototype, SceneData, View
from sumo3dviz_pt.model.traffic import Scenario
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.pipeline.production import Production

SIZE = (64, 36)
"""Width, height of most cases [px]."""

MOMENTS = ("shot", "first", "last", "empty", "crowded")
"""The shot's own time; the log's first and last; with no road user and with the most of them."""

ELEVATIONS = tuple(range(-18, 91, 3))
"""Of the sun [deg]: from astronomical night over exactly the horizon to the zenith."""

STOPS = tuple(range(-10, 11, 2))
"""Exposures [EV]."""

_HIGH = 2000.0  # m
_OVER_TREES = 60.0  # m
_NARROW = 5.0  # deg; the sun's disc spans six of 64 pixels


@dataclass(frozen=True, slots=True)
class Case:
    """One extreme at which a scene is rendered.

    Attributes:
        name: What users call it.
        spot: Where the camera stands: the shot's own camera (`shot`), or a name in `SPOTS`.
        moment: When, a name in `MOMENTS`.
        elevation: Of the sun instead of the scene's own [deg].
        exposure: Added to the film's [EV].
        size: Width, height [px].
        spp: Samples per pixel.
        fov: Instead of the camera's own [deg].
        film: Rendered as a film of one frame.
        twice: Rendered a second time from scratch; both must be the same to the bit.
        stored: Written as EXR and read again.
        may_be_dark: The camera stands where no light need come.
        shows_sun: The sun's disc must be in the picture.
        weather: A preset's name instead of the scene's own weather.
    """

    name: str
    spot: str = "shot"
    moment: str = "shot"
    elevation: float | None = None
    exposure: float = 0.0
    size: tuple[int, int] = SIZE
    spp: int = 2
    fov: float | None = None
    film: bool = False
    twice: bool = False
    stored: bool = False
    may_be_dark: bool = False
    shows_sun: bool = False
    weather: str | None = None

    @property
    def stage(self) -> tuple[object, ...]:
        """What must be built anew for it; cases with the same stage share that."""
        place = (self.spot, self.moment, self.size, self.fov, self.film)
        return (*place, self.elevation, self.weather)


@dataclass(frozen=True, slots=True, eq=False)
class NearbyUser:
    """A road user that a camera stands in, or close to.

    Attributes:
        id: The mover's.
        middle: Of its box, (3,) [m].
        paint: A point on its left side, (3,) [m].
        outward: Unit vector away from that side, (3,).
    """

    id: str
    middle: Floats
    paint: Floats
    outward: Floats


@dataclass(frozen=True, slots=True, eq=False)
class SceneFacts:
    """What a scene has to offer to the cases.

    Attributes:
        eye: The shot's eye, (3,) [m]; above the roof if it rides in a vehicle.
        forward: The shot's unit viewing direction, (3,).
        fov: The shot's opening angle [deg].
        road: The nearest point of a lane, (3,) [m].
        along: Unit direction of that lane, (3,).
        box: Lowest and highest corner of the network, (2, 3) [m].
        sun: Unit vector to the sun, (3,); None where the sky is the user's own picture.
        body: The nearest road user at the shot's time, or None.
        times: Of the moments that exist, by name [s].
        memory: That the machine has [MB]; 0 where it does not say.
        triangles: Of the shot.
    """

    eye: Floats
    forward: Floats
    fov: float
    road: Floats
    along: Floats
    box: Floats
    sun: Floats | None
    body: NearbyUser | None
    times: Mapping[str, float]
    memory: float
    triangles: int


def all_cases() -> tuple[Case, ...]:
    """Return all cases, in the order in which they run."""
    return (*_lights(), *_exposures(), *_weathers(), *_spots(), *_moments(), *_pictures())


def _lights() -> tuple[Case, ...]:
    """Return cases of the sun's course, and of its disc in the picture."""
    course = tuple(
        Case(f"sun at {angle} deg", elevation=angle, stored=angle in (-18, 0, 90))
        for angle in ELEVATIONS
    )
    seen = [(f"sun disc in the picture at {angle} deg", angle) for angle in (0, 30)]
    return course + tuple(
        Case(name, "at_sun", elevation=angle, fov=_NARROW, shows_sun=True, stored=True)
        for name, angle in seen
    )


def _exposures() -> tuple[Case, ...]:
    """Return cases of exposures, over twenty stops."""
    return tuple(Case(f"exposure {stop:+d} EV", exposure=stop) for stop in STOPS)


def _weathers() -> tuple[Case, ...]:
    """Return cases of all weathers by day and by night."""
    return tuple(
        Case(f"{name} by {word}", elevation=angle, weather=name, twice=word == "night")
        for name in catalog.template_names("weather")
        for word, angle in (("day", 36), ("night", -12))
    )


def _spots() -> tuple[Case, ...]:
    """Return cases of places where no one would put a camera."""
    return (
        Case("camera inside a body", "inside_body", may_be_dark=True, twice=True),
        Case("camera under the road", "under_road", may_be_dark=True),
        Case("camera 2 km high looking down", "high"),
        Case("camera 5 cm from paint", "near_paint", may_be_dark=True),
        Case("camera looks at nothing", "away"),
        Case("camera looks at the zenith", "zenith"),
        Case("camera looks straight down", "nadir"),
        Case("road at a grazing angle from 2 km", "grazing", fov=_NARROW),
        Case("field of view 5 deg", "eye", fov=5.0),
        Case("field of view 150 deg", "eye", fov=150.0),
    )


def _moments() -> tuple[Case, ...]:
    """Return cases of times at the edges of the log."""
    return (
        Case("first moment of the log", "eye", "first"),
        Case("last moment of the log", "eye", "last"),
        Case("nobody on the road", "eye", "empty"),
        Case("most road users", "eye", "crowded", twice=True),
    )


def _pictures() -> tuple[Case, ...]:
    """Return cases of sizes, films and numbers of samples."""
    return (
        Case("the shot itself", twice=True, stored=True),
        Case("film of one frame", film=True, stored=True),
        Case("picture of 1x1 pixel", size=(1, 1)),
        Case("picture of 8x8 pixels", size=(8, 8)),
        Case("1 sample per pixel", size=(8, 8), spp=1),
        Case("4096 samples per pixel", size=(8, 8), spp=4096),
        Case("picture of 3840x2160 pixels", size=(3840, 2160), spp=1),
    )


# Where cameras stand ----------------------------------------------------------------------

Spot = Callable[[SceneFacts, Case], EulerianCamera]


def _stand(facts: SceneFacts, case: Case, position: Floats, forward: Floats) -> EulerianCamera:
    """Return a camera at a place that looks along a direction, (3,) each."""
    heading = np.degrees(np.arctan2(forward[0], forward[1]))
    pitch = np.degrees(np.arctan2(forward[2], np.hypot(forward[0], forward[1])))
    return EulerianCamera(
        mode="eulerian",
        position=(float(position[0]), float(position[1]), float(position[2])),
        heading=float(heading),
        pitch=float(pitch),
        lens=LensSettings(fov=facts.fov if case.fov is None else case.fov),
    )


def _up(metres: float) -> Floats:
    """Return a step upwards, (3,) [m]."""
    return np.array([0.0, 0.0, metres])


def _eye(facts: SceneFacts, case: Case) -> EulerianCamera:
    """Return a standing camera where the shot begins."""
    return _stand(facts, case, facts.eye, facts.forward)


def _at_sun(facts: SceneFacts, case: Case) -> EulerianCamera:
    """Return a camera high above the shot, turned at the sun."""
    assert facts.sun is not None and case.elevation is not None
    elevation, azimuth = np.radians(case.elevation), np.arctan2(facts.sun[0], facts.sun[1])
    level = np.array([np.sin(azimuth), np.cos(azimuth), 0.0]) * np.cos(elevation)
    return _stand(facts, case, facts.eye + _up(200.0), level + _up(float(np.sin(elevation))))


def _inside_body(facts: SceneFacts, case: Case) -> EulerianCamera:
    """Return a camera in the middle of a road user."""
    assert facts.body is not None
    return _stand(facts, case, facts.body.middle, facts.forward)


def _near_paint(facts: SceneFacts, case: Case) -> EulerianCamera:
    """Return a camera five centimetres from a road user's side, looking at it."""
    assert facts.body is not None
    place = facts.body.paint + 0.05 * facts.body.outward
    return _stand(facts, case, place, -facts.body.outward)


def _under_road(facts: SceneFacts, case: Case) -> EulerianCamera:
    """Return a camera a metre below a lane, looking up at it a little."""
    return _stand(facts, case, facts.road - _up(1.0), facts.along + _up(0.3))


def _high(facts: SceneFacts, case: Case) -> EulerianCamera:
    """Return a camera two kilometres above a lane, looking down."""
    return _stand(facts, case, facts.road + _up(_HIGH), -_up(1.0))


def _away(facts: SceneFacts, case: Case) -> EulerianCamera:
    """Return a camera outside the network and level, with everything behind it."""
    low, high = facts.box
    place = np.array([high[0] + 200.0, (low[1] + high[1]) / 2, high[2] + 50.0])
    return _stand(facts, case, place, np.array([1.0, 0.0, 0.0]))


def _zenith(facts: SceneFacts, case: Case) -> EulerianCamera:
    """Return a camera at the shot's eye that looks straight up."""
    return _stand(facts, case, facts.eye, _up(1.0))


def _nadir(facts: SceneFacts, case: Case) -> EulerianCamera:
    """Return a camera at the shot's eye that looks straight down."""
    return _stand(facts, case, facts.eye, -_up(1.0))


def _grazing(facts: SceneFacts, case: Case) -> EulerianCamera:
    """Return a camera that looks along a lane, from 2 km behind, at less than two degrees."""
    back = _HIGH * facts.along - _up(_OVER_TREES)
    return _stand(facts, case, facts.road - back, back / np.linalg.norm(back))


SPOTS: Mapping[str, Spot] = MappingProxyType(
    {
        "eye": _eye,
        "at_sun": _at_sun,
        "inside_body": _inside_body,
        "near_paint": _near_paint,
        "under_road": _under_road,
        "high": _high,
        "away": _away,
        "zenith": _zenith,
        "nadir": _nadir,
        "grazing": _grazing,
    }
)
"""Places for the camera, by name."""

_NEEDS_BODY = frozenset({"inside_body", "near_paint"})
_NO_MOMENT = MappingProxyType(
    {
        "empty": "somebody is on the road at every moment of the log",
        "crowded": "nobody is on the road at any moment of the log",
    }
)


def why_not(case: Case, facts: SceneFacts) -> str | None:
    """Return why a scene cannot have a case, or None if it can."""
    if case.elevation is not None and facts.sun is None:
        return "the sky is a picture with a light of its own"
    if case.spot in _NEEDS_BODY and facts.body is None:
        return "nobody is on the road at the shot's time"
    if case.moment not in facts.times:
        return _NO_MOMENT.get(case.moment, "the log has no such moment")
    return _too_large(case, facts)


def _too_large(case: Case, facts: SceneFacts) -> str | None:
    """Return why a case needs more memory than the machine has, or None if it does not."""
    from sumo3dviz_pt.pipeline.costs import memory_forecast

    megapixels = case.size[0] * case.size[1] / 1e6
    if megapixels < 1:
        return None
    needed = memory_forecast(megapixels, facts.triangles)
    if facts.memory <= 0:
        return f"it needs about {needed:.0f} MB and this system does not say what it has"
    if needed > 0.7 * facts.memory:
        return f"it needs about {needed:.0f} MB of {facts.memory:.0f} MB"
    return None


_ABOVE_ROOF = 3.0
"""Height above a riding camera at which a standing copy sees more than the cabin [m]."""

_MOST_MOMENTS = 20_000


def facts_of(
    production: Production, scenario: Scenario, trajectories: Sequence[Trajectory], *, time: float
) -> SceneFacts:
    """Collect what a shot has to offer.

    Args:
        production: The shot, prepared for one time.
        scenario: The whole log.
        trajectories: Its smoothed motion.
        time: The shot's [s].
    """
    from sumo3dviz_pt.installation.doctor import physical_memory

    shot = production.shot
    view = shot.camera.view_at(time)
    eye, forward = _standing(view)
    road, along = nearest_lane(scenario.network, eye)
    lanes = [lane.shape for lane in scenario.network.lanes.values()]
    corners = np.concatenate(lanes) if lanes else eye[None]
    users = shot.fleet.movers_at(time)
    return SceneFacts(
        eye=eye,
        forward=forward,
        fov=float(np.degrees(view.lens.opening)),
        road=road,
        along=along,
        box=np.stack([corners.min(axis=0), corners.max(axis=0)]),
        sun=shot.data.sky.sun_direction,
        body=nearest_body(users, shot.fleet.prototypes, eye),
        times={"shot": time, **moments(scenario, trajectories)},
        memory=physical_memory() / 1e6,
        triangles=_triangles(shot.data),
    )


def _standing(view: View) -> tuple[Floats, Floats]:
    """Return the eye and viewing direction of a standing camera that shows the same."""
    if view.rides_in is None:
        return view.position, view.forward
    level = np.array([view.forward[0], view.forward[1], -0.15])
    return view.position + np.array([0.0, 0.0, _ABOVE_ROOF]), level / np.linalg.norm(level)


def nearest_lane(network: Network, eye: Floats) -> tuple[Floats, Floats]:
    """Return the lane's point nearest to an eye, (3,) [m], and its direction there, (3,)."""
    roads = [lane.shape for lane in network.lanes.values() if _is_road(network, lane.edge_id)]
    starts = np.concatenate([shape[:-1] for shape in roads] or [eye[None] - [0.0, 0.0, 2.0]])
    ends = np.concatenate([shape[1:] for shape in roads] or [eye[None] + [1.0, 0.0, -2.0]])
    along = ends - starts
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-9)
    share = np.einsum("ij,ij->i", eye - starts, along) / length**2
    points = starts + np.clip(share, 0.0, 1.0)[:, None] * along
    # Pieces of lanes that are too short have no direction.
    distance = np.where(length > 0.1, np.linalg.norm(points - eye, axis=1), np.inf)
    best = int(np.argmin(distance))
    return points[best], along[best] / length[best]


def _is_road(network: Network, edge: str) -> bool:
    """Return whether an edge's lanes have the direction of driving; a walking area's do not."""
    known = network.edges.get(edge)
    return known is None or known.function == "normal"


def nearest_body(
    users: Iterable[Mover], prototypes: Mapping[str, Prototype], eye: Floats
) -> NearbyUser | None:
    """Return the vehicle nearest to an eye; another road user if there is none.

    Args:
        users: Road users of a frame.
        prototypes: Their bodies.
        eye: (3,) [m].
    """

    def order(user: Mover) -> tuple[bool, float]:
        distance = np.linalg.norm(user.world_from_body.position - eye)
        return not user.id.startswith("vehicle:"), float(distance)

    nearest = min(users, key=order, default=None)
    if nearest is None:
        return None
    parts = prototypes[nearest.prototype].parts
    points = np.concatenate([part.mesh.vertices for part in parts])
    low, high = points.min(axis=0), points.max(axis=0)
    side = _on_side(points, low, high)
    middle, paint = nearest.world_from_body.points(np.stack([(low + high) / 2, side]))
    outward = nearest.world_from_body.directions(np.array([[0.0, 1.0, 0.0]]))[0]
    return NearbyUser(nearest.id, middle, paint, outward / np.linalg.norm(outward))


def _on_side(points: Floats, low: Floats, high: Floats) -> Floats:
    """Return a point on the left side of a body at half height, behind the mirrors."""
    size = high - low
    share = (points - low) / np.maximum(size, 1e-9)
    band: Bools = (np.abs(share[:, 0] - 0.4) < 0.15) & (np.abs(share[:, 2] - 0.5) < 0.15)
    if not band.any():
        return np.array([low[0] + 0.4 * size[0], high[1], low[2] + 0.5 * size[2]])
    return np.asarray(points[band][np.argmax(points[band, 1])])


def moments(scenario: Scenario, trajectories: Sequence[Trajectory]) -> dict[str, float]:
    """Return the edges of the log that exist: `first`, `last`, `empty`, `crowded` [s]."""
    log = scenario.traffic
    times_of = {"first": log.begin, "last": log.end}
    count = 1 if log.step <= 0 else round((log.end - log.begin) / log.step) + 1
    times = np.linspace(log.begin, log.end, max(1, min(count, _MOST_MOMENTS)))
    lives = [(p.begin, p.end) for trajectory in trajectories for p in trajectory.pieces]
    begins, ends = np.sort(np.array(lives).reshape(-1, 2), axis=0).T
    alive = np.searchsorted(begins, times, "right") - np.searchsorted(ends, times, "left")
    if alive.min() == 0:
        times_of["empty"] = float(times[np.argmin(alive)])
    if alive.max() > 0:
        times_of["crowded"] = float(times[np.argmax(alive)])
    return times_of


def _triangles(data: SceneData) -> int:
    """Return about how many triangles the renderer holds."""
    static = sum(len(part.part.mesh.faces) for part in data.static)
    return static + sum(prototype.triangles for prototype in data.prototypes.values())
