"""Finds the command, runs it and turns errors into one sentence and an exit code."""

from __future__ import annotations

import argparse
import errno
import logging
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from sumo3dviz_pt.cli import (
    assets,
    check,
    compare,
    completion,
    converge,
    demo,
    develop,
    doctor,
    farm,
    motion,
    record,
    render,
    report,
    scene_files,
    still,
    study,
    vehicles,
    view,
)
from sumo3dviz_pt.cli.options import PROGRAM, Parser, add_verbosity
from sumo3dviz_pt.cli.progress import complain
from sumo3dviz_pt.errors import (
    ConfigError,
    InputError,
    InstallationError,
    Sumo3dvizError,
    cut,
    interrupted,
)
from sumo3dviz_pt.files.outputs import check_place, check_spared
from sumo3dviz_pt.installation.dependencies import explained, package_of, require_packages

_COMMANDS = (
    demo.add,
    record.add,
    scene_files.add_init,
    scene_files.add_import,
    check.add,
    vehicles.add,
    still.add,
    render.add,
    study.add,
    farm.add,
    develop.add,
    converge.add,
    report.add,
    compare.add,
    motion.add,
    view.add,
    assets.add,
    doctor.add,
    scene_files.add_schema,
    completion.add,
)
"""In the order in which `--help` lists them."""


def run(arguments: Sequence[str] | None = None) -> int:
    """Run a command; the exit code.

    Raises:
        BrokenPipeError: If nobody reads the output any more.
    """
    with notes_on_stderr():
        return _run(arguments)


def _run(arguments: Sequence[str] | None) -> int:
    """Run a command; errors become sentences."""
    try:
        parser = build_parser()
        options = parser.parse_args(arguments, argparse.Namespace(parser=parser))
        _set_level(options.verbosity)
        options.words = list(sys.argv[1:] if arguments is None else arguments)
        if options.command != "doctor":
            require_packages()
        _check_output(options)
        code: int = options.run(options)
        return code
    except (InputError, ConfigError) as error:
        return complain(error, 2)
    except BrokenPipeError:
        raise
    except (Exception, KeyboardInterrupt) as error:
        hint = _hint(locals().get("options"), error)
        if interrupted(error):
            return complain("interrupted", 130, hint)
        if isinstance(error, ImportError):
            return complain(explained(package_of(error.name), error), 1)
        if not isinstance(error, Sumo3dvizError | OSError | MemoryError):
            raise
        return _failed(error, hint)


def _failed(error: BaseException, hint: str) -> int:
    """Say what failed; the exit code, that of wrong input for a name that no file can have."""
    if isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG:
        return complain(f"{cut(str(error.filename))} is too long for a file's name", 2)
    return complain(str(error) or "there is not enough memory for this", 1, hint)


def _check_output(options: argparse.Namespace) -> None:
    """Refuse a place that cannot be written to, or what is read by the command itself."""
    output = getattr(options, "output", None)
    if output is None:
        return
    check_place(output)
    given = [value if isinstance(value, list) else [value] for value in vars(options).values()]
    named = [one for some in given for one in some if isinstance(one, Path) and one is not output]
    check_spared(output, named)


def build_parser() -> argparse.ArgumentParser:
    """Return all commands and their options."""
    from sumo3dviz_pt import __version__

    parser = Parser(
        prog=PROGRAM, description="Path-traced stills and films of SUMO traffic simulations."
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    add_verbosity(parser, 0)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for add in _COMMANDS:
        add(commands)
    for command in commands.choices.values():
        add_verbosity(command, argparse.SUPPRESS)
    return parser


def _hint(options: argparse.Namespace | None, error: BaseException) -> str:
    """Return how to go on after a film broke off."""
    began = not isinstance(error, InstallationError)
    if began and options is not None and getattr(options, "command", "") in ("render", "study"):
        return "; finished frames are kept: the same command with --resume goes on"
    return ""


class _WarningPrinter(logging.Handler):
    """Prints our warnings as plain sentences to the present standard error, each of them once.

    What other packages log, and Python's own warnings, are no sentences for users.
    Records that differ only in what part of a file was read have the same attribute `once`;
    the first of them is printed.
    """

    def __init__(self) -> None:
        super().__init__()
        self._said: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        """Print one."""
        if record.name.partition(".")[0] != _OURS.name:
            return
        text = record.getMessage()
        subject = getattr(record, "once", text)
        if subject not in self._said:
            self._said.add(subject)
            note = "note: " if record.levelno >= logging.WARNING else ""
            line = f"{PROGRAM}: {note}{text}"
            bars = sys.modules.get("tqdm")
            if bars is None:
                print(line, file=sys.stderr)
            else:  # above a bar that is being drawn
                bars.tqdm.write(line, file=sys.stderr)


_ALL, _OURS = logging.getLogger(), logging.getLogger("sumo3dviz_pt")


@contextmanager
def notes_on_stderr() -> Iterator[None]:
    """Show warnings as plain sentences; afterwards the caller's own loggers are as they were."""
    handlers, levels = _ALL.handlers[:], (_ALL.level, _OURS.level)
    _ALL.handlers[:] = [_WarningPrinter()]
    _set_level(0)
    logging.captureWarnings(True)
    try:
        yield
    finally:
        logging.captureWarnings(False)
        _ALL.handlers[:] = handlers
        _ALL.setLevel(levels[0])
        _OURS.setLevel(levels[1])


def _set_level(verbosity: int) -> None:
    """Say more, or nothing but errors; of other packages never more than warnings."""
    _ALL.setLevel(logging.ERROR if verbosity < 0 else logging.WARNING)
    _OURS.setLevel({-1: logging.ERROR, 0: logging.WARNING, 1: logging.INFO}[verbosity])
