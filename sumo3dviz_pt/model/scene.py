"""What a shot hands to the renderer: plain values, no Mitsuba.

Everything is in world coordinates of the network (float64 metres); the renderer
recentres. Materials are dicts in Mitsuba's words with some words of our own:

* `{"type": "tint"}` as a colour is that of the part's faces, or of a mover;
* `{"type": "coated"}` is a varnished paint (`coated` in `library/materials.py`);
* `{"type": "bitmap", "filename": "<absolute path>"}` can be loaded twice;
* `{"type": "draped"}` is such a picture of the land from above (`render/draped.py`).

Lamps are on vehicles, or stand still. Their radiances are in scene units, linear sRGB primaries.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from sumo3dviz_pt.model.falling import Falling, Pane
from sumo3dviz_pt.model.geometry import Colour, Floats, Image, Ints, Mesh, Transform, frozen
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.swaying import Swaying
from sumo3dviz_pt.model.trajectory import TyreTracks
from sumo3dviz_pt.model.weather import CloudLayer, StoredClouds, Weather, WeatherCourse

CANDELAS_PER_UNIT = 32_000.0
"""Luminance of radiance 1 [cd/m^2]: a sunlit white wall has about 1."""

LENS_THAT_SHINES = 0.0
"""Reflectance of a vehicle's lamp while it shines: nothing else is as black, which tells it."""


@dataclass(frozen=True, slots=True, eq=False)
class Sky:
    """The environment as a recipe; the renderer bakes it into one map.

    Attributes:
        sun_direction: Unit vector to the sun (east, north, up), or None for no sun.
        turbidity: Of the clear-sky model, [1, 10].
        clouds: A layer over the clear sky, or None.
        image: A user's radiance map instead of all this, (h, w, 3), rows from the
            zenith to the nadir, columns as in `CloudLayer`; or None.
        image_scale: Scene units per unit of `image`.
        rotation: Turns clouds and image clockwise seen from above [rad].
        night: Radiance of a moonless night sky, scene units; added everywhere.
        moon_direction: Unit vector to the full moon, or None; it gives no light beside
            the sun.
        stars: Seed of the stars, or None for none.
        glow: Radiance of a city's light at the horizon, scene units.
        tint: What the sun's light and sky are multiplied with.
        exposure: EV at which this sky looks right; the film's exposure adds to it.
        overcast: Clouds that rain or snow falls from at some time, or None.
    """

    sun_direction: Floats | None
    turbidity: float = 3.0
    clouds: CloudLayer | StoredClouds | None = None
    image: Image | None = None
    image_scale: float = 1.0
    rotation: float = 0.0
    night: Colour = (0.0, 0.0, 0.0)
    moon_direction: Floats | None = None
    stars: int | None = None
    glow: Colour = (0.0, 0.0, 0.0)
    tint: Colour = (1.0, 1.0, 1.0)
    exposure: float = 0.0
    overcast: CloudLayer | StoredClouds | None = None

    def __post_init__(self) -> None:
        """Make the directions unit vectors."""
        for name in ("sun_direction", "moon_direction"):
            value = getattr(self, name)
            if value is not None:
                direction = np.asarray(value, dtype=np.float64)
                object.__setattr__(self, name, frozen(direction / np.linalg.norm(direction)))


@dataclass(frozen=True, slots=True)
class Haze:
    """Aerial perspective: radiance x transmittance + in-scattered horizon light.

    Attributes:
        extinction: Per metre for red, green, blue [1/m].
        falls: Extinction of rain and snow that fall through it, where lamps light them [1/m].
    """

    extinction: Colour = (0.85 / 2600, 1.0 / 2600, 1.2 / 2600)
    falls: float = 0.0


@dataclass(frozen=True, slots=True)
class VehicleLamp:
    """A lamp on a body: a flat ellipse that shines away from it.

    Attributes:
        role: What lights it: `head`, `tail`, `brake`, `left`, `right`, `reverse`, `blue`,
            `sign`, and in a driver's own cabin `dials`, `screen`.
        at: Its centre in the body's frame, a few millimetres before the lens [m].
        size: Its width and height [m].
        yaw: Where it shines, from the body's +x [rad]: 0 forward, pi backward.
    """

    role: str
    at: tuple[float, float, float]
    size: tuple[float, float]
    yaw: float


@dataclass(frozen=True, slots=True)
class Lobe:
    """How radiance falls with the angle t from a lamp's axis: f + (1 - f) exp(-k (1 - cos t)).

    Attributes:
        floor: What is left far from the axis, f; 1 shines alike everywhere (Lambert's law), and
            more than 1 is brighter there, like luminaires that light a road evenly.
        sharpness: k; all above the floor has fallen to half where 1 - cos t = ln 2 / k.
    """

    floor: float = 1.0
    sharpness: float = 0.0

    def at(self, cosine: Floats) -> Floats:
        """Radiance against that on the axis, for cosines of angles from it."""
        return self.floor + (1.0 - self.floor) * np.exp(self.sharpness * (cosine - 1.0))

    @property
    def flux(self) -> float:
        """Of a small flat lamp that gives one candela on its axis [lm].

        The integral of `at` times the cosine over the half sphere; pi by Lambert's law.
        """
        k = max(self.sharpness, 1e-6)
        peak = 1.0 / k + np.expm1(-k) / k**2 if k > 1e-3 else 0.5
        return float(2.0 * np.pi * (0.5 * self.floor + (1.0 - self.floor) * peak))


@dataclass(frozen=True, slots=True, eq=False)
class LampSet:
    """Lamps that stand still, as one mesh; their radiance may change from frame to frame.

    Attributes:
        id: Unique, such as `signals`.
        family: As in `StaticPart`.
        mesh: All lenses, in world coordinates.
        lamp_of_face: Which lamp each face belongs to, (m,).
        lamps: Lamp names, such as `J1/3/green`.
        sampled: Whether light paths aim at them (night); in daylight they are
            only seen, which costs nothing.
        radiance: Of lamps that never change, (lamps, 3); None for those that a
            frame's state lights.
        weight: How often paths aim at this set, against others that give as much light.
        tint: Linear reflectance of each face's glass, (m, 3); None for dark grey.
        lobe: How they shine to the sides, where they are sampled.
    """

    id: str
    family: str
    mesh: Mesh
    lamp_of_face: Ints
    lamps: tuple[str, ...]
    sampled: bool = False
    radiance: Floats | None = None
    weight: float = 1.0
    tint: Floats | None = None
    lobe: Lobe = Lobe()

    def __post_init__(self) -> None:
        """Freeze the index."""
        object.__setattr__(self, "lamp_of_face", frozen(self.lamp_of_face, np.int64))


def aimed_at(lamps: Sequence[LampSet], *, dark: bool) -> tuple[LampSet, ...]:
    """Return lamps that change, with light paths that aim at them only when it is dark."""
    return tuple(replace(some, sampled=dark) if some.radiance is None else some for some in lamps)


@dataclass(frozen=True, slots=True, eq=False)
class Beam:
    """What a vehicle's head lamps throw on the road.

    Attributes:
        pattern: Share of the peak, (n, n), rows from above to below, columns from left
            to right, straight ahead in the middle; even in the tangent of the angle.
        half_angle: From the middle to the pattern's edge [rad].
        intensity: Peak of both lamps of a car, scene units x m^2.
    """

    pattern: Image
    half_angle: float
    intensity: Colour


@dataclass(frozen=True, slots=True, eq=False)
class RunningLights:
    """Lamps on vehicles.

    Attributes:
        intensity: On the axis of one lamp by role, scene units x m^2; roles that are
            missing never shine.
        beam: Of head lamps, or None by day.
        sampled: As in `LampSet`.
        lobes: How lamps shine to the sides, by role; those missing by Lambert's law.
        heads: Share of a car's head lamps that other bodies have, by their names.
    """

    intensity: Mapping[str, Colour]
    beam: Beam | None = None
    sampled: bool = False
    lobes: Mapping[str, Lobe] = field(default_factory=dict)
    heads: Mapping[str, float] = field(default_factory=dict)


Bsdf = Mapping[str, Any]
"""A material in Mitsuba's words."""

ORIGIN_GRID = 250.0
"""Spacing of the renderer's possible origins [m]."""


def is_tinted(bsdf: Bsdf) -> bool:
    """Return whether a material takes its colour from faces or movers."""
    return any(
        isinstance(value, Mapping) and (value.get("type") == "tint" or is_tinted(value))
        for value in bsdf.values()
    )


OWN = "own"
"""The role of what takes a mover's own colour."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A mesh and what it is made of.

    Attributes:
        mesh: In the frame of what it belongs to.
        material: A name in `SceneData.materials`.
        tint: Linear reflectance of each face, (m, 3), for tinted materials
            whose colour does not come from a mover; with a role, what the mover's colour of that
            role is multiplied with.
        role: Which of a mover's colours it takes: `OWN`, or a key of its outfit; empty for none.
    """

    mesh: Mesh
    material: str
    tint: Floats | None = None
    role: str = ""

    def __post_init__(self) -> None:
        """Freeze the tints and check their number."""
        if self.tint is not None:
            tint = frozen(self.tint).reshape(-1, 3)
            if len(tint) != len(self.mesh.faces):
                raise ValueError(f"{len(tint)} tints for {len(self.mesh.faces)} faces")
            object.__setattr__(self, "tint", tint)


@dataclass(frozen=True, slots=True, eq=False)
class StaticPart:
    """A part that never moves, in world coordinates.

    Attributes:
        id: Unique, such as `road/asphalt`.
        family: What a user would call it: `ground`, `roads`, `markings`, `trees`,
            `fences`, `homes`, `shops`, `blocks`, `buildings`, `signals`.
        part: Mesh, material and tints.
    """

    id: str
    family: str
    part: Part


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Shapes that a body takes: at rest, then the phases of a movement that repeats.

    Attributes:
        vertices: Of all parts in their order, (poses, v, 3) [m].
        normals: Unit, of the same vertices, (poses, v, 3).
        steady: Whether each mover keeps one of them, so that it moves as a rigid body does.
    """

    vertices: Floats
    normals: Floats
    steady: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Prototype:
    """A body that movers show; +x forward, origin on the ground under the front's middle.

    Attributes:
        name: Unique, such as `sedan`.
        parts: The detailed body.
        far: A cheap stand-in with the same outline for far away.
        lamps: What can shine on it.
        poses: Shapes that `parts` take in turn; such bodies are never instanced.
        far_poses: Shapes that `far` takes in turn.
        rooted: Whether its movers stand still, as plants do.
    """

    name: str
    parts: tuple[Part, ...]
    far: tuple[Part, ...]
    lamps: tuple[VehicleLamp, ...] = ()
    poses: Poses | None = None
    far_poses: Poses | None = None
    rooted: bool = False

    @property
    def triangles(self) -> int:
        """Triangles of the detailed body."""
        return sum(len(part.mesh.faces) for part in self.parts)


@dataclass(frozen=True, slots=True, eq=False)
class Mover:
    """One road user in one frame.

    Attributes:
        id: The trajectory's key, such as `vehicle:flow_0.3`.
        prototype: A name in `SceneData.prototypes`.
        world_from_body: Its placement, scaled to its vType's size.
        colour: Linear reflectance of its tinted materials.
        lit: Roles of its lamps that shine.
        part: Empty for the road user itself; else a further part of it, such as `wheel0`.
        phase: Of the movement of its prototype's poses, [0, 1).
        effort: How much of that it shows, [0, 1].
        parked: Whether it never moves, so that snow lies on it as on what stands.
        outfit: Factors of its parts' reflectance, by their roles; 1 for those missing.
        flop: How much its colour is an effect paint, that darkens where one looks along it, [0, 1].
    """

    id: str
    prototype: str
    world_from_body: Transform
    colour: Colour
    lit: frozenset[str] = frozenset()
    part: str = ""
    phase: float = 0.0
    effort: float = 0.0
    parked: bool = False
    outfit: Mapping[str, Colour] = field(default_factory=dict)
    flop: float = 0.0

    @property
    def name(self) -> str:
        """Unique among what moves in a frame, and the same in all frames."""
        return f"{self.id}/{self.part or 'body'}"


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Something that was left out of a scene, and why.

    Attributes:
        what: Such as `signals` or `120 trees`.
        why: Such as `the network has none`.
        surprising: Whether people are told of it unasked.
        triangles: About how many it would take where it is; None where only building it
            would tell.
    """

    what: str
    why: str
    surprising: bool = False
    triangles: int | None = None


@dataclass(frozen=True, slots=True)
class Slots:
    """How many bodies of each prototype a shot shows at once, at most.

    Attributes:
        near: Detailed bodies by prototype name.
        far: Stand-ins by prototype name.
        deforming: Detailed bodies that take poses, by prototype name.
    """

    near: Mapping[str, int] = field(default_factory=dict)
    far: Mapping[str, int] = field(default_factory=dict)
    deforming: Mapping[str, int] = field(default_factory=dict)

    @property
    def detailed(self) -> Mapping[str, int]:
        """Detailed bodies, whether they take poses or not."""
        return {**self.near, **self.deforming}

    def hold(self, frame: FrameState) -> bool:
        """Return whether there is room for all that moves in a frame, at every moment of it."""
        return all(
            Counter(mover.prototype for mover in movers) <= Counter(room)
            for state in (frame, *(moment.frame for moment in frame.exposure))
            for movers, room in (
                ((*state.movers, *state.fixtures), self.near),
                (state.far, self.far),
                (state.deforming, self.deforming),
            )
        )


@dataclass(frozen=True, slots=True, eq=False)
class SceneData:
    """Everything that does not change during a shot.

    Attributes:
        materials: BSDFs by name; only those in use.
        static: What never moves.
        prototypes: What movers show, by name; only those in use.
        lamps: Lamp sets; empty when nothing shines.
        sky: The environment.
        running: Lamps on vehicles, or None where none shine.
        slots: Room for movers; fixed, so that nothing compiles during a film.
        haze: Aerial perspective, or None.
        left_out: What was left out, and why.
        weather: Over time; None for a dry and clear summer.
        tracks: Where wheels have passed, if snow lies on roads; else None.
        ruts: Where lanes are worn down by wheels, if puddles stand there; else None.
        swaying: How wind moves parts of `static`, by their ids; all others stand still.
        origin: What is from files, derived or invented, in words; empty without a town.
    """

    materials: Mapping[str, Bsdf]
    static: tuple[StaticPart, ...]
    prototypes: Mapping[str, Prototype]
    lamps: tuple[LampSet, ...]
    sky: Sky
    slots: Slots = field(default_factory=Slots)
    haze: Haze | None = None
    running: RunningLights | None = None
    left_out: tuple[LeftOut, ...] = ()
    weather: WeatherCourse | None = None
    tracks: TyreTracks | None = None
    ruts: TyreTracks | None = None
    swaying: Mapping[str, Swaying] = field(default_factory=dict)
    origin: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Where a camera is and what it sees with.

    Attributes:
        world_from_camera: Camera frame: +x forward, +y left, +z up.
        lens: What it sees with.
        rides_in: Mover id of the vehicle that the camera sits in, or None.
        cutaway: True if that vehicle's cabin must not be drawn (driver's view).
        mirrors: Where the mirrors of that vehicle look, unit, (3,); None if it shows none.
        pane: Before the eye, if its reflections are wanted.
    """

    world_from_camera: Transform
    lens: Lens
    rides_in: str | None = None
    cutaway: bool = False
    mirrors: Floats | None = None
    pane: Pane | None = None

    @property
    def position(self) -> Floats:
        """The eye, (3,) [m]."""
        return self.world_from_camera.position

    @property
    def forward(self) -> Floats:
        """Unit viewing direction, (3,)."""
        return self.world_from_camera.matrix[:3, 0]

    @property
    def origin(self) -> Floats:
        """Where the renderer puts its own origin: the eye on a 250 m grid, (3,) [m].

        Mitsuba lets rays start 9e-5 x (distance from that origin) off their surface, so
        shadows where things touch are right only near it.
        """
        return np.round(self.position / ORIGIN_GRID) * ORIGIN_GRID

    def directions(self, size: tuple[int, int]) -> Floats:
        """World direction through every pixel's centre, unit, (h, w, 3).

        Args:
            size: Width, height [px].
        """
        return self.world_from_camera.directions(self.lens.rays(size))

    def pixel_angle(self, width: int) -> float:
        """Angle of a pixel of a picture so wide [px] [rad]; of parallel rays, at the ground."""
        down = max(-float(self.forward[2]), 0.05)
        return self.lens.pixel_angle(width, away=max(float(self.position[2]) / down, 10.0))

    def points(self, distances: Floats, size: tuple[int, int]) -> Floats:
        """World points at distances, (h, w) [m], along rays through pixels' centres, (h, w, 3)."""
        points = self.position + self.directions(size) * distances[..., None]
        origins = self.lens.origins(size)
        return points if origins is None else points + self.world_from_camera.directions(origins)


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """What a part of a picture's rows sees at one moment of an exposure.

    Attributes:
        rows: Where they begin and end, shares of the picture's height from the top.
        frame: What is there then.
    """

    rows: tuple[float, float]
    frame: FrameState


@dataclass(frozen=True, slots=True, eq=False)
class FrameState:
    """Everything that changes from frame to frame.

    Attributes:
        time: SUMO's time [s].
        view: The camera.
        movers: Road users, or parts of them, that are drawn in detail.
        far: Those that are drawn by their stand-ins.
        lamps: Radiance of each lamp that changes, (lamps, 3), by lamp set id.
        deforming: Those that are drawn in detail and take poses.
        fixtures: What is drawn as a body and is no road user: the arms of barriers, and plants
            of which many are alike.
        weather: Of its time, or None.
        flying: Finds what falls and flies before the camera; None where nothing does.
        exposure: The moments at which a picture with a shutter sees the scene: every row at
            equally many of them. Empty where all light comes at once; else all else is what there
            is in the middle of the exposure.
    """

    time: float
    view: View
    movers: tuple[Mover, ...]
    far: tuple[Mover, ...] = ()
    lamps: Mapping[str, Floats] = field(default_factory=dict)
    deforming: tuple[Mover, ...] = ()
    fixtures: tuple[Mover, ...] = ()
    weather: Weather | None = None
    flying: Callable[[], Falling] | None = None
    exposure: tuple[Moment, ...] = ()

    def as_seen_from(self, view: View) -> FrameState:
        """Return the same moment before another camera, which stands still."""
        falling = None if view is self.view else self.falling()
        if falling is None:
            return replace(self, view=view)
        here = view.world_from_camera.matrix
        seen = replace(falling, cameras=np.stack([here, here]))
        if (view.rides_in, view.cutaway) != (self.view.rides_in, self.view.cutaway):
            seen = replace(seen, cabin=None, windscreen=None)
        return replace(self, view=view, flying=lambda: seen)

    def falling(self) -> Falling | None:
        """Find what falls and flies before the camera, or None."""
        return None if self.flying is None else self.flying()

    @property
    def instanced(self) -> tuple[Mover, ...]:
        """Everything that takes a near slot: rigid road users in detail, and fixtures."""
        return (*self.movers, *self.fixtures)

    @property
    def everyone(self) -> tuple[Mover, ...]:
        """All road users that are drawn, at any level."""
        return (*self.movers, *self.deforming, *self.far)

    @property
    def users(self) -> frozenset[str]:
        """Ids of all road users that are drawn."""
        return frozenset(mover.id for mover in self.everyone)

    @property
    def origin(self) -> Floats:
        """Where the renderer puts its own origin; see `View.origin`."""
        return self.view.origin
