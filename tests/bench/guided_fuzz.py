"""Damages files of one kind again and again where that reaches new lines of our readers.

    pip install atheris pytest hypothesis  # Linux, Python 3.12 to 3.14
    python tests/bench/guided_fuzz.py KIND FOLDER -max_total_time=60 [other options of libFuzzer]

KIND is a key of SEEDS below; FOLDER keeps files that reached something new, from run to run. A
reader may take a file or refuse it in one sentence. Anything else ends the search with exit code
77 and leaves the file (`crash-...`): give it instead of FOLDER to see it again. What the seeded
damage of `fuzz.py` does in one step, this does in many, guided by the coverage of what came before.
"""

from __future__ import annotations

import logging
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import atheris
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from damage import (
    CONFIGURATION,
    NETWORK,
    OBJECTS,
    SIGNALS,
    TYPES,
    damaged_bytes,
    damaged_xml,
    damaged_yaml,
    log_text,
    write_town,
)
from damaged_work import STUDY

TABLE = "time,id,x,y,speed,heading\n" + "".join(
    f"{step * 0.5},car{car},{3.0 * step + 20 * car},{-1.6 * car},6.0,0.0\n"
    for step in range(6)
    for car in range(2)
)
SEEDS = {
    "network": ("net.net.xml", NETWORK),
    "log": ("fcd.xml", log_text(people=True)),
    "signals": ("tls.xml", SIGNALS),
    "objects": ("objects.add.xml", OBJECTS),
    "types": ("types.rou.xml", TYPES),
    "configuration": ("town.sumocfg", CONFIGURATION),
    "table": ("tracks.csv", TABLE),
    "scene": ("scene.yaml", ""),
    "study": ("study.yaml", STUDY),
}
"""What is damaged, by kind: a file's name, and what stands in it."""


def readers() -> dict[str, Callable[[Path], object]]:
    """What reads each kind; their lines are counted."""
    with atheris.instrument_imports(include=["sumo3dviz_pt"]):
        from sumo3dviz_pt.pipeline.scene_file import load_job
        from sumo3dviz_pt.studies.file import load_study
        from sumo3dviz_pt.sumo.additional import read_additional, read_detectors, read_stops
        from sumo3dviz_pt.sumo.fcd import read_trajectories
        from sumo3dviz_pt.sumo.find import files_behind
        from sumo3dviz_pt.sumo.network import read_network
        from sumo3dviz_pt.sumo.signals import read_signals
        from sumo3dviz_pt.sumo.types import read_vehicle_types

    return {
        "network": read_network,
        "log": lambda path: read_trajectories([path]),
        "signals": lambda path: read_signals([path]),
        "objects": lambda path: [
            read([path]) for read in (read_additional, read_stops, read_detectors)
        ],
        "types": lambda path: read_vehicle_types([path]),
        "configuration": files_behind,
        "table": lambda path: read_trajectories([path]),
        "scene": load_job,
        "study": load_study,
    }


def trial(reader: Callable[[Path], object], path: Path) -> Callable[[bytes], None]:
    """Return what is done with each file."""
    from sumo3dviz_pt.errors import Sumo3dvizError

    def one(data: bytes) -> None:
        path.write_bytes(data)
        try:
            reader(path)
        except Sumo3dvizError as error:
            assert "\n" not in str(error), f"not one sentence: {error}"
        except OSError as error:  # the command line says it in a sentence (cli/program.py)
            assert error.strerror, error

    return one


def mutator(name: str) -> Callable[[bytes, int, int], bytes]:
    """Return how a file becomes another: bytes by libFuzzer, or what people get wrong."""
    damage = damaged_yaml if name.endswith(".yaml") else damaged_xml

    def mutated(data: bytes, most: int, seed: int) -> bytes:
        rng = np.random.default_rng(seed)
        if rng.random() < 0.3:
            return atheris.Mutate(data, most)
        try:
            changed = damage(data.decode("utf-8"), rng)
        except (UnicodeDecodeError, ValueError):
            changed = damaged_bytes(data, rng)
        return changed[:most]

    return mutated


def main(kind: str, folder: Path, options: list[str]) -> None:
    """Search until the time is over or something is found."""
    logging.getLogger("sumo3dviz_pt").addHandler(logging.NullHandler())
    name, text = SEEDS[kind]
    with tempfile.TemporaryDirectory() as place:
        os.environ["SUMO3DVIZ_PT_CACHE"] = place
        scene = write_town(Path(place) / "town")
        if not folder.is_file():
            folder.mkdir(parents=True, exist_ok=True)
            (folder / "seed").write_text(text or scene.read_text("utf-8"), "utf-8")
        limits = ["-timeout=20", "-rss_limit_mb=4096", "-max_len=20000", "-verbosity=1"]
        atheris.Setup(
            [sys.argv[0], str(folder), *limits, *options],
            trial(readers()[kind], scene.with_name(name)),
            custom_mutator=mutator(name),
        )
        atheris.Fuzz()


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), sys.argv[3:])
