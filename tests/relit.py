"""How often a relit fiftieth of the picture is found, at places drawn by lot."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from violations import Films

from sumo3dviz_pt.model.geometry import Bools
from sumo3dviz_pt.studies.certificate.acts import Acts
from sumo3dviz_pt.studies.certificate.comparison import compare
from sumo3dviz_pt.studies.certificate.evidence import Evidence, light_faults, luminance

RATES = "relit.md"
"""File of the table, beside that of violations."""

SHARE, PLACES, FACTORS = 0.02, 20, (1.5, 2.5)
"""Share of the picture that is lit otherwise, how many places are drawn, and by how much it is."""

_DARK = 2e-3


def places(one: Evidence, own: Bools) -> Iterator[Bools]:
    """Yield rectangles drawn by lot, of which half at least can be judged, (h, w).

    That is where the factor does not act, and where something is lit at all.
    """
    height, width = own.shape
    rows, columns = (round(side * SHARE**0.5) for side in (height, width))
    rng = np.random.default_rng(0)
    judged = ~own & (luminance(one) > _DARK)
    for _ in range(PLACES):
        row, column = rng.integers(height - rows + 1), rng.integers(width - columns + 1)
        where = np.zeros(own.shape, dtype=bool)
        where[row : row + rows, column : column + columns] = True
        if judged[where].mean() >= 0.5:
            yield where


def is_found(frames: list[tuple[Evidence, Evidence]], acts: Acts, where: Bools, by: float) -> bool:
    """Return whether a rectangle that is lit otherwise in all frames of a film is found."""
    found = []
    for number, (one, other) in enumerate(frames):
        radiance = np.array(other.radiance)
        radiance[where] *= by
        found.append(compare(number, one, replace(other, radiance=radiance), acts).blocks)
    return bool(light_faults([each for each in found if each is not None]))


def rates(films: Films, factors: Iterable[str], scene: str) -> list[dict[str, Any]]:
    """Return how often it is found, by pair; and whether the clean pair is called wrong."""
    rows = []
    for light in ("day", "night"):
        for factor in factors:
            acts, frames = films.evidence(factor, light)
            if acts.light:
                continue
            first = compare(0, *frames[0], acts)
            drawn = list(places(frames[0][0], first.own))
            row = {"scene": scene, "light": light, "factor": factor, "places": len(drawn)}
            for by in FACTORS:
                row[f"{by}"] = sum(is_found(frames, acts, where, by) for where in drawn)
            rows.append(row | {"clean": "; ".join(films.judge(factor, light).faults) or "nothing"})
    return rows


def rates_table(rows: list[dict[str, Any]]) -> str:
    """Return the rows as the manual shows them."""
    factors = "".join(f" lit {by} times |" for by in FACTORS)
    lines = [
        f"| scene | light | the factor | places |{factors} the clean pair |",
        "|---|---|---|--:|" + "--:|" * len(FACTORS) + "---|",
    ]
    for row in rows:
        found = [f"{row[str(by)]}" for by in FACTORS]
        cells = [
            row["scene"],
            row["light"],
            row["factor"],
            str(row["places"]),
            *found,
            row["clean"],
        ]
        lines.append(f"| {' | '.join(cells)} |")
    places = sum(row["places"] for row in rows) * len(FACTORS)
    found = sum(row[str(by)] for row in rows for by in FACTORS)
    lines += ["", f"All together: {found} of {places} are found."]
    return "\n".join(lines) + "\n"
