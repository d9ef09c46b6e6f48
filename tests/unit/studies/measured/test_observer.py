"""When road users arrive, and how they are seen, in closed form."""

import numpy as np
import pytest
from builders import network_xml
from hypothesis import example, given
from hypothesis import strategies as st

from sumo3dviz_pt.job.sessions import ObserverSettings, ReportSettings
from sumo3dviz_pt.studies.measured.observer import (
    Observer,
    arrival_rows,
    arrivals,
    camera_observer,
    named_observer,
    observer_rows,
    sight_of,
    way_across,
)
from sumo3dviz_pt.studies.measured.pictures import box_entries
from sumo3dviz_pt.studies.measured.traffic import Traffic
from sumo3dviz_pt.sumo.network import read_network

CAR = (4.0, 1.8, 1.5)
FRAMES = np.arange(0.0, 3.0, 0.04)
GRID = np.arange(-10.0, 13.05, 0.1)


def traffic(times, *cars, ridden=""):
    """Cars (x at 0 s, y, yaw in degrees, speed, first and last time), each on a straight way."""
    fronts, alive, yaws, speeds = [], [], [], []
    for x, y, yaw, speed, begin, end in cars:
        turn = np.radians(yaw)
        there = (times >= begin) & (times <= end)
        place = np.stack([x + speed * times * np.cos(turn), y + speed * times * np.sin(turn)], 1)
        place = np.append(place, np.zeros((len(times), 1)), axis=1)
        place[~there] = np.nan
        fronts.append(place)
        alive.append(there)
        yaws.append(np.where(there, turn, np.nan))
        speeds.append(np.where(there, speed, np.nan))
    keys = [f"vehicle:c{k}" for k in range(len(cars))]
    sizes = np.tile(CAR, (len(cars), 1))
    shape = (len(cars), len(times))
    return Traffic(
        keys,
        sizes,
        np.reshape(alive, shape).astype(bool),
        np.reshape(fronts, (*shape, 3)),
        np.reshape(yaws, shape),
        np.reshape(speeds, shape),
        np.reshape(speeds, shape),
        times,
        ridden,
    )


def kerb(count, *, at=(0.0, -5.0), end=(0.0, 5.0), eye=1.6):
    """Somebody who looks north across a road that runs to the east."""
    way = np.array([at, end])
    ahead = np.append(way[1] - way[0], 0.0) / np.linalg.norm(way[1] - way[0])
    return Observer(
        "kerb",
        np.broadcast_to((*at, eye), (count, 3)),
        np.broadcast_to(ahead, (count, 3)),
        np.broadcast_to(way, (count, 2, 2)),
    )


def rows_of(*cars, observer=None, within=200.0, speed=1.0):
    some, around = traffic(FRAMES, *cars), traffic(GRID, *cars)
    observer = observer or kerb(len(FRAMES))
    came = arrivals(observer, around)
    rows = list(observer_rows(observer, (some, around), came, within=within, seen={}))
    return rows, list(arrival_rows(observer, came, some.keys, begin=0.0, speed=speed))


ALWAYS = (-99.0, 99.0)


def test_arrivals_and_the_gaps_between_them():
    _, came = rows_of((-20, 0, 0, 10, *ALWAYS), (-54, 0, 0, 10, *ALWAYS), (60, 3, 180, 10, *ALWAYS))
    assert [(row["road_user"], row["from"], row["arrives"]) for row in came] == [
        ("vehicle:c0", "left", 2.0),
        ("vehicle:c1", "left", 5.4),
        ("vehicle:c2", "right", 6.0),
    ]
    # Each is 4 m long, which takes .4 s; nobody came in the ten seconds before the first.
    assert [row["gap_before"] for row in came] == ["", 3.0, 0.2]
    assert came[0]["leaves"] == 2.4 and came[0]["speed"] == 10.0


def test_the_films_time_of_an_arrival_is_that_of_slow_motion():
    (row,) = rows_of((-20, 0, 0, 10, *ALWAYS), speed=0.25)[1]
    assert (row["arrives"], row["arrives_in_film"], row["leaves"]) == (2.0, 8.0, 2.4)


def test_a_row_tells_distance_and_time_to_arrival():
    row = rows_of((-40, 0, 0, 10, *ALWAYS), (-70, 0, 0, 20, *ALWAYS))[0]
    first, second = row[:2]
    assert (first["distance_to_arrival"], first["time_to_arrival"]) == (40.0, 4.0)
    assert first["arrives_in"] == 4.0 and first["next"] == 0
    assert (second["arrives_in"], second["time_to_arrival"], second["next"]) == (3.5, 3.5, 1)


@given(st.floats(0.0, 360.0), st.floats(-500.0, 500.0), st.floats(1.0, 30.0), st.floats(10.0, 80.0))
def test_angles_do_not_hang_on_place_or_direction(turn, shift, speed, away):
    """Of a car that comes straight on: width 2 atan(w / 2d), growing; tau is about d / v."""
    angle = np.radians(turn)
    ahead = np.array([np.cos(angle), np.sin(angle)])
    place = np.array([shift, -shift])
    begin = place + (away + 1.0) * ahead
    car = (*begin, turn + 180.0, speed, *ALWAYS)
    some = traffic(np.array([0.0, 0.002, 0.004]), car)
    eyes = np.broadcast_to((*place, 0.75), (3, 3))
    looks = np.broadcast_to((*ahead, 0.0), (3, 3))
    seen = sight_of(Observer("x", eyes, looks, None), some, 0)
    front = away + 1.0 - speed * 0.002
    width = 2.0 * np.arctan(0.9 / front)
    assert seen.distance[1] == pytest.approx(front, rel=1e-6)
    assert seen.width[1] == pytest.approx(width, rel=1e-6)
    assert seen.height[1] == pytest.approx(2.0 * np.arctan(0.75 / front), rel=1e-6)
    rate = 1.8 * speed / (front**2 + 0.81)
    assert seen.rate[1] == pytest.approx(rate, rel=1e-3)
    if rate > 1e-3:
        assert seen.tau(1) == pytest.approx(front / speed, rel=0.01)
    assert seen.bearing[1] == pytest.approx(0.0, abs=1e-6)
    assert seen.eccentricity[1] < 1e-3


def test_bearings_are_clockwise():
    (row, *_), _ = rows_of((5.0, -5.0 + np.sqrt(75.0), 90, 0, *ALWAYS))
    middle = np.degrees(np.arctan2(5.0, np.sqrt(75.0) - 2.0))
    assert row["bearing"] == pytest.approx(middle, abs=0.01)


STIFF = {
    "nobody": (),
    "who stands": ((-20, 0, 0, 0, *ALWAYS),),
    "who stands on the observer": ((0.5, -5, 0, 0, *ALWAYS),),
    "who drives over the observer": ((-9, -5, 0, 10, *ALWAYS),),
    "who is there for one frame": ((-20, 0, 0, 10, 1.0, 1.0),),
    "who vanishes on the way": ((-20, 0, 0, 10, -99.0, 1.99),),
    "who appears behind it": ((2, 0, 0, 10, 0.2, 99.0),),
    "who comes and goes between frames": ((-20, 0, 0, 10, 1.01, 1.03),),
}


@pytest.mark.parametrize("cars", STIFF.values(), ids=STIFF)
def test_no_cell_is_nan_and_none_is_infinite(cars):
    some = traffic(FRAMES, *cars, ridden="vehicle:c0" if cars else "")
    cameras = [{"position": [0, -5, 1.6], "forward": [0, 1, 0]} for _ in FRAMES]
    riding = camera_observer(cameras, some, NETWORK) if cars else kerb(len(FRAMES))
    for observer in (kerb(len(FRAMES)), riding):
        rows, came = rows_of(*cars, observer=observer)
        for row in (*rows, *came):
            numbers = [value for value in row.values() if isinstance(value, float)]
            assert np.isfinite(numbers).all(), row


def test_who_rides_has_a_line_that_goes_along():
    """A bicycle at 5 m/s is overtaken by a car at 15 m/s whose front is 20 m behind."""
    cars = ((0, 0, 0, 5, *ALWAYS), (-20, 3, 0, 15, *ALWAYS))
    some = traffic(FRAMES, *cars)
    bike = named_observer("bike", ObserverSettings(road_user="c0"), some, NETWORK)
    rows, came = rows_of(*cars, observer=bike)
    assert {row["road_user"] for row in rows} == {"vehicle:c1"}
    assert rows[0]["distance_to_arrival"] == 20.0
    assert rows[0]["time_to_arrival"] == pytest.approx(2.0) and rows[0]["arrives_in"] == 2.0
    assert [(row["arrives"], row["from"]) for row in came] == [(2.0, "behind")]
    assert named_observer("bike", ObserverSettings(road_user="c9"), some, NETWORK) is None


@pytest.fixture(autouse=True, scope="module")
def _network(tmp_path_factory):
    global NETWORK
    path = tmp_path_factory.mktemp("net") / "net.net.xml"
    path.write_text(network_xml(), encoding="utf-8")
    NETWORK = read_network(path)


def test_the_way_across_begins_at_the_kerb():
    """Lanes run east with their middles at y = -4.8 and -1.6, 3.2 m wide."""
    np.testing.assert_allclose(way_across(np.array([50.0, -8.0]), NETWORK), [[50, -8], [50, 7.2]])
    np.testing.assert_allclose(way_across(np.array([50.0, -4.8]), NETWORK)[1] - (50, -4.8), (0, 12))
    assert way_across(np.array([50.0, 60.0]), NETWORK) is None


def test_settings_of_observers_are_checked():
    with pytest.raises(ValueError, match="either position or road_user"):
        ObserverSettings()
    with pytest.raises(ValueError, match="either position or road_user"):
        ObserverSettings(position=(0, 0), road_user="a")
    with pytest.raises(ValueError, match="another place than position"):
        ObserverSettings(road_user="a", across=(1, 1))
    with pytest.raises(ValueError, match="no observer can be called 'camera'"):
        ReportSettings(observers={"camera": {"position": (0, 0)}})


@given(st.lists(st.floats(-5.0, 5.0), min_size=3, max_size=3))
@example([2.3e-308, 1.0, 1.0])
def test_rays_enter_a_box_where_they_meet_its_faces(direction):
    ray = np.array(direction)
    if np.linalg.norm(ray) < 0.1:
        return
    ray = ray / np.linalg.norm(ray)
    low, high = np.array([1.0, -1.0, -1.0]), np.array([3.0, 1.0, 1.0])
    near, meets = box_entries(np.zeros(3), ray[None], low, high)
    ts = np.linspace(0.0, 6.0, 4001)[:, None]
    inside = ((ts * ray >= low) & (ts * ray <= high)).all(axis=1)
    if inside.any():
        assert meets[0] and near[0] == pytest.approx(float(ts[inside][0, 0]), abs=2e-3)
    assert box_entries(np.array([2.0, 0.0, 0.0]), ray[None], low, high)[0][0] == 0.0
