"""Networks of every kind that SUMO writes are proposed, drawn lawfully, and built."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
import pytest
from any_network.known import expect
from any_network.laws import (
    floating_users,
    gaps,
    kerbs_in_the_way,
    overlaps,
    wrong_area,
    wrong_heads,
)
from any_network.programs import why_missing
from any_network.recipes import RECIPES
from any_network.simulation import LOG, NET, SIGNALS, TYPES, simulate
from any_network.towns import BUILT, Town, made_town, name_of
from needed import skip_if

from sumo3dviz_pt.job.settings import SignalSettings
from sumo3dviz_pt.motion import LogMotion
from sumo3dviz_pt.motion.breaches import lawfulness
from sumo3dviz_pt.pipeline.production import Request, prepare
from sumo3dviz_pt.world.signals.signals import build_signals

pytestmark = [
    pytest.mark.slow,
    skip_if(bool(why_missing()), why_missing() or "SUMO is here"),
]


@pytest.fixture(scope="module", params=range(len(RECIPES)), ids=name_of)
def town(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Town]:
    yield made_town(request.param, tmp_path_factory.mktemp("towns"))


@pytest.mark.parametrize("number", [4, 9, 28])
def test_a_number_means_the_same_network_and_traffic_each_time(number, tmp_path):
    one, other = (simulate(number, tmp_path / name) for name in ("one", "other"))
    names = sorted(path.name for path in one.iterdir())
    assert {NET, LOG, SIGNALS, TYPES} <= set(names)
    assert names == sorted(path.name for path in other.iterdir())
    for name in names:
        # SUMO tells the time and its options in comments.
        texts = [(folder / name).read_text(encoding="utf-8") for folder in (one, other)]
        assert len({re.sub(r"<!--.*?-->", "", text, flags=re.S) for text in texts}) == 1, name


@pytest.mark.parametrize(
    "law", [wrong_area, gaps, overlaps, kerbs_in_the_way], ids=lambda law: law.__name__
)
def test_roads_keep_the_laws_of_surfaces(town, law, request):
    expect(request, law.__name__, town.number)
    faults = list(law(town.drawn))
    assert not faults, "\n".join(faults[:20])


def test_road_users_stand_on_surfaces_of_their_own_kind(town, request):
    expect(request, "floating_users", town.number)
    faults = list(floating_users(town.drawn, town.scenario))
    assert not faults, "\n".join(faults[:20])


def test_road_users_are_drawn_as_they_drive(town):
    read = town.scenario
    for smoother in ("hermite", "lane", "linear", "paper_symmetric"):
        motion = LogMotion.of(
            read.traffic, smoother=smoother, network=read.network, types=read.vehicle_types
        )
        found = lawfulness(motion)
        assert found.looked == found.users and not found.text, f"{smoother}: {found.text}"


def test_every_signalled_link_has_its_head(town, request):
    expect(request, "wrong_heads", town.number)
    network, phases = town.scenario.network, town.scenario.signals
    links = [link for link in network.connections if link.tls and link.link_index >= 0]
    assert bool(phases) == bool(links)
    if phases:
        faults = list(wrong_heads(network, build_signals(network, phases, SignalSettings())))
        assert not faults, "\n".join(faults[:20])


def test_what_is_proposed_can_be_built(town, request):
    if town.number not in BUILT:
        pytest.skip("it is built with houses and plants, or only with ANY_NETWORK=all")
    expect(request, "built", town.number)
    job = town.job("abstract")
    assert {"overview", "flight"} <= set(job.cameras)
    shot = job.shots[0]
    times = np.array([shot.start, 0.5 * (shot.start + shot.end)])
    data = prepare(job, Request(camera="overview"), times).shot.data
    assert data.static
    for part in data.static:
        assert np.isfinite(part.part.mesh.vertices).all(), part.id
