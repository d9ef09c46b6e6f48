"""What there is of a film's frame to compare, and how the light of two frames differs.

Layers are of the rays through the pixels' centres, so that they are the same bytes wherever two
scenes are the same. The picture is the film's own, as people see it but for overlays. Radiance is
as it is stored. All films of a study have one seed, so a pixel is the same to its last bit unless
one of its paths met what differs. Where one did, it brings light of its own, with noise of its own.

*Light that was changed after it was traced* is painted, scaled, tinted or made grey. What is lit by
more or less by a share *s* differs from pixel to pixel by as much as its noise times *s*. A brush
multiplies light and noise alike. So many pixels of a noisy block that changed by one and the same
share were not traced so; nor were pixels that changed their colour and kept their luminance.
Neither limit hangs on what the factor throws, or how far.

*Light where a factor does not act* is compared block by block, as single pixels say little through
their noise. A block is judged by its typical pixel, which neither noise nor a few reflections move:
it is *lit otherwise* if the median of its pixels' shares is beyond 15 %, and if more of its pixels
are brighter than darker, or the other way round, by five standard errors of a fair coin.

What a factor acts on throws light and shadows on what is near it, and no farther than it reaches.
How much of a picture may be lit otherwise at all, and how much out of reach, hangs on what that is:
a car in another colour changes no shadow, trees that are gone open the sky over a street. The
limits are measured on clean pairs and on spoilt ones (docs/internals/certificate.md).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, binary_erosion
from scipy.spatial import cKDTree

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.geometry import Bools, Floats, Image, Ints
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.numbers import LayerName
from sumo3dviz_pt.model.weather import FALLING_KINDS
from sumo3dviz_pt.pipeline.films.frames import frame_file, frames_folder
from sumo3dviz_pt.pipeline.films.layers import beside
from sumo3dviz_pt.pipeline.films.overlays import plain_twin
from sumo3dviz_pt.pipeline.films.stored_layers import StoredCamera, read_frame

COUNTED: LayerName = "instance"
"""The layer that says which thing each pixel shows."""

LAYERS: tuple[LayerName, ...] = (COUNTED, "depth", "normals", "albedo")
"""The layers that are compared, as a scene file asks for them."""

SKY = "sky"
"""What pixels show that show no thing."""


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """A frame of a film.

    Attributes:
        things: What each pixel shows, as numbers that are the same in all films, (h, w).
        names: Of those numbers.
        labels: Of those names, such as `vegetation`.
        layers: `depth` (h, w) [m], `normals` and `albedo` (h, w, 3).
        radiance: With lamps that are seen directly, in units of white, (h, w, 3); None if the frame
            is gone.
        picture: Of the film, (h, w, 3) in 0 .. 255.
        rays: Unit vectors from the eye, east, north and up, (h, w, 3).
        clear: Whether nothing in the air scatters light: no fog, rain or snowfall.
        overlaid: The same picture with overlays, (h, w, 3) in 0 .. 255; None where it has none.
    """

    things: NDArray[np.int64]
    names: Mapping[int, str]
    labels: Mapping[str, str]
    layers: Mapping[str, Image]
    radiance: Image | None
    picture: NDArray[np.uint8]
    rays: Floats
    clear: bool = True
    overlaid: NDArray[np.uint8] | None = None

    @property
    def delivered(self) -> NDArray[np.uint8]:
        """The picture that people see, (h, w, 3) in 0 .. 255."""
        return self.picture if self.overlaid is None else self.overlaid


def read_evidence(
    film: Path, number: int, account: Mapping[str, Any], *, unexposed: bool = False
) -> Evidence:
    """Return what there is of a frame.

    Args:
        film: The film.
        number: The frame's.
        account: The film's.
        unexposed: Whether light is told before exposure, because that may differ.

    Raises:
        InputError: If layers or the film's picture are missing or damaged.
    """
    from sumo3dviz_pt.video.ffmpeg import film_picture

    seen = read_frame(beside(frames_folder(film)), number)
    things = np.asarray(seen.layers[COUNTED], dtype=np.int64)
    height, width = things.shape
    rate = Fraction(str(account["frame_rate"]))
    plain, overlays = without_overlays(film), account.get("overlays")
    before = int(overlays["frames_before"]) if overlays else 0
    names = {int(key): thing.name for key, thing in seen.things.items()} | {0: SKY}
    return Evidence(
        things,
        names,
        {SKY: SKY, **{thing.name: thing.label for thing in seen.things.values()}},
        {name: seen.layers[name] for name in LAYERS if name != COUNTED},
        _radiance(film, number, 0.0 if unexposed else float(account["exposure"])),
        film_picture(plain, float(number / rate), size=(width, height)),
        _rays(seen.camera),
        _is_clear(account),
        film_picture(film, float((number + before) / rate), size=(width, height))
        if plain != film
        else None,
    )


def _is_clear(account: Mapping[str, Any]) -> bool:
    """Return whether a film's air scatters no light that is seen before the sky."""
    weather = account.get("scene", {}).get("weather") or {}
    return not any(weather.get(key) for key in ("fog", *FALLING_KINDS, "course", "preset"))


def _rays(camera: StoredCamera) -> Floats:
    """Return unit vectors from the eye through the pixels' centres, (h, w, 3)."""
    (width, height), (across, down) = camera.size, camera.centre
    columns, rows = np.meshgrid(np.arange(width), np.arange(height))
    left, up = (across - columns) / camera.focal, (down - rows) / camera.focal
    rays = np.stack([np.ones_like(left), left, up], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    return np.asarray(rays @ camera.world_from_camera.matrix[:3, :3].T)


def without_overlays(film: Path) -> Path:
    """Return the film whose pictures are its frames: the twin without overlays, if it has one."""
    twin = plain_twin(film)
    return twin if twin.is_file() else film


def _radiance(film: Path, number: int, exposure: float) -> Image | None:
    """Return a stored frame's radiance in units of white; None if it is gone."""
    from sumo3dviz_pt.image.exr import read_layers

    path = frame_file(frames_folder(film), number)
    if not path.is_file():
        return None
    layers, _ = read_layers(path)
    # Light of lamps that are seen directly is stored apart where frames help each other.
    radiance = layers["radiance"] + layers.get("excess", np.float32(0.0))
    return np.asarray(radiance * np.float32(2.0**exposure))


def compared_frames(count: int, wanted: int) -> list[int]:
    """Return the numbers of frames that are compared, evenly over a film, ends included.

    Args:
        count: Of the film's frames, at least 1.
        wanted: How many, at least 1.
    """
    if wanted == 1:
        return [count // 2]
    return sorted({round(n) for n in np.linspace(0, count - 1, min(wanted, count)).tolist()})


def check_same_size(one: Evidence, other: Evidence, film: Path) -> None:
    """Refuse pictures that cannot be laid one over the other.

    Raises:
        InputError: If they differ in size.
    """
    if one.things.shape != other.things.shape:
        raise InputError("has layers of another size than its partner", file=film)


CHANGED = 0.02
"""Logarithm of the share by which a channel of a pixel must differ to count."""

SAME_SHARE = 0.25
"""Share of a block's pixels that must have changed alike."""

_OF_NOISE, _WIDEST, _NARROWEST = 0.15, 0.02, 0.003
"""How far the logarithms of shares lie apart that count as one: this times what noise would make of
them, and at most and at least so much. Light is stored in half precision, which is 0.001 here."""

_SAME_LUMINANCE = 0.004
"""Logarithm of the share by which luminance may differ where colour alone was changed."""

_LEAST = 16
"""Pixels that a block must have to tell anything."""


def touched_blocks(
    one: Image, other: Image, albedo: Image, things: Ints, *, telling: Bools, side: int
) -> Bools:
    """Return which blocks of a picture hold light that was changed by hand, (rows, columns).

    Args:
        one: Light of the first film, (h, w, 3) [white].
        other: Of the second.
        albedo: Reflectance of the first surface, (h, w, 3).
        things: What is seen, (h, w).
        telling: Pixels that are compared, (h, w).
        side: Of blocks [px].
    """
    first, second = one.astype(np.float64), other.astype(np.float64)
    seen = telling & (np.minimum(first, second).min(axis=-1) > 1e-5)
    logs = np.log(np.maximum(second, 1e-9) / np.maximum(first, 1e-9))
    bright = np.log(np.maximum(second @ LUMINANCE, 1e-9) / np.maximum(first @ LUMINANCE, 1e-9))
    tinted = seen & (np.abs(logs).max(axis=-1) > CHANGED) & (np.abs(bright) < _SAME_LUMINANCE)
    noise = _noise(first @ LUMINANCE, np.maximum(albedo @ LUMINANCE, 0.02), things, seen)
    rows, columns = (length // side for length in seen.shape)
    touched: Bools = np.zeros((rows, columns), dtype=np.bool_)
    changed = seen & (np.abs(logs).max(axis=-1) > CHANGED)
    for row, column in np.ndindex(rows, columns):
        where = np.s_[row * side : (row + 1) * side, column * side : (column + 1) * side]
        inside = seen[where]
        count = int(inside.sum())
        if count < _LEAST or changed[where].sum() < SAME_SHARE * count:
            continue
        alike = float(tinted[where].sum())
        known = noise[where][np.isfinite(noise[where])]
        typical = float(np.median(known)) if len(known) else 0.0
        for channel in range(3):
            alike = max(alike, _most_alike(logs[where][..., channel][inside], typical))
        touched[row, column] = alike > SAME_SHARE * count
    return touched


def _most_alike(logs: Floats, noise: float) -> int:
    """Return how many pixels changed by one and the same share, at most.

    Args:
        logs: Logarithms of shares, (n,).
        noise: Of the light there, as the logarithm of a typical share.
    """
    changed = np.sort(logs[np.abs(logs) > CHANGED])
    wide = np.minimum(_OF_NOISE * np.abs(1.0 - np.exp(-changed)) * noise, _WIDEST)
    ends = np.searchsorted(changed, changed + wide, side="right")
    alike = (ends - np.arange(len(changed)))[wide >= _NARROWEST]
    return int(alike.max(initial=0))


def _noise(light: Floats, albedo: Floats, things: Ints, seen: Bools) -> Floats:
    """Return by how much light differs from a pixel to the next of the same thing, (h, w).

    It is the logarithm of the share, without what paint does; NaN where the next is another thing.
    """
    level = np.log(np.maximum(light, 1e-9) / albedo)
    apart = np.abs(np.diff(level, axis=1))
    pairs = (things[:, 1:] == things[:, :-1]) & seen[:, 1:] & seen[:, :-1] & (things[:, 1:] != 0)
    return np.pad(np.where(pairs, apart, np.nan), ((0, 0), (0, 1)), constant_values=np.nan)


LIT_OTHERWISE = 0.15
"""Share by which the light of a block's typical pixel must differ to count."""

STANDARD_ERRORS = 5.0
"""By how many standard errors more of its pixels must be brighter than darker, or less."""

FAR_OTHERWISE, MOST_BEYOND = 0.3, 0.01
"""Share by which it must differ to count out of reach, because what acts on it may stand beside the
picture; and share of the blocks that may be so."""

LARGE, THROWN = 0.1, 0.5
"""Share of the picture from which on something that is painted otherwise throws its colour on all
that stands on it, such as a road; and for how many blocks it does, for each that it fills."""

MOST_OWN = 0.1
"""Share of the blocks in which the ridden vehicle may be lit otherwise: its mirrors and its paint
show what is behind and beside the picture."""


@dataclass(frozen=True, slots=True)
class Throw:
    """What throws light and shadows, and how far.

    Attributes:
        reach: How far they go [m].
        most: Share of the blocks that may be lit otherwise for it.
    """

    reach: float
    most: float


PAINT, USERS, THINGS = Throw(5.0, 0.0075), Throw(15.0, 0.04), Throw(25.0, 0.15)
"""Of what is only painted otherwise, of road users that are gone or elsewhere, of all else."""

MOST_SKY, SKY_OTHERWISE = 0.1, 0.6
"""Share of the sky's pixels that may be others, seen through clear air: nothing lights the sky,
but wires and twigs that are thinner than a pixel hide some of it; and share of a block's from which
on all of the block is another sky."""

MOST_TOUCHED = 0.003
"""Share of the blocks in which light may look as if it was changed by hand; see `touched`."""

_ACROSS = 40
"""Blocks from left to right."""

_SMALLEST, _FILLED = 8, 0.25
"""Side of a block [px], and the share of it that tells something, at least: where the factor does
not act, and that is not dark."""

_OWN = 0.25
"""Share of a block that shows the ridden vehicle, from which on the block does."""

_DARK = 2e-3
"""Luminance of pixels that tell nothing [white]: paths that found no lamp are black."""

_BLACK = 0.02
"""Added to luminances before shares are taken, so that noise of black pixels does not count
[white]."""

_SAME_SKY = 2e-3
"""Share by which the sky may differ: it is stored in half precision."""

_MOST_POINTS = 4000
"""Points that stand for what a factor acts on."""


@dataclass(frozen=True, slots=True, eq=False)
class LightDifference:
    """How the light of two frames differs where the factor does not act.

    Attributes:
        side: Of blocks [px].
        judged: Blocks in enough of which the factor does not act, (rows, columns).
        lit: Those that are lit otherwise, and do not show the ridden vehicle.
        own: Those that are, and do.
        beyond: Those of them that are out of reach.
        typical: By which share the light of a block's typical pixel differs, (rows, columns).
        touched: Blocks whose light was changed by hand, or that are another sky, (rows, columns).
        sky: Pixels of the sky that were compared, and those of them that are others.
        most: Share of the blocks that may be lit otherwise.
    """

    side: int
    judged: Bools
    lit: Bools
    own: Bools
    beyond: Bools
    typical: Floats
    touched: Bools
    sky: tuple[int, int]
    most: float


def luminance(one: Evidence) -> Floats:
    """Return the luminance of a frame that is there, (h, w) [white]."""
    assert one.radiance is not None
    return np.asarray(one.radiance.astype(np.float64) @ LUMINANCE)


def shares(one: Floats, other: Floats) -> Floats:
    """Return by which share luminances differ; black ones do not."""
    return np.asarray((other - one) / (_BLACK + np.maximum(np.abs(one), np.abs(other))))


def light_difference(
    one: Evidence, other: Evidence, near: Bools, acts_on: Sequence[tuple[Bools, Throw]]
) -> LightDifference:
    """Compare the light of two frames of one camera.

    Args:
        one: Of the first film.
        other: Of the second.
        near: Where the factor acts, and a little around, (h, w).
        acts_on: Where it acts on what is seen, (h, w), by what it throws.
    """
    side = max(_SMALLEST, round(near.shape[1] / _ACROSS))
    first, second, away = luminance(one), luminance(other), ~near
    brighter = np.maximum(np.abs(first), np.abs(second))
    telling = away & (brighter > _DARK)
    judged = _sums(telling, side) >= _FILLED * side**2
    share = np.divide(second - first, brighter, out=np.full(near.shape, np.nan), where=telling)
    typical = _medians(share, side, judged)
    more, less = (_sums(telling & where, side) for where in (second > first, second < first))
    sure = np.abs(more - less) > STANDARD_ERRORS * np.sqrt(more + less)
    unlike = judged & (np.abs(typical) > LIT_OTHERWISE) & sure
    own = unlike & (_sums(_ridden(one) | _ridden(other), side) >= _OWN * side**2)
    lit = unlike & ~own
    most = max((_allowed(where, throw) for where, throw in acts_on), default=PAINT.most)
    far = lit & (np.abs(typical) > FAR_OTHERWISE)
    beyond = far & ~_reached(one, other, away, side=side, acts_on=acts_on)
    sky = _sky(one, other, away)
    touched = _touched(one, other, telling, side) | _other_sky(*sky, side)
    counts = int(sky[0].sum()), int(sky[1].sum())
    return LightDifference(side, judged, lit, own, beyond, typical, touched, counts, most)


def _touched(one: Evidence, other: Evidence, telling: Bools, side: int) -> Bools:
    """Return which blocks hold light that was changed by hand, (rows, columns)."""
    assert one.radiance is not None and other.radiance is not None
    return touched_blocks(
        *(one.radiance, other.radiance, one.layers["albedo"], one.things),
        telling=telling,
        side=side,
    )


def _other_sky(open_: Bools, unlike: Bools, side: int) -> Bools:
    """Return which blocks show another sky, (rows, columns)."""
    there = _sums(open_, side)
    return np.asarray((there >= _FILLED * side**2) & (_sums(unlike, side) > SKY_OTHERWISE * there))


def _allowed(where: Bools, throw: Throw) -> float:
    """Return which share of the blocks may be lit otherwise for what is seen somewhere."""
    share = float(where.mean())
    return max(throw.most, THROWN * share if throw is PAINT and share > LARGE else 0.0)


def _medians(values: Floats, side: int, judged: Bools) -> Floats:
    """Return the median of each block that is judged, (rows, columns); 0 for the others."""
    rows, columns = judged.shape
    cut = values[: rows * side, : columns * side].reshape(rows, side, columns, side)
    blocks = np.moveaxis(cut, 2, 1).reshape(rows, columns, side * side)
    medians = np.zeros(judged.shape)
    medians[judged] = np.nanmedian(blocks[judged], axis=-1)
    return medians


def _sums(values: Floats | Bools, side: int) -> Floats:
    """Return the sum of each block, (rows, columns); a rest at the edges is cut off."""
    rows, columns = (length // side for length in values.shape)
    cut = values[: rows * side, : columns * side].astype(np.float64)
    return np.asarray(cut.reshape(rows, side, columns, side).sum(axis=(1, 3)))


def _reached(
    one: Evidence,
    other: Evidence,
    away: Bools,
    *,
    side: int,
    acts_on: Sequence[tuple[Bools, Throw]],
) -> Bools:
    """Return which blocks show something that light or shadow of what differs reaches."""
    seen = away & (one.things != 0)
    count = np.maximum(_sums(seen, side), 1.0)
    middle = [
        _sums(np.where(seen, axis, 0.0), side) / count for axis in np.moveaxis(_places(one), -1, 0)
    ]
    places = np.stack(middle, axis=-1)
    reached: Bools = np.zeros(places.shape[:2], dtype=np.bool_)
    for where, throw in acts_on:
        points = np.concatenate(
            [_places(each)[where & (each.things != 0)] for each in (one, other)]
        )
        if len(points):
            tree = cKDTree(points[:: -(-len(points) // _MOST_POINTS)])
            far = np.reshape(tree.query(places.reshape(-1, 3))[0], reached.shape)
            reached |= far <= throw.reach
    return reached


def _ridden(one: Evidence) -> Bools:
    """Return where the vehicle is seen that the camera rides in, (h, w)."""
    names = [name for name, label in one.labels.items() if label == "ego vehicle"]
    numbers = [number for number, name in one.names.items() if name in names]
    return np.asarray(np.isin(one.things, numbers))


def _places(one: Evidence) -> Floats:
    """Return what pixels show relative to the eye, (h, w, 3) [m]."""
    return np.asarray(one.layers["depth"][..., None] * one.rays)


def _sky(one: Evidence, other: Evidence, away: Bools) -> tuple[Bools, Bools]:
    """Return which pixels show the open sky through clear air, and which of them differ, (h, w)."""
    if not (one.clear and other.clear):
        return (np.zeros_like(away), np.zeros_like(away))
    # At edges, part of a pixel's rays meet something.
    open_ = binary_erosion((one.things == 0) & (other.things == 0) & away, iterations=2)
    first, second = luminance(one), luminance(other)
    unlike = np.abs(second - first) > _SAME_SKY * np.maximum(first, second) + 1e-4
    return np.asarray(open_), np.asarray(open_ & unlike)


def spread(blocks: Bools, *, side: int, shape: tuple[int, ...]) -> Bools:
    """Return blocks as pixels, (h, w)."""
    whole = np.kron(blocks, np.ones((side, side), dtype=np.bool_))
    rows, columns = (max(0, want - have) for want, have in zip(shape, whole.shape, strict=True))
    return np.asarray(np.pad(whole, ((0, rows), (0, columns))), dtype=np.bool_)


def around(own: Bools, *, reach: int) -> Bools:
    """Return pixels and those around them into which their edges are blurred."""
    return np.asarray(binary_dilation(own, iterations=reach))


def lit_shares(lights: Sequence[LightDifference]) -> tuple[float, float, float]:
    """Return which shares of blocks are lit otherwise, are so out of reach, and may be; or NaN."""
    blocks = sum(int(each.judged.sum()) for each in lights)
    if not blocks:
        return (float("nan"),) * 3
    lit = sum(int(each.lit.sum()) for each in lights) / blocks
    beyond = sum(int(each.beyond.sum()) for each in lights) / blocks
    return lit, beyond, max(each.most for each in lights)


def light_faults(lights: Sequence[LightDifference]) -> list[str]:
    """Return what is lit otherwise and should not be, a sentence each.

    Args:
        lights: By compared frame.
    """
    lit, beyond, most = lit_shares(lights)
    sky, unlike = (sum(each.sky[n] for each in lights) for n in (0, 1))
    where = "where the factor does not act"
    faults = []
    blocks = max(sum(int(each.judged.sum()) for each in lights), 1)
    own = sum(int(each.own.sum()) for each in lights) / blocks
    # A single block is chance, however small a picture is; out of reach, one in every frame.
    one = 1.5 / blocks
    if lit > max(most, one) or beyond > max(MOST_BEYOND, one * len(lights)):
        faults.append(
            f"light differs {where} in {lit:.1%} of the picture's blocks, and out of its reach in"
            f" {beyond:.1%}{_by(lights)}; {most:.1%} and {MOST_BEYOND:.1%} may"
        )
    if own > MOST_OWN:
        faults.append(
            f"light differs on the ridden vehicle, {where}, in {own:.1%} of the picture's blocks,"
            f" more than {MOST_OWN:.0%}"
        )
    touched = sum(int(each.touched.sum()) for each in lights)
    if touched / blocks > max(MOST_TOUCHED, one):
        faults.append(
            f"light was changed by hand {where}, in {touched / blocks:.1%} of the picture's blocks,"
            f" more than {MOST_TOUCHED:.1%}"
        )
    if unlike > MOST_SKY * sky:
        faults.append(
            f"the sky is another {where}, in {unlike / sky:.1%} of its pixels, more than"
            f" {MOST_SKY:.0%}"
        )
    return faults


def _by(lights: Sequence[LightDifference]) -> str:
    """Return by how much blocks that are lit otherwise differ at most."""
    worst = max(float(np.abs(each.typical[each.lit]).max(initial=0.0)) for each in lights)
    return f", by {worst:.0%} at most"
