"""From nobody to five thousand on the road, from one lane to ten thousand."""

import logging
import re
import time
from xml.etree import ElementTree

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
    with opened(production) as session:
        rendered = session.render(frame)
    image = rendered.radiance
    assert np.isfinite(image).all() and (image >= 0).all() and image.max() > 0
    assert (rendered.tally.nonfinite, rendered.tally.negative) == (0, 0)
    return production.shot, frame, image, (built - started, time.process_time() - built)


def seen_in_log(folder, time, view, *, within):
    """Ids of the vehicles whose logged fronts lie in the picture, no farther than `within` [m]."""
    steps = ElementTree.parse(folder / "fcd.xml").getroot()
    (step,) = (each for each in steps if float(each.get("time")) == time)
    ids = np.array([f"vehicle:{each.get('id')}" for each in step])
    fronts = np.array([[float(each.get("x")), float(each.get("y")), 0.5] for each in step])
    to_camera = np.linalg.inv(view.world_from_camera.matrix)
    local = fronts @ to_camera[:3, :3].T + to_camera[:3, 3]
    seen = view.lens.sees(local, SIZE[1] / SIZE[0])
    return set(ids[seen & (np.linalg.norm(local, axis=1) < within)].tolist())


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
    shot, frame, _, seconds = pictured(place, at=4.0)
    log.info("%d vehicles: CPU-seconds to build and to render %s", vehicles, seconds)
    missing = seen_in_log(place.parent, 4.0, frame.view, within=150.0) - frame.users
    assert not missing
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


def asphalt_of(shot):
    """Area of what is driven on, seen from above [m2]: in detail, and plainly beyond."""
    parts = [p for p in shot.data.static if p.id in {"road/asphalt", "road/beyond/asphalt"}]
    corners = [p.part.mesh.vertices[p.part.mesh.faces] for p in parts]
    crosses = [np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])[:, 2] for c in corners]
    return 0.5 * sum(np.abs(each).sum() for each in crosses)


def test_a_network_of_one_lane(tmp_path):
    shot, _, _, _ = pictured(town(tmp_path, one_lane(), middle=(0.0, 0.0)))
    assert asphalt_of(shot) == pytest.approx(100 * 3.2, rel=0.05)


def test_ten_thousand_lanes(tmp_path):
    """All are built, in detail or plainly: the area of asphalt grows with their number.

    Seconds are logged, not judged: machines differ.
    """
    areas, seconds = {}, {}
    for streets in (16, 51):
        folder = tmp_path / str(streets)
        folder.mkdir()
        middle = (BLOCK * (streets // 2),) * 2
        shot, _, image, spent = pictured(town(folder, grid(streets), middle=middle))
        lanes = 4 * streets * (streets - 1)
        expected = lanes * 32.0 * 3.2 + streets**2 * 64.0
        assert asphalt_of(shot) == pytest.approx(expected, rel=0.03)
        areas[lanes], seconds[lanes] = expected, spent
        assert image.mean() > 0.01
    log.info("CPU-seconds to build and to render, by lanes: %s", seconds)
    assert max(seconds) == 10_200
