"""The scene file: every setting with its default, unit, range and meaning, said once.

All of them stand in the setting's `Field`. The command line's help, the check of scene files, the
JSON schema and the manual's table are made from these. Angles are degrees here and radians inside.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

from pydantic import BaseModel, Field, model_validator
from pydantic.fields import FieldInfo

from sumo3dviz_pt.files.forms import Form
from sumo3dviz_pt.job.cameras import CameraSettings as CameraSettings
from sumo3dviz_pt.job.cameras import CinematicCamera as CinematicCamera
from sumo3dviz_pt.job.cameras import EulerianCamera as EulerianCamera
from sumo3dviz_pt.job.cameras import KeyFrame as KeyFrame
from sumo3dviz_pt.job.cameras import LagrangianCamera as LagrangianCamera
from sumo3dviz_pt.job.cameras import LensSettings as LensSettings
from sumo3dviz_pt.job.overlays import OverlaySettings as OverlaySettings
from sumo3dviz_pt.job.surroundings import ObjectSettings as ObjectSettings
from sumo3dviz_pt.job.surroundings import ObjectsSettings as ObjectsSettings
from sumo3dviz_pt.job.surroundings import SoundSettings as SoundSettings
from sumo3dviz_pt.job.surroundings import TableSettings as TableSettings
from sumo3dviz_pt.job.surroundings import TrafficSettings as TrafficSettings
from sumo3dviz_pt.job.surroundings import WeatherSettings as WeatherSettings
from sumo3dviz_pt.job.values import (
    MOST_ENTRIES,
    Colours,
    Date,
    File,
    FilePart,
    Finite,
    HexColour,
    Latitude,
    Longitude,
    Names,
    OneOrMoreFiles,
    OwnLook,
    Positive,
    Rate,
    Seconds,
    Seed,
    Size,
    Speed,
    Surface,
    TimeOfDay,
    Turn,
    Whole,
    Zone,
    models_in,
)
from sumo3dviz_pt.job.values import Settings as Settings
from sumo3dviz_pt.model.numbers import LAYER_KINDS, LayerName, ResponseName

if TYPE_CHECKING:
    from sumo3dviz_pt.model.traffic import LandFiles, TableChoices

Lights = Literal["auto", "on", "off"]
"""When lamps are lit."""


class ScenarioSettings(Settings):
    """Which simulation to show."""

    sumocfg: File | None = Field(None, description="SUMO configuration; names the rest")
    folder: File | None = Field(None, description="folder that is searched by content")
    network: File | None = Field(None, description=".net.xml or .net.xml.gz")
    trajectories: OneOrMoreFiles | TableSettings = Field(
        (), description="FCD logs (.xml, .csv, .parquet; .gz), or tables of other tools"
    )
    signals: OneOrMoreFiles = Field(
        (), description="logs of SaveTLSStates, SaveTLSSwitchStates or SaveTLSSwitchTimes"
    )
    additional: OneOrMoreFiles = Field((), description="POIs, polygons and vTypes")
    vehicle_types: OneOrMoreFiles = Field((), description="files that hold vTypes")
    allow_truncated: bool = Field(False, description="use the complete steps of a cut-off log")
    allow_misfit: bool = Field(
        False, description="show a log that seems wrong or of another network; it is only noted"
    )

    @property
    def logs(self) -> tuple[Path, ...]:
        """The files that tell where road users are."""
        own = self.trajectories
        return own.file if isinstance(own, TableSettings) else own

    @property
    def table(self) -> TableChoices:
        """How logs are to be understood that are no logs of SUMO."""
        from sumo3dviz_pt.model.traffic import TableChoices

        own = self.trajectories
        return own.choices if isinstance(own, TableSettings) else TableChoices()


class SunSettings(Settings):
    """Where the sun stands: by date, time and place, or by angles."""

    date: Date | None = Field(None, description="calendar date, such as 2026-06-21")
    time: TimeOfDay | None = Field(None, description='clock time there, such as "17:30"')
    zone: Zone | None = Field(
        None, description="Europe/Berlin, +02:00, or solar for mean solar time; default the place's"
    )
    place: tuple[Latitude, Longitude] | None = Field(
        None, description="latitude, longitude [deg]; default the network's"
    )
    azimuth: Turn | None = Field(None, description="clockwise from north [deg]")
    elevation: Finite | None = Field(None, ge=-90, le=90, description="above the horizon [deg]")

    @model_validator(mode="after")
    def _one_way(self) -> SunSettings:
        """Ask for exactly one complete way of placing the sun."""
        by_angle = self.azimuth is not None and self.elevation is not None
        by_clock = self.date is not None and self.time is not None
        if by_angle == by_clock:
            raise ValueError("give either date and time, or azimuth and elevation")
        if self.zone is not None and not by_clock:
            raise ValueError("a zone goes with date and time")
        return self


class SkySettings(Settings):
    """The sky, and with it the light."""

    preset: str | None = Field(None, description="a name from `scene_templates/sky`")
    sun: SunSettings | None = Field(None, description="moves the sun; alone it means a clear sky")
    file: File | None = Field(None, description="equirectangular radiance map (.exr, .hdr)")
    turbidity: Finite | None = Field(None, ge=1, le=10, description="haziness of the clear sky")
    rotation: Turn = Field(0.0, description="turns clouds or map clockwise from above [deg]")
    scale: Finite = Field(1.0, ge=1e-6, le=1e6, description="brightness factor of `file`")


class PictureSettings(Settings):
    """A picture of the land from above, north up."""

    file: File = Field(description="PNG, JPEG or TIFF")
    corners: tuple[tuple[Finite, Finite], tuple[Finite, Finite]] = Field(
        description="south-western and north-eastern corner, [[x, y], [x, y]] [m]"
    )


class GroundSettings(Settings):
    """The ground around the roads."""

    texture: Surface = Field("ground_grass", description="a surface's name, or an image file")
    scale: Finite = Field(1.0, ge=0.01, le=100, description="enlarges the texture")
    horizon: Literal["auto", "hills", "trees", "flat"] = Field(
        "auto", description="what closes the view; auto: hills, and woods where grass grows"
    )
    planting: Literal["auto", "none"] = Field(
        "auto",
        description="auto: belts along fast roads; elsewhere trees and shrubs"
        " where the scenario has none of its own in view",
    )
    heights: File | None = Field(
        None,
        description="the land's real heights (GeoTIFF, .asc, .hgt); roads without z follow them",
    )
    picture: File | PictureSettings | None = Field(
        None,
        description="the land from above: GeoTIFF, SUMO's view settings with a decal, or a picture"
        " with its corners",
    )
    areas: Literal["auto", "none"] = Field(
        "auto",
        description="auto: water, woods, parks, fields, squares and car parks that polygons"
        " mean, and gardens between buildings",
    )

    @property
    def files(self) -> LandFiles:
        """The files that tell what the land is like."""
        from sumo3dviz_pt.model.traffic import LandFiles

        own = self.picture
        if isinstance(own, PictureSettings):
            return LandFiles(self.heights, own.file, own.corners)
        return LandFiles(self.heights, own)


class EdgeStyle(Settings):
    """Overrides for edges whose id matches a pattern."""

    surface: Surface | None = Field(None, description="a surface's name, or an image file")
    colour: HexColour | None = Field(None, description="#rrggbb instead of a texture")
    lane_width: Positive | None = Field(None, le=100, description="width of each lane [m]")
    markings: bool | None = Field(None, description="whether lines are painted")


class RoadSettings(Settings):
    """How roads look."""

    surface: Surface = Field("asphalt", description="a surface's name, or an image file")
    colour: HexColour | None = Field(None, description="#rrggbb instead of a texture")
    markings: bool = Field(True, description="whether lines are painted")
    marking_style: Literal["auto", "european", "american", "british"] = Field(
        "auto",
        description="habits of markings and signals; auto: british where traffic keeps left,"
        " american in the United States and Canada, else european",
    )
    lane_width: Literal["from_network"] | Annotated[Positive, Field(le=100)] = Field(
        "from_network", description="width of each lane [m]"
    )
    line_width: Positive = Field(0.12, le=1.0, description="width of painted lines [m]")
    per_edge: dict[str, EdgeStyle] = Field(
        default_factory=dict,
        max_length=MOST_ENTRIES,
        description="overrides by edge id; * and ? are wildcards",
    )


class VehicleSettings(Settings):
    """Which bodies and colours vehicles show."""

    types: dict[str, str] = Field(
        default_factory=dict,
        max_length=MOST_ENTRIES,
        description="vClass by vType id or pattern, where no file defines the vType; by vehicle id"
        " in a log without types",
    )

    passenger: Names = Field((), description="models to draw from; default all")
    models: dict[str, Names] = Field(
        default_factory=dict,
        max_length=MOST_ENTRIES,
        description="models to draw from by other vClasses",
    )
    colours: Literal["european", "sumo"] | Colours = Field(
        "european", description="a fleet's palette, SUMO's colours, or a list of #rrggbb"
    )
    user_models: dict[str, File] = Field(
        default_factory=dict,
        max_length=MOST_ENTRIES,
        description="own GLB/OBJ/PLY files by vehicle or vType id pattern",
    )
    by_id: dict[str, OwnLook] = Field(
        default_factory=dict,
        max_length=MOST_ENTRIES,
        description="model and colour by id, or by pattern of an id or vType",
    )
    full_models: Whole | None = Field(
        None,
        ge=0,
        le=8,
        description="models that a shot draws in full detail where they are near; default what a"
        " budget of triangles leaves beside all that stands; studies have 6",
    )


class SignalSettings(Settings):
    """Traffic lights."""

    show: bool = Field(True, description="whether lights are drawn")
    design: Literal["two_heads", "three_heads", "countdown"] = Field(
        "three_heads", description="lamps a light; countdown adds seconds to the next change"
    )
    yellow: Literal["auto", "log"] = Field(
        "auto", description="auto: interpolated for links whose log never shows yellow"
    )
    yellow_time: Positive = Field(3.0, le=600, description="length of interpolated yellow [s]")


class StreetSettings(Settings):
    """Street furniture that stands by itself; POIs of its types are always drawn."""

    fronts: Literal["auto", "none"] = Field(
        "auto", description="closed rows of houses along city streets without building polygons"
    )
    town: Literal["auto", "none"] = Field(
        "none",
        description="auto: a town invented by what roads tell",
    )
    parked: Literal["auto", "none"] = Field("auto", description="parked cars in an invented town")
    lamps: Literal["auto", "none"] = Field("auto", description="street lamps along urban roads")
    signs: Literal["auto", "none"] = Field(
        "auto", description="speed limits, stop, give way, priority, exits, gantries"
    )
    furniture: Literal["auto", "none"] = Field(
        "auto", description="benches, bins, bollards along sidewalks; kerbed islands"
    )


class ShotSettings(Settings):
    """A camera and a stretch of time."""

    camera: str = Field(description="a name from `cameras`")
    start: Seconds = Field(alias="from", description="SUMO's time of the first frame [s]")
    end: Seconds = Field(alias="to", description="SUMO's time after the last frame [s]")
    speed: Speed = Field(
        Fraction(1), description="SUMO's time per film's; 0.25 is slow motion, 10 time-lapse"
    )

    @model_validator(mode="after")
    def _forward(self) -> ShotSettings:
        """Refuse a shot without length."""
        if self.end <= self.start:
            raise ValueError(f"'to' ({self.end}) must be later than 'from' ({self.start})")
        return self


class OutputSettings(Settings):
    """What comes out."""

    size: Size = Field((1280, 720), description="width, height [px]")
    fps: Rate = Field(Fraction(25), description="frames per second; a ratio such as 30000/1001")
    codec: str = Field(
        "auto",
        description="video codec: h264, h264_10, h265_10, prores, vp9 or gif; auto: by the ending",
    )
    exposure: Finite = Field(0.0, ge=-30, le=30, description="EV above the sky's own")
    tone: str = Field("camera", description="tone curve: camera, neutral, srgb, agx or filmic")
    glare: Finite = Field(0.0, ge=0, le=1, description="share of light that the lens spreads")
    response: ResponseName = Field(
        "none", description="what a camera adds: veil, softness, dark corners, noise, sharpening"
    )
    half: bool = Field(True, description="EXR frames in half precision")
    sound: SoundSettings | None = Field(
        None, description="sound, and tracks for tools that make sound of them, beside the film"
    )
    layers: tuple[LayerName, ...] = Field(
        (),
        max_length=len(LAYER_KINDS),
        description="what is written of every frame beside the film, into its folder `.layers`:"
        " depth, normals, albedo, ids, instance, semantic, flow, boxes2d, boxes3d, lamps",
    )


class MotionSettings(Settings):
    """How logged samples become continuous motion."""

    smoother: str = Field("lane", description="lane, hermite, linear, paper_symmetric or paper")
    heading: Literal["chord", "tractrix"] = Field(
        "chord", description="how bodies follow their fronts; tractrix never slips sideways"
    )
    suspension: bool = Field(True, description="bodies pitch and roll with acceleration")


class Quality(Settings):
    """A quality preset: what a frame costs and what error it leaves."""

    spp: Whole = Field(ge=1, le=65536, description="samples per pixel")
    pass_spp: Whole = Field(4, ge=1, le=1024, description="samples per pass, a power of two")
    max_depth: Whole = Field(8, ge=2, le=64, description="longest light path")
    rr_depth: Whole = Field(
        2, ge=1, le=64, description="path length from which roulette may end it"
    )
    denoise: Literal["none", "fast", "balanced", "high"] = Field("high", description="OIDN")
    guides: bool = Field(True, description="albedo and normals guide the denoiser")
    raw_share: Finite = Field(
        0.0, ge=0.0, le=1.0, description="share of the raw picture that textures keep"
    )
    accumulate: Whole = Field(
        0,
        ge=0,
        le=16,
        description="frames before and after that help each of a film's frames; 0 is none",
    )
    alone: Whole | None = Field(
        None,
        ge=1,
        le=65536,
        description="samples per pixel of a picture that no others help; default spp",
    )
    cap: Finite | None = Field(40.0, description="firefly cap per sample, x white; null is none")
    sampler: Literal["multijitter", "independent"] = Field(
        "multijitter", description="how samples spread; independent is for references"
    )
    haze: bool = Field(True, description="aerial perspective")
    tracer: Literal["kernel", "path"] = Field(
        "kernel", description="our own kernel, or Mitsuba's path tracer, as always without LLVM"
    )
    purpose: str = Field("", description="what it is for")

    @property
    def by_itself(self) -> Quality:
        """The quality of a picture that no others help, such as a still."""
        changes = {"spp": self.alone or self.spp, "accumulate": 0, "alone": None}
        return self.model_copy(update=changes)


SCENE_FILE = Form("scene file")
"""Its version, and what makes it of older ones."""


class Job(Settings):
    """A whole scene file."""

    scenario: ScenarioSettings
    template: str = Field("highway_day", description="scene template, from `scene_templates/scene`")
    seed: Seed = Field(0, description="seed of everything random")
    sky: SkySettings = Field(SkySettings(), description="sky and light")
    weather: WeatherSettings | None = Field(
        None, description="fog, rain, snow, wet roads, wind and season; default dry, clear summer"
    )
    ground: GroundSettings = GroundSettings()
    roads: RoadSettings = RoadSettings()
    vehicles: VehicleSettings = VehicleSettings()
    objects: ObjectsSettings = ObjectsSettings()
    signals: SignalSettings = SignalSettings()
    street: StreetSettings = StreetSettings()
    motion: MotionSettings = MotionSettings()
    traffic: TrafficSettings | None = Field(
        None, description="changes recorded traffic: rides at other times or paces, or fewer"
    )
    lights: Lights = Field("auto", description="auto lights lamps after sunset")
    cameras: dict[FilePart, CameraSettings] = Field(
        default_factory=dict, max_length=MOST_ENTRIES, description="by name"
    )
    shots: tuple[ShotSettings, ...] = Field(
        (), max_length=MOST_ENTRIES, description="what `render` films"
    )
    output: OutputSettings = OutputSettings()
    overlays: OverlaySettings | None = Field(
        None, description="what is drawn over the film; the film without it lies beside it"
    )
    quality: str = Field("standard", description="quality preset, from `scene_templates/quality`")
    textured: bool = Field(True, description="false paints everything in matt colours")
    # It says how to read the file, not what is shown: no hash, record or comparison has it.
    schema_version: Whole = Field(
        SCENE_FILE.version,
        ge=1,
        le=SCENE_FILE.version,
        exclude=True,
        description="version of the file's form; a newer one than this package reads is refused",
    )


_KINDS = ("gt", "ge", "lt", "le")

_VAST = 1e6
"""Ranges that reach this far only keep out nonsense; `--help` leaves them out."""


@dataclass(frozen=True, slots=True)
class Bound:
    """One end of a range.

    Attributes:
        kind: `gt`, `ge`, `lt` or `le`, as pydantic calls them.
        value: The end itself.
    """

    kind: str
    value: float


def meaning(key: str) -> str:
    """Return a setting's meaning and range, such as `samples per pixel; 1 to 65536`.

    Args:
        key: Dotted, as `output.fps`; `quality.spp` is a key of quality presets.
    """
    field = _field_of(key)
    ends = {bound.kind: bound.value for bound in bounds(field.annotation, field.metadata)}
    text = field.description or ""
    if {"ge", "le"} <= ends.keys() and ends["le"] < _VAST:
        text += f"; {ends['ge']:g} to {ends['le']:g}"
    return text


def default(key: str) -> Any:
    """Return a setting's default, by its dotted key."""
    return _field_of(key).get_default(call_default_factory=True)


def bounds(annotation: Any, metadata: Sequence[Any]) -> list[Bound]:
    """Return the ends of a field's range, each once; of lists and unions those of all parts.

    Args:
        annotation: The field's type.
        metadata: What stands beside the type, as in `FieldInfo.metadata`.
    """
    return list(dict.fromkeys(_bounds(annotation, metadata)))


def _field_of(key: str) -> FieldInfo:
    """Find a field by its dotted key."""
    *parents, last = key.split(".")
    model: type[BaseModel] = Job
    for parent in parents:
        # A scene file only names its preset; the preset's own keys stand in a file of its own.
        inner = (
            [Quality] if parent == "quality" else models_in(model.model_fields[parent].annotation)
        )
        model = inner[0]
    return model.model_fields[last]


def _bounds(annotation: Any, metadata: Sequence[Any]) -> Iterator[Bound]:
    """Find all ends of a range."""
    for kind in _KINDS:
        for limit in metadata:
            if isinstance(value := getattr(limit, kind, None), int | float):
                yield Bound(kind, _short(value))
    yield from _of_ratios(metadata)
    for part in get_args(annotation):
        around = getattr(part, "__metadata__", ())
        inner = [item for info in around for item in getattr(info, "metadata", [info])]
        yield from _bounds(part, inner)


def _of_ratios(metadata: Sequence[Any]) -> Iterator[Bound]:
    """Find the range of a ratio: a function checks it, and its JSON schema tells it."""
    schemas = [getattr(extra, "json_schema", None) or {} for extra in metadata]
    for part in [part for schema in schemas for part in schema.get("anyOf", ())]:
        for kind, word in (("ge", "minimum"), ("le", "maximum")):
            if word in part:
                yield Bound(kind, _short(part[word]))


def _short(value: float) -> float:
    """Return a number without needless decimals: 240, not 240.0."""
    return int(value) if value == int(value) else value
