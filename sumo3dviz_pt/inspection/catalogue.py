"""Lists the library of assets, and draws contact sheets of all that users can choose by name."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.image.tonemap import develop
from sumo3dviz_pt.job.settings import SkySettings
from sumo3dviz_pt.library.materials import principled
from sumo3dviz_pt.model.geometry import Floats, Image, Mesh, Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.model.scene import Bsdf, FrameState, Haze, Part, SceneData, Sky, StaticPart, View
from sumo3dviz_pt.pipeline.scene_file import quality_preset
from sumo3dviz_pt.pipeline.still import check_target
from sumo3dviz_pt.world.sky import DARK, build_sky

if TYPE_CHECKING:
    from sumo3dviz_pt.render.session import Session
    from sumo3dviz_pt.shot.showroom import Exhibit


_HEAD = ("family", "name", "for", "size [m]", "triangles", "kB", "licence")


def families() -> tuple[str, ...]:
    """Return all families of assets."""
    folder = catalog.data_root("assets")
    return tuple(sorted(path.name for path in folder.iterdir() if path.is_dir()))


def listing(chosen: Sequence[str]) -> list[str]:
    """Return a table of assets: family, name, what it is, triangles, size, licence.

    Args:
        chosen: Families; none stands for all.

    Raises:
        ConfigError: If there is no such family; the message suggests one.
    """
    rows: list[tuple[str, ...]] = [_HEAD]
    for family in checked(chosen):
        rows += [_row(catalog.find(family, name)) for name in catalog.names(family)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return [
        "  ".join(word.ljust(width) for word, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def checked(chosen: Sequence[str]) -> Sequence[str]:
    """Return the families that words mean; none stands for all.

    Raises:
        ConfigError: If there is no such family; the message suggests one.
    """
    known = families()
    for word in chosen:
        if word not in known:
            hint = catalog.did_you_mean(word, known)
            raise ConfigError(f"no family of assets is called {word!r}{hint}")
    return chosen or known


def _row(entry: catalog.Entry) -> tuple[str, ...]:
    """Return one line of the table."""
    meta = entry.meta
    sides = [meta[key] for key in ("length", "width", "height") if key in meta]
    levels = [sum(meta.get(level, {}).values()) for level in ("full", "parts", "far")]
    served = meta.get("vclass", "")
    return (
        entry.family,
        entry.name,
        served if isinstance(served, str) else ", ".join(served) or "a unit",
        " x ".join(f"{float(side):.2f}" for side in sides),
        " / ".join(f"{count:,}" for count in levels if count),
        f"{sum(path.stat().st_size for path in entry.folder.iterdir()) / 1e3:.0f}",
        str(meta["licence"]),
    )


Pixels = NDArray[np.uint8]

SKIES = "skies"
"""The sheet that shows skies; the others show exhibits."""

_PICTURES = (".png", ".jpg", ".jpeg", ".exr")  # endings of pictures, not of folders
_APART = 170.0  # between exhibits, so that none stands in another's light [m]
_COLUMNS = {SKIES: 3, "levels": 6}
_SLABS = 2  # triangles of flat samples, whose number the title leaves out
_FLAT = 0.1  # exhibits up to this height are seen from above [m]
_MOSTLY = 4  # columns of all other sheets
_FOV = math.radians(32.0)
_SKY_FOV = math.radians(78.0)
_ASIDE = 1.0  # angle between the middle of a sky's picture and the sun, to its right [rad]
_LOW = math.radians(12.0)  # suns below this need a tone curve with a soft shoulder
_MEAN = 0.05  # mean of a night's picture after exposure, as a share of white


def sheet_names() -> tuple[str, ...]:
    """Return all contact sheets."""
    from sumo3dviz_pt.shot.showroom import FAMILIES

    return (*FAMILIES, SKIES)


def sheet_files(chosen: Sequence[str], *, into: Path | None = None) -> dict[str, Path]:
    """Return the file of each sheet, by the sheet's name.

    Args:
        chosen: Names of sheets; none stands for all.
        into: A folder for them, or the .png of a single one; default the working directory.

    Raises:
        ConfigError: If a picture is to hold several sheets, or is no .png.
    """
    folder, names = into or Path(), tuple(chosen) or sheet_names()
    if folder.is_dir() or folder.suffix.lower() not in _PICTURES:
        return {name: folder / f"sheet_{name}.png" for name in names}
    if len(names) > 1:
        known = ", ".join(names)
        raise ConfigError(
            f"{folder} can hold one sheet only; name one of {known}, or a folder", key="output"
        )
    check_target(folder, suffixes=(".png",), overwrite=True)
    return {names[0]: folder}


@dataclass(frozen=True, slots=True)
class SheetOrder:
    """Which sheet to draw.

    Attributes:
        name: One of `sheet_names`.
        path: The PNG to write.
        size: Of each picture, width and height [px].
        quality: A preset's name.
        columns: Pictures in a row; None leaves it to the sheet's name.
        counted: Whether titles say how many triangles there are.
    """

    name: str
    path: Path
    size: tuple[int, int] = (480, 270)
    quality: str = "preview"
    columns: int | None = None
    counted: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class _Picture:
    """A picture of a sheet.

    Attributes:
        title: What stands below it.
        pixels: 8-bit sRGB, (h, w, 3).
    """

    title: str
    pixels: Pixels


def draw_sheet(order: SheetOrder) -> None:
    """Draw a contact sheet.

    Args:
        order: Which one, and where to.

    Raises:
        ConfigError: If there is no such sheet or preset, or matplotlib is missing.
    """
    from sumo3dviz_pt.shot.showroom import exhibits

    if order.name == SKIES:
        total, pictures = len(catalog.template_names("sky")), _skies(order)
    else:
        shown = list(exhibits(order.name))
        total, pictures = len(shown), _exhibits(shown, order)
    made: list[_Picture] = []
    for picture in pictures:
        made.append(picture)
        announce(Doing.DRAW, len(made), total, what=order.name)
    _compose(made, order)


def draw_exhibits(shown: Sequence[Exhibit], order: SheetOrder) -> None:
    """Draw a contact sheet of exhibits that are not the catalogue's.

    Args:
        shown: What to draw.
        order: Size, quality and where to; its name counts for nothing.
    """
    _compose(list(_exhibits(shown, order)), order)


def _skies(order: SheetOrder) -> Iterator[_Picture]:
    """Yield every sky beside its sun or moon, over a few things that it lights."""
    from sumo3dviz_pt.shot.showroom import still_life

    for name in catalog.template_names("sky"):
        sky = build_sky(SkySettings(preset=name))
        yaw = _beside(sky)
        life = still_life(yaw)
        view = View(_looking((0.0, 0.0, 1.9), yaw=yaw, pitch=math.radians(9)), Lens(_SKY_FOV))
        static = tuple(
            StaticPart(str(index), "exhibit", part) for index, part in enumerate(life.parts)
        )
        data = SceneData(life.materials, static, {}, (), sky, haze=Haze())
        with _session(data, order) as session:
            radiance = session.render(FrameState(0.0, view, ())).radiance
        yield _Picture(name, _exposed(radiance, sky))


def _beside(sky: Sky) -> float:
    """Return a yaw left of the moon or sun, so that it lights things from the side [rad]."""
    light = sky.sun_direction if sky.moon_direction is None else sky.moon_direction
    return math.pi / 2 if light is None else _towards(light) + _ASIDE


def _exposed(radiance: Image, sky: Sky) -> Pixels:
    """Return a sky's picture: by day at the sky's own exposure, by night at the picture's.

    The exposure of a night is made for streets with lamps, and here are none.
    """
    height = 1.0 if sky.sun_direction is None else math.asin(sky.sun_direction[2])
    if height > DARK:
        tone = "neutral" if height > _LOW else "filmic"
        return develop(radiance, exposure=sky.exposure, tone=tone, dither=0)
    from sumo3dviz_pt.model.layers import LUMINANCE

    mean = float(np.exp(np.log(radiance @ LUMINANCE + 1e-9).mean()))
    return develop(radiance, exposure=math.log2(_MEAN / mean), tone="agx", dither=0)


def _exhibits(shown: Sequence[Exhibit], order: SheetOrder) -> Iterator[_Picture]:
    """Yield a picture of every exhibit, from the front and a little above."""
    sky = build_sky(SkySettings(preset="sky_daycloud1"))
    with _showing(shown, sky, order) as session:
        for number, exhibit in enumerate(shown):
            counted = order.counted and exhibit.triangles > _SLABS
            count = f" ({exhibit.triangles:,})" if counted else ""
            title = f"{exhibit.title}{count}"
            view = _view_of(exhibit, at=_place(number), aspect=order.size[1] / order.size[0])
            yield _Picture(title, _photographed(session, view, sky))


def _place(number: int) -> Floats:
    """Return where an exhibit stands [m]."""
    return np.array([_APART * number, 0.0, 0.0])


def _view_of(exhibit: Exhibit, *, at: Floats, aspect: float) -> View:
    """From the front, the left and a little above, on slabs from further above.

    The whole exhibit fills the picture.
    """
    low, high = exhibit.bounds
    middle = (low + high) / 2
    points = np.concatenate([part.mesh.vertices for part in exhibit.parts]) - middle
    direction = np.array([1.0, 0.9, 0.35 if high[2] - low[2] > _FLAT else 1.5])
    direction /= np.linalg.norm(direction)
    left = np.array([direction[1], -direction[0], 0.0]) / math.hypot(*direction[:2])
    up = np.cross(-direction, left)
    wide = math.tan(_FOV / 2)
    needed = np.maximum(np.abs(points @ left), np.abs(points @ up) / aspect) / wide
    away = float((needed + points @ direction).max()) * 1.06 + 0.2
    eye = middle + direction * away + at
    return View(_aimed(np.maximum(eye, [-np.inf, -np.inf, 0.4]), middle + at), Lens(_FOV))


def _aimed(eye: Floats, target: Floats) -> Transform:
    """Return a camera's frame at a point, looking at another [m]."""
    ahead = target - eye
    yaw = math.atan2(ahead[1], ahead[0])
    return _looking(eye, yaw=yaw, pitch=math.atan2(ahead[2], math.hypot(ahead[0], ahead[1])))


def _looking(eye: Sequence[float] | Floats, *, yaw: float, pitch: float) -> Transform:
    """Return a camera's frame at a point [m]; angles in radians, pitch upwards."""
    return Transform.from_pose(np.asarray(eye, dtype=np.float64), yaw=yaw, pitch=pitch)


def _towards(direction: Floats) -> float:
    """Return the yaw of a direction [rad]."""
    return math.atan2(float(direction[1]), float(direction[0]))


@contextmanager
def _showing(shown: Sequence[Exhibit], sky: Sky, order: SheetOrder) -> Iterator[Session]:
    """Open all exhibits in one scene, far apart, on grey ground."""
    materials: dict[str, Bsdf] = {"ground": principled((0.16, 0.16, 0.155), roughness=0.9)}
    static = [StaticPart("ground", "ground", Part(_ground(len(shown)), "ground"))]
    for number, exhibit in enumerate(shown):
        materials |= dict(exhibit.materials)
        for index, part in enumerate(exhibit.parts):
            mesh = Transform.from_pose(_place(number)).mesh(part.mesh)
            moved = Part(mesh, part.material, part.tint)
            static.append(StaticPart(f"{number}/{index}", "exhibit", moved))
    with _session(SceneData(materials, tuple(static), {}, (), sky), order) as session:
        yield session


@contextmanager
def _session(data: SceneData, order: SheetOrder) -> Iterator[Session]:
    """Open a scene in the renderer."""
    from sumo3dviz_pt.render.backend import choose_backend
    from sumo3dviz_pt.render.session import RenderSettings, Session

    quality, white = quality_preset(order.quality), 2.0**-data.sky.exposure
    settings = RenderSettings(order.size, quality, 1, white=white)
    with Session(data, choose_backend(), settings) as session:
        yield session


def _ground(count: int) -> Mesh:
    """Return a plane under all exhibits."""
    x0, x1, y = -3000.0, _APART * count + 3000.0, 3000.0
    corners = np.array([[x0, -y, 0.0], [x1, -y, 0.0], [x1, y, 0.0], [x0, y, 0.0]])
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))


def _photographed(session: Session, view: View, sky: Sky) -> Pixels:
    """Return one view, developed."""
    radiance = session.render(FrameState(0.0, view, ())).radiance
    return develop(radiance, exposure=sky.exposure)


def _compose(pictures: Sequence[_Picture], order: SheetOrder) -> None:
    """Draw pictures with their titles, a few in a row."""
    from sumo3dviz_pt.report.plots import new_figure, save_figure

    size, path = order.size, order.path
    columns = min(order.columns or _COLUMNS.get(order.name, _MOSTLY), len(pictures))
    rows = -(-len(pictures) // columns)
    width = columns * size[0] / 110 * 1.02
    figure: Any = new_figure(width, rows * (size[1] + 26) / 110)
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis in axes.flat:
        axis.set_axis_off()
    for axis, picture in zip(axes.flat, pictures, strict=False):
        axis.imshow(picture.pixels)
        text = {"fontsize": 2.0 * max(columns, _MOSTLY), "ha": "center", "va": "top"}
        axis.text(0.5, -0.02, picture.title, transform=axis.transAxes, **text)
    path.parent.mkdir(parents=True, exist_ok=True)
    save_figure(figure, path)
