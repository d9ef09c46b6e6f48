"""Finding a scenario's files."""

import os

import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo import find_scenario, read_network, read_trajectories

NET = '<net><edge id="a"><lane id="a_0" shape="0,0 9,0"/></edge></net>'
CARS = (
    '<fcd-export><timestep time="0"><vehicle id="v" x="0" y="0" angle="0"/></timestep></fcd-export>'
)
WALKERS = CARS.replace("vehicle", "person")
POIS = '<additional><poi id="p" x="0" y="0"/></additional>'
TYPES = '<additional><vType id="t"/></additional>'


def states(times, lights="ab"):
    rows = "".join(f'<tlsState time="{t}" id="{i}" state="G"/>' for t in times for i in lights)
    return f"<tlsStates>{rows}</tlsStates>"


def lay(folder, **files):
    """Write files; `__` in a name stands for a slash and `_` before the end for a dot."""
    for name, text in files.items():
        path = folder / name.replace("__", "/").replace("_", ".")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def config(**options):
    rows = "".join(f'<{key.replace("_", "-")} value="{value}"/>' for key, value in options.items())
    return f"<configuration><input>{rows}</input></configuration>"


def names(paths):
    return [path.name for path in paths]


def test_folder_by_content(tmp_path):
    lay(
        tmp_path,
        n=NET,
        log_txt=CARS,
        people=WALKERS,
        full=states(range(50)),
        switches=states([0, 30]),
        viz__trees_add_xml=POIS,
        types_add_xml=TYPES,
        demand_xml="<routes/>",
        stops_xml='<additional><busStop id="b"/></additional>',
        notes_md="# no XML",
        broken_xml="<net",
    )
    (tmp_path / "picture.png").write_bytes(b"\x89PNG\r\n")
    files = find_scenario(tmp_path)
    assert files.network.name == "n"
    assert names(files.trajectories) == ["log.txt", "people"]
    assert names(files.signals) == ["full"]
    assert names(files.additional) == ["stops.xml", "trees.add.xml"]
    assert sorted(names(files.vehicle_types)) == ["demand.xml", "types.add.xml"]
    assert files.missing == ()


def test_a_file_that_was_written_again_is_looked_at_again(tmp_path):
    lay(tmp_path, n=NET, log=CARS, a=POIS)
    assert names(find_scenario(tmp_path).additional) == ["a"]
    lay(tmp_path, a=TYPES)
    files = find_scenario(tmp_path)
    assert (names(files.additional), names(files.vehicle_types)) == ([], ["a"])


def test_subfolder_with_its_own_network_is_another_scenario(tmp_path):
    lay(tmp_path, n=NET, log=CARS, other__n=NET, other__log=CARS, other__tls=states([0]))
    files = find_scenario(tmp_path)
    assert files.network == tmp_path / "n"
    assert files.trajectories == (tmp_path / "log",)
    assert files.signals == ()


def test_files_may_all_lie_in_subfolders(tmp_path):
    lay(tmp_path, nets__n=NET, logs__log=CARS)
    assert find_scenario(tmp_path).network == tmp_path / "nets" / "n"


def test_configuration_names_the_files(tmp_path):
    lay(
        tmp_path,
        city_sumocfg=config(
            net_file="net/n",
            route_files="demand.rou, more.rou",
            additional_files="extra,tls",
            fcd_output="out\\\\log".replace("\\\\", "\\"),
        ),
        net__n=NET,
        other_n=NET,
        demand_rou="<routes><vType id='r'/></routes>",
        extra=POIS.replace("<poi", "<vType id='x'/><poi"),
        tls='<additional><timedEvent type="SaveTLSStates" dest="out/states"/></additional>',
        out__log=CARS,
        out__states=states([0, 1]),
        out__unrelated=CARS,
    )
    files = find_scenario(tmp_path / "city.sumocfg")
    assert files.network == tmp_path / "net" / "n"
    assert files.trajectories == (tmp_path / "out" / "log",)
    assert files.signals == (tmp_path / "out" / "states",)
    assert names(files.additional) == ["extra"]
    assert names(files.vehicle_types) == ["demand.rou", "extra"]
    assert names(files.missing) == ["more.rou"]
    assert find_scenario(tmp_path) == files


def test_a_log_that_a_configuration_does_not_name_is_told(tmp_path, caplog):
    lay(tmp_path, c_sumocfg=config(net_file="n"), n=NET, scene_recorded__fcd=CARS)
    (file,) = find_scenario(tmp_path / "c.sumocfg").trajectories
    assert f"no vehicle log that is there; {file.relative_to(tmp_path)} is taken" in caplog.text
    caplog.clear()
    find_scenario(tmp_path / "c.sumocfg", trajectories=[file])
    assert not caplog.text


def test_what_a_configuration_names_but_is_missing_is_looked_for(tmp_path):
    lay(
        tmp_path,
        c_sumocfg=config(net_file="gone.net", fcd_output="logs/cars.xml", route_files="demand"),
        n=NET,
        viz__objects=POIS,
        cars_ci_xml=CARS,
        another=CARS,
        tls=states([0]),
    )
    files = find_scenario(tmp_path / "c.sumocfg")
    assert files.network.name == "n"
    assert names(files.trajectories) == ["cars.ci.xml"]
    assert names(files.signals) == ["tls"]
    assert names(files.additional) == ["objects"]
    assert names(files.missing) == ["gone.net", "demand", "cars.xml"]


def test_configuration_may_point_outside_its_folder(tmp_path):
    lay(tmp_path, n=NET, log=CARS, cfg__c_sumocfg=config(net_file="../n", fcd_output="../log"))
    files = find_scenario(tmp_path / "cfg" / "c.sumocfg")
    assert files.network.resolve() == (tmp_path / "n").resolve()
    assert names(files.trajectories) == ["log"]


def test_names_that_go_up_are_short_in_messages_unless_links_lead_elsewhere(tmp_path):
    lay(tmp_path, sim__run_sumocfg=config(net_file="../n", fcd_output="../log"), n=NET, log=CARS)
    files = find_scenario(tmp_path / "sim" / "run.sumocfg")
    assert (files.network, *files.trajectories) == (tmp_path / "n", tmp_path / "log")
    lay(tmp_path, far__sim__run_sumocfg=config(net_file="../n", fcd_output="../log"))
    lay(tmp_path, far__n=NET, far__log=CARS)
    (tmp_path / "link").symlink_to(tmp_path / "far" / "sim", target_is_directory=True)
    linked = find_scenario(tmp_path / "link" / "run.sumocfg").network
    assert linked.samefile(tmp_path / "far" / "n")


def test_configurations_of_other_tools_are_no_scenarios(tmp_path):
    lay(tmp_path, n=NET, log=CARS, router_duarcfg=config(net_file="gone"))
    assert find_scenario(tmp_path).missing == ()


def test_choices_can_be_made_by_name(tmp_path):
    lay(tmp_path, n1=NET, n2=NET, log1=CARS, log2=CARS)
    with pytest.raises(InputError, match="n1, n2 are networks; name one by --network"):
        find_scenario(tmp_path, trajectories=[tmp_path / "log1"])
    with pytest.raises(InputError, match="log1, log2 are vehicle logs"):
        find_scenario(tmp_path, network=tmp_path / "n1")
    lay(tmp_path, a__fcd=CARS, b__fcd=CARS)
    with pytest.raises(InputError, match="a/fcd, b/fcd"):
        find_scenario(tmp_path, network=tmp_path / "n1")
    files = find_scenario(tmp_path, network=tmp_path / "n2", trajectories=[tmp_path / "log1"])
    assert (files.network.name, names(files.trajectories)) == ("n2", ["log1"])


def test_signal_logs_complement_each_other(tmp_path):
    lay(
        tmp_path,
        n=NET,
        log=CARS,
        sparse=states([0, 50], "abc"),
        dense=states(range(50), "ab"),
        once=states([0], "ab"),
        odd=states(["x", "y"], "ab"),
    )
    assert names(find_scenario(tmp_path).signals) == ["dense", "sparse"]


def test_clear_errors(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        find_scenario(tmp_path / "none")
    with pytest.raises(InputError, match="no network"):
        find_scenario(tmp_path)
    lay(tmp_path, n=NET, broken="<configuration")
    with pytest.raises(InputError, match="no vehicle log was found"):
        find_scenario(tmp_path)
    with pytest.raises(InputError, match="not a configuration"):
        find_scenario(tmp_path / "n")
    with pytest.raises(InputError, match="ends in the middle"):
        find_scenario(tmp_path / "broken")


def test_damaged_additional_files_are_found_all_the_same(tmp_path):
    lay(tmp_path, n=NET, log=CARS, trees_xml=POIS.replace("</additional>", "<po"))
    assert names(find_scenario(tmp_path).additional) == ["trees.xml"]


@pytest.mark.parametrize(
    ("affixes", "cars", "states_of"),
    [
        ({"output_prefix": "run_"}, "run_log.xml.gz", "run_states.xml"),
        ({"output_suffix": ".7"}, "log.7.xml.gz", "states.7.xml"),
        ({"output_prefix": "TIME_"}, "2026-01-02_log.xml.gz", "2026-01-02_states.xml"),
        ({"output_prefix": "run_"}, "log.xml.gz", "states.xml"),  # renamed
    ],
)
def test_what_a_configuration_adds_to_names(tmp_path, affixes, cars, states_of):
    lay(
        tmp_path,
        c_sumocfg=config(net_file="n", additional_files="tls", fcd_output="log.xml.gz", **affixes),
        n=NET,
        tls='<additional><timedEvent type="SaveTLSStates" dest="states.xml"/></additional>',
    )
    (tmp_path / cars).write_text(CARS, encoding="utf-8")
    (tmp_path / states_of).write_text(states([0, 1]), encoding="utf-8")
    (tmp_path / "another").write_text(CARS, encoding="utf-8")
    files = find_scenario(tmp_path / "c.sumocfg")
    assert names(files.trajectories) == [cars]
    assert names(files.signals) == [states_of]
    assert files.missing == ()


def test_of_several_runs_the_last_counts(tmp_path):
    lay(tmp_path, c_sumocfg=config(net_file="n", fcd_output="log", output_prefix="TIME_"), n=NET)
    for number, name in enumerate(["2026-01-03_log", "2026-01-02_log"]):
        (tmp_path / name).write_text(CARS, encoding="utf-8")
        os.utime(tmp_path / name, (number, number))
    assert names(find_scenario(tmp_path).trajectories) == ["2026-01-02_log"]


def test_a_missing_output_is_named_as_sumo_would_write_it(tmp_path):
    lay(
        tmp_path,
        c_sumocfg=config(net_file="n", fcd_output="out/log.xml", output_prefix="run_"),
        n=NET,
        other=CARS,
    )
    assert find_scenario(tmp_path).missing == (tmp_path / "out" / "run_log.xml",)


def test_logs_of_states_come_before_logs_of_green_times(tmp_path):
    green = '<tlsSwitch id="{}" fromLane="a" toLane="b" begin="0" end="1"/>'
    greens = f"<tlsSwitches>{green}</tlsSwitches>"
    lay(tmp_path, n=NET, log=CARS, a=greens.format("a"), b=states([0, 30]), c=greens.format("c"))
    assert names(find_scenario(tmp_path).signals) == ["b", "c"]


# Variables --------------------------------------------------------------------------------


def test_variables_are_replaced_as_sumo_does(tmp_path, monkeypatch):
    monkeypatch.setenv("TAG", "runA")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    options = {
        "net_file": "~/a.net.xml",
        "route_files": "${DIR}x.rou.xml,~/y.rou.xml",
        "fcd_output": "out/${TAG}_${TAG}.xml",
    }
    monkeypatch.delenv("DIR", raising=False)
    lay(tmp_path, cfg__run_sumocfg=config(**options), home__a_net_xml=NET)
    lay(tmp_path, cfg__x_rou_xml="<routes/>", home__y_rou_xml="<routes/>")
    (tmp_path / "cfg/out").mkdir()
    (tmp_path / "cfg/out/runA_runA.xml").write_text(CARS)
    (tmp_path / "cfg/out/other.xml").write_text(CARS)
    found = find_scenario(tmp_path / "cfg/run.sumocfg")
    assert (found.network.name, names(found.trajectories)) == ("a.net.xml", ["runA_runA.xml"])
    assert names(found.vehicle_types) == ["x.rou.xml", "y.rou.xml"] and not found.missing


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("${LOCALTIME}_${PID}.xml", "2026-11-27-03-00-00.123456_77.xml"),
        ("runs/${UTC}/log.xml", "runs/2026-11-27-03-00-00.5/log.xml"),
    ],
)
def test_what_each_run_has_anew_is_that_of_the_last_run(tmp_path, name, written):
    lay(tmp_path, a_net_xml=NET, run_sumocfg=config(net_file="a.net.xml", fcd_output=name))
    older = tmp_path / written.replace("2026", "2025")
    for number, path in enumerate((older, tmp_path / written)):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(CARS)
        os.utime(path, (number, number))
    found = find_scenario(tmp_path / "run.sumocfg")
    assert [path.resolve() for path in found.trajectories] == [(tmp_path / written).resolve()]


@pytest.mark.parametrize(
    ("options", "trouble"),
    [
        ({"net_file": "a.net.xml", "fcd_output": "../out/${TAG}_fcd.xml"}, "no vehicle log"),
        ({"net_file": "${TAG}.net.xml", "fcd_output": "a.xml"}, "no network"),
        (
            {"net_file": "a.net.xml", "output_prefix": "${TAG}", "fcd_output": "../out/a.xml"},
            "no vehicle log",
        ),
    ],
)
def test_a_variable_that_is_not_set_is_named(tmp_path, monkeypatch, options, trouble):
    monkeypatch.delenv("TAG", raising=False)
    lay(tmp_path, cfg__run_sumocfg=config(**options), out__runA_fcd_xml=CARS)
    if trouble == "no vehicle log":
        lay(tmp_path, cfg__a_net_xml=NET)
    words = rf"{trouble}.*\$\{{TAG\}}.* names TAG, which is not set .* when SUMO ran"
    with pytest.raises(InputError, match=words):
        find_scenario(tmp_path / "cfg/run.sumocfg")


# Files that are no networks and no logs ---------------------------------------------------

OTHER = {
    "map.xodr": ("<OpenDRIVE/>", "netconvert --opendrive-files {} -o map.net.xml"),
    "map.osm": ("<osm/>", "netconvert --osm-files {} -o map.net.xml"),
    "map.osm.pbf": (
        "\0\0\0\x0d\n\tOSMHeader\x18|\x10",
        "osmium cat {} -o {folder}/map.osm, then make a network of it: netconvert --osm-files",
    ),
    "plain.nod.xml": ("<nodes/>", "netconvert --node-files {} --edge-files FILE.edg.xml -o plain"),
    "queues.xml": ("<queue-export/>", "SUMO's --queue-output"),
}


@pytest.mark.parametrize("name", OTHER)
def test_other_files_are_told_apart_with_what_to_do(tmp_path, name):
    text, words = OTHER[name]
    path = tmp_path / name
    path.write_text(text)
    network = "netconvert" in words
    words = words.format(path, folder=tmp_path)
    reader = read_network if network else lambda file: read_trajectories([file])
    for read in (reader, find_scenario):
        with pytest.raises(InputError) as caught:
            read(path)
        assert words in str(caught.value)
    if not network:
        lay(tmp_path, a_net_xml=NET)
    with pytest.raises(InputError, match=f"no (network|vehicle log).*{name} is ") as caught:
        find_scenario(tmp_path)
    assert words in str(caught.value)


def test_where_no_log_is_recording_is_named(tmp_path):
    lay(tmp_path, a_net_xml=NET, run_sumocfg=config(net_file="a.net.xml"))
    for place in (tmp_path, tmp_path / "run.sumocfg"):
        with pytest.raises(InputError, match=r"no vehicle log was found; let init --record run"):
            find_scenario(place)
