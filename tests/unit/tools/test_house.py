"""The tool that measures the shape of the package."""

from __future__ import annotations

from pathlib import Path

import house

FILES = {
    "__init__.py": '"""A house."""\n',
    "low.py": '"""Low."""\n\nimport os\n\nFAR = 7.5  # a number\n\n\nclass Kind:\n    """One."""\n',
    "high.py": (
        '"""High."""\n\nfrom typing import TYPE_CHECKING\n\nfrom sumo3dviz_pt.low import Kind\n\n'
        "if TYPE_CHECKING:\n    from sumo3dviz_pt import top\n\n\n"
        "def ask() -> Kind:\n    from sumo3dviz_pt.top import Kind as Other\n\n    return Other()\n"
    ),
    "top.py": (
        '"""Top."""\n\nfrom sumo3dviz_pt import high\n\n\nclass Kind:\n    # Why.\n    at = high\n'
    ),
}


def built(folder: Path) -> dict[str, house.Module]:
    for name, text in FILES.items():
        place = folder / house.PACKAGE / name
        place.parent.mkdir(exist_ok=True)
        place.write_text(text, encoding="utf-8")
    return house.read_modules(folder / house.PACKAGE)


def test_a_circle_is_seen_only_with_late_imports(tmp_path: Path) -> None:
    modules = built(tmp_path)
    top = {name: house.imports_of(one, modules, late=False) for name, one in modules.items()}
    late = {name: house.imports_of(one, modules, late=True) for name, one in modules.items()}
    assert top["high"] == {"low"}
    assert house.circles(top) == []
    assert house.circles(late) == [["high", "top"]]
    assert house.longest_chain(top) == ["top", "high", "low"]


def test_lines_names_and_numbers_are_counted(tmp_path: Path) -> None:
    modules = built(tmp_path)
    kinds = house.lines_by_kind(modules["low"])
    assert kinds == {"header": 2, "blank": 4, "code": 2, "docstring": 1}
    assert house.lines_by_kind(modules["top"])["comment"] == 1
    assert house.class_names(modules) == {"Kind": 2}
    assert house.number_literals(modules["low"]) == 1


def test_equal_runs_of_code_are_clones(tmp_path: Path) -> None:
    modules = built(tmp_path)
    assert house.clones(modules) == 0
    same = "".join(f"a{n} = {n} + 5\n" for n in range(9))
    (tmp_path / house.PACKAGE / "one.py").write_text(f'"""One."""\n\n{same}', encoding="utf-8")
    (tmp_path / house.PACKAGE / "two.py").write_text(
        f'"""Two."""\n\nb = 3\n{same}', encoding="utf-8"
    )
    assert house.clones(house.read_modules(tmp_path / house.PACKAGE)) == 1
