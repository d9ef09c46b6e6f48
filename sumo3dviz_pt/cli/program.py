"""Finds the command, runs it and turns errors into one sentence and an exit code.

`completion` writes a script that lets a shell complete commands, options and names.
"""

from __future__ import annotations

import argparse
import errno
import logging
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli import (
    check,
    export,
    farm,
    installed,
    measure,
    render,
    scene_files,
    study,
    view,
)
from sumo3dviz_pt.cli.options import PROGRAM, Parser, add_verbosity, complain
from sumo3dviz_pt.errors import (
    ConfigError,
    InputError,
    InstallationError,
    Sumo3dvizError,
    cut,
    interrupted,
)
from sumo3dviz_pt.files.atomic import check_place, check_spared
from sumo3dviz_pt.installation.dependencies import explained, package_of, require_packages


@dataclass(frozen=True, slots=True)
class _Word:
    """An option or an argument.

    Attributes:
        flags: As written; empty for arguments without an option.
        help: What it means.
        takes: What may follow; None means a file, empty nothing.
    """

    flags: tuple[str, ...]
    help: str
    takes: tuple[str, ...] | None


@dataclass(frozen=True, slots=True)
class _Command:
    """A command.

    Attributes:
        about: What it does.
        words: Its options and arguments.
    """

    about: str
    words: tuple[_Word, ...]

    @property
    def offered(self) -> list[str]:
        """What can stand after it."""
        return [each for word in self.words for each in _offered(word)]


_Commands = Mapping[str, _Command]
"""Commands by name."""


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser(
        "completion", help="a script by which your shell completes commands and names"
    )
    sub.add_argument("shell", choices=tuple(_SHELLS), help=", ".join(_SHELLS))
    sub.set_defaults(run=run_completion)


def run_completion(options: argparse.Namespace) -> int:
    """Print the script."""
    print(_SHELLS[options.shell](_commands(options.parser)))
    return 0


def _commands(parser: argparse.ArgumentParser) -> _Commands:
    """Return every command's meaning and words."""
    subs = next(a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    about = {action.dest: action.help or "" for action in subs._choices_actions}
    return {
        name: _Command(about[name], tuple(_word(each, sub.settings) for each in sub._actions))
        for name, sub in subs.choices.items()
    }


def _word(action: argparse.Action, settings: Mapping[str, str]) -> _Word:
    """Return what a shell needs to know of an option; `settings` are a parser's."""
    from sumo3dviz_pt.pipeline.scene_file import names_for

    flags, meaning = tuple(action.option_strings), (action.help or "").replace("%%", "%")
    if action.choices is not None:
        return _Word(flags, meaning, tuple(map(str, action.choices)))
    names = [name for flag in flags if flag in settings for name in names_for(settings[flag])]
    if names:
        return _Word(flags, meaning, tuple(names))
    return _Word(flags, meaning, () if action.nargs == 0 else None)


def _bash(commands: _Commands) -> str:
    """Write the script for bash; zsh understands it, too."""
    cases = []
    for name, command in commands.items():
        flags = " ".join(flag for word in command.words for flag in word.flags)
        arguments = (word for word in command.words if not word.flags)
        words = " ".join(each for word in arguments for each in word.takes or ())
        cases.append(f'    {name}) words="{flags} {words}" ;;')
    values = [
        f'    {"|".join(word.flags)}) words="{" ".join(word.takes or ())}" ;;'
        for word in _taking(commands)
    ]
    return "\n".join(
        [
            f"# bash completion for {PROGRAM}; load it by: source FILE",
            "_sumo3dviz_pt() {",
            '  local here="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD-1]}"',
            '  local words="" command="" word',
            '  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do',
            '    case "$word" in -*) ;; *) command="$word"; break ;; esac',
            "  done",
            '  case "$command" in',
            f'    "") words="{" ".join(commands)} --help --version --verbose --quiet" ;;',
            *cases,
            "  esac",
            '  case "$before" in',
            *values,
            "  esac",
            '  COMPREPLY=($(compgen -W "$words" -- "$here"))',
            "}",
            f"complete -o default -F _sumo3dviz_pt {PROGRAM}",
        ]
    )


def _taking(commands: _Commands) -> Iterator[_Word]:
    """Yield the options with values, each once; those that take files have none to offer."""
    seen = set[tuple[str, ...]]()
    for command in commands.values():
        for word in command.words:
            if word.flags and word.takes != () and word.flags not in seen:
                seen.add(word.flags)
                yield word


def _zsh(commands: _Commands) -> str:
    """Write the script for zsh, through its emulation of bash."""
    load = "autoload -U +X compinit bashcompinit && compinit && bashcompinit"
    return f"# zsh completion for {PROGRAM}; load it by: source FILE\n{load}\n{_bash(commands)}"


def _fish(commands: _Commands) -> str:
    """Write the script for fish."""
    lines = [f"# fish completion for {PROGRAM}; put it into ~/.config/fish/completions"]
    for name, command in commands.items():
        start = f"complete -c {PROGRAM} -n"
        lines.append(f"{start} __fish_use_subcommand -f -a {name} -d {_quoted(command.about)}")
        within = f"{start} '__fish_seen_subcommand_from {name}'"
        lines += [" ".join([within, *_fish_word(word)]) for word in command.words if _offered(word)]
    return "\n".join(lines)


def _fish_word(word: _Word) -> Iterator[str]:
    """Yield the parts of an option's line for fish."""
    for flag in word.flags:
        yield f"-l {flag[2:]}" if flag.startswith("--") else f"-s {flag[1:]}"
    if word.takes:
        yield f"-x -a {_quoted(' '.join(word.takes))}"
    elif word.takes is None and word.flags:
        yield "-r -F"
    yield f"-d {_quoted(word.help)}"


def _powershell(commands: _Commands) -> str:
    """Write the script for PowerShell, also on Windows."""
    table = [
        f"  {_quoted(name)} = @({', '.join(map(_quoted, command.offered))})"
        for name, command in commands.items()
    ]
    values = [
        f"  {_quoted(flag)} = @({', '.join(map(_quoted, word.takes))})"
        for word in _taking(commands)
        if word.takes
        for flag in word.flags
    ]
    return "\n".join(
        [
            f"# PowerShell completion for {PROGRAM}; load it from $PROFILE by: . FILE",
            "$sumo3dvizCommands = @{",
            *table,
            "}",
            "$sumo3dvizValues = @{",
            *values,
            "}",
            f"Register-ArgumentCompleter -Native -CommandName {PROGRAM} -ScriptBlock {{",
            "  param($word, $ast, $cursor)",
            "  $before = @($ast.CommandElements | ForEach-Object { $_.ToString() } |",
            "    Select-Object -Skip 1 | Where-Object { $_ -ne $word })",
            "  $command = $before | Where-Object { $_ -notlike '-*' } | Select-Object -First 1",
            "  $last = $before | Select-Object -Last 1",
            "  if ($last -and $sumo3dvizValues[$last]) { $words = $sumo3dvizValues[$last] }",
            "  elseif ($command) { $words = $sumo3dvizCommands[$command] }",
            "  else { $words = $sumo3dvizCommands.Keys }",
            '  $words | Where-Object { $_ -like "$word*" } | Sort-Object |',
            "    ForEach-Object { [System.Management.Automation.CompletionResult]::new($_) }",
            "}",
        ]
    )


def _offered(word: _Word) -> tuple[str, ...]:
    """Return what can stand where a command's words stand."""
    return word.flags or word.takes or ()


def _quoted(text: str) -> str:
    """Return a word in single quotes, as fish and PowerShell read them."""
    return "'" + text.replace("'", "’") + "'"


_SHELLS = {"bash": _bash, "zsh": _zsh, "fish": _fish, "powershell": _powershell}


_COMMANDS = (
    render.add_demo,
    scene_files.add_record,
    scene_files.add_init,
    scene_files.add_import,
    check.add,
    check.add_vehicles,
    render.add_still,
    render.add,
    study.add,
    farm.add,
    render.add_develop,
    measure.add_converge,
    measure.add_report,
    measure.add_compare,
    check.add_motion,
    view.add_view,
    export.add,
    installed.add_assets,
    installed.add_doctor,
    scene_files.add_schema,
    add,
)
"""In the order in which `--help` lists them."""


def run(arguments: Sequence[str] | None = None) -> int:
    """Run a command; the exit code.

    Raises:
        BrokenPipeError: If nobody reads the output any more.
    """
    with notes_on_stderr(), _escapes():
        return _run(arguments)


@contextmanager
def _escapes() -> Iterator[None]:
    """Print letters that the console lacks as escapes: a code page of Windows has few of them."""
    streams = {
        each: each.errors for each in (sys.stdout, sys.stderr) if hasattr(each, "reconfigure")
    }
    for stream in streams:
        stream.reconfigure(errors="backslashreplace")
    try:
        yield
    finally:
        for stream, errors in streams.items():
            stream.reconfigure(errors=errors)


def _run(arguments: Sequence[str] | None) -> int:
    """Run a command; errors become sentences."""
    try:
        parser = build_parser()
        _check_letters(sys.argv[1:] if arguments is None else arguments)
        options = parser.parse_args(arguments, argparse.Namespace(parser=parser))
        _set_level(options.verbosity)
        options.words = list(sys.argv[1:] if arguments is None else arguments)
        if options.command != "doctor":
            require_packages()
        _check_output(options)
        code: int = options.run(options)
        return code
    except (InputError, ConfigError) as error:
        return complain(_as_typed(error, arguments), 2)
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


def _as_typed(error: Exception, arguments: Sequence[str] | None) -> str:
    """Return an error's sentence; an option that was typed is named as such."""
    words = sys.argv[1:] if arguments is None else arguments
    key = getattr(error, "key", None)
    flags = {word.partition("=")[0] for word in words}
    of_file = getattr(error, "file", None) is not None
    return f"{'' if of_file or f'--{key}' not in flags else '--'}{error}"


def _failed(error: BaseException, hint: str) -> int:
    """Say what failed; the exit code, that of wrong input for a name that no file can have."""
    if isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG:
        return complain(f"{cut(str(error.filename))} is too long for a file's name", 2)
    return complain(str(error) or "there is not enough memory for this", 1, hint)


def _check_letters(words: Sequence[str]) -> None:
    """Refuse words whose letters this Python could not read, which then are no letters."""
    odd = next((word for word in words if any("\ud800" <= char <= "\udfff" for char in word)), None)
    if odd is not None:
        raise ConfigError(
            f"letters of {cut(odd)} cannot be read by this console's encoding; run it again with"
            " PYTHONUTF8=1 before the command, or give the file a name in UTF-8"
        )


def _check_output(options: argparse.Namespace) -> None:
    """Refuse a place that cannot be written to, or what is read by the command itself."""
    output = getattr(options, "output", None)
    if output is None:
        return
    check_place(output)
    values = [value if isinstance(value, list) else [value] for value in vars(options).values()]
    named = [one for some in values for one in some if isinstance(one, Path) and one is not output]
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
