"""Who is in a log, read in blocks."""

import numpy as np
import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.traffic import Point
from sumo3dviz_pt.sumo import fcd, read_roster, read_trajectories, reader
from sumo3dviz_pt.sumo.guesses import TypesOfUsers


def vehicle(name, x, y=0.0, *, of="car", speed=10.0, lane="a_0"):
    spoken = "" if speed is None else f' speed="{speed}"'
    return f'<vehicle id="{name}" x="{x}" y="{y}" angle="90" type="{of}"{spoken} lane="{lane}"/>'


def log(tmp_path, *steps, name="fcd.xml", end="</fcd-export>"):
    body = "\n".join(f'<timestep time="{time}">{rows}</timestep>' for time, rows in steps)
    path = tmp_path / name
    path.write_text(f"<fcd-export>\n{body}\n{end}", encoding="utf-8")
    return path


def roster(*paths, **asked):
    return {user.id: user for user in read_roster(paths, types=TypesOfUsers({}), **asked)}


def test_a_drive_is_summed_up(tmp_path):
    path = log(
        tmp_path,
        (0, vehicle("v", 0, lane="a_0")),
        (1, vehicle("v", 10, lane="a_1")),
        (2, vehicle("v", 22, speed=14, lane=":j_0_0")),
        (3, vehicle("v", 30, 6, lane="b_0")),
    )
    found = roster(path)["v"]
    assert (found.kind, found.type_id, found.vclass) == ("vehicle", "car", "passenger")
    assert (found.begin, found.end, found.duration) == (0.0, 3.0, 3.0)
    assert found.length == pytest.approx(10 + 12 + 10)
    assert found.mean_speed == pytest.approx(32 / 3) and found.max_speed == 14.0
    assert found.lanes == 3 and found.edges == ("a", "b")
    assert found.place is None and found.passage is None


def test_blocks_change_nothing(tmp_path, monkeypatch):
    """Rows that are passed on every second step give what all at once give."""
    rng = np.random.default_rng(5)
    steps = [
        (
            time,
            "".join(
                vehicle(f"v{k}", 9.7 * time + k, rng.normal(), lane=f"a_{rng.integers(3)}")
                for k in range(5)
                if (time + k) % 7
            ),
        )
        for time in range(40)
    ]
    path, asked = log(tmp_path, *steps), {"near": Point(200, 0, 35), "at": 20.4}
    whole = roster(path, **asked)
    monkeypatch.setattr(reader, "_BLOCK", 60)
    parts = roster(path, **asked)
    assert parts.keys() == whole.keys() and len(whole) == 5
    for name, user in whole.items():
        assert parts[name].edges == user.edges and parts[name].lanes == user.lanes
        for value in ("begin", "end", "length", "mean_speed", "max_speed"):
            assert getattr(parts[name], value) == pytest.approx(getattr(user, value)), value
        assert parts[name].place == user.place
        for value in ("begin", "end", "time", "distance"):
            whole_way, part = getattr(user.passage, value), getattr(parts[name].passage, value)
            assert part == pytest.approx(whole_way), value


def test_memory_holds_a_block_and_no_more(tmp_path, monkeypatch):
    held = []
    monkeypatch.setattr(reader, "_BLOCK", 100)
    path = log(tmp_path, *((t, vehicle("v", 10 * t)) for t in range(200)))
    fcd.stream_rows([path], lambda rows, _: held.append(sum(map(len, rows.values()))))
    assert max(held) == 100 and sum(held) == 200 * 10


def test_gaps_and_teleports_are_no_way(tmp_path):
    times = (0, 1, 2, 6, 7, 8)
    places = (0, 10, 20, 90, 100, 400)
    others = {time: vehicle("steady", time) for time in range(9)}
    drive = dict(zip(times, places, strict=True))
    path = log(
        tmp_path,
        *((t, others[t] + (vehicle("v", drive[t]) if t in drive else "")) for t in range(9)),
    )
    found = roster(path, at=4.0)
    assert found["v"].length == pytest.approx(30.0) and found["v"].mean_speed == pytest.approx(10)
    assert found["v"].place is None and found["steady"].place.x == 4.0
    assert (found["v"].begin, found["v"].end) == (0.0, 8.0)


def test_who_passes_a_point_and_when(tmp_path):
    steps = [
        (
            t,
            vehicle("near", 10 * t, 3)
            + vehicle("far", 10 * t, 30)
            + vehicle("slow", 5, 0, speed=0),
        )
        for t in range(11)
    ]
    found = roster(log(tmp_path, *steps), near=Point(53, 0, 5), at=5.5)
    way = found["near"].passage
    assert (way.begin, way.end) == (pytest.approx(4.9), pytest.approx(5.7))
    assert (way.time, way.distance) == (pytest.approx(5.3), pytest.approx(3.0))
    assert found["far"].passage is None and found["slow"].passage is None
    assert (found["near"].place.x, found["near"].place.lane) == (55.0, "a_0")
    standing = roster(log(tmp_path, *steps), near=Point(5, 0, 1))["slow"].passage
    assert (standing.begin, standing.end, standing.distance) == (0.0, 10.0, 0.0)


def test_logs_without_speeds_and_lanes(tmp_path):
    rows = [(t, f'<vehicle id="v" x="{8 * t}" y="0" angle="90"/>') for t in range(3)]
    found = roster(log(tmp_path, *rows))["v"]
    assert found.max_speed == found.mean_speed == 8.0 and found.lanes == 0 and found.edges == ()
    assert found.type_id == "DEFAULT_VEHTYPE"


def test_riders_count_while_they_walk(tmp_path):
    def person(x):
        return f'<person id="p" x="{x}" y="0" angle="0" speed="1" edge="a"/>'

    steps = [
        (t, vehicle("bus", 50 + 10 * t) + person(t if t < 3 else 50 + 10 * t)) for t in range(9)
    ]
    found = roster(log(tmp_path, *steps))["p"]
    assert (found.begin, found.end, found.length) == (0.0, 2.0, pytest.approx(2.0))
    assert found.vclass == "pedestrian" and found.edges == ("a",)


def test_ids_are_those_by_which_cameras_ride(tmp_path):
    path = log(tmp_path, (0, vehicle("v", 0)), (1, vehicle("v", 500, of="bus")))
    assert [user.id for user in read_roster([path], types=TypesOfUsers({}))] == ["v", "v#2"]


@pytest.mark.parametrize("block", [10**6, 20])
def test_who_changes_its_type_while_driving_is_one(tmp_path, monkeypatch, block):
    monkeypatch.setattr(reader, "_BLOCK", block)
    types = ("car", "car", "bus", "bus", "truck", "car", "car")
    path = log(
        tmp_path,
        *((t, vehicle("v", 10 * t, of=of) + vehicle("w", 5 * t, 9)) for t, of in enumerate(types)),
        (7, vehicle("w", 35, 9)), (8, vehicle("w", 40, 9)), (9, vehicle("v", 0, of="bus")),
    )  # fmt: skip
    found = roster(path)
    assert {user.id: user.type_id for user in found.values()} == {
        "v": "car", "v#2": "bus", "w": "car",
    }  # fmt: skip
    assert found["v"].end == 6.0 and found["v"].length == pytest.approx(60.0)
    traces = {(t.id, t.type_id): len(t.times) for t in read_trajectories([path]).traces}
    assert traces == {("v", "car"): 7, ("w", "car"): 9, ("v", "bus"): 1}


def test_several_logs_belong_together(tmp_path):
    first = log(tmp_path, (0, vehicle("v", 0)), (1, vehicle("v", 10)), name="a.xml")
    second = log(tmp_path, (2, vehicle("v", 20)), (3, vehicle("w", 0)), name="b.xml")
    found = roster(first, second)
    assert found["v"].end == 2.0 and found["v"].length == pytest.approx(20.0)


def test_broken_and_empty_logs(tmp_path):
    broken = log(tmp_path, (0, vehicle("v", 0)), (1, vehicle("v", 5)), end="<timestep time='2'>")
    with pytest.raises(InputError, match="breaks off"):
        read_roster([broken], types=TypesOfUsers({}))
    assert roster(broken, allow_truncated=True)["v"].end == 1.0
    with pytest.raises(InputError, match="no time step"):
        read_roster([log(tmp_path)], types=TypesOfUsers({}))


def test_the_same_people_as_the_reader_of_traces(tmp_path):
    steps = [(t, "".join(vehicle(f"v{k}", 3 * t + k) for k in range(t % 4))) for t in range(20)]
    path = log(tmp_path, *steps)
    traces = {trace.id: trace for trace in read_trajectories([path]).traces}
    for name, user in roster(path).items():
        assert (user.begin, user.end) == (traces[name].times[0], traces[name].times[-1])


def test_a_kept_log_gives_the_same_without_being_read(tmp_path, monkeypatch):
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(reader, "_LEAST", 0)
    rng = np.random.default_rng(6)
    steps = [
        (
            time,
            "".join(
                vehicle(f"v{k}", round(9.7 * time + k, 2), lane=f"a_{rng.integers(3)}")
                for k in range(5)
                if (time + k) % 7
            )
            + f'<person id="p" x="{9.7 * time + 1 if time > 9 else 3:.2f}" y="0" angle="0"'
            ' speed="1" edge="a"/>',
        )
        for time in range(30)
    ]
    path, asked = log(tmp_path, *steps), {"near": Point(150, 0, 35), "at": 20.4}
    streamed = roster(path, **asked)
    read_trajectories([path], margin=2.0)
    monkeypatch.setattr(reader.LogReader, "read", None)
    found = roster(path, **asked)
    assert found.keys() == streamed.keys() and len(found) == 6
    for name, user in streamed.items():
        assert found[name].length == pytest.approx(user.length)
        assert found[name].passage == user.passage and found[name].place == user.place
        assert (found[name].edges, found[name].lanes) == (user.edges, user.lanes)
        assert (found[name].begin, found[name].end) == (user.begin, user.end)
        assert found[name].mean_speed == pytest.approx(user.mean_speed)
        assert found[name].max_speed == user.max_speed
