"""A whole log tells what vehicles are by their ids, lanes and speeds."""

import pytest

from sumo3dviz_pt.sumo import find_scenario, read_scenario, with_use

NET = """<net>
<edge id="r"><lane id="r_0" index="0" allow="{allow}" speed="13.9" shape="0,0 500,0"/></edge>
<edge id="c"><lane id="c_0" index="0" speed="13.9" shape="0,9 500,9"/></edge>
</net>"""


def guess(folder, *, allow="all", speed=10.0, name="v{}", count=6):
    """What is guessed of a type `t` whose vehicles drive on r, beside fast cars on c."""
    steps = []
    for time in range(12):
        rows = [
            f'<vehicle id="{name.format(n)}" x="{30 * n + speed * time}" y="0" angle="90" type="t"'
            f' speed="{speed}" lane="r_0"/>'
            for n in range(count)
        ]
        rows.append(
            f'<vehicle id="c" x="{13 * time}" y="9" angle="90" type="car" speed="13" lane="c_0"/>'
        )
        steps.append(f'<timestep time="{time}">{"".join(rows)}</timestep>')
    (folder / "fcd.xml").write_text(f"<fcd-export>{''.join(steps)}</fcd-export>", encoding="utf-8")
    (folder / "n.net.xml").write_text(NET.format(allow=allow), encoding="utf-8")
    scenario = with_use(read_scenario(find_scenario(folder)))
    (found,) = [each for each in scenario.guesses if each.type_id == "t"]
    assert scenario.vehicle_types["t"].vclass == (found.vclass or "passenger")
    return found


@pytest.mark.parametrize(
    ("allow", "vclass"),
    [
        ("bus taxi", "bus"),
        ("bus tram", "bus"),
        ("tram", "tram"),
        ("rail rail_electric", "rail"),
        ("bicycle pedestrian", "bicycle"),
        ("ship", "ship"),
        ("all", ""),
        ("passenger bus", ""),
    ],
)
def test_lanes_that_are_closed_to_cars(allow, vclass, tmp_path):
    found = guess(tmp_path, allow=allow)
    assert found.vclass == vclass and found.count == 6
    assert found.why == ("the vehicles keep to lanes that are closed to cars" if vclass else "")


def test_ids_of_vehicles(tmp_path):
    found = guess(tmp_path, name="tram_{}")
    assert (found.vclass, found.why) == ("tram", "the ids of the vehicles say so")


def test_slow_vehicles_are_bicycles_where_they_may_be(tmp_path):
    assert guess(tmp_path, speed=5.0).vclass == "bicycle"
    assert guess(tmp_path, speed=5.0, allow="passenger bus").vclass == ""
    assert guess(tmp_path, speed=5.0, count=2).vclass == ""
    assert guess(tmp_path, speed=9.0).vclass == ""
