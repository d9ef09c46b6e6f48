"""From nobody to five thousand on the road, from one lane to ten thousand."""

import logging
import re
import time

import numpy as np
import pytest
from builders import SCENE, TYPES, fcd_xml, write_scenario

from sumo3dviz_pt.pipeline.production import Request, opened, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job

pytestmark = pytest.mark.slow

log = logging.getLogger(__name__)

SIZE = (64, 36)
BLOCK = 40.0
"""Distance of the grid's streets [m]."""


def pictured(place, *, at=5.0, size=SIZE):
    """Build, render one frame at a time [s]; shot, frame, picture and CPU-seconds."""
    started = time.process_time()
    request = Request(camera="post", size=size, spp=2)
    production = prepare(load_job(place), request, np.array([at]))
    built = time.process_time()
    frame = production.shot.frame_at(at)
    with opened(production, film=False) as session:
        rendered = session.render(frame)
    image = rendered.radiance
    assert np.isfinite(image).all() and (image >= 0).all() and image.max() > 0
    assert (rendered.tally.nonfinite, rendered.tally.negative) == (0, 0)
    return production.shot, frame, image, (built - started, time.process_time() - built)


@pytest.mark.parametrize(
    ("vehicles", "spacing"), [(1, 18.0), (300, 0.3), (5000, 0.3), (5000, 18.0)]
)
def test_any_number_of_vehicles(tmp_path, vehicles, spacing):
    """Everyone in view is drawn, in detail or by a stand-in; nobody else takes room.

    5,000 at 0.3 m fill 750 m of road many times over; at 18 m they stretch 45 km beyond
    the network, so that nearly all are out of sight. These stand: a log of which most drive
    off the roads is refused as that of another network.
    """
    crowd = {"vehicles": vehicles, "spacing": spacing, "speed": 0.0 if spacing > 1 else 10.0}
    place = write_scenario(tmp_path, end=8.0, step=2.0, **crowd)
    shot, frame, _, seconds = pictured(place)
    log.info("%d vehicles: CPU-seconds to build and to render %s", vehicles, seconds)
    assert len(shot.fleet.movers_at(5.0)) == vehicles
    drawn = len(frame.users)
    assert len({mover.id for mover in frame.movers}) <= shot.limit
    assert drawn == len([mover for mover in frame.everyone if not mover.part])
    room = sum(shot.data.slots.near.values()) + sum(shot.data.slots.far.values())
    assert room < 1.2 * len(frame.everyone) + 50
    if spacing == 18.0:
        assert 1 <= drawn < 100
    if vehicles >= 300 and spacing < 1:
        assert drawn > 50


def test_a_log_without_anyone(tmp_path):
    """Steps but no vehicles: the road lies empty, and nothing takes room."""
    place = write_scenario(tmp_path, vehicles=0)
    shot, frame, _, _ = pictured(place)
    assert frame.everyone == ()
    assert not shot.data.slots.near and not shot.data.slots.far


# Networks -----------------------------------------------------------------------------------


def one_lane():
    """The smallest network: one edge with one lane and two dead ends."""
    return (
        '<net version="1.20"><location netOffset="0,0" convBoundary="-50,-5,50,5"'
        ' origBoundary="-50,-5,50,5" projParameter="!"/>'
        '<edge id="w" from="a" to="b" priority="1"><lane id="w_0" index="0" speed="13.9"'
        ' length="100" width="3.2" shape="-50,-1.6 50,-1.6"/></edge>'
        '<junction id="a" type="dead_end" x="-50" y="0" incLanes="" intLanes="" shape=""/>'
        '<junction id="b" type="dead_end" x="50" y="0" incLanes="w_0" intLanes="" shape=""/>'
        "</net>"
    )


def grid(streets):
    """A square of streets with a lane in each direction, 4 n (n - 1) lanes in all."""
    nodes = [(i, j) for i in range(streets) for j in range(streets)]
    rows, incoming = [], {node: [] for node in nodes}
    for i, j in nodes:
        for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            k, m = i + di, j + dj
            if not (0 <= k < streets and 0 <= m < streets):
                continue
            key = f"e{i}_{j}_{k}_{m}"
            incoming[k, m].append(f"{key}_0")
            # On the right of the middle, between the junctions' edges.
            side = np.array([dj, -di]) * 1.6
            start = np.array([i, j]) * BLOCK + side + np.array([di, dj]) * 4
            end = np.array([k, m]) * BLOCK + side - np.array([di, dj]) * 4
            shape = f"{start[0]:.2f},{start[1]:.2f} {end[0]:.2f},{end[1]:.2f}"
            rows.append(
                f'<edge id="{key}" from="n{i}_{j}" to="n{k}_{m}" priority="1"><lane'
                f' id="{key}_0" index="0" speed="13.9" length="{BLOCK - 8}" width="3.2"'
                f' shape="{shape}"/></edge>'
            )
    for (i, j), lanes in incoming.items():
        x, y = i * BLOCK, j * BLOCK
        shape = f"{x - 4},{y - 4} {x - 4},{y + 4} {x + 4},{y + 4} {x + 4},{y - 4}"
        rows.append(
            f'<junction id="n{i}_{j}" type="priority" x="{x}" y="{y}"'
            f' incLanes="{" ".join(lanes)}" intLanes="" shape="{shape}"/>'
        )
    box = f"0,0,{BLOCK * (streets - 1)},{BLOCK * (streets - 1)}"
    head = f'<location netOffset="0,0" convBoundary="{box}" origBoundary="{box}"'
    return "\n".join(['<net version="1.20">', head + ' projParameter="!"/>', *rows, "</net>"])


def town(folder, network, *, middle):
    """Scene files around a network; the camera looks at its middle, (x, y) [m]."""
    x, y = middle
    (folder / "net.net.xml").write_text(network, encoding="utf-8")
    # A log of another network's lanes is refused, so this one names none.
    log_of = re.sub(r' lane="[^"]*"', "", fcd_xml(offset=(x, y), vehicles=2, end=8.0))
    (folder / "fcd.xml").write_text(log_of, encoding="utf-8")
    (folder / "types.add.xml").write_text(TYPES, encoding="utf-8")
    text = SCENE.format(files="", x0=x + 60, y0=y - 40, x1=x, y1=y)
    (folder / "scene.yaml").write_text(text, encoding="utf-8")
    return folder / "scene.yaml"


def test_a_network_of_one_lane(tmp_path):
    shot, _, _, _ = pictured(town(tmp_path, one_lane(), middle=(0.0, 0.0)))
    (asphalt,) = (part for part in shot.data.static if part.id == "road/asphalt")
    corners = asphalt.part.mesh.vertices[asphalt.part.mesh.faces]
    area = 0.5 * np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    assert area.sum() == pytest.approx(100 * 3.2, rel=0.05)


def test_ten_thousand_lanes(tmp_path):
    """All are built: the area of asphalt grows with their number.

    Seconds are logged, not judged: machines differ.
    """
    areas, seconds = {}, {}
    for streets in (16, 51):
        folder = tmp_path / str(streets)
        folder.mkdir()
        middle = (BLOCK * (streets // 2),) * 2
        shot, _, image, spent = pictured(town(folder, grid(streets), middle=middle))
        (asphalt,) = (part for part in shot.data.static if part.id == "road/asphalt")
        corners = asphalt.part.mesh.vertices[asphalt.part.mesh.faces]
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        lanes = 4 * streets * (streets - 1)
        expected = lanes * 32.0 * 3.2 + streets**2 * 64.0
        assert 0.5 * np.abs(sides[:, 2]).sum() == pytest.approx(expected, rel=0.03)
        areas[lanes], seconds[lanes] = expected, spent
        assert image.mean() > 0.01
    log.info("CPU-seconds to build and to render, by lanes: %s", seconds)
    assert max(seconds) == 10_200
