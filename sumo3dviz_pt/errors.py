"""Errors that a user can meet, each one clear sentence.

`InputError` is about a file of the simulation, `ConfigError` about a key of
the scene file or a command-line option, `RenderError` about the work itself,
`InstallationError` about what this package stands on. The command line turns the
first two into exit code 2 and the others into 1.
"""

from __future__ import annotations

from pathlib import Path


class Sumo3dvizError(Exception):
    """Base of every error that this package raises on purpose."""


class InputError(Sumo3dvizError):
    """A file of the simulation is missing, damaged or contradicts itself.

    Args:
        message: What is wrong and what to do, without the place.
        file: The file at fault.
        line: Line in it, from 1.
        element: XML element or object at fault, such as `vehicle "a.1"`.
    """

    def __init__(
        self,
        message: str,
        *,
        file: str | Path | None = None,
        line: int | None = None,
        element: str | None = None,
    ) -> None:
        place = "" if file is None else str(file)
        if place and line is not None:
            place += f":{line}"
        super().__init__(_sentence(place, element, message))
        self.file, self.line, self.element = file, line, element


class ConfigError(Sumo3dvizError):
    """A setting is unknown, of the wrong type or out of range.

    Args:
        message: What is wrong and what is allowed.
        key: Dotted key, such as `cameras.driver.vehicle`.
        file: The scene file.
        line: Line in it, from 1.
        column: Column in it, from 1.
    """

    def __init__(
        self,
        message: str,
        *,
        key: str | None = None,
        file: str | Path | None = None,
        line: int | None = None,
        column: int | None = None,
    ) -> None:
        place = ":".join(str(part) for part in (file, line, column) if part is not None)
        super().__init__(_sentence(place, key and cut(key, most=200), message))
        self.key, self.file, self.line, self.column = key, file, line, column


class MissingExtraError(ConfigError):
    """Something that was asked for needs a package that only an extra brings.

    Args:
        need: What is missing, such as `the viewer needs aiohttp`.
        extra: The extra's name.
    """

    def __init__(self, need: str, *, extra: str) -> None:
        # There is no package index to install it from by name.
        super().__init__(
            f'{need}: pip install ".[{extra}]" in a checkout,'
            f' pip install "{_wheel()}[{extra}]" with a wheel'
        )


def _wheel() -> str:
    """Name of this version's wheel."""
    from importlib import metadata

    try:
        return f"sumo3dviz_pt-{metadata.version('sumo3dviz_pt')}-py3-none-any.whl"
    except metadata.PackageNotFoundError:
        return "FILE.whl"


class RenderError(Sumo3dvizError):
    """Rendering failed while at work; finished frames are kept."""


class InstallationError(Sumo3dvizError):
    """A package or a shared library is missing or cannot be loaded; says what mends it."""


def cut(text: str, *, most: int = 60) -> str:
    """Return what messages quote of a text: all of it, or its beginning where it is long."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


def _sentence(place: str, element: str | None, message: str) -> str:
    """Return a message with its place as one line: what cannot be printed stands as an escape."""
    text = ": ".join(part for part in (place, element, message) if part)
    return "".join(char if char.isprintable() else ascii(char)[1:-1] for char in text)


def interrupted(error: BaseException | None) -> bool:
    """Return whether Ctrl-C is behind an error: Dr.Jit hands it on as a RuntimeError."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False
