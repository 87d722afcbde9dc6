"""protocol/generate.py: what is committed is current, and a bad frames.toml costs one line."""

import json
import subprocess
import sys
import tomllib
import zlib
from pathlib import Path

import pytest

from tests.protocol.log_writer import ROOT, layouts, schema_text

FRAMES = (ROOT / "protocol/frames.toml").read_text()
COMPILERS = (("g++",), ("avr-g++", "-mmcu=atmega2560"))
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Wundef")

# What is changed in frames.toml, and what the one line must name.
BAD = {
    "unknown type": ('name = "imu_seq", type = "u8"', 'name = "imu_seq", type = "u7"', "'u7'"),
    "id twice": ("id = 2\n", "id = 1\n", "frame id 1 stands twice"),
    "id zero": ("id = 2\n", "id = 0\n", "frame mag: id is 0"),
    "name twice": ('name = "mag"', 'name = "ident"', "'ident' stands twice"),
    "field twice": ('name = "my"', 'name = "mx"', "frame mag: field 'mx' stands twice"),
    "missing unit": ('"p", type = "i16", unit = "rad/s",', '"p", type = "i16",', "but no unit"),
    "unknown unit": ('unit = "rad/s"', 'unit = "rad/h"', "'rad/h'"),
    "unit against name": ('name = "hold_ms", type = "u16", unit = "ms"',
                          'name = "hold_ms", type = "u16", unit = "us"', "'ms'"),
    "unknown axis": ('axis = "x"', 'axis = "w"', "'w'"),
    "valid bit out of range": ("valid = 12", "valid = 16", "valid bit 16"),
    "age field missing": ('age = "imu_age"', 'age = "imu_ago"', "'imu_ago'"),
    "age field in counts": ('name = "imu_age", type = "u16", unit = "us", scale = 4,',
                            'name = "imu_age", type = "u16", unit = "count",', "not in us"),
    "invalid beyond the type": ("invalid = -4096", "invalid = -40960", "-40960"),
    "scale zero": ("scale = 0.25", "scale = 0", "scale is 0"),
    "ident too long": ('"rc_switch", type = "u16"', '"rc_switch", type = "u32"', "70 bytes"),
    "no time first": ('name = "t_us", type = "u32", unit = "us", doc = "Mega clock in',
                      'name = "t_at", type = "u32", unit = "us", doc = "Mega clock in', "t_us"),
    "unknown table": ('enum = "gps_fix"', 'enum = "gps_fox"', "'gps_fox'"),
    "unknown key": ('"fix", type = "u8"', '"fix", type = "u8", colour = 1', "'colour'"),
    "rate of no field": ('rate_hz = "config.rate_hz"', 'rate_hz = "config.rate"', "config.rate"),
    "enum number twice": ("bmp085 = 1", "bmp085 = 2", "two names have one number"),
    "layout twice": ('name = "card_row"', 'name = "card_head"', "layout name 'card_head' stands"),
    "layout with an id": ('name = "card_row"', 'id = 1\nname = "card_row"', "layout card_row: key"),
    "number too large": ("card_longest_ms = 20000", "card_longest_ms = 70000", "numbers.card_"),
    "not TOML": ("[bits]", "[bits", "is not TOML"),
}  # fmt: skip


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "protocol/generate.py"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_committed_files_are_current() -> None:
    done = run("--check")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_generating_twice_changes_nothing(tmp_path: Path) -> None:
    assert run("--out", str(tmp_path / "generated")).returncode == 0
    for path in (tmp_path / "generated").iterdir():
        assert path.read_bytes() == (ROOT / "protocol/generated" / path.name).read_bytes()
        assert "protocol/generate.py" in path.read_text().splitlines()[0]


@pytest.mark.parametrize(
    "name", ["frames.h", "schema_blob.h", "FRAMES.md", "schema.json", "packets.json", "cases.h"]
)
def test_check_names_the_file_that_differs(tmp_path: Path, name: str) -> None:
    run("--out", str(tmp_path))
    path = tmp_path / name
    lines = path.read_text().split("\n")
    lines[1] += " "
    path.write_text("\n".join(lines))
    done = run("--check", "--out", str(tmp_path))
    assert done.returncode == 1
    assert done.stderr == f"{name} differs in line 2; run: python protocol/generate.py\n"
    path.unlink()
    assert run("--check", "--out", str(tmp_path)).stderr.startswith(f"{name} is missing; run:")


def test_check_refuses_a_file_it_does_not_make(tmp_path: Path) -> None:
    run("--out", str(tmp_path))
    (tmp_path / "old_frames.h").write_text("")
    done = run("--check", "--out", str(tmp_path))
    assert (done.returncode, done.stderr.split(" ")[0]) == (1, "old_frames.h")


@pytest.mark.parametrize("what", BAD)
def test_bad_schema_costs_one_line(tmp_path: Path, what: str) -> None:
    old, new, named = BAD[what]
    text = FRAMES.replace(old, new, 1)
    assert text != FRAMES
    bad = tmp_path / "frames.toml"
    bad.write_text(text)
    done = run("--frames", str(bad), "--out", str(tmp_path / "generated"))
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("frames.toml")
    assert named in done.stderr
    assert not (tmp_path / "generated").exists()


@pytest.mark.parametrize("compiler", COMPILERS, ids=lambda compiler: compiler[0])
@pytest.mark.parametrize("header", ["frames.h", "schema_blob.h", "cases.h"])
def test_header_compiles_alone_without_warning(
    tmp_path: Path, compiler: tuple[str, ...], header: str
) -> None:
    source = tmp_path / "alone.cpp"
    source.write_text(f'#include "{header}"\n')
    generated = str(ROOT / "protocol/generated")
    command = [*compiler, "-std=c++14", *WARNINGS, "-Wpedantic", "-Werror", "-I", generated]
    done = subprocess.run(
        [*command, "-c", str(source), "-o", str(tmp_path / "alone.o")],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")


def test_header_refuses_a_layout_that_is_not_packed(tmp_path: Path) -> None:
    # The asserts must be able to fail: the same header without `packed`.
    text = (ROOT / "protocol/generated/frames.h").read_text()
    source = tmp_path / "loose.cpp"
    source.write_text(text.replace("__attribute__((packed)) ", "").replace("#pragma once", ""))
    done = subprocess.run(
        ["g++", "-std=c++14", "-fsyntax-only", str(source)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode != 0
    assert "size of IdentFrame" in done.stderr


def test_schema_text_says_what_frames_toml_says() -> None:
    truth = tomllib.loads(FRAMES)
    text = json.loads(schema_text())
    assert schema_text().isascii() and b"\n" not in schema_text()
    assert (text["format"], text["version"]) == ("flight-test-log", truth["version"])
    assert text["columns"] == [
        "name", "type", "unit", "scale", "axis", "invalid", "valid", "age", "delay_us", "table"
    ]  # fmt: skip
    defaults = {"unit": "", "scale": 1, "axis": "", "invalid": None, "valid": None, "age": None}
    assert [(f["id"], f["name"], f["rate_hz"]) for f in text["frames"]] == [
        (f["id"], f["name"], f["rate_hz"]) for f in truth["frame"]
    ]
    for frame, expected in zip(text["frames"], truth["frame"], strict=True):
        for row, field in zip(frame["fields"], expected["field"], strict=True):
            said = dict(zip(text["columns"], row, strict=False))
            wanted = {key: field.get(key, default) for key, default in defaults.items()}
            wanted |= {"name": field["name"], "type": field["type"]}
            wanted["delay_us"] = field.get("delay_us")
            wanted["table"] = field.get("enum", field.get("bits"))
            for key, value in wanted.items():
                assert said.get(key, defaults.get(key)) == value, (frame["name"], row, key)
            default_of_last = defaults.get(text["columns"][len(row) - 1])
            assert len(row) == 2 or row[-1] != default_of_last, "row not cut"
    assert text["bits"] == truth["bits"]
    assert text["enum"] == truth["enum"]


def test_parts_of_the_flight_card_are_whole() -> None:
    data = json.loads((ROOT / "protocol/generated/packets.json").read_text())
    part = data["numbers"]["card_part_bytes"]
    sizes = {name: _bytes(layout["fields"]) for name, layout in data["layouts"].items()}
    single = ("card_learning", "card_row", "card_axis", "card_worth", "card_hold")
    assert sizes == {"card_head": 2 * part} | dict.fromkeys(single, part)
    assert data["layouts"]["card_head"]["fields"][-1][0] == "crc"
    assert len(_always(data["layouts"]["card_head"])) == 3


def _bytes(fields: list[list[object]]) -> int:
    sizes = {"u8": 1, "char": 1, "u16": 2, "i16": 2, "u32": 4, "f32": 4}
    total = 0
    for _, kind, *_ in fields:
        base, _, length = str(kind).rstrip("]").partition("[")
        total += sizes[base] * int(length or 1)
    return total


def _always(layout: dict[str, dict[str, int]]) -> dict[str, int]:
    return layout["always"]


def test_hashes_are_the_crc_of_the_text() -> None:
    crc = zlib.crc32(schema_text())
    for name in ("frames.h", "schema_blob.h", "FRAMES.md"):
        assert f"0x{crc:08X}" in (ROOT / "protocol/generated" / name).read_text()
    blob = (ROOT / "protocol/generated/schema_blob.h").read_text()
    pieces = [line.split('R"(')[1].split(')"')[0] for line in blob.splitlines() if 'R"(' in line]
    assert "".join(pieces).encode() == schema_text()
    assert f"kSchemaSize = {len(schema_text())};" in blob


def test_identification_frame_fits() -> None:
    assert layouts(schema_text())["ident"].itemsize <= 68
