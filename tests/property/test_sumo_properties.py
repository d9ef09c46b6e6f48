"""Laws of SUMO's readers."""

import gzip
import math
import tempfile
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from searching import tries

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.layers import linear_from_srgb
from sumo3dviz_pt.sumo import read_trajectories
from sumo3dviz_pt.sumo.values import parse_colour, parse_points, parse_time, yaw_from_angle_deg

finite = st.floats(-1e7, 1e7, allow_nan=False)
ids = st.text(
    st.characters(codec="utf-8", exclude_categories=("Cs", "Cc", "Zs", "Zl", "Zp", "Cn")),
    min_size=1,
    max_size=8,
)


@given(st.integers(0, 10**7))
def test_clock_times_are_seconds(seconds):
    days, rest = divmod(seconds, 86_400)
    clock = f"{rest // 3600:02d}:{rest // 60 % 60:02d}:{rest % 60:02d}"
    assert parse_time(f"{days}:{clock}") == parse_time(str(seconds)) == seconds
    if not days:
        assert parse_time(clock) == seconds


@given(st.tuples(*[st.integers(0, 255)] * 3))
def test_colour_notations_agree(rgb):
    text = ",".join(map(str, rgb))
    expected = tuple(linear_from_srgb(v / 255) for v in rgb)
    assert parse_colour("#" + "".join(f"{v:02x}" for v in rgb)) == expected
    if max(rgb) > 1:
        assert parse_colour(text) == parse_colour(text + ",255") == expected
    assert parse_colour(",".join(f"{v / 255:.9f}" for v in rgb)) == pytest.approx(
        expected, abs=1e-7
    )


@given(st.floats(0, 1), st.floats(0, 1))
def test_transfer_curve_rises(a, b):
    low, high = sorted((a, b))
    assert 0 <= linear_from_srgb(low) <= linear_from_srgb(high) <= 1


@given(st.text(max_size=20))
def test_parsers_refuse_with_value_errors_only(text):
    for parse in (parse_time, parse_colour, parse_points):
        outcome = None
        try:
            parse(text)
        except Exception as error:  # noqa: BLE001 - any other kind is what this looks for
            outcome = error
        assert outcome is None or isinstance(outcome, ValueError)


@given(st.floats(-1000, 1000))
def test_yaw_points_where_sumo_says(angle):
    yaw = yaw_from_angle_deg(angle)
    assert -math.pi <= yaw <= math.pi
    assert math.cos(yaw) == pytest.approx(math.sin(math.radians(angle)), abs=1e-9)
    assert math.sin(yaw) == pytest.approx(math.cos(math.radians(angle)), abs=1e-9)


@given(st.lists(st.tuples(finite, finite, st.floats(-2e4, 2e4)), max_size=8))
def test_points_come_back(points):
    parsed = parse_points(" ".join(",".join(map(repr, p)) for p in points))
    expected = [p for i, p in enumerate(points) if i == 0 or p != points[i - 1]]
    np.testing.assert_array_equal(parsed, np.array(expected).reshape(-1, 3))


@st.composite
def logs(draw):
    """A log as {(id, time): (x, y, angle, speed)} with distinct places per id."""
    names = draw(st.lists(ids, min_size=1, max_size=4, unique=True))
    times = draw(st.lists(st.integers(0, 50), min_size=1, max_size=8, unique=True))
    return {
        (name, time): draw(st.tuples(finite, finite, st.floats(0, 360), st.floats(0, 50)))
        for name in names
        for time in times
        if draw(st.booleans())
    }, times


@settings(max_examples=tries(60), deadline=None)
@given(logs(), st.booleans(), st.integers(0, 50), st.integers(0, 50))
def test_log_written_is_log_read(log, packed, first, last):
    rows, times = log
    begin, end = sorted((first, last))
    steps = [
        f'<timestep time="{time}">'
        + "".join(
            f'<vehicle id={quoteattr(name)} x="{x!r}" y="{y!r}" angle="{angle!r}" speed="{v!r}"/>'
            for (name, at), (x, y, angle, v) in rows.items()
            if at == time
        )
        + "</timestep>"
        for time in sorted(times)
    ]
    text = f"<fcd-export>{''.join(steps)}</fcd-export>".encode()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.xml"
        path.write_bytes(gzip.compress(text) if packed else text)
        if not any(begin <= time <= end for time in times):
            with pytest.raises(InputError, match="no time step lies"):
                read_trajectories([path], begin=begin, end=end)
            return
        traffic = read_trajectories([path], begin=begin, end=end)
    found = {
        (trace.id, time): (x, y, yaw, v)
        for trace in traffic.traces
        for time, (x, y, _), yaw, v in zip(
            trace.times, trace.positions, trace.yaws, trace.speeds, strict=True
        )
    }
    assert set(found) == {key for key in rows if begin <= key[1] <= end}
    for key, (x, y, yaw, v) in found.items():
        assert (x, y, v) == (rows[key][0], rows[key][1], rows[key][3])
        turn = yaw - (math.pi / 2 - math.radians(rows[key][2]))
        assert math.remainder(turn, 2 * math.pi) == pytest.approx(0, abs=1e-9)
    assert traffic.begin == min(times)
