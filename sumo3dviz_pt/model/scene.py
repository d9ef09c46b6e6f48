"""What a shot hands to the renderer: plain values, no Mitsuba.

Everything is in world coordinates of the network (float64 metres); the renderer
recentres. Materials are dicts in Mitsuba's words with two words of our own:

* `{"type": "tint"}` as a colour: comes from the part's face tints, or, for a
  mover, from the mover's colour;
* `{"type": "bitmap", "filename": "<absolute path>"}` needs no tensor, so that a
  dict can be loaded twice.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from sumo3dviz_pt.model.falling import Falling
from sumo3dviz_pt.model.geometry import Colour, Floats, Mesh, Transform, frozen
from sumo3dviz_pt.model.lamps import LampSet, RunningLights, VehicleLamp
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.panes import Pane
from sumo3dviz_pt.model.skies import CloudLayer as CloudLayer
from sumo3dviz_pt.model.skies import Haze as Haze
from sumo3dviz_pt.model.skies import Sky as Sky
from sumo3dviz_pt.model.swaying import Swaying
from sumo3dviz_pt.model.tyre_tracks import TyreTracks
from sumo3dviz_pt.model.weather import Weather, WeatherCourse

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


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A mesh and what it is made of.

    Attributes:
        mesh: In the frame of what it belongs to.
        material: A name in `SceneData.materials`.
        tint: Linear reflectance of each face, (m, 3), for tinted materials
            whose colour does not come from a mover.
    """

    mesh: Mesh
    material: str
    tint: Floats | None = None

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
    """

    name: str
    parts: tuple[Part, ...]
    far: tuple[Part, ...]
    lamps: tuple[VehicleLamp, ...] = ()
    poses: Poses | None = None
    far_poses: Poses | None = None

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
        part: Empty for the road user itself; else which further part of it this is,
            such as `wheel0` or `unit1`.
        phase: Of the movement of its prototype's poses, [0, 1).
        effort: How much of that movement it shows: 0 at rest, 1 all of it.
        parked: Whether it never moves, so that snow lies on it as on what stands.
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
        fixtures: What moves and is no road user, such as the arms of barriers.
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
