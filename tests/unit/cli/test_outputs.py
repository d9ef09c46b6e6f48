"""Where nothing can be written, or what is read would be lost, is refused before any work."""

from pathlib import Path

import pytest
from builders import complaints, write_scenario
from PIL import Image

from sumo3dviz_pt.cli import main

COMMANDS = {
    "still": ["still", "{scene}", "--time", "4", "-o", "{out}.png"],
    "render": ["render", "{scene}", "--from", "4", "--to", "4.2", "-o", "{out}.mp4"],
    "develop": ["develop", "{scene}", "-o", "{out}.png"],
    "motion": ["motion", "{scene}", "--vehicle", "a", "-o", "{out}.png"],
    "init": ["init", "{folder}", "-o", "{out}.yaml"],
    "import": ["import-sumo3dviz", "{scene}", "-o", "{out}.yaml"],
    "record": ["record", "{scene}", "-o", "{out}"],
    "study": ["study", "{scene}", "-o", "{out}"],
    "converge": ["converge", "{scene}", "--time", "4", "-o", "{out}"],
    "report": ["report", "{folder}", "-o", "{out}"],
    "demo": ["demo", "-o", "{out}"],
    "sheet": ["assets", "sheet", "vehicles", "-o", "{out}.png"],
    "farm": ["farm", "{scene}", "--from", "4", "--to", "4.2", "-o", "{out}.mp4"],
    "schema": ["schema", "-o", "{out}.json"],
}
PLACES = {
    "a folder of the system's": "/proc/x",
    "within a file": "{scene}/a",
    "a long name": "{folder}/" + 300 * "a",
}


def run(words, scene: Path, out: str, capsys) -> tuple[int, list[str]]:
    places = {"{out}": out, "{scene}": str(scene), "{folder}": str(scene.parent)}
    filled = list(words)
    for old, new in places.items():
        filled = [word.replace(old, new) for word in filled]
    return main(filled), complaints(capsys.readouterr().err)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="only Linux has such a folder")
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("command", COMMANDS)
def test_places_where_nothing_can_be_made_are_refused(command, place, tmp_path, capsys):
    scene = write_scenario(tmp_path)
    before = sorted(tmp_path.iterdir())
    code, said = run(COMMANDS[command], scene, PLACES[place], capsys)
    assert code == 2 and len(said) == 1, said
    assert "output" in said[0] and ("cannot be" in said[0] or "there is no folder" in said[0])
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("command", "more"),
    [("still", ["--overwrite"]), ("motion", ["--overwrite"]), ("render", ["--overwrite"])],
)
@pytest.mark.parametrize("link", [False, True])
def test_what_the_scene_reads_is_not_replaced(command, more, link, tmp_path, capsys):
    """Whatever allows to replace files; also by another name of the same file."""
    scene = write_scenario(tmp_path)
    suffix = ".mp4" if command == "render" else ".png"
    picture = tmp_path / f"grass{suffix}"
    Image.new("RGB", (8, 8), (40, 90, 30)).save(picture, format="PNG")
    key = "trajectories" if command == "render" else "texture"
    text = scene.read_text("utf-8")
    if key == "texture":
        text += f"ground: {{texture: {picture.name}}}\n"
    else:
        log = tmp_path / "fcd.xml"
        picture.write_bytes(log.read_bytes())
        text = text.replace(log.name, picture.name)
        assert picture.name in text
    scene.write_text(text, encoding="utf-8")
    content, out = picture.read_bytes(), picture
    if link:
        out = tmp_path / f"other{suffix}"
        out.symlink_to(picture)
    code, said = run([*COMMANDS[command], *more], scene, str(out.with_suffix("")), capsys)
    assert code == 2 and len(said) == 1 and "is read for this" in said[0], said
    assert picture.read_bytes() == content


def test_a_command_does_not_replace_its_own_arguments(tmp_path, capsys):
    scene = write_scenario(tmp_path)
    text = scene.read_text("utf-8")
    words = ["import-sumo3dviz", "{scene}", "--force", "-o", "{out}"]
    code, said = run(words, scene, str(scene), capsys)
    assert code == 2 and "is read for this" in said[0]
    assert scene.read_text("utf-8") == text
