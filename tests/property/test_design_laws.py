"""Laws of designs, tables and playlists, whatever the factors and the seed."""

from __future__ import annotations

import csv
import io
from collections import Counter
from itertools import product
from math import prod

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.studies.designs.arrays import orthogonal_array, pair_counts
from sumo3dviz_pt.studies.designs.cells import read_table
from sumo3dviz_pt.studies.designs.profiles import build_design, is_excluded
from sumo3dviz_pt.studies.designs.tables import TableRequest, trials_in
from sumo3dviz_pt.studies.designs.trials import Trial, build_playlists, permutation, single_trials

SEEDS = st.integers(0, 2**31 - 1)
COUNTS = st.lists(st.integers(2, 5), min_size=1, max_size=6)


def levels_of(counts):
    return {f"f{n}": tuple(f"l{k}" for k in range(count)) for n, count in enumerate(counts)}


@pytest.mark.slow
@given(COUNTS)
@settings(max_examples=60, deadline=None)
def test_arrays_are_orthogonal_or_refused(counts):
    """Every pair of levels occurs equally often; never more rows than all combinations."""
    try:
        rows = orthogonal_array(counts)
    except ConfigError:
        return
    assert len(rows) < prod(counts)
    for one in range(len(counts)):
        for other in range(one):
            times = pair_counts(rows, counts, one, other)
            assert times.min() == times.max() > 0


@given(COUNTS, SEEDS, st.data())
@settings(max_examples=60, deadline=None)
def test_a_full_design_is_everything_that_is_not_excluded(counts, seed, data):
    assume(prod(counts) <= 400)
    levels = levels_of(counts)
    some = {name: st.lists(st.sampled_from(names), min_size=1) for name, names in levels.items()}
    exclude = data.draw(st.lists(st.fixed_dictionaries({}, optional=some).filter(bool), max_size=2))
    wanted = {p for p in product(*levels.values()) if not is_excluded(p, levels, exclude)}
    assume(wanted)
    design = build_design("full", levels, exclude=exclude, seed=seed)
    assert set(design.profiles) == wanted and len(design.profiles) == len(wanted)
    assert design.excluded == prod(counts) - len(wanted)


@pytest.mark.slow
@given(st.integers(0, 60), SEEDS, st.text(max_size=8))
def test_permutations_are_permutations(count, seed, word):
    assert sorted(permutation(count, seed, word)) == list(range(count))


@given(st.integers(1, 9), st.sampled_from(["latin", "random"]), st.integers(1, 3), SEEDS)
@settings(deadline=None)
def test_each_playlist_shows_every_trial_equally_often(count, order, repeat, seed):
    trials = single_trials([(str(n),) for n in range(count)])
    lists = build_playlists(trials, order=order, count=None, parts=1, repeat=repeat, seed=seed)
    for playlist in lists:
        assert set(Counter(playlist.trials).values()) == {repeat}


NAMES = st.text(
    st.characters(codec="utf-8", exclude_categories=("C", "Z"), exclude_characters='"'),
    min_size=1,
    max_size=8,
).filter(lambda text: text.upper() not in ("NA", "N/A", "NAN", "#N/A"))


def unlike(names):
    """Whether no two names are one number."""
    numbers = []
    for name in names:
        try:
            numbers.append(float(name.replace(",", ".")))
        except ValueError:
            continue
    return len(set(numbers)) == len(numbers)


@given(
    st.lists(NAMES, min_size=2, max_size=5, unique=True).filter(unlike),
    st.sampled_from([",", ";", "\t"]),
    st.integers(1, 6),
    st.data(),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_what_is_written_is_read(tmp_path, names, separator, tasks, data):
    """Any level's name comes back through any separator, quoted where it must be."""
    shown = data.draw(st.lists(st.sampled_from(names), min_size=2 * tasks, max_size=2 * tasks))
    stream = io.StringIO()
    writer = csv.writer(stream, delimiter=separator)
    writer.writerow(["task", "alternative", "f"])
    writer.writerows([n // 2 + 1, n % 2 + 1, level] for n, level in enumerate(shown))
    path = tmp_path / "design.csv"
    path.write_text(stream.getvalue(), encoding="utf-8", newline="")
    trials = trials_in(read_table(path), {"f": names}, TableRequest())
    assert trials == tuple(
        Trial("1", str(n + 1), ((shown[2 * n],), (shown[2 * n + 1],))) for n in range(tasks)
    )
