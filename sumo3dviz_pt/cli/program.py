"""Finds the command, runs it and turns errors into one sentence and an exit code."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Sequence

from sumo3dviz_pt.cli import (
    assets,
    check,
    compare,
    completion,
    converge,
    demo,
    develop,
    doctor,
    import_sumo3dviz,
    init,
    motion,
    render,
    report,
    schema,
    still,
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
    interrupted,
)
from sumo3dviz_pt.installation.dependencies import explained, package_of, require_packages

_COMMANDS = (
    demo,
    init,
    import_sumo3dviz,
    check,
    vehicles,
    still,
    render,
    develop,
    converge,
    report,
    compare,
    motion,
    view,
    assets,
    doctor,
    schema,
    completion,
)
"""In the order in which `--help` lists them."""


def run(arguments: Sequence[str] | None = None) -> int:
    """Run a command; the exit code.

    Raises:
        BrokenPipeError: If nobody reads the output any more.
    """
    _log_to_stderr()
    try:
        options = build_parser().parse_args(arguments)
        _set_level(options.verbosity)
        options.words = list(sys.argv[1:] if arguments is None else arguments)
        if options.command != "doctor":
            require_packages()
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
        return complain(error, 1, hint)


def build_parser() -> argparse.ArgumentParser:
    """All commands and their options."""
    from sumo3dviz_pt import __version__

    parser = Parser(
        prog=PROGRAM, description="Path-traced stills and films of SUMO traffic simulations."
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    add_verbosity(parser, 0)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for command in _COMMANDS:
        command.add(commands)
        name = command.__name__.rpartition(".")[2].replace("_", "-")
        commands.choices[name].set_defaults(run=command.run)
        add_verbosity(commands.choices[name], argparse.SUPPRESS)
    return parser


def _hint(options: argparse.Namespace | None, error: BaseException) -> str:
    """How to go on after a film broke off."""
    began = not isinstance(error, InstallationError)
    if began and options is not None and getattr(options, "command", "") == "render":
        return "; finished frames are kept: the same command with --resume goes on"
    return ""


class _Notes(logging.Handler):
    """Prints warnings as plain sentences to whatever stderr is then, each of them once."""

    def __init__(self) -> None:
        super().__init__()
        self._said: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        """Print one."""
        text = record.getMessage()
        if text not in self._said:
            self._said.add(text)
            note = "note: " if record.levelno >= logging.WARNING else ""
            print(f"{PROGRAM}: {note}{text}", file=sys.stderr)


def _log_to_stderr() -> None:
    """Show warnings as plain sentences."""
    logging.basicConfig(level=logging.WARNING, handlers=[_Notes()], force=True)


def _set_level(verbosity: int) -> None:
    """Say more, or nothing but errors; of other packages never more than warnings."""
    quiet = verbosity < 0
    logging.getLogger().setLevel(logging.ERROR if quiet else logging.WARNING)
    level = {-1: logging.ERROR, 0: logging.WARNING, 1: logging.INFO}[verbosity]
    logging.getLogger("sumo3dviz_pt").setLevel(level)
