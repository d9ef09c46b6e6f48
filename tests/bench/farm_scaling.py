"""Simulates a study of 32 films of 10 s on many nodes: python tests/bench/farm_scaling.py -o docs

The tasks are those that `farm` plans; what they cost is `pipeline/costs.py`, which is
measured. Nodes take tasks as workers do: the first that is ready. What is not simulated: a shared
folder that is slower the more read it, queues of other people's jobs, machines that fail.
"""

from __future__ import annotations

import argparse
import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sumo3dviz_pt.farm.making import FarmOrder
from sumo3dviz_pt.farm.plan import EngineChoice, chunks
from sumo3dviz_pt.pipeline.costs import Stages, Work, stages_of, time_in_words
from sumo3dviz_pt.pipeline.scene_file import quality_preset

FILMS, FRAMES, SIZE, CORES = 32, 250, (1280, 720), 16
PAIRS = 80
"""Of a design of five factors with two levels each: every film has five partners."""
_PAIR, _MEASURED = 5.5, 0.23
"""Comparing two films, and measuring a frame of one, for each million pixels [CPU-s], by
`tests/bench/farm_costs.py`."""

NODES = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512)
LOOK = 5.0
"""A worker that waits looks at the disk every 10 s: so long it is late on average [s]."""


@dataclass(frozen=True, slots=True)
class Task:
    """A task of the simulation.

    Attributes:
        seconds: How long it takes a node [s].
        needs: Numbers of tasks that come first.
    """

    seconds: float
    needs: tuple[int, ...] = ()


def tasks_of(stages: Stages, *, minutes: float | None, workers: int | None = None) -> list[Task]:
    """The tasks of the study, as `farm` plans them."""
    order = FarmOrder(EngineChoice("slurm", threads=CORES, workers=workers), minutes)
    tasks, needs = [], []
    for _ in range(FILMS):
        needs.append([])
        for first, after in chunks(FRAMES, longest=order.longest(stages, frames=FILMS * FRAMES)):
            needs[-1].append(len(tasks))
            work = stages.start + (after - first) * stages.trace
            tasks.append(Task(work.wall(CORES)))
    for own in needs:
        tasks.append(Task(film_of(stages).wall(CORES), tuple(own)))
    made = tuple(range(len(tasks) - FILMS, len(tasks)))
    return [*tasks, Task(ending().wall(CORES), made)]


def film_of(stages: Stages) -> Work:
    """Making a film of its frames."""
    return stages.start + FRAMES * (stages.develop + stages.encode)


def ending() -> Work:
    """What is done when all films are there, by one thread of a process without a renderer."""
    megapixels = SIZE[0] * SIZE[1] / 1e6
    return Work(megapixels * (_PAIR * PAIRS + _MEASURED * FRAMES * FILMS))


def simulated(tasks: Sequence[Task], nodes: int) -> float:
    """How long nodes need that each take the first task that is ready [s]."""
    ended: dict[int, float] = {}
    free = [0.0] * nodes
    waiting = list(range(len(tasks)))
    running: list[tuple[float, int]] = []
    now = 0.0
    while waiting or running:
        ready = [n for n in waiting if all(ended.get(m, now + 1) <= now for m in tasks[n].needs)]
        while ready and free and free[0] <= now:
            heapq.heappop(free)
            number = ready.pop(0)
            waiting.remove(number)
            late = LOOK if tasks[number].needs else 0.0
            heapq.heappush(running, (now + late + tasks[number].seconds, number))
        now, number = heapq.heappop(running)
        ended[number] = now
        heapq.heappush(free, now)
    return now


def main() -> None:
    """Write the table and the curve."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"))
    folder = parser.parse_args().output
    quality = quality_preset("study", together=True)
    stages = stages_of(quality, size=SIZE, frames=FRAMES)
    columns = {}
    for minutes in (60.0, 20.0, 2.0, None):
        name = "by `--workers`" if minutes is None else f"tasks of {minutes:g} min"
        plans = [tasks_of(stages, minutes=minutes, workers=nodes) for nodes in NODES]
        columns[name] = [simulated(*pair) for pair in zip(plans, NODES, strict=True)]
    write_table(folder / "_bench" / "farm.md", columns)
    draw(folder / "images" / "farm_scaling.png", columns)
    path = longest_path(stages)
    print(f"no node is faster than {time_in_words(path)}")


def longest_path(stages: Stages) -> float:
    """What nobody can do at once, with a node for every frame [s]."""
    frame = (stages.start + stages.trace).wall(CORES)
    return frame + film_of(stages).wall(CORES) + ending().wall(CORES) + 2 * LOOK


def write_table(path: Path, columns: dict[str, list[float]]) -> None:
    """Write the table that the manual includes."""
    lines = [
        f"| nodes of {CORES} cores | {' | '.join(columns)} | efficiency of the last |",
        "|--:|" + "--:|" * (len(columns) + 1),
    ]
    last = list(columns.values())[-1]
    for row, nodes in enumerate(NODES):
        cells = [time_in_words(times[row]) for times in columns.values()]
        share = last[0] / (nodes * last[row])
        lines.append(f"| {nodes} | {' | '.join(cells)} | {100 * share:.0f} % |")
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")


def draw(path: Path, columns: dict[str, list[float]]) -> None:
    """Draw the curve."""
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7, 4.2), dpi=110)
    first = list(columns.values())[-1][0] / 60
    axes.plot(NODES, [first / n for n in NODES], color="0.75", ls="--", label="if all were shared")
    for name, found in columns.items():
        axes.plot(NODES, [t / 60 for t in found], marker="o", ms=4, label=name.replace("`", ""))
    axes.set_xscale("log", base=2)
    axes.set_yscale("log")
    axes.set_xticks(NODES, list(map(str, NODES)))
    axes.set_xlabel(f"nodes of {CORES} cores")
    axes.set_ylabel("time to the finished study [min]")
    axes.grid(visible=True, which="both", color="0.92")
    axes.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, metadata={"Software": None})


if __name__ == "__main__":
    main()
