"""Draws pictures beside each other: equal crops, FLIP maps, the worst frame of a film."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.image.metrics import flip_map
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.report.convergence.windows import Window, choose_windows
from sumo3dviz_pt.report.plots import PALETTE, new_figure, save_figure

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
