"""The vehicle log reader."""

import gzip
import logging

import numpy as np
import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo import read_trajectories

CAR = '<vehicle id="{id}" x="{x}" y="2" angle="90" type="{type}" speed="5" lane="a_0"/>'


def car(name="c", x=0.0, of="car"):
    return CAR.format(id=name, x=x, type=of)


def person(name="p", x=0.0, extra=""):
    return f'<person id="{name}" x="{x}" y="2" angle="0" edge="a" {extra}/>'


def log(*steps, end="</fcd-export>"):
    body = "\n".join(f'<timestep time="{time}">{rows}</timestep>' for time, rows in steps)
    return f"<fcd-export>\n{body}\n{end}"


def read(tmp_path, *texts, **options):
    paths = []
    for number, text in enumerate(texts):
        path = tmp_path / f"{number}.xml"
        path.write_text(text, encoding="utf-8")
        paths.append(path)
    return read_trajectories(paths, **options)


def test_values_and_units(tmp_path):
    row = (
        '<vehicle id="ü/车" x="1.5" y="-2" z="3" angle="0" type="bus" speed="4" slope="10" '
        'lane="e_1" signals="9"/>'
    )
    traffic = read(tmp_path, log(("0.00", row), ("0.50", row)))
    (trace,) = traffic.traces
    assert (trace.id, trace.kind, trace.type_id, trace.key) == (
        "ü/车",
        "vehicle",
        "bus",
        "vehicle:ü/车",
    )
    np.testing.assert_array_equal(trace.times, [0, 0.5])
    np.testing.assert_array_equal(trace.positions[0], [1.5, -2, 3])
    np.testing.assert_allclose(trace.yaws, np.pi / 2)
    np.testing.assert_allclose(trace.slopes, np.radians(10))
    assert trace.speeds[0] == 4
    assert traffic.lane_names[trace.lanes[0]] == "e_1"
    assert trace.signals[0] == 9
    assert trace.lanes.dtype == np.int64
    assert not trace.positions.flags.writeable
    assert (traffic.begin, traffic.end, traffic.step) == (0, 0.5, 0.5)


def test_only_id_x_y_angle_are_needed(tmp_path):
    (trace,) = read(tmp_path, log((0, '<vehicle id="v" x="1" y="2" angle="180"/>'))).traces
    assert trace.type_id == ""
    assert np.isnan(trace.speeds[0])
    assert (trace.positions[0, 2], trace.slopes[0]) == (0, 0)
    assert (trace.lanes[0], trace.signals[0]) == (-1, -1)
    np.testing.assert_allclose(trace.yaws, -np.pi / 2)


@pytest.mark.parametrize(("slope", "kept"), [("90", 30), ("-90", -30), ("29", 29)])
def test_impossible_slopes_are_clamped(tmp_path, slope, kept):
    row = f'<vehicle id="v" x="1" y="2" angle="0" slope="{slope}"/>'
    (trace,) = read(tmp_path, log((0, row))).traces
    assert np.degrees(trace.slopes[0]) == pytest.approx(kept)


def test_window_keeps_steps_on_its_borders(tmp_path):
    text = log(*((t, car(x=t)) for t in range(10)))
    traffic = read(tmp_path, text, begin=3, end=5)
    np.testing.assert_array_equal(traffic.traces[0].times, [3, 4, 5])
    assert traffic.begin == 0
    assert traffic.end == 5


def test_nothing_behind_the_window_is_read(tmp_path):
    text = log((0, car()), (1, car()), (2, car()), end="<vehicle broken")
    assert len(read(tmp_path, text, end=1).traces[0].times) == 2
    with pytest.raises(InputError):
        read(tmp_path, text)


@pytest.mark.parametrize(("begin", "end"), [(20, 30), (-9, -5), (1.2, 1.8)])
def test_window_without_a_step_names_the_log(tmp_path, begin, end):
    with pytest.raises(InputError, match="the log goes from 0 s to 9 s"):
        read(tmp_path, log(*((t, car()) for t in range(10))), begin=begin, end=end)


def test_order_of_steps_does_not_matter(tmp_path):
    steps = [(0, car(x=0)), (2, car(x=2)), (1, car(x=1)), (2, car(x=99)), (3, car(x=3))]
    (trace,) = read(tmp_path, log(*steps)).traces
    np.testing.assert_array_equal(trace.times, [0, 1, 2, 3])
    np.testing.assert_array_equal(trace.positions[:, 0], [0, 1, 2, 3])


def test_another_type_makes_another_trace(tmp_path):
    steps = [(0, car()), (1, ""), (2, car(of="bus")), (3, car(of="bus") + person(name="c", x=9))]
    traces = read(tmp_path, log(*steps)).traces
    assert [(t.key, t.type_id, len(t.times)) for t in traces] == [
        ("vehicle:c", "car", 1),
        ("vehicle:c", "bus", 2),
        ("person:c", "", 1),
    ]


def test_riders_are_left_out_while_they_ride(tmp_path, caplog):
    steps = [
        (0, car(x=0) + person(x=5)),
        (1, car(x=5) + person(x=5)),
        (2, car(x=10) + person(x=10.004)),
        (3, car(x=15) + person(x=15.5)),
    ]
    with caplog.at_level(logging.INFO):
        traffic = read(tmp_path, log(*steps))
    traces = traffic.traces
    assert traffic.taken == {"vehicle:c": ((1.0, 2.0),)}
    walker = next(t for t in traces if t.kind == "person")
    np.testing.assert_array_equal(walker.times, [0, 3])
    assert "2 samples of riders" in caplog.text


def test_a_person_at_anothers_past_place_is_kept(tmp_path):
    steps = [(0, car(x=0) + person(x=7)), (1, car(x=7) + person(x=0))]
    assert len(next(t for t in read(tmp_path, log(*steps)).traces if t.kind == "person").times) == 2


def test_riders_in_a_log_of_their_own(tmp_path):
    traffic = read(
        tmp_path, log((0, car(x=3)), (1, car(x=4))), log((0, person(x=3)), (1, person(x=9)))
    )
    assert [(t.kind, list(t.times)) for t in traffic.traces] == [
        ("vehicle", [0, 1]),
        ("person", [1]),
    ]


def test_tagged_riders_are_left_out(tmp_path):
    steps = [
        (0, person(extra='vehicle="" stage="walking"')),
        (1, person(extra='vehicle="bus" stage="driving"')),
        (2, person(extra='vehicle="bus" stage="waiting for bus"')),
    ]
    traffic = read(tmp_path, log(*steps))
    (trace,) = traffic.traces
    np.testing.assert_array_equal(trace.times, [0, 2])
    assert traffic.taken == {"vehicle:bus": ((1.0, 1.0),)}


def test_the_same_id_in_two_files_is_one_trace(tmp_path):
    traffic = read(tmp_path, log((0, car(x=0)), (1, car(x=1))), log((2, car(x=2))))
    assert [list(t.times) for t in traffic.traces] == [[0, 1, 2]]
    assert (traffic.begin, traffic.end) == (0, 2)


def test_clock_times(tmp_path):
    traffic = read(tmp_path, log(("00:03:20", car()), ("1:00:00:00", car())))
    np.testing.assert_array_equal(traffic.traces[0].times, [200, 86_400])


def test_steps_without_traffic(tmp_path):
    traffic = read(tmp_path, '<fcd-export><timestep time="0"/><timestep time="1"/></fcd-export>')
    assert traffic.traces == ()
    assert (traffic.begin, traffic.end, traffic.step) == (0, 1, 1)


def test_large_coordinates_stay_exact(tmp_path):
    (trace,) = read(tmp_path, log((0, car(x=5_000_000.01)))).traces
    assert trace.positions[0, 0] == 5_000_000.01


@pytest.mark.parametrize("speed", ["inf", "nan"])
def test_impossible_speeds_count_as_none(tmp_path, speed):
    row = f'<vehicle id="v" x="1" y="2" angle="0" speed="{speed}"/>'
    assert np.isnan(read(tmp_path, log((0, row))).traces[0].speeds[0])


def test_foreign_elements_are_passed_over(tmp_path):
    text = log((0, car() + '<something x="no"/>'), (1, '<param key="a" value="b"/>' + car()))
    assert len(read(tmp_path, text).traces[0].times) == 2


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ('<vehicle id="bad" y="1" angle="0"/>', '"x" is missing'),
        ('<vehicle id="bad" x="1" y="1"/>', '"angle" is missing'),
        ('<person x="1" y="1" angle="0"/>', '"id" is missing'),
        ('<vehicle id="bad" x="nan" y="1" angle="0"/>', "x=.nan. must be a finite number"),
        ('<vehicle id="bad" x="1" y="inf" angle="0"/>', "y=.inf. must be a finite number"),
        ('<vehicle id="bad" x="1" y="1" z="nan" angle="0"/>', "z=.nan. must be"),
        ('<vehicle id="bad" x="1" y="1" angle="-inf"/>', "angle=.-inf. must be"),
        ('<vehicle id="bad" x="1" y="1" angle="0" slope="nan"/>', "slope=.nan. must be"),
        ('<vehicle id="bad" x="1" y="1" angle="0" speed="fast"/>', "speed=.fast. must be"),
        ('<vehicle id="bad" x="1" y="1" angle="0" signals="1.5"/>', "signals=.1.5. cannot be"),
        ('<vehicle id="bad" x="1" y="1" z="6e9" angle="-6e9"/>', "z=.6e9. cannot be"),
        ('<vehicle id="bad" x="1e12" y="1" angle="0"/>', "x=.1e12. cannot be"),
    ],
)
def test_bad_rows_are_named(tmp_path, row, words):
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path, log((0, car()), (1, row)))
    assert caught.value.line == 3
    assert "vehicle" in caught.value.element or "person" in caught.value.element
    if "id=" in row:
        assert '"bad"' in caught.value.element


def test_bad_rows_outside_the_window_do_not_matter(tmp_path):
    text = log((0, '<vehicle id="bad" x="nan"/>'), (1, car()))
    assert len(read(tmp_path, text, begin=1).traces) == 1


@pytest.mark.parametrize("time", ['time="soon"', 'time="nan"', ""])
def test_bad_times_are_named(tmp_path, time):
    with pytest.raises(InputError, match="time") as caught:
        read(tmp_path, f"<fcd-export>\n<timestep {time}/></fcd-export>")
    assert caught.value.line == 2


def test_empty_and_foreign_logs(tmp_path):
    with pytest.raises(InputError, match="no time step"):
        read(tmp_path, "<fcd-export/>")
    with pytest.raises(InputError, match="not a vehicle log"):
        read(tmp_path, "<net/>")
    with pytest.raises(InputError, match="no time step"):
        read_trajectories([])


@pytest.mark.parametrize("packed", [False, True])
def test_a_log_that_breaks_off(tmp_path, packed):
    whole = log(*((t, car(x=t) + car(name=f"d{t % 7}", x=t * 3.7)) for t in range(500))).encode()
    path = tmp_path / "log.xml"
    path.write_bytes(gzip.compress(whole)[:-900] if packed else whole[:-50])
    with pytest.raises(InputError, match=r"breaks off after \d+ complete time steps") as caught:
        read_trajectories([path])
    assert caught.value.line > 1
    traffic = read_trajectories([path], allow_truncated=True)
    times = next(t for t in traffic.traces if t.id == "c").times
    assert traffic.end == times[-1] == len(times) - 1
    assert f"after {len(times)} complete" in str(caught.value)
    if not packed:
        assert len(times) == 499


def test_the_only_vehicle_may_be_in_the_step_that_breaks_off(tmp_path):
    text = log((0, person()), (1, car()), end="")
    text = text[: text.rindex("</timestep>")]
    traffic = read(tmp_path, text, allow_truncated=True)
    assert [(trace.id, len(trace.times)) for trace in traffic.traces] == [("p", 1)]


def test_a_log_that_breaks_off_at_once(tmp_path):
    with pytest.raises(InputError, match="after 0 complete time steps;"):
        read(tmp_path, "<fcd-export>")
    with pytest.raises(InputError, match="no time step"):
        read(tmp_path, "<fcd-export>", allow_truncated=True)


FORMS = {
    # As SUMO writes it, and with attributes in another order, which takes another way.
    "regular": CAR,
    "odd": '<vehicle type="{type}" y="2" x="{x}"  angle="90" id="{id}" speed="5" lane="a_0"/>',
}


def as_csv(steps):
    rows = [f"{time};{name};{x};2;90;{of};5;a_0" for time, users in steps for name, x, of in users]
    return "\n".join(["time;id;x;y;angle;type;speed;lane", *rows, ""])


@pytest.mark.parametrize("form", [*FORMS, "csv"])
def test_a_type_of_its_own_makes_no_other_road_user(tmp_path, form):
    """SUMO calls the type `T@id` when TraCI, a blue light or a split changes a road user."""
    steps = [
        (k, [("f.1", 5.0 * k, "T" if k < 3 else "T@f.1"), ("f.2", 5.0 * k + 90, "T")])
        for k in range(8)
    ]
    if form == "csv":
        path = tmp_path / "log.csv"
        path.write_text(as_csv(steps))
    else:
        path = tmp_path / "log.xml"
        rows = [
            (k, "".join(FORMS[form].format(id=i, x=x, type=t) for i, x, t in u)) for k, u in steps
        ]
        path.write_text(log(*rows))
    first, second = read_trajectories([path]).traces
    assert (first.id, first.type_id, second.type_id) == ("f.1", "T", "T")
    np.testing.assert_array_equal(first.times, range(8))
    np.testing.assert_array_equal(first.positions[:, 0], 5.0 * np.arange(8))
    (late, _) = read_trajectories([path], begin=5.0).traces
    assert (late.id, late.type_id) == ("f.1", "T")


def test_who_goes_on_as_another_type_is_one_road_user_and_it_is_noted(tmp_path, caplog):
    """TraCI's `setType`; an id that comes back elsewhere is another one."""
    rows = [(k, car("f.1", 5 * k, "bike" if k > 3 else "T")) for k in range(8)]
    found = read(tmp_path, log(*rows)).traces
    assert [(trace.id, trace.type_id, len(trace.times)) for trace in found] == [("f.1", "T", 8)]
    assert "`f.1`, from `T` to `bike` at 4 s" in caplog.text
    jump = [(k, car("f.1", 5 * k + 900 * (k > 3), "bike" if k > 3 else "T")) for k in range(8)]
    assert len(read(tmp_path, log(*jump)).traces) == 2
    at_once = [(k, car("f.1", 5 * k, "T") + car("f.1", 5 * k + 9, "bike")) for k in range(8)]
    assert len(read(tmp_path, log(*at_once)).traces) == 2


def test_only_its_own_name_is_taken_off_a_type(tmp_path):
    """`@` may stand in any type, and a type of another road user's name is another type."""
    traces = read(tmp_path, log((0, car("a", 0, "T@b") + car("b", 9, "x@y") + car("c", 20, "@c"))))
    assert [trace.type_id for trace in traces.traces] == ["T@b", "x@y", ""]
