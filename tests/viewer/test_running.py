"""A simulation that runs while a page looks at it: the program as a whole, and somebody's loop."""

from __future__ import annotations

import asyncio
import gzip
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import aiohttp
import pytest
from needed import package
from small_simulations import KINDS
from viewer.program import Program

import sumo3dviz_pt as sv
from sumo3dviz_pt.recording.run import RecordOrder, record

sumo = package("sumo", "needs the extra sumo")

pytestmark = pytest.mark.slow

SIZE = "64x36"
ROW = re.compile(r"\s*<(?:timestep|vehicle|person|tlsState) .*")


@pytest.fixture(scope="module")
def city(tmp_path_factory):
    """Streets with buses, people and signals; its configuration."""
    return KINDS["buses"](tmp_path_factory.mktemp("buses"))


async def seen_until(address, shown, *, seconds, orders=()):
    """Play until pictures show a time; all pictures' words, and the notes about the simulation."""
    frames, spans, waiting = [], [], list(orders)
    deadline = time.monotonic() + seconds
    async with aiohttp.ClientSession() as session, session.ws_connect(f"{address}ws") as line:
        await line.send_json({"do": "play", "on": True})
        while not frames or frames[-1]["time"] < shown:
            message = await line.receive(timeout=deadline - time.monotonic())
            if message.type is aiohttp.WSMsgType.BINARY:
                await line.send_json({"ack": frames[-1]["seq"]})
                continue
            said = json.loads(message.data)
            if said["kind"] == "frame":
                frames.append(said)
            if said["kind"] == "span":
                spans.append(said)
                for order in waiting:
                    await line.send_json(order(said))
                waiting = []
            assert (said["kind"], said.get("level")) != ("note", "error"), said["text"]
    return frames, spans


async def heard_after_a_crash(address, sumo):
    """End SUMO, and return what the page is told of it, and what it was told at the beginning."""
    async with aiohttp.ClientSession() as session, session.ws_connect(f"{address}ws") as line:
        told = [json.loads((await line.receive(timeout=60.0)).data)]  # the page is there
        os.kill(sumo, signal.SIGKILL)
        while [each["kind"] for each in told].count("note") < 1:
            message = await line.receive(timeout=60.0)
            if message.type is aiohttp.WSMsgType.TEXT:
                told.append(json.loads(message.data))
    scene = next(each for each in told if each["kind"] == "scene")
    span = [each for each in told if each["kind"] == "span"][-1]
    return scene, span, told[-1]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="children are found in /proc")
def test_a_sumo_that_dies_is_told_as_such(city, tmp_path):
    # So long that SUMO has to wait for its reader.
    endless = city.with_name("endless.sumocfg")
    endless.write_text(re.sub('<end value="[^"]*"', '<end value="1e6"', city.read_text()))
    with Program(endless, "--size", SIZE, "--from", "20") as program:
        (child,) = (
            Path(f"/proc/{program.number}/task/{program.number}/children").read_text().split()
        )
        scene, span, note = asyncio.run(heard_after_a_crash(program.address, int(child)))
        assert program.stop() == 0
    assert (scene["title"], scene["begin"]) == ("endless", 20.0)
    assert span["trouble"] == note["text"] == "SUMO ended unexpectedly (signal 9)"
    assert note["level"] == "error"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows knows no such signals")
@pytest.mark.parametrize(("which", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_it_can_be_ended_while_it_opens_even_from_the_background(city, tmp_path, which, code):
    # A shell's script lets what it starts in the background ignore Ctrl-C.
    words = ["view", str(city), "--size", SIZE, "--keep", str(tmp_path / "kept")]
    with subprocess.Popen(
        [
            "sh",
            "-c",
            'trap "" INT; exec "$@"',
            "sh",
            sys.executable,
            "-m",
            "sumo3dviz_pt.cli",
            *words,
        ],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        encoding="utf-8",
    ) as program:
        assert program.stderr is not None
        while "opening" not in program.stderr.readline():
            assert program.poll() is None
        time.sleep(1.0)
        began = time.monotonic()
        program.send_signal(which)
        said, _ = program.communicate(timeout=60.0)
    assert program.returncode == code and "http" not in said
    assert time.monotonic() - began < 15.0
    assert not list((tmp_path / "kept").glob(".*"))


def rows(log):
    """Lines of a log that say something."""
    return [
        line.strip()
        for line in gzip.decompress(log.read_bytes()).decode().splitlines()
        if ROW.match(line)
    ]


def test_a_page_watches_a_simulation_that_runs_and_what_it_saw_is_kept(city, tmp_path):
    keep = tmp_path / "kept"
    with Program(city, "--size", SIZE, "--keep", str(keep), "--seed", "5") as program:
        ride = [lambda said: {"do": "ride", "vehicle": said["users"][0]}]
        assert {path.name for path in keep.glob("[!.]*")} == {"scene.yaml"}, "nobody saw anything"
        work = seen_until(program.address, 14.0, seconds=200.0, orders=ride)
        frames, spans = asyncio.run(work)
        assert program.stop() == 0
    times = [frame["time"] for frame in frames]
    assert times[0] < 5.0 and max(times) <= spans[-1]["end"] + 1e-6
    assert len(set(times)) > 20 and spans[-1]["running"]
    assert any(frame["riding"] for frame in frames)
    whole = tmp_path / "whole"
    record(city, RecordOrder(whole, seed=5))
    for name in ("fcd.xml.gz", "signals.xml.gz"):
        own = rows(keep / name)
        assert own == rows(whole / name)[: len(own)] and len(own) > 14
    still = sv.load(keep / "scene.yaml").still(
        time=10.0, camera="overview", quality="draft", size=(64, 36)
    )
    assert still.radiance.max() > 0.0


def test_a_loop_is_shown_while_it_runs_and_never_waits(city, tmp_path):
    libsumo = package("libsumo", "needs the extra sumo")
    libsumo.start(["sumo", "-c", str(city), "--no-warnings", "true"])
    try:
        with sv.LiveView(libsumo, keep=tmp_path / "kept", size=(64, 36)) as live:
            slowest = 0.0
            for _ in range(120):
                libsumo.simulationStep()
                began = time.monotonic()
                live.step()
                slowest = max(slowest, time.monotonic() - began)
            live.finish()
            # All is known by now; at eight times its pace nobody waits for clocks.
            fast = [lambda said: {"do": "speed", "factor": 8.0}]
            frames, spans = asyncio.run(seen_until(live.address, 55.0, seconds=200.0, orders=fast))
        assert slowest < 2.0 and frames[-1]["time"] >= 55.0
        assert all(not span["running"] for span in spans[-1:])
        with pytest.raises(sv.ConfigError, match="closed"):
            live.step()
    finally:
        libsumo.close()
    assert (tmp_path / "kept" / "recording.sumocfg").is_file()


def test_an_observer_sees_the_last_step_and_follows_a_new_episode(city):
    libsumo = package("libsumo", "needs the extra sumo")
    options = ["-c", str(city), "--no-warnings", "true"]
    libsumo.start(["sumo", *options])
    try:
        with sv.Observer(libsumo, size=(64, 36), samples=2) as observer:
            first = []
            for _ in range(8):
                libsumo.simulationStep()
                first.append(observer.render_array())
            assert first[0].shape == (36, 64, 3) and first[0].dtype == "uint8"
            assert (first[0] != first[-1]).any(), "somebody moves"
            assert (observer.render_array() == first[-1]).all(), "a step has one picture"
            libsumo.load(options)
            for known in first:
                libsumo.simulationStep()
                assert (observer.render_array() == known).all(), "one seed gives one day"
        with pytest.raises(sv.ConfigError, match="nowhere"):
            sv.Observer(libsumo, camera="nowhere")
    finally:
        libsumo.close()


def test_an_observer_says_that_whom_it_rides_with_has_left(city, tmp_path):
    libsumo = package("libsumo", "needs the extra sumo")
    scene = tmp_path / "scene.yaml"
    ride = "{mode: lagrangian, vehicle: f.0, view: chase}"
    scene.write_text(f"scenario: {{}}\ncameras:\n  seat: {ride}\n")
    libsumo.start(["sumo", "-c", str(city), "--no-warnings", "true"])
    try:
        with sv.Observer(libsumo, scene=scene, camera="seat", size=(64, 36), samples=1) as observer:
            libsumo.simulationStep()
            observer.render_array()
            for time in (40.0, 120.0):  # while the window knows it, and when it does not
                libsumo.simulationStep(time)
                with pytest.raises(
                    sv.ConfigError, match=r"'f\.0' is not on the road at .*; last seen"
                ):
                    observer.render_array()
    finally:
        libsumo.close()
