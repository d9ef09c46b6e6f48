"""Measures how costs grow with the size of a city.

    python tests/bench/cities.py FOLDER [--lanes 1000 10000 40000] [--hills 10000]

Makes random cities with SUMO's netgenerate, drives through them, and runs `init`, `check` and what
comes before the first pixel of a driver's view and of a flight, each in a process of its own.
Prints CPU-seconds and peak memory as a table. What lies in FOLDER already is not made again.
"""

from __future__ import annotations

import argparse
import re
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

LANES_PER_ITERATION = 34.5
"""Lanes of a random network of netgenerate for each iteration, footways and junctions included."""

PER_VEHICLE = 8.0
"""Lanes for each vehicle that drives at once, about."""

MINUTES = 6.0
WINDOW = 60.0
"""How long vehicles drive in all [min], and how much of that is logged [s]."""


def make_city(folder: Path, lanes: int, *, hills: float = 0.0) -> Path:
    """Make a network, traffic and a log of about so many lanes; return the configuration."""
    import sumo

    folder = folder.absolute()
    config = folder / "city.sumocfg"
    if config.exists():
        return config
    folder.mkdir(parents=True, exist_ok=True)
    net, trips, end = folder / "city.net.xml", folder / "trips.rou.xml", MINUTES * 60.0
    size = ["--rand", "--rand.iterations", str(round(lanes / LANES_PER_ITERATION)), "--rand.grid"]
    size += ["--rand.max-distance", "180", "--rand.min-distance", "90", "--seed", "11"]
    looks = ["--random-lanenumber", "--default.lanenumber", "3", "--tls.guess"]
    looks += ["--sidewalks.guess", "--sidewalks.guess.max-speed", "20", "--crossings.guess"]
    looks += ["--perturb-z", str(hills)] if hills else []
    _run("netgenerate", *size, *looks, "--no-warnings", "-o", str(net), folder=folder)
    period = end * PER_VEHICLE / (lanes * 3.0)
    tool = Path(sumo.SUMO_HOME) / "tools" / "randomTrips.py"
    often = ["-e", str(end), "-p", str(period), "--seed", "3", "--fringe-factor", "2"]
    _run(
        sys.executable,
        str(tool),
        "-n",
        str(net),
        "-o",
        str(trips),
        "--validate",
        *often,
        folder=folder,
    )
    log = ["--fcd-output", str(folder / "fcd.xml"), "--device.fcd.begin", str(end - WINDOW)]
    quiet = ["--no-step-log", "--no-warnings", "--ignore-route-errors", "--step-length", "0.5"]
    _run(
        "sumo",
        "-n",
        str(net),
        "-r",
        str(trips),
        "-e",
        str(end),
        "--seed",
        "3",
        *log,
        *quiet,
        folder=folder,
    )
    inputs = '<net-file value="city.net.xml"/><route-files value="trips.rou.xml"/>'
    output = '<fcd-output value="fcd.xml"/>'
    config.write_text(
        f"<configuration><input>{inputs}</input><output>{output}</output></configuration>"
    )
    return config


def _run(*command: str, folder: Path) -> None:
    """Run a program of SUMO in a folder, where it leaves files; its own words do not matter."""
    quiet = subprocess.DEVNULL
    subprocess.run(command, cwd=folder, check=True, stdout=quiet, stderr=quiet)


def init(config: Path) -> None:
    """Propose a scene file."""
    from sumo3dviz_pt.proposals.proposal import propose

    scene = config.with_name("scene.yaml")
    text, _ = propose(config, output=scene)
    scene.write_text(text, encoding="utf-8")


def check(config: Path) -> None:
    """Check all shots."""
    from sumo3dviz_pt.inspection.checks import check_scene
    from sumo3dviz_pt.pipeline.scene_file import load_job

    check_scene(load_job(config.with_name("scene.yaml")))


def _view(config: Path, camera: str) -> None:
    """Prepare a still of a camera, up to its first pixel."""
    import numpy as np

    from sumo3dviz_pt.pipeline.production import Request, prepare
    from sumo3dviz_pt.pipeline.scene_file import load_job

    job = load_job(config.with_name("scene.yaml"))
    (shot,) = [shot for shot in job.shots if shot.camera == camera]
    prepare(job, Request(camera=camera), np.array([shot.start + 1.0]))


def driver(config: Path) -> None:
    """Prepare what a driver sees."""
    _view(config, "driver")


def flight(config: Path) -> None:
    """Prepare what is seen from the air."""
    _view(config, "flight")


STEPS: dict[str, Callable[[Path], None]] = {
    step.__name__: step for step in (init, check, driver, flight)
}


def measured(step: str, config: Path) -> tuple[float, float]:
    """Run a step in a process of its own; return CPU-seconds and peak memory [MB]."""
    run = subprocess.run(
        [sys.executable, __file__, "--step", step, str(config)],
        check=True,
        capture_output=True,
        text=True,
    )
    seconds, peak = run.stdout.split()[-2:]
    return float(seconds), float(peak)


def main() -> None:
    """Make the cities and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--lanes", type=int, nargs="*", default=[1000, 10_000, 40_000])
    parser.add_argument("--hills", type=int, nargs="*", default=[10_000])
    parser.add_argument("--step", choices=STEPS)
    options = parser.parse_args()
    if options.step:
        STEPS[options.step](options.folder)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(time.process_time(), peak)
        return
    wanted = [(lanes, 0.0) for lanes in options.lanes]
    wanted += [(lanes, 5.0) for lanes in options.hills]
    print("| lanes | step | CPU-s | peak MB |\n|---|---|---|---|")
    for lanes, hills in wanted:
        name = f"{lanes}{'_hills' if hills else ''}"
        config = make_city(options.folder / name, lanes, hills=hills)
        text = (config.parent / "city.net.xml").read_text(encoding="utf-8")
        count = len(re.findall("<lane ", text))
        for step in STEPS:
            seconds, peak = measured(step, config)
            about = f"{count:,}{' with hills' if hills else ''}"
            print(f"| {about} | {step} | {seconds:.1f} | {peak:.0f} |", flush=True)


if __name__ == "__main__":
    main()
