"""Surfaces, skies and vehicles, made again by their tool."""

import sys

import bake
import pytest
from alike import assert_assets_alike, assert_files_alike

from sumo3dviz_pt import catalog


def called(monkeypatch, *words):
    monkeypatch.setattr(sys, "argv", ["bake.py", *map(str, words)])
    return bake.main()


def test_the_tool_makes_what_it_is_told(tmp_path, monkeypatch, capsys):
    assert called(monkeypatch, "surfaces/ground_chess", "-o", tmp_path) == 0
    assert capsys.readouterr().out == "1 of 1: surfaces/ground_chess\n"
    assert_assets_alike(
        tmp_path / "surfaces" / "ground_chess", catalog.find("surfaces", "ground_chess").folder
    )


def test_waves_made_again_are_those_that_travel(tmp_path, monkeypatch):
    assert called(monkeypatch, "areas", "-o", tmp_path) == 0
    assert_assets_alike(
        tmp_path / "areas" / "land_cover", catalog.find("areas", "land_cover").folder
    )


def test_a_vehicle_made_again_is_the_one_that_travels(tmp_path, monkeypatch):
    assert called(monkeypatch, "vehicles/e_scooter", "-o", tmp_path) == 0
    assert_assets_alike(
        tmp_path / "vehicles" / "e_scooter", catalog.find("vehicles", "e_scooter").folder
    )


def test_what_others_vary_is_there_too(tmp_path, monkeypatch):
    """An asset with a base is built from both recipes, in a folder of copies too."""
    assert called(monkeypatch, "vehicles/e_scooter_office", "-o", tmp_path) == 0
    made = tmp_path / "vehicles"
    assert {path.name for path in (made / "e_scooter").iterdir()} == {"asset.yaml"}
    own = catalog.find("vehicles", "e_scooter_office").folder
    assert_files_alike(made / "e_scooter_office", own)


@pytest.mark.parametrize("word", ["people", "plants/broom"])
def test_what_has_no_files_is_refused(word, monkeypatch, capsys):
    """People and plants are built when they are needed."""
    assert called(monkeypatch, word) == 2
    assert "have no files to be made, only surfaces, skies, areas, vehicles" in (
        capsys.readouterr().err
    )


def test_an_unknown_name_is_one_sentence(monkeypatch, capsys):
    assert called(monkeypatch, "surfaces/asfalt") == 2
    assert "did you mean 'asphalt'" in capsys.readouterr().err


@pytest.mark.slow
def test_clouds_made_again_are_those_that_travel(tmp_path, monkeypatch):
    assert called(monkeypatch, "skies/sky_veil", "-o", tmp_path) == 0
    assert_assets_alike(tmp_path / "skies" / "sky_veil", catalog.find("skies", "sky_veil").folder)
