"""What surrounds films on a study's page: texts in languages, forms, keys, endpoints, jsPsych."""

import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.study import StudySettings
from sumo3dviz_pt.studies.file import session_of, texts_of, words_of

FRENCH = """\
fr:
  page: {%s}
  question: {text: Sûr ?, choice: Lequel ?, low: non, high: oui, none: Aucun}
  forms:
    age: {items: [{text: Quel âge ?}]}
en:
  page: {start: Go}
"""


def settings(folder, **more):
    content = {"scene": "a.yaml", "factors": {"a": {"levels": {"x": {}, "y": {}}}}, **more}
    return StudySettings.model_validate(content, context={"folder": folder})


def french(folder, *, lacks=""):
    keys = [key for key in texts_of(settings(folder)).page if key != lacks]
    file = folder / "texts.yaml"
    file.write_text(FRENCH % ", ".join(f"{key}: mot" for key in keys), "utf-8")
    return {"question": {"language": "fr"}, "session": {"texts": "texts.yaml", "after": ["age"]}}


def test_texts_are_of_the_studys_language_unless_the_study_says_them(tmp_path):
    german = settings(tmp_path, question={"language": "de", "low": "null"})
    assert words_of(german).question == "Wie sicher würden Sie sich hier fühlen?"
    assert words_of(german).low == "null" and words_of(german).none == "Nichts davon"
    assert session_of(german, tmp_path).texts["next"] == "Weiter"


def test_a_file_adds_a_language_forms_and_single_texts(tmp_path):
    own = settings(tmp_path, **french(tmp_path))
    assert session_of(own, tmp_path).texts["end"] == "mot" and words_of(own).low == "non"
    (form,) = session_of(own, tmp_path).after
    assert (form.name, form.items, form.answers) == ("age", [{"text": "Quel âge ?"}], ())
    english = settings(tmp_path, session={"texts": "texts.yaml", "after": ["presence"]})
    assert session_of(english, tmp_path).texts["start"] == "Go"
    assert len(session_of(english, tmp_path).after[0].items) == 3


def test_scales_say_their_source(tmp_path):
    for language in ("en", "de"):
        forms = texts_of(settings(tmp_path, question={"language": language})).forms
        assert all("doi:10." in forms[name].source for name in ("presence", "sickness", "symptoms"))
        assert [len(forms[n].items) for n in ("presence", "sickness", "symptoms")] == [3, 1, 9]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"question": {"language": "fr"}}, "no texts in 'fr', only in en and de"),
        ({"session": {"after": "presense"}}, "did you mean 'presence'"),
        ({"session": {"texts": "none.yaml"}}, "there is no file"),
        ({"tools": {"offline": True}}, "npm install jspsych@8.3.0"),
        ({"tools": {"offline": True, "jspsych": "node_modules/"}}, "not in node_modules/"),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence(tmp_path, more, words):
    with pytest.raises(ConfigError) as found:
        session_of(settings(tmp_path, **more), tmp_path)
    assert words in str(found.value) and "\n" not in str(found.value)


def test_files_of_texts_that_lack_or_spoil_something_are_refused(tmp_path):
    asked = french(tmp_path, lacks="retry")
    with pytest.raises(ConfigError, match=r"lacks texts in 'fr': page: retry"):
        session_of(settings(tmp_path, **asked), tmp_path)
    (tmp_path / "texts.yaml").write_text("fr: {forms: {age: {items: [{txt: x}]}}}", "utf-8")
    with pytest.raises(ConfigError, match=r"texts\.yaml:1:.*txt"):
        session_of(settings(tmp_path, **asked), tmp_path)
    own = {"texts": "texts.yaml", "after": ["film"]}
    (tmp_path / "texts.yaml").write_text("en: {forms: {film: {items: [{text: x}]}}}", "utf-8")
    with pytest.raises(ConfigError, match="no form can be called 'film'"):
        session_of(settings(tmp_path, session=own), tmp_path)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("question", {"during": {}}, "keys, or a button"),
        ("question", {"during": {"keys": ["shift"]}}, "a key is a character"),
        ("tools", {"endpoint": {}}, "url"),
        ("tools", {"endpoint": {"kind": "datapipe"}}, "experiment"),
    ],
)
def test_halves_are_refused(tmp_path, key, value, words):
    with pytest.raises(ValueError, match=words):
        settings(tmp_path, **{key: value})


def test_services_have_addresses_of_their_own(tmp_path):
    asked = {"endpoint": {"kind": "datapipe", "experiment": "AbC1"}}
    endpoint = session_of(settings(tmp_path, tools=asked), tmp_path).endpoint
    assert endpoint == {
        "kind": "datapipe",
        "url": "https://pipe.jspsych.org/api/data/",
        "experiment": "AbC1",
    }
