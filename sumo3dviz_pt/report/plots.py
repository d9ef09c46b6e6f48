"""Charts of measurements, and pictures beside each other.

Charts show error against run time, and against path depth. Pictures are compared by equal crops, by
FLIP maps, and by the worst frame of a film. Crops are windows with detail in which pictures differ.

References:
    M. Okabe and K. Ito, "Color universal design", 2008 (a palette that colour-blind
    readers can tell apart: https://jfly.uni-koeln.de/color/).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from sumo3dviz_pt.files.atomic import atomic_path
from sumo3dviz_pt.image.metrics import flip_map
from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.report.convergence.table import (
    DEPTH,
    LADDER,
    TableRow,
    Value,
    cost,
    grouped,
    median,
    numbers,
    plain_title,
)

DPI = 110
PALETTE = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9")
"""Okabe and Ito, without black and yellow."""

_MARKERS = "osD^vP"
_PNG: Mapping[str, Any] = MappingProxyType({"format": "png", "metadata": {"Software": None}})
_JPEG: Mapping[str, Any] = MappingProxyType(
    {"format": "jpeg", "pil_kwargs": {"quality": 92, "subsampling": 0}}
)


def new_figure(width: float, height: float) -> Any:
    """Return a figure of a width and height [inches], without any state that outlives it."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), dpi=DPI, layout="constrained")


def save_figure(figure: Any, path: Path) -> None:
    """Write a figure as PNG, or as JPEG where the file's name ends so.

    JPEG is for maps of whole pictures, which take more than twice as much as PNG.
    """
    kind = _JPEG if path.suffix == ".jpg" else _PNG
    with atomic_path(path) as part:
        figure.savefig(part, dpi=DPI, **kind)


def error_plot(
    rows: Sequence[TableRow],
    path: Path,
    *,
    own: Mapping[str, float] | None = None,
    columns: Sequence[str] = ("rmse_capped", "flip"),
) -> None:
    """Draw errors over CPU-seconds, both logarithmic: rungs as lines, presets as points.

    Args:
        rows: Measurements; those of depth are passed over.
        path: The picture to write.
        own: The reference's own error by column, drawn as a horizontal line.
        columns: Errors to draw, side by side.
    """
    figure = new_figure(5.4 * len(columns), 4.9)
    axes = figure.subplots(1, len(columns), squeeze=False)[0]
    for axis, column in zip(axes, columns, strict=True):
        _draw_errors(axis, rows, column)
        if own and own.get(column, 0) > 0:
            axis.axhline(own[column], color="0.25", lw=1.2, ls="-.", label="reference's own error")
        _finish_logarithmic(axis, column)
    handles, labels = axes[0].get_legend_handles_labels()
    known = dict(zip(labels, handles, strict=True))
    for axis in axes[1:]:
        known.update({label: known.get(label, handle) for handle, label in
                      zip(*axis.get_legend_handles_labels(), strict=True)})  # fmt: skip
    figure.legend(known.values(), known.keys(), loc="outside lower center", ncols=4, frameon=False)
    save_figure(figure, path)


def _series_name(key: tuple[Value, ...]) -> str:
    """Return what a line of the ladder is called."""
    denoise, quality, sampler = key
    return f"raw, {sampler}" if denoise == "none" else f"OIDN {quality}, {sampler}"


def _draw_errors(axis: Any, rows: Sequence[TableRow], column: str) -> None:
    """Draw one panel: all series, presets and the guide."""
    ladder = [row for row in rows if row["preset"] == LADDER and numbers([row], column).size]
    series = grouped(ladder, ("denoise", "quality", "sampler"))
    for number, (key, some) in enumerate(series.items()):
        _draw_series(axis, some, column, name=_series_name(key), number=number)
    raw = [row for row in ladder if row["denoise"] == "none"]
    if raw:
        _draw_guide(axis, raw, column)
    others = [row for row in rows if row["preset"] not in (LADDER, DEPTH)]
    for key, some in grouped(others, ("preset", "denoise")).items():
        _draw_preset(axis, some, column, name=f"{key[0]}{', raw' * (key[1] == 'none')}")


def _draw_series(
    axis: Any, rows: Sequence[TableRow], column: str, *, name: str, number: int
) -> None:
    """Draw medians as a line, seeds as faint points."""
    colour, marker = PALETTE[number % len(PALETTE)], _MARKERS[number % len(_MARKERS)]
    axis.plot(
        [cost(row) for row in rows], [float(row[column]) for row in rows],
        marker, color=colour, ms=3.2, alpha=0.28, mec="none",
    )  # fmt: skip
    rungs = list(grouped(rows, ["spp"]).values())
    times = [float(np.median([cost(row) for row in rung])) for rung in rungs]
    values = [median(rung, column) for rung in rungs]
    axis.plot(times, values, "-", marker=marker, color=colour, ms=5.5, lw=1.6, label=name)


def _draw_guide(axis: Any, raw: Sequence[TableRow], column: str) -> None:
    """Draw a line of slope -0.5 through the cheapest raw rung, a little above the curves."""
    times = np.array(sorted(cost(row) for row in raw))
    first = min(int(row["spp"]) for row in raw)
    start = 1.35 * median([row for row in raw if row["spp"] == first], column)
    power = -1.0 if column.startswith("relmse") else -0.5
    ends = np.array([times[0], times[-1]])
    label = "slope -0.5 (-1 of a mean square)" if power == -1.0 else "slope -0.5"
    axis.plot(ends, start * (ends / ends[0]) ** power, ":", color="0.35", lw=1.6, label=label)


def _draw_preset(axis: Any, rows: Sequence[TableRow], column: str, *, name: str) -> None:
    """Draw a preset as it is: its median, with its name."""
    at, value = float(np.median([cost(row) for row in rows])), median(rows, column)
    if not np.isfinite([at, value]).all():
        return
    axis.plot(at, value, "*", color="black", mec="white", ms=13, mew=0.8, label="preset", zorder=5)
    axis.annotate(
        name, (at, value), (-2, -9), textcoords="offset points", ha="right", va="top",
        fontsize=9, weight="bold", zorder=6, path_effects=_halo(),
    )  # fmt: skip


def _halo() -> list[Any]:
    """Return a white rim that keeps a label legible on lines."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=2.5, foreground="white")]


def _finish_logarithmic(axis: Any, column: str) -> None:
    """Make both axes logarithmic, with plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set(xscale="log", yscale="log", xlabel="CPU-seconds a frame")
    axis.set_title(plain_title(column), fontsize=11)
    for line in (axis.xaxis, axis.yaxis):
        line.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        line.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        line.set_minor_formatter(NullFormatter())
    axis.grid(visible=True, which="major", alpha=0.3, lw=0.6)


def time_plot(
    times: Sequence[float],
    panels: Mapping[str, Mapping[str, Sequence[float]]],
    path: Path,
    *,
    signed: Sequence[str] = (),
) -> None:
    """Draw series over time, one panel above the other.

    Args:
        times: Of the frames, (n,) [s].
        panels: Titles of panels, and their series by name, each (n,); unknown is NaN.
        path: The picture to write.
        signed: Titles of panels that reach at least 1 to both sides of 0; others start
            at 0, so that a little noise does not look like a change.
    """
    figure = new_figure(9.6, 1.9 * len(panels) + 0.5)
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    size = 4.0 if len(times) < 100 else 0.0
    for axis, (title, series) in zip(axes, panels.items(), strict=True):
        for number, (name, values) in enumerate(series.items()):
            marker = _MARKERS[number] if size else ""
            axis.plot(times, values, color=PALETTE[number], marker=marker, ms=size, label=name)
        axis.set_title(title, fontsize=10, loc="left")
        axis.grid(visible=True, alpha=0.3, lw=0.6)
        axis.ticklabel_format(useOffset=False)
        axis.set_ylim(*_limits(list(series.values()), signed=title in signed))
        if len(series) > 1:
            place = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.02), "borderaxespad": 0.0}
            axis.legend(frameon=False, fontsize=9, ncols=len(series), **place)
    axes[-1].set_xlabel("time [s]")
    save_figure(figure, path)


def _limits(series: Sequence[Sequence[float]], *, signed: bool) -> tuple[float, float]:
    """Return an axis' range."""
    values = np.array(series, dtype=np.float64).ravel()
    reach = 1.15 * float(np.abs(values[np.isfinite(values)]).max(initial=0.0))
    return (-max(1.0, reach), max(1.0, reach)) if signed else (0.0, reach or 1.0)


def depth_plot(rows: Sequence[TableRow], path: Path) -> None:
    """Draw mean bias and FLIP over path depth, as differences from the deepest.

    Args:
        rows: Measurements; only those of depth count.
        path: The picture to write.

    Raises:
        ValueError: If there are none.
    """
    groups = grouped([row for row in rows if row["preset"] == DEPTH], ["max_depth"])
    if not groups:
        raise ValueError("no measurements of depth")
    figure = new_figure(9.6, 3.9)
    left, right = figure.subplots(1, 2)
    depths = [float(key[0]) for key in groups]
    for axis, column, scale, number in ((left, "mean_bias", 100, 0), (right, "flip", 1, 3)):
        changes = [scale * values for values in depth_changes(list(groups.values()), column)]
        colour = PALETTE[number]
        for depth, values in zip(depths, changes, strict=True):
            axis.plot(np.full(values.size, depth), values, "o", color=colour, ms=4, alpha=0.3)
        middle = [float(np.median(values)) if values.size else np.nan for values in changes]
        axis.plot(depths, middle, "-o", color=colour, lw=1.6, ms=5)
        axis.axhline(0, color="0.25", lw=1)
        axis.set(xlabel="max_depth", xticks=depths)
        axis.grid(visible=True, alpha=0.3, lw=0.6)
    deepest = f"relative to depth {depths[-1]:g}"
    left.axhspan(-1, 1, color="0.5", alpha=0.12, lw=0)
    left.set_title(f"mean radiance {deepest} [%]; band: ±1 %", fontsize=11)
    right.set_title(f"FLIP of raw pictures, {deepest}", fontsize=11)
    save_figure(figure, path)


def depth_changes(groups: Sequence[Sequence[TableRow]], column: str) -> list[Floats]:
    """Return a column's differences from the deepest group, seed by seed.

    Args:
        groups: Rows of one depth each, the deepest last.
        column: `mean_bias` is compared as a ratio of means, others as a difference.

    Returns:
        One array for each group, (n,), of the seeds that the deepest has too.
    """
    deepest = {row["seed"]: float(row[column]) for row in groups[-1]}
    ratio = column == "mean_bias"
    return [
        np.array([
            (1 + float(row[column])) / (1 + deepest[row["seed"]]) - 1
            if ratio else float(row[column]) - deepest[row["seed"]]
            for row in some if row["seed"] in deepest
        ])
        for some in groups
    ]  # fmt: skip


_DETAIL = 0.25
"""Weight of detail against error: a window without edges shows blur badly."""


@dataclass(frozen=True, slots=True)
class Window:
    """A rectangle of a picture [px].

    Attributes:
        row: Of its top left corner.
        column: Of its top left corner.
        height: Of the rectangle.
        width: Of the rectangle.
    """

    row: int
    column: int
    height: int
    width: int

    def of(self, picture: Image) -> Image:
        """Return what lies inside it."""
        rows = slice(self.row, self.row + self.height)
        return picture[rows, self.column : self.column + self.width]

    def apart(self, other: Window) -> bool:
        """Return whether half a window or more lies between two windows of one size."""
        rows, columns = abs(self.row - other.row), abs(self.column - other.column)
        return rows >= 1.5 * self.height or columns >= 1.5 * self.width


def choose_windows(
    reference: Image, errors: Sequence[Image], *, count: int = 3, share: float = 0.16
) -> list[Window]:
    """Return windows with space between them, the most telling first.

    Args:
        reference: Display-encoded picture, (h, w, 3) in [0, 1].
        errors: Error maps of the pictures to compare, each (h, w), >= 0; may be none.
        count: How many windows are wanted; small pictures may hold fewer.
        share: Width of a window over that of the picture, (0, 1].

    Returns:
        At most `count` windows of one size, at least one.
    """
    height, width = reference.shape[:2]
    wide = max(1, min(width, round(share * width)))
    tall = max(1, min(height, round(0.75 * wide)))
    scores = _box_means(_interest(reference, errors), tall, wide)
    chosen: list[Window] = []
    for place in np.argsort(-scores, axis=None, kind="stable"):
        row, column = np.unravel_index(place, scores.shape)
        window = Window(int(row), int(column), tall, wide)
        if all(window.apart(other) for other in chosen):
            chosen.append(window)
        if len(chosen) == count:
            break
    return chosen


def _interest(reference: Image, errors: Sequence[Image]) -> Floats:
    """Return what a window gains by each pixel, (h, w): error, and edges that error could hide."""
    grey = reference.astype(np.float64).mean(axis=-1)
    edges = sum(np.abs(np.diff(grey, axis=axis, append=_last(grey, axis))) for axis in (0, 1))
    edges = np.minimum(np.asarray(edges), 0.3)
    wrong = sum((np.asarray(error, dtype=np.float64) for error in errors), np.zeros(grey.shape))
    return np.asarray(_levelled(wrong) + _DETAIL * _levelled(edges))


def _last(values: Floats, axis: int) -> Floats:
    """Return the last line along an axis, kept as an axis."""
    return np.asarray(np.take(values, [-1], axis=axis))


def _levelled(values: Floats) -> Floats:
    """Return values whose mean is 1, or 0 if there is nothing."""
    mean = float(values.mean())
    return values / mean if mean > 0 else values


def _box_means(values: Floats, tall: int, wide: int) -> Floats:
    """Return the mean of every window that fits, (h - tall + 1, w - wide + 1).

    A summed-area table gives all of them at once.
    """
    table = np.pad(values, ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)
    sums = table[tall:, wide:] - table[:-tall, wide:] - table[tall:, :-wide] + table[:-tall, :-wide]
    return np.asarray(sums / (tall * wide))


_SMALLEST_SCALE = 0.05
"""FLIP at the top of a map's colours is at least this, so that equal pictures stay black."""

_TALLEST = 3.4
"""Height of the whole picture above crops [inch]."""


def crops_plot(
    pictures: Mapping[str, Image],
    path: Path,
    *,
    reference: str = "reference",
    costs: Mapping[str, float] | None = None,
    count: int = 3,
) -> list[Window]:
    """Draw the same windows of several pictures side by side, the whole reference above.

    Args:
        pictures: sRGB-encoded, by name in the order of columns, each (h, w, 3) in [0, 1].
        path: The picture to write.
        reference: Name of the one that the others are compared with.
        costs: CPU-seconds by name, for the captions.
        count: How many windows are wanted.

    Returns:
        The windows.

    Raises:
        ConfigError: If the package flip-evaluator (extra `report`) is missing.
    """
    # Choose where to look, then lay out a column for each picture.
    truth = pictures[reference]
    maps = _maps(pictures, reference)
    windows = choose_windows(truth, list(maps.values()), count=count)
    columns = [*maps, reference]
    height = 2.0 * windows[0].height / windows[0].width
    top = min(_TALLEST, len(columns) * truth.shape[0] / truth.shape[1])
    figure = new_figure(2.0 * len(columns) + 0.1, top + (height + 0.04) * len(windows) + 0.7)
    grid = figure.add_gridspec(
        len(windows) + 1, len(columns), height_ratios=[top, *[height] * len(windows)]
    )

    # The whole reference stands above the windows.
    _draw_whole(figure.add_subplot(grid[0, :]), truth, windows, title=reference)
    for place, name in enumerate(columns):
        for line, window in enumerate(windows):
            axis = figure.add_subplot(grid[line + 1, place])
            _draw_picture(axis, window.of(pictures[name]))
            _frame(axis, PALETTE[line % len(PALETTE)])
            if line == 0:
                axis.set_title(_caption(name, maps.get(name), (costs or {}).get(name)), fontsize=9)
    save_figure(figure, path)
    return windows


def flip_maps(
    pictures: Mapping[str, Image],
    path: Path,
    *,
    reference: str = "reference",
    costs: Mapping[str, float] | None = None,
) -> None:
    """Draw FLIP maps of several pictures beside their reference, on one scale.

    Args:
        pictures: As in `crops_plot`.
        path: The picture to write.
        reference: Name of the one that the others are compared with.
        costs: CPU-seconds by name, for the captions.

    Raises:
        ConfigError: If the package flip-evaluator (extra `report`) is missing.
    """
    truth, maps = pictures[reference], _maps(pictures, reference)
    across = 2 if len(maps) < 5 else 3
    lines = -(-(len(maps) + 1) // across)
    wide = 9.6 / across
    figure = new_figure(10.4, (wide * truth.shape[0] / truth.shape[1] + 0.3) * lines)
    axes = figure.subplots(lines, across, squeeze=False).ravel()
    _draw_picture(axes[0], truth)
    axes[0].set_title(reference, fontsize=10)
    top = _scale(list(maps.values()))
    for place, (name, errors) in enumerate(maps.items(), start=1):
        axis = axes[place]
        shown = _draw_map(axis, errors, top)
        axis.set_title(_caption(name, errors, (costs or {}).get(name), lines=1), fontsize=10)
        if place % across == across - 1 or place == len(maps):
            _draw_scale(figure, axis, shown)
    for axis in axes[len(maps) + 1 :]:
        axis.set_axis_off()
    save_figure(figure, path)


def pair_plot(image: Image, reference: Image, path: Path, *, titles: Sequence[str]) -> None:
    """Draw two pictures and their FLIP map in a row.

    Args:
        image: sRGB-encoded, (h, w, 3) in [0, 1].
        reference: What it is compared with, in the same form.
        path: The picture to write.
        titles: Of the two pictures.

    Raises:
        ConfigError: If the package flip-evaluator (extra `report`) is missing.
    """
    errors = flip_map(image, reference)
    figure = new_figure(15.0, 4.9 * image.shape[0] / image.shape[1] + 0.4)
    axes = figure.subplots(1, 3)
    for axis, picture, title in zip(axes, (image, reference), titles, strict=False):
        _draw_picture(axis, picture)
        axis.set_title(title, fontsize=10)
    shown = _draw_map(axes[2], errors, _scale([errors]))
    axes[2].set_title(f"FLIP {errors.mean():.4f}", fontsize=10)
    _draw_scale(figure, axes[2], shown)
    save_figure(figure, path)


def _maps(pictures: Mapping[str, Image], reference: str) -> dict[str, Image]:
    """Return the FLIP maps of all pictures but the reference."""
    truth = pictures[reference]
    return {name: flip_map(image, truth) for name, image in pictures.items() if name != reference}


def _scale(maps: Sequence[Image]) -> float:
    """Return the FLIP at the top of the colours: what few pixels exceed, in steps of 0.05."""
    worst = max((float(np.percentile(errors, 99.5)) for errors in maps), default=0.0)
    return float(max(_SMALLEST_SCALE, np.ceil(worst * 20) / 20))


def _caption(name: str, errors: Image | None, seconds: float | None, *, lines: int = 2) -> str:
    """Return a picture's name, cost and error."""
    facts = [] if seconds is None else [f"{seconds:.3g} CPU-s"]
    facts += [] if errors is None else [f"FLIP {errors.mean():.3f}"]
    return ("\n" if lines == 2 else ": ").join([name, *([", ".join(facts)] if facts else [])])


def _draw_picture(axis: Any, picture: Image) -> None:
    """Show a picture's own pixels."""
    axis.imshow(np.clip(picture, 0.0, 1.0), interpolation="nearest", aspect="equal")
    axis.set(xticks=[], yticks=[])


def _draw_map(axis: Any, errors: Image, top: float) -> Any:
    """Return an error map in the colours of FLIP's paper."""
    axis.set(xticks=[], yticks=[])
    return axis.imshow(errors, cmap="magma", vmin=0.0, vmax=top, interpolation="nearest")


def _draw_scale(figure: Any, axis: Any, shown: Any) -> None:
    """Draw a map's colours beside it, just as high as the map."""
    figure.colorbar(shown, cax=axis.inset_axes((1.015, 0.0, 0.025, 1.0)))


def _draw_whole(axis: Any, picture: Image, windows: Sequence[Window], *, title: str) -> None:
    """Show the whole picture with its windows framed."""
    from matplotlib.patches import Rectangle

    _draw_picture(axis, picture)
    axis.set_title(title, fontsize=9)
    for number, window in enumerate(windows):
        corner, colour = (window.column - 0.5, window.row - 0.5), PALETTE[number % len(PALETTE)]
        rim = Rectangle(corner, window.width, window.height, fill=False, lw=2, ec=colour)
        axis.add_patch(rim)


def _frame(axis: Any, colour: str) -> None:
    """Draw a rim in the colour of the window."""
    for spine in axis.spines.values():
        spine.set(edgecolor=colour, linewidth=2)
