"""Samples that a pilot chooses by cost or error."""

import json
from itertools import pairwise

import numpy as np
import pytest
from builders import write_scenario
from hypothesis import given
from hypothesis import strategies as st
from needed import package

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.pipeline.films.frames import NOTE
from sumo3dviz_pt.pipeline.films.pilot import affordable, counts, sufficient
from sumo3dviz_pt.pipeline.production import Request

CHEAP = ["--size", "32x18", "--variant", "scalar"]


def test_counts_are_those_that_the_pattern_does_not_round():
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    small = [number for number in counts() if number <= 64]
    for number in small:
        sampler = mi.load_dict({"type": "multijitter", "sample_count": number})
        assert sampler.sample_count() == number
    assert small[0] == 1 and small[-1] == 64
    assert all(after <= 1.5 * before for before, after in pairwise(small[2:]))
    assert all(number % 64 == 0 for number in counts() if number > 64)


@given(st.floats(0.1, 20), st.floats(0.01, 2), st.floats(0.3, 200))
def test_a_budget_is_kept_and_used(always, each, budget):
    costs = {spp: always + each * spp for spp in (2, 9)}
    if budget < always + each:
        with pytest.raises(ConfigError, match="too few"):
            affordable(costs, 0.999 * budget)
        return
    spp, expected = affordable(costs, 1.001 * budget)
    assert expected <= 1.001 * budget
    assert expected == pytest.approx(always + each * spp, rel=1e-6)
    more = next((number for number in counts() if number > spp), None)
    assert more is None or always + each * more > budget * 0.999


def test_noise_does_not_make_samples_free():
    spp, _ = affordable({2: 5.2, 9: 5.0}, 6.0)
    assert spp == counts()[-1]


@given(st.floats(0.05, 0.3), st.floats(0.2, 0.6), st.floats(0.01, 0.2))
def test_the_fewest_samples_that_are_enough(first, power, target):
    errors = {spp: first * spp**-power for spp in (2, 6, 20, 64)}
    try:
        spp, expected = sufficient(errors, target)
    except ConfigError:
        assert first * counts()[-1] ** -power > 0.999 * target
        return
    assert expected == pytest.approx(first * spp**-power, rel=1e-6) and expected <= target
    fewer = [number for number in counts() if number < spp]
    assert not fewer or first * fewer[-1] ** -power > 0.999 * target


def test_an_error_below_the_floor_is_refused():
    with pytest.raises(ConfigError, match=r"0\.030 was measured with 64 samples"):
        sufficient({2: 0.06, 6: 0.04, 20: 0.03, 64: 0.03}, 0.02)


@pytest.mark.parametrize("more", [{"spp": 4}, {"target_error": 0.05}])
def test_only_one_thing_chooses_the_samples(more):
    with pytest.raises(ConfigError, match="give one of them"):
        Request(time_budget=3.0, **more)


@pytest.mark.parametrize("wrong", [{"time_budget": 0.0}, {"target_error": 1.5}])
def test_wishes_out_of_range_are_refused(wrong):
    with pytest.raises(ConfigError):
        Request(**wrong)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return write_scenario(tmp_path_factory.mktemp("pilot"), vehicles=2)


def told(folder):
    return json.loads((folder / NOTE).read_text())


@pytest.mark.slow
def test_a_film_keeps_what_its_pilot_chose(place, tmp_path, capsys):
    """A second pilot would measure other seconds, and the film would be rendered anew."""
    film = tmp_path / "a.mp4"
    window = ["--camera", "post", "--from", "4", "--to", "4.4", "--fps", "5"]
    words = ["render", place, *window, *CHEAP, "--time-budget", "0.5", "-o", film]
    assert main([str(word) for word in words]) == 0
    first = told(tmp_path / "a.frames")
    assert first["pilot"]["spp"] == first["spp"] and first["pilot"]["time_budget"] == 0.5
    before = {p: p.stat().st_mtime_ns for p in (tmp_path / "a.frames").glob("*.exr")}
    assert main([str(word) for word in (*words, "--resume")]) == 0
    assert told(tmp_path / "a.frames")["pilot"] == first["pilot"]
    after = {p: p.stat().st_mtime_ns for p in (tmp_path / "a.frames").glob("*.exr")}
    assert before and after == before


@pytest.mark.slow
def test_a_still_of_an_error(place, tmp_path):
    package("flip_evaluator")
    import sumo3dviz_pt as sv

    still = sv.load(place).still(
        time=4.0, camera="post", size=(32, 18), variant="scalar", target_error=0.2
    )
    assert still.provenance["pilot"]["target_error"] == 0.2
    assert still.provenance["pilot"]["expected"] <= 0.2
    assert np.isfinite(still.radiance).all()
