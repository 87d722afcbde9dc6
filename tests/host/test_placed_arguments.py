"""Options that belong to the file before them: their order survives argparse."""

import argparse
from pathlib import Path
from typing import Any

import pytest
from host.cli import main
from host.errors import UsageError
from host.placed_arguments import PlacedParser, StorePlaced, of_each, stretches_of_each


def parsed(line: str) -> Any:
    """Return what a verb below another parser gets."""
    parser = argparse.ArgumentParser()
    verb = parser.add_subparsers(parser_class=PlacedParser).add_parser("do")
    verb.add_files("files")
    for side, name in enumerate(("--from", "--to")):
        verb.add_argument(name, dest="ends", type=float, action=StorePlaced, const=side, default=[])
    verb.add_argument("--map", action=StorePlaced, type=Path, default=[])
    verb.add_argument("--json", action="store_true")
    return parser.parse_args(["do", *line.split()])


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("a --from 1 --to 2 --from 6 --to 8 b --from 5 --to 9", [[(1, 2), (6, 8)], [(5, 9)]]),
        ("a b --from 5 --to 9 --json", [[], [(5, 9)]]),
        ("--from=1 a --to 2 b", [[(None, 2)], [(1, None)]]),  # before the first: of those without
        ("--from -3 --json a", [[(-3, None)]]),
        ("a --to 2 --fro 1 --from 3", [[(1, 2), (3, None)]]),
        ("a b", None),
    ],
)
def test_stretches_belong_to_the_file_before_them(line: str, expected: Any) -> None:
    found = parsed(line)
    assert [str(path) for path in found.source] == [w for w in line.split() if w in "ab"]
    assert stretches_of_each(found.ends, len(found.source)) == expected


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("a b --map m", Path("m")),
        ("a --map m b --map n", [Path("m"), Path("n")]),
        ("a b --map m --map n", [Path("m"), Path("n")]),
        ("a b --map m c --map n", [None, Path("m"), Path("n")]),
        ("--map m a b c --map n", [Path("m"), Path("m"), Path("n")]),
        ("a b", None),
    ],
)
def test_one_map_is_of_all_and_several_are_of_their_files(line: str, expected: Any) -> None:
    found = parsed(line)
    assert of_each("--map", found.map, len(found.source)) == expected


def test_two_maps_of_one_file_are_refused() -> None:
    found = parsed("a --map m --map n b c")
    with pytest.raises(UsageError, match="--map stands 2 times for 3 sources: give it once"):
        of_each("--map", found.map, 3)


def test_what_stands_behind_two_dashes_is_a_file() -> None:
    assert parsed("a --json -- --map b").source == [Path("a"), Path("--map"), Path("b")]


def test_an_unknown_option_is_still_unknown(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        parsed("a --mop m")
    assert "unrecognized arguments: --mop" in capsys.readouterr().err


def test_a_second_file_to_write_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """The first was forgotten without a word."""
    assert main(["identify", "x.csv", "--save-model", "a.toml", "--save-model", "b.mat"]) == 2
    assert "given twice, a.toml and b.mat" in capsys.readouterr().err
