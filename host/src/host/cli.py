"""The command line: which verb, and what its end means; no work here and no heavy imports."""

from __future__ import annotations

import _thread
import argparse
import contextlib
import importlib
import json
import os
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import FrameType, ModuleType
from typing import TextIO

from host.errors import ExitCode, HostError, UsageError
from host.files.regular import file_or_folder
from host.near_names import like
from host.placed_arguments import READS, PlacedParser
from host.progress import watched
from host.terminal import cleaned_streams

# name -> one line of help. A verb is listed when its module is in the tree.
VERBS = {
    "ports": "list the serial ports with a logger plugged in",
    "status": "show what the logger says of itself, live over USB",
    "simulate": "fly a virtual test and write the log it would leave",
    "calibrate": "measure zero and slope of every sensor on the bench",
    "aircraft": "write the file of your aircraft, or check one",
    "card": "write, read, check or erase the logger's flight card over USB",
    "plan": "judge planned maneuvers before they are flown",
    "preflight": "walk round the aircraft: each check turns green by itself",
    "live": "receive the radio in flight: on disk, and on a page",
    "decode": "turn a log into a table in SI and say how good it is",
    "info": "say what a log is, from its head",
    "maneuvers": "find the test points of a log",
    "identify": "estimate the aircraft's derivatives with their uncertainty",
    "plot": "show a flight on a page, or as pictures for papers",
    "report": "write up what a flight says of the aircraft, in one page to mail",
    "export": "write a flight for other programs",
    "fleet": "say what a type of aircraft is, from all flights of its fleet",
    "predict": "run a saved model over another record",
    "tune": "find gains for an autopilot that keep their margins",
    "convert": "turn derivatives into coefficients, and back",
    "doctor": "say what is installed, plugged in, set and kept",
    "completion": "print the script that completes these words in your shell",
}
# They draw themselves, ask, or are read by a shell.
_OWN_DISPLAY = ("live", "preflight", "status", "completion", "calibrate", "aircraft")
_LONGEST_LINE = 2000  # characters
_AGAIN_S = 0.02  # until Ctrl-C comes again where Python dropped it
_EPILOG = """\
exit codes: 0 ok, 1 internal error, 2 usage, 3 decoded with losses, 4 not a log,
5 device missing or silent, 6 a check failed, 130 interrupted

host VERB --help says more. Results go to stdout, progress and warnings to stderr.
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb and return its exit code.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments without the program's name; those of the process without it.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    with cleaned_streams():
        return _ended(arguments)


def _ended(arguments: list[str]) -> int:
    """Run one verb to its end, whatever that is."""
    seen: list[int] = []
    try:
        with _interrupts_noted(seen):
            try:
                return _run(arguments)
            finally:
                sys.stdout.flush()  # here a reader that left, or a full disk, can still be reported
    except KeyboardInterrupt:
        return _interrupted()
    except Exception as error:
        # Compiled extensions hand Ctrl-C on as an error of their own.
        return _interrupted() if seen else _failed(arguments, error)


@contextlib.contextmanager
def _interrupts_noted(seen: list[int]) -> Iterator[None]:
    """Append to `seen` whenever Ctrl-C comes, and let it do what it does."""

    def note(number: int, frame: FrameType | None) -> None:
        seen.append(number)
        signal.default_int_handler(number, frame)

    def unraisable(what: sys.UnraisableHookArgs) -> None:
        # Where Python cannot raise it (a callback of its import locks) Ctrl-C would be lost.
        if what.exc_type is KeyboardInterrupt:
            threading.Timer(_AGAIN_S, _thread.interrupt_main).start()
        else:
            previous_hook(what)

    before, previous_hook = signal.getsignal(signal.SIGINT), sys.unraisablehook
    ours = threading.current_thread() is threading.main_thread() and callable(before)
    if ours:
        sys.unraisablehook = unraisable
        signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        if ours:
            signal.signal(signal.SIGINT, before)
            sys.unraisablehook = previous_hook


def _interrupted() -> int:
    # A terminal has shown ^C at the beginning of the line.
    print("\nhost: interrupted" if sys.stderr.isatty() else "host: interrupted", file=sys.stderr)
    return int(ExitCode.INTERRUPTED)


def _line_of(error: HostError) -> str:
    """Return an error's line; a file that was made of a gzip has the gzip's name in it."""
    packed = sys.modules.get("host.readers.gzip_file")  # not loaded: nothing was made
    return str(error) if packed is None else str(packed.as_given(str(error)))


def _failed(arguments: list[str], error: Exception) -> int:
    """Say in one line what went wrong; return the exit code."""
    if isinstance(error, HostError):
        return _end(arguments, _line_of(error), error.exit_code)
    if isinstance(error, BrokenPipeError):
        # The reader (`head`, a pager) left: nothing more to say, and nothing to flush at exit.
        _nothing_more(sys.stdout)
        return int(ExitCode.OK)
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        return _end(arguments, f"{where}{error.strerror or error}", ExitCode.USAGE)
    if isinstance(error, MemoryError):
        text = "out of memory; try --to parquet, which works in pieces"
        return _end(arguments, text, ExitCode.INTERNAL)
    if os.environ.get("HOST_TRACEBACK"):
        raise error
    text = (
        f"internal error: {type(error).__name__}: {error}"
        " (HOST_TRACEBACK=1 shows where; please report it)"
    )
    return _end(arguments, text, ExitCode.INTERNAL)


def _nothing_more(stream: TextIO) -> None:
    """Let what is still to be written to a stream go nowhere."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _end(arguments: list[str], text: str, code: ExitCode) -> int:
    """Say in one line why a verb gave up, to a program in JSON too; return the exit code."""
    line = " ".join(text.splitlines())
    if len(line) > _LONGEST_LINE:  # it repeats a stranger's text
        line = f"{line[:_LONGEST_LINE]}..."
    try:
        print(f"host: {line}", file=sys.stderr)
    except OSError:  # nobody reads it
        _nothing_more(sys.stderr)
    try:
        if "--json" in arguments and "-" not in arguments:  # there stdout carries the table
            print(json.dumps({"error": line, "exit_code": int(code)}))
        sys.stdout.flush()
    except OSError:  # stdout itself may be what failed
        _nothing_more(sys.stdout)
    return int(code)


def verbs() -> dict[str, str]:
    """Return the verbs whose module is in the tree, with their line of help."""
    folder = Path(__file__).parent / "verbs"
    return {name: text for name, text in VERBS.items() if (folder / f"{name}.py").is_file()}


def _run(arguments: list[str]) -> int:
    known = verbs()
    chosen = next((one for one in arguments if not one.startswith("-")), None)
    if chosen is not None and chosen not in known:
        raise UsageError(f"no verb '{chosen}'{like(chosen, known)}; host --help lists them")
    parser, modules = command_parser([chosen] if chosen is not None else [])
    parsed, strange = parser.parse_known_args(arguments)
    if strange:
        raise UsageError(_strange(strange[0], parser, chosen))
    if parsed.version:
        from host import __version__

        print(f"host {__version__}")
        return int(ExitCode.OK)
    if not modules:
        parser.print_help()
        return int(ExitCode.USAGE)
    _look_for_files(parsed)
    with watched(chosen or "", shown=chosen not in _OWN_DISPLAY):
        return int(modules[0].run(parsed))


def _look_for_files(parsed: argparse.Namespace) -> None:
    """Refuse a file that is not there before a verb loads what it works with.

    What has no ending may be the name of something shipped: the verb knows.
    """
    named = getattr(parsed, "source", None) if getattr(parsed, READS, False) else None
    for path in named if isinstance(named, list) else [named]:
        if isinstance(path, Path) and path.suffix:
            file_or_folder(path)


def command_parser(loaded: Sequence[str]) -> tuple[argparse.ArgumentParser, list[ModuleType]]:
    """Return the parser of the command line, and the modules of the verbs that are loaded.

    Parameters
    ----------
    loaded : sequence of str
        Verbs whose arguments it knows; of the others it knows the name.
    """
    parser = argparse.ArgumentParser(
        prog="host",
        description="Flight-test logs of RC aircraft: decode, look, simulate, identify.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="store_true", help="print the version and stop")
    subparsers = parser.add_subparsers(
        dest="verb", metavar="VERB", title="verbs", parser_class=PlacedParser
    )
    modules = []
    for name, text in verbs().items():
        if name in loaded:
            modules.append(importlib.import_module(f"host.verbs.{name}"))
            modules[-1].add_parser(subparsers)
        else:
            subparsers.add_parser(name, help=text)
    return parser, modules


def parser_of(parser: argparse.ArgumentParser, verb: str) -> argparse.ArgumentParser:
    """Return the parser of a verb."""
    (verbs_of,) = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    found: argparse.ArgumentParser = verbs_of.choices[verb]
    return found


def _strange(word: str, parser: argparse.ArgumentParser, verb: str | None) -> str:
    """Return the error line of an unknown argument."""
    own = parser_of(parser, verb) if verb is not None else parser
    options = [name for action in own._actions for name in action.option_strings]
    name = word.partition("=")[0]
    meant = like(name, options) if word.startswith("-") else ""
    return f"unrecognized argument {word}{meant}; {own.prog} --help lists them"
