"""Folders that nobody but the user can have written to."""

import os

import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.files.atomic import own_folder

pytestmark = pytest.mark.skipif(os.name == "nt", reason="temporary folders are one's own there")


def test_a_new_folder_is_ours_alone(tmp_path):
    before = os.umask(0)
    try:
        folder = own_folder(tmp_path / "a" / "b")
    finally:
        os.umask(before)
    assert folder.stat().st_mode & 0o777 == 0o700
    assert own_folder(folder) == folder


def test_one_that_others_only_read_becomes_ours_alone(tmp_path):
    folder = tmp_path / "kernels"
    folder.mkdir(mode=0o755)
    assert own_folder(folder).stat().st_mode & 0o777 == 0o700


def test_links_and_folders_that_others_may_fill_are_refused(tmp_path, monkeypatch):
    folder, link = tmp_path / "open", tmp_path / "link"
    folder.mkdir()
    folder.chmod(0o777)
    link.symlink_to(tmp_path)
    with pytest.raises(ConfigError, match="others may write"):
        own_folder(folder)
    with pytest.raises(ConfigError, match="link"):
        own_folder(link)
    monkeypatch.setattr(os, "getuid", lambda: 4242)
    with pytest.raises(ConfigError, match="somebody else"):
        own_folder(tmp_path)
