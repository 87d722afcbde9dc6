"""Write the page of every verb's arguments, as its parser has them.

.venv/bin/python .ci/docs/generate_options.py           write host/generated/OPTIONS.md
.venv/bin/python .ci/docs/generate_options.py --check   compare with what is committed
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from host.cli import command_parser, parser_of, verbs

PAGE = Path(__file__).resolve().parents[2] / "host" / "generated" / "OPTIONS.md"
HEAD = """\
<!-- made by .ci/docs/generate_options.py from the parsers of host/src/host/verbs -->
# Every verb's arguments

What `host VERB --help` says, on one page. What verbs are for: [host](../README.md); exit codes:
[there](../README.md#exit-codes).
"""


def rows_of(parser: argparse.ArgumentParser) -> Iterator[tuple[str, str]]:
    """Yield each argument of a verb, as it is typed, and its meaning."""
    for action in parser._actions:
        if action.help is argparse.SUPPRESS or isinstance(action, argparse._HelpAction):
            continue
        choices = "" if action.choices is None else "|".join(map(str, action.choices))
        given = action.metavar or choices or action.dest.upper()
        value = given if isinstance(given, str) else " ".join(given)
        words = ", ".join(action.option_strings) or value
        typed = words if action.nargs == 0 or not action.option_strings else f"{words} {value}"
        meaning = " ".join((action.help or "").split()).replace("%%", "%")
        yield typed, meaning if not choices or choices in typed else f"{meaning} ({choices})"


def section(verb: str, parser: argparse.ArgumentParser) -> str:
    """Return the part of one verb: what it does and a table of its arguments."""
    lines = [f"## host {verb}", "", " ".join((parser.description or "").split()), ""]
    found = [(f"`{typed}`", meaning) for typed, meaning in rows_of(parser)]
    if found:
        lines += ["| argument | meaning |", "| --- | --- |"]
        lines += ["| " + " | ".join(c.replace("|", "\\|") for c in row) + " |" for row in found]
        lines.append("")
    return "\n".join(lines)


def text() -> str:
    """Return the page."""
    names = list(verbs())
    parser, _ = command_parser(names)
    return "\n".join([HEAD, *(section(name, parser_of(parser, name)) for name in names)])


def main(arguments: list[str] | None = None) -> int:
    """Write or compare; 0 ok, 6 the page is not current."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--check", action="store_true", help="compare with what is committed")
    if not parser.parse_args(arguments).check:
        PAGE.parent.mkdir(exist_ok=True)
        PAGE.write_text(text(), encoding="utf-8", newline="\n")
        return 0
    if PAGE.is_file() and PAGE.read_text(encoding="utf-8") == text():
        return 0
    print(
        "host/generated/OPTIONS.md is not current: run .ci/docs/generate_options.py",
        file=sys.stderr,
    )
    return 6


if __name__ == "__main__":
    sys.exit(main())
