"""What is measured, and which rows belong to it."""

import pytest

from sumo3dviz_pt.report.convergence.plan import (
    DEEPEST,
    DEPTHS,
    SeedGroup,
    base_quality,
    digest,
    groups,
    presets_up_to,
    rungs,
)
from sumo3dviz_pt.report.convergence.table import DEPTH, LADDER


@pytest.mark.parametrize(
    ("top", "expected"), [(1, (1,)), (2, (1, 2)), (7, (1, 2, 4)), (8, (1, 2, 4, 8))]
)
def test_rungs_double(top, expected):
    assert rungs(top) == expected


def test_presets_that_the_ladder_cannot_judge_are_left_out():
    assert "draft" in presets_up_to(2) and "standard" not in presets_up_to(4)
    assert "reference" not in presets_up_to(64)
    spp = [quality.spp for quality in presets_up_to(64).values()]
    assert spp == sorted(spp) and len(spp) >= 4


def row_of(group, seed, denoiser):
    quality = group.quality
    return {
        "preset": group.label,
        "sampler": quality.sampler,
        "spp": quality.spp,
        "max_depth": quality.max_depth,
        "denoise": "none" if denoiser == "none" else "oidn",
        "seed": seed,
    }


def test_every_row_has_one_owner():
    wanted = groups(64)
    for group in wanted:
        rows = [
            row_of(group, seed, denoiser)
            for seed in range(1, group.seeds + 1)
            for denoiser in group.denoisers
        ]
        assert len(rows) == group.rows
        for row in rows:
            assert [other for other in wanted if other.owns(row)] == [group]


def test_ladder_has_both_samplers_and_the_denoiser_at_every_rung():
    ladder = [group for group in groups(16) if group.label == LADDER]
    for spp in rungs(16):
        own = [group for group in ladder if group.quality.spp == spp]
        assert {(g.quality.sampler, g.denoisers == ("none",)) for g in own} == {
            ("independent", True),
            ("multijitter", True),
            ("multijitter", False),
        }
        assert all(group.quality.max_depth == DEEPEST for group in own)


def test_depths_share_seeds_and_end_with_the_references():
    depths = [group for group in groups(16) if group.label == DEPTH]
    assert [group.quality.max_depth for group in depths] == list(DEPTHS)
    assert DEPTHS[-1] == DEEPEST and len({group.seeds for group in depths}) == 1


def test_presets_are_measured_as_films_and_as_stills():
    labels = [group.label for group in groups(64)]
    assert {"preview", "preview still", "study", "study still"} <= set(labels)
    # The ladder's rungs must reach the still's samples, too.
    assert "standard" in (some := [group.label for group in groups(8)])
    assert "standard still" not in some
    alone = [group for group in groups(64, together=False) if group.label == "preview"]
    assert [group.quality.accumulate for group in alone] == [0]
    assert not any(group.label.endswith("still") for group in groups(64, together=False))


def test_work_is_counted_in_samples():
    helped = base_quality(2).model_copy(update={"accumulate": 4})
    assert SeedGroup("draft", helped, ("fast",), seeds=2).samples == 2 * 2 * 9
    group = SeedGroup(LADDER, base_quality(8), ("fast", "high"), seeds=3)
    assert (group.samples, group.rows) == (24, 6)


def test_a_changed_preset_is_another_measurement():
    group = SeedGroup("draft", base_quality(2), ("fast",))
    other = SeedGroup("draft", base_quality(2).model_copy(update={"raw_share": 0.5}), ("fast",))
    assert digest([group]) == digest([group]) != digest([other])


def test_in_weather_only_our_own_kernel_is_measured():
    """Mitsuba's path tracer would refuse it after hours of others."""
    dry, wet = (presets_up_to(4096, weather=weather) for weather in (False, True))
    assert {quality.tracer for quality in wet.values()} == {"kernel"}
    assert set(dry) - set(wet) == {"reference_path"}
