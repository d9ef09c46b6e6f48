"""What a study's folder says of its own files: seals, inputs, choice cards, checksums."""

import json

import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.pipeline.films.encoding import sealed
from sumo3dviz_pt.pipeline.provenance import file_hash
from sumo3dviz_pt.studies.certificate.links import (
    Fault,
    StudyFolder,
    frame_faults,
    listed_faults,
    seal_faults,
)
from sumo3dviz_pt.studies.tools.datasets import write_checksums

CARD, LOG, PAGE = "materials/cards/b1t1.mp4", "inputs/fcd.xml", "index.html"
ACCOUNT, FRAME = "materials/day.json", "materials/day.frames/000002.exr"


@pytest.fixture
def folder(tmp_path):
    """The folder of a study of one film, but for the film."""
    for name in (CARD, LOG, PAGE, FRAME):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(name)
    plain = {"frames": [{}], "delivered": {}, "scene": {}}
    files = {FRAME.removeprefix("materials/"): file_hash(tmp_path / FRAME)}
    inputs = {"fcd.xml": file_hash(tmp_path / LOG), "scene_templates/sky/a.yaml": "12"}
    account = sealed({**plain, "files": files, "inputs": inputs})
    film = {"file": "materials/day.mp4", "account": account["digest"], "sha256": "5"}
    record = sealed({"films": {"day": film}, "pairs": []})
    digests = {
        "study.json": record["digest"],
        "accounts": {"day": account["digest"]},
        "films": {"materials/day.mp4": "5"},
        "inputs": {LOG: file_hash(tmp_path / LOG)},
        "cards": {CARD: file_hash(tmp_path / CARD)},
    }
    certificate = sealed({"digests": digests, "pairs": []})
    for name, content in (
        *((ACCOUNT, account), ("study.json", record), ("certificate.json", certificate)),
    ):
        (tmp_path / name).write_text(json.dumps(content))
    write_checksums(tmp_path, [tmp_path / name for name in (CARD, LOG, PAGE)])
    return tmp_path


def faults(folder):
    study = StudyFolder.read(folder)
    found = [*seal_faults(study), *frame_faults(study)[0]]
    return [*found, *listed_faults(study, found)]


def test_a_folder_as_it_was_written_has_no_faults(folder):
    assert faults(folder) == []
    assert frame_faults(StudyFolder.read(folder))[1] == (1, 1)


@pytest.mark.parametrize(
    ("name", "link", "frame"),
    [
        (CARD, "films", None),
        (LOG, "inputs", None),
        (PAGE, "folder", None),
        (FRAME, "frames", 2),
        (ACCOUNT, "inputs", None),
        ("study.json", "inputs", None),
        ("certificate.json", "inputs", None),
    ],
)
def test_a_file_that_was_edited_is_named_with_its_link(folder, name, link, frame):
    path = folder / name
    path.write_text(path.read_text().replace("a", "b", 1) + " ")
    assert (link, name, frame) in [(each.link, each.file, each.frame) for each in faults(folder)]


def signed_anew(folder, account=None, film=None):
    """Sign an account, or the film's digest, anew in `study.json`, and that in the certificate."""
    record, certificate = (
        json.loads((folder / name).read_text()) for name in ("study.json", "certificate.json")
    )
    if account is not None:
        (folder / ACCOUNT).write_text(json.dumps(sealed(account)))
        record["films"]["day"]["account"] = sealed(account)["digest"]
    record["films"]["day"]["sha256"] = film or "5"
    certificate["digests"]["study.json"] = sealed(record)["digest"]
    for name, content in (("study.json", record), ("certificate.json", certificate)):
        (folder / name).write_text(json.dumps(sealed(content)))


def test_accounts_and_films_that_were_signed_anew_are_not_those_of_the_certificate(folder):
    account = json.loads((folder / ACCOUNT).read_text())
    signed_anew(folder, {**account, "exposure": 1.5})
    assert [(each.link, each.file) for each in faults(folder)] == [("inputs", ACCOUNT)]
    signed_anew(folder, account, film="6")
    assert [(each.link, each.file) for each in faults(folder)] == [("films", "materials/day.mp4")]


def test_a_file_that_is_gone_is_named_and_a_frame_is_not(folder):
    for name in (PAGE, FRAME):
        (folder / name).unlink()
    assert faults(folder) == [Fault("folder", PAGE, "is not there")]
    assert frame_faults(StudyFolder.read(folder))[1] == (0, 1)
    assert str(Fault("frames", FRAME, "is another", 2)) == f"frames: {FRAME}: frame 2: is another"


def test_an_account_that_was_sealed_anew_is_not_that_of_the_record(folder):
    account = json.loads((folder / ACCOUNT).read_text())
    (folder / ACCOUNT).write_text(json.dumps(sealed({**account, "exposure": 1.0})))
    (fault,) = faults(folder)
    assert fault.file == ACCOUNT and "study.json was written with" in fault.what


@pytest.mark.parametrize("text", ["", "[]", '{"films": 3}', '{"films": {"a": {"file": "../a"}}}'])
def test_what_is_no_record_of_films_is_refused(folder, text):
    (folder / "study.json").write_text(text)
    with pytest.raises(InputError, match=r"study\.json"):
        StudyFolder.read(folder)
