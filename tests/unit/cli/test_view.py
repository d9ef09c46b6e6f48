"""What `view` refuses before anything is read, built or run."""

import socket
import sys

import pytest

from sumo3dviz_pt.cli import main

CONFIGURATION = '<configuration><input><net-file value="n.net.xml"/></input></configuration>'


@pytest.fixture
def city(tmp_path):
    path = tmp_path / "city.sumocfg"
    path.write_text(CONFIGURATION)
    return path


@pytest.mark.parametrize(
    ("name", "words", "said"),
    [
        ("scene.yaml", ["--keep", "kept"], "--keep: only goes with a .sumocfg"),
        ("scene.yaml", ["--delay", "0"], "--delay: only goes with a .sumocfg"),
        ("scene.yaml", ["--seed", "1"], "--seed: only goes with a .sumocfg"),
        ("city.sumocfg", ["--to", "9"], "--to: a running simulation ends where its .sumocfg says"),
        ("city.sumocfg", ["--delay", "17"], "--delay: must lie in 0..16 s, not 17"),
        ("city.sumocfg", ["--delay", "nan"], "--delay: must lie in 0..16 s, not nan"),
    ],
)
def test_options_that_do_not_go_together_are_named(tmp_path, capsys, name, words, said):
    assert main(["view", str(tmp_path / name), *words]) == 2
    assert said in capsys.readouterr().err


def test_without_sumo_one_sentence_names_the_extra(city, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "sumo", None)
    monkeypatch.delenv("SUMO_HOME", raising=False)
    monkeypatch.setenv("PATH", "")
    assert main(["view", str(city), "--keep", str(city.parent / "kept")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and 'pip install ".[sumo]"' in said
    assert not (city.parent / "kept").exists()


def test_a_port_that_is_taken_is_said_before_anything_is_read(tmp_path, capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert main(["view", str(tmp_path / "missing.yaml"), "--port", port]) == 2
    said = f"sumo3dviz-pt: --port: port {port} is in use; choose another, or leave it out\n"
    assert capsys.readouterr().err == said
    assert main(["view", str(tmp_path / "missing.yaml"), "--port", "70000"]) == 2
    assert "--port: must lie in 0..65535" in capsys.readouterr().err
