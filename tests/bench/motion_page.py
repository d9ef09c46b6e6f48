"""The manual's page about smoothers and the truth: tables, verdicts and a plot."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.installation.doctor import processor_name
from sumo3dviz_pt.report.plots import PALETTE, new_figure, save_figure

Row = dict[str, Any]

LATERAL_NOISE = ("motorway_sublane",)
"""Here vehicles sway in their lanes, which no log of a second tells."""

DEFAULT = "lane"
PAPER = "paper_symmetric"


@dataclass(frozen=True)
class Target:
    """Something that the default smoother is to reach on logs of one second.

    Attributes:
        name: For the table.
        column: Of the rows.
        limit: Largest value, by kind of speed: of the moment, and Euler's.
        against: A smoother whose value over ours must be at least `limit`; empty: none.
        noisy: Largest value where vehicles sway.
    """

    name: str
    column: str
    limit: tuple[float, float]
    against: str = ""
    noisy: float | None = None

    def value(self, row: Row, others: Mapping[str, Row]) -> float:
        """Of a row; `others` are those of the same log by smoother."""
        if not self.against:
            return float(row[self.column])
        return float(others[self.against][self.column] / row[self.column])

    def met(self, row: Row, value: float) -> bool:
        """Whether the target is reached."""
        limit = self.limit[row["speed"] == "Euler"]
        if self.against:
            return value >= limit
        if self.noisy is not None and row["scenario"] in LATERAL_NOISE:
            limit = self.noisy
        return value <= limit


TARGETS = (
    Target("RMSE [m]", "rmse", (0.03, 0.06), noisy=0.06),
    Target("along p95 [m]", "along_p95", (0.03, 0.13)),
    Target("along p99 [m]", "along_p99", (0.12, 0.25)),
    Target("lateral p95 [m]", "lateral_p95", (0.03, 0.03), noisy=0.1),
    Target("largest [m]", "max", (1.0, 1.0)),
    Target("heading p95 [deg]", "heading_p95", (0.5, 0.5), noisy=1.5),
    Target("heading p99 [deg]", "heading_p99", (3.5, 3.5)),
    Target("birth [m]", "birth", (0.05, 0.05), noisy=0.25),
    Target("death [m]", "death", (0.05, 0.05), noisy=0.25),
    Target("`linear`'s jerk / ours", "jerk_p99", (10.0, 10.0), against="linear"),
    Target("`paper_symmetric`'s RMSE / ours", "rmse", (6.0, 2.5), against=PAPER),
    Target("jumps", "jumps", (0.0, 0.0)),
    Target("spikes in lane changes on straights", "spikes", (0.0, 0.0)),
)
"""Those of the issue; `facts/motion.md`, section 8."""

MEASURES: tuple[tuple[str, str, int], ...] = (
    ("RMSE [m]", "rmse", 3), ("along p95", "along_p95", 3), ("lateral p95", "lateral_p95", 3),
    ("largest", "max", 2), ("heading p95 [deg]", "heading_p95", 2), ("p99", "heading_p99", 1),
    ("speed RMSE [m/s]", "speed_rmse", 2), ("acceleration p99 [m/s²]", "acceleration_p99", 1),
    ("jerk p99 [m/s³]", "jerk_p99", 0), ("birth [m]", "birth", 2), ("death [m]", "death", 2),
    ("jumps", "jumps", 0), ("off lane p95 [m]", "lane_p95", 3), ("run time [µs]", "us", 1),
)  # fmt: skip
CHANGES: tuple[tuple[str, str, int], ...] = (
    ("across p99 [m/s²]", "change_across_p99", 1),
    ("yaw rate p99 [deg/s]", "change_yaw_rate_p99", 0), ("crab p99 [m/s]", "change_crab_p99", 2),
    ("changes", "changes", 0), ("above 30 m/s² on straights", "spikes", 0),
    ("in bends", "bend_spikes", 0),
)  # fmt: skip


def publish(rows: Sequence[Row], spent: Mapping[str, Any], output: Path) -> list[str]:
    """Write table, page and plot; returns the page's lines."""
    folder = output / "motion"
    folder.mkdir(parents=True, exist_ok=True)
    left = ("worst", "what", "vehicles", "seconds")
    kept = [{key: _short(row[key]) for key in row if key not in left} for row in rows]
    with (folder / "motion.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(kept[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(kept)
    if spent:
        record = json.dumps({"cpu": processor_name(), **spent}, indent=1, default=float)
        (folder / "cost.json").write_text(record + "\n", encoding="utf-8")
    plot(rows, folder / "error.png")
    lines = page(rows, spent)
    (output / "motion.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return lines


def _short(value: Any) -> Any:
    """A number with three digits."""
    return float(f"{value:.3g}") if isinstance(value, float) else value


def some(rows: Iterable[Row], **wanted: Any) -> list[Row]:
    """Rows with given values."""
    return [row for row in rows if all(row[key] == value for key, value in wanted.items())]


def grid(head: Sequence[str], lines: Iterable[Sequence[str]]) -> list[str]:
    """A Markdown table; all but the first column are numbers."""
    found = ["| " + " | ".join(head) + " |", "|---|" + "--:|" * (len(head) - 1)]
    return [*found, *("| " + " | ".join(cells) + " |" for cells in lines), ""]


def number(value: float, digits: int) -> str:
    """A number, or a dash for one that was not measured."""
    return f"{value:.{digits}f}" if np.isfinite(value) else "-"


def _ours(rows: Sequence[Row]) -> str:
    """The smoother that is judged."""
    names = [row["smoother"] for row in rows]
    return DEFAULT if DEFAULT in names else names[-1]


def page(rows: Sequence[Row], spent: Mapping[str, Any]) -> list[str]:
    """All tables."""
    ours = _ours(rows)
    lines = ["### Scenarios", "", *towns(rows)]
    lines += ["### All smoothers, logs of 1 s", "", *smoothers(rows, MEASURES)]
    lines += [f"### `{ours}` by scenario, logs of 1 s", "", *scenarios(rows, ours)]
    lines += ["### Position error [m] by step of the log", "", *steps(rows)]
    lines += ["### Around lane changes, logs of 1 s", "", *changes(rows)]
    lines += [f"### Targets of `{ours}`, logs of 1 s", "", *verdicts(rows, ours)]
    lines += ["### Error against run time", ""]
    lines += ["![Error over run time](../_bench/motion/error.png)", ""]
    return lines + (cost_lines(spent) if spent else [])


def towns(rows: Sequence[Row]) -> list[str]:
    """What was simulated."""
    lines = []
    for row in some(rows, smoother="truth", step=1.0):
        held = "yes" if row["held_out"] else ""
        lines.append(
            [row["scenario"], row["what"], held, f"{row['vehicles']}", f"{row['seconds']:.0f}"]
        )
    found = grid(["scenario", "what", "held out", "vehicles", "vehicle-seconds"], lines)
    return [found[0], "|---|---|---|--:|--:|", *found[2:]]


def smoothers(rows: Sequence[Row], measures: Sequence[tuple[str, str, int]]) -> list[str]:
    """Smoothers by measures: medians over scenarios that are held out, and the others."""
    lines = []
    for held, word in ((False, "tuned"), (True, "held out")):
        for kind in ("moment", "Euler"):
            wanted = some(rows, held_out=held, step=1.0, fps=25.0, speed=kind)
            for name in sorted({row["smoother"] for row in wanted}):
                own = some(wanted, smoother=name)
                cells = [number(_median(own, key), digits) for _, key, digits in measures]
                shown = name if name == "truth" else f"`{name}`"
                lines.append([f"{shown}, {word}" + ", Euler" * (kind == "Euler"), *cells])
    return grid(["smoother", *(title for title, _, _ in measures)], lines)


def _median(rows: Sequence[Row], key: str) -> float:
    """Over rows that have a number."""
    values = [row[key] for row in rows if np.isfinite(row[key])]
    return float(np.median(values)) if values else float("nan")


def scenarios(rows: Sequence[Row], ours: str) -> list[str]:
    """One smoother by scenario."""
    lines = []
    for row in some(rows, smoother=ours, step=1.0, fps=25.0):
        cells = [number(row[key], digits) for _, key, digits in MEASURES]
        lines.append([row_name(row), *cells])
    return grid(["scenario", *(title for title, _, _ in MEASURES)], lines)


def row_name(row: Row) -> str:
    """Scenario, its kind of speed, and whether it was held out."""
    held = " (held out)" if row["held_out"] else ""
    return row["scenario"] + held + (", Euler" if row["speed"] == "Euler" else "")


def steps(rows: Sequence[Row]) -> list[str]:
    """Medians over held-out scenarios by step."""
    wanted = some(rows, fps=25.0, held_out=True) or some(rows, fps=25.0)
    found = sorted({row["step"] for row in wanted})
    lines = []
    for name in sorted({row["smoother"] for row in wanted} - {"truth"}):
        for kind in ("moment", "Euler"):
            own = some(wanted, smoother=name, speed=kind)
            if own:
                cells = [number(_median(some(own, step=step), "rmse"), 3) for step in found]
                lines.append([f"`{name}`" + ", Euler" * (kind == "Euler"), *cells])
    return grid(["held out, medians", *(f"{step:g} s" for step in found)], lines)


def changes(rows: Sequence[Row]) -> list[str]:
    """Lane changes by scenario and smoother."""
    lines = []
    wanted = some(rows, step=1.0, fps=25.0, speed="moment")
    for row in sorted(wanted, key=lambda row: (row["scenario"], row["smoother"])):
        if row["changes"] >= 5 and row["smoother"] != "paper":
            cells = [number(row[key], digits) for _, key, digits in CHANGES]
            lines.append([f"{row_name(row)}, {row['smoother']}", *cells])
    return grid(["scenario, smoother", *(title for title, _, _ in CHANGES)], lines)


def verdicts(rows: Sequence[Row], ours: str) -> list[str]:
    """Targets by held-out scenario: the value, bold where it is missed."""
    wanted = some(rows, step=1.0, fps=25.0, smoother=ours)
    wanted = some(wanted, held_out=True) or wanted
    head = ["target", *(row_name(row).replace(" (held out)", "") for row in wanted)]
    cells = [_verdict(rows, row) for row in wanted]
    table = [
        [f"{target.name}, {_limit(target)}", *(column[number] for column in cells)]
        for number, target in enumerate(TARGETS)
    ]
    return grid(head, table)


def _limit(target: Target) -> str:
    """What is asked for: of the moment's speed / of Euler's."""
    sign = "≥" if target.against else "≤"
    return f"{sign} " + " / ".join(f"{limit:g}" for limit in dict.fromkeys(target.limit))


def _verdict(rows: Sequence[Row], row: Row) -> list[str]:
    """One scenario's values for all targets."""
    beside = some(rows, scenario=row["scenario"], step=1.0, fps=25.0, speed="moment")
    others = {each["smoother"]: each for each in beside}
    found = []
    for target in TARGETS:
        if target.against and target.against not in others:
            found.append("-")
            continue
        value = target.value(row, others)
        shown = number(value, 0 if value >= 100 or float(value).is_integer() else 3 - (value >= 1))
        found.append(shown if target.met(row, value) else f"**{shown}**")
    return found


def plot(rows: Sequence[Row], path: Path) -> None:
    """RMSE over run time, a line for each smoother from short to long steps of the log."""
    figure = new_figure(9.6, 4.4)
    axes = figure.subplots(1, 2, sharey=True)
    for axis, kind in zip(axes, ("moment", "Euler"), strict=True):
        _draw(axis, rows, kind)
        axis.set(xscale="log", yscale="log", xlabel="CPU-time per vehicle-second [µs]")
        axis.grid(alpha=0.3, which="both", lw=0.4)
        axis.set_xticks((20, 50, 100, 200), ("20", "50", "100", "200"))
        axis.xaxis.set_minor_formatter("")
        title = "speed of the moment" if kind == "moment" else "Euler's speed (mean of the step)"
        axis.set_title(f"Logs with {title}")
    axes[0].set_ylabel("RMSE of the front [m]; medians over held-out scenarios")
    axes[0].legend(frameon=False, fontsize=8)
    save_figure(figure, path)


def _draw(axis: Any, rows: Sequence[Row], kind: str) -> None:
    """One panel."""
    wanted = some(rows, fps=25.0, held_out=True) or some(rows, fps=25.0)
    names = sorted({row["smoother"] for row in wanted} - {"truth"})
    for index, name in enumerate(names):
        own = some(wanted, smoother=name, speed=kind) or some(wanted, smoother=name)
        places = [
            (_median(some(own, step=step), "us"), _median(some(own, step=step), "rmse"), step)
            for step in sorted({row["step"] for row in own})
        ]
        colour = PALETTE[index % len(PALETTE)]
        axis.plot(
            *zip(*[place[:2] for place in places], strict=True), "o-", color=colour, label=name
        )
        for us, rmse, step in places:
            axis.annotate(f"{step:g} s", (us, rmse), (4, 3), textcoords="offset points",
                          fontsize=7, color=colour)  # fmt: skip


def cost_lines(spent: Mapping[str, Any]) -> list[str]:
    """What smoothing costs."""
    lines = ["### Cost", ""]
    if "barcelona" in spent:
        lines += _real_cost(spent["barcelona"])
    table = [
        [
            f"{each['rows']:,.0f}",
            number(each["cpu"], 2),
            number(1e6 * each["cpu"] / each["rows"], 1),
        ]
        for each in spent["scaling"]
    ]
    lines += [f"`{spent['smoother']}` over rows:", "", *grid(["rows", "CPU-s", "µs a row"], table)]
    table = [
        [f"{each['turns']} min", f"{each['rows']}", number(each["peak"], 1)]
        for each in spent["memory"]
    ]
    lines += ["Peak memory to read and smooth the last minute of ever longer logs:", ""]
    return lines + grid(["log", "rows kept", "MB"], table)


def _real_cost(real: Mapping[str, Any]) -> list[str]:
    """The ring road."""
    table = [
        [f"`{name}`", number(each["smooth"], 2), number(each["sample"], 2)]
        for name, each in real["smoothers"].items()
    ]
    return [
        f"Ring road of Barcelona: {real['vehicles']} vehicles, {real['rows']} rows,"
        f" {real['seconds']:.0f} s; CPU-seconds ({real['read']:.1f} to read):",
        "",
        *grid(["smoother", "smoothing", "all positions at 25 fps"], table),
    ]
