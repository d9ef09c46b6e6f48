"""A run that goes on step by step is the run that `record` records."""

import gzip
import re
from pathlib import Path

import pytest
from needed import package
from small_simulations import KINDS

from sumo3dviz_pt.pipeline.reading import Ground
from sumo3dviz_pt.pipeline.scene_file import make_job
from sumo3dviz_pt.recording.feeds import RunFeed
from sumo3dviz_pt.recording.live_log import LiveLog
from sumo3dviz_pt.recording.run import RecordOrder, record
from sumo3dviz_pt.recording.stepped import SteppedRun

package("sumo", "needs the extra sumo")

pytestmark = pytest.mark.slow

ELEMENT = re.compile(r"\s*(<(?:timestep|vehicle|person|container|tlsState) .*?)/?>")


@pytest.fixture(scope="module")
def city(tmp_path_factory):
    """Streets with buses, people and containers that ride, and signals; its configuration."""
    return KINDS["buses"](tmp_path_factory.mktemp("buses"))


@pytest.fixture(scope="module")
def whole(city, tmp_path_factory):
    """Its recording."""
    folder = tmp_path_factory.mktemp("whole")
    record(city, RecordOrder(folder, seed=5))
    return folder


def elements(log: Path) -> list[str]:
    """All elements of a log with their attributes, in order."""
    text = gzip.decompress(log.read_bytes()).decode()
    return [found[1] for found in map(ELEMENT.match, text.splitlines()) if found]


def test_what_was_seen_is_kept_as_it_would_be_recorded(city, whole, tmp_path):
    before = {path.name: path.read_bytes() for path in city.parent.iterdir()}
    run = SteppedRun(city, tmp_path, seed=5)
    steps = [step for _ in range(80) if (step := run.next()) is not None]
    assert not run.stopped and len(steps) == 80
    kept = run.close()
    assert run.close() == kept and kept.read_text() == (whole / kept.name).read_text()
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in whole.iterdir()}
    for name in ("fcd.xml.gz", "signals.xml.gz"):
        own, all_of_it = elements(tmp_path / name), elements(whole / name)
        assert own == all_of_it[: len(own)] and len(own) > 80
    assert {path.name: path.read_bytes() for path in city.parent.iterdir()} == before


def test_a_run_ends_as_the_configuration_says_and_says_so(city, whole, tmp_path):
    run = SteppedRun(city, tmp_path, seed=5)
    while run.next() is not None:
        pass
    assert run.stopped == "the simulation has ended" and run.next() is None
    run.close()
    assert elements(tmp_path / "fcd.xml.gz") == elements(whole / "fcd.xml.gz")


def test_a_run_that_crashes_leaves_what_is_there(city, whole, tmp_path):
    job = make_job({"scenario": {"folder": str(whole)}})
    # So long that SUMO has to wait for its reader.
    endless = city.with_name("endless.sumocfg")
    endless.write_text(re.sub('<end value="[^"]*"', '<end value="1e6"', city.read_text()))
    run = SteppedRun(endless, tmp_path)
    feed = RunFeed(run, LiveLog(job, Ground.of(job), delay=2.0))
    first = feed.advance(20.0)
    assert first is not None and first.growing and 20.0 <= first.end < 22.0
    assert feed.advance(20.0) is None
    assert not feed.trouble
    run._process.kill()
    run._process.wait()
    assert feed.trouble == "SUMO ended unexpectedly (signal 9)" and not feed.stopped
    while not feed.stopped:
        last = feed.advance(1e6)
    assert last is not None and not last.growing and last.end >= first.end
    assert feed.stopped == f"SUMO ended unexpectedly at {last.end:.12g} s (signal 9)"
    run.close()
    assert elements(tmp_path / "fcd.xml.gz")


def test_a_start_later_on_runs_through_what_lies_before(city, whole, tmp_path):
    job = make_job({"scenario": {"folder": str(whole)}})
    run = SteppedRun(city, tmp_path)
    log = LiveLog(job, Ground.of(job), delay=2.0, start=50.0)
    window = RunFeed(run, log, start=50.0).advance(0.0)
    run.close()
    assert window is not None and window.begin == 50.0 < window.end + 1e-9
    assert window.scenario.traffic.begin == 38.0


def test_a_start_within_the_first_steps_shows_nothing_earlier(city, whole, tmp_path):
    job = make_job({"scenario": {"folder": str(whole)}})
    run = SteppedRun(city, tmp_path)
    log = LiveLog(job, Ground.of(job), delay=2.0, start=5.0)
    window = RunFeed(run, log, start=5.0).advance(0.0)
    run.close()
    assert window is not None and window.begin == window.origin == 5.0
    assert window.scenario.traffic.begin == 0.0


def test_a_run_that_nobody_saw_leaves_nothing(city, tmp_path):
    run = SteppedRun(city, tmp_path)
    assert run.close() is None and run.next() is None
    assert not list(tmp_path.iterdir())
