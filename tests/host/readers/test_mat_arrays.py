"""Our reader of MAT files against scipy's, value for value, and files that mean harm."""

from __future__ import annotations

import struct
import time
import tracemalloc
import warnings
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io.matlab
from host.errors import IdentificationError
from host.readers.foreign_tables import read_foreign
from host.readers.mat_arrays import MatError, Struct, read_arrays
from scipy import io

# Files of MATLAB 4.2 to 8 on SPARC, Linux and Windows, for scipy's own tests.
MADE_BY_MATLAB = Path(scipy.io.matlab.__file__).parent / "tests" / "data"
DAMAGED = {"bad_miuint32", "bad_miutf8_array_name", "corrupted_zlib_checksum", "malformed1",
           "corrupted_zlib_data", "debigged_m4", "testhdf5_7.4_GLNX86"}  # fmt: skip
NO_MATLAB_WRITES = {"nasty_duplicate_fieldnames"}  # scipy renames the second of two fields
HEAD = b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\1IM"


def ours(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield real numbers by name, of structs that stand alone."""
    if isinstance(value, Struct):
        for part, values in value.fields.items():
            if len(values) == 1:
                yield from ours(f"{name}.{part}", values[0])
    elif isinstance(value, np.ndarray) and value.size:
        yield name, value


def theirs(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    array = np.asarray(value)
    if array.dtype.names and array.shape == () and "_TypeSystem" not in array.dtype.names:
        for part in array.dtype.names:
            yield from theirs(f"{name}.{part}", array[part].item())
    elif array.dtype.kind in "fiub" and array.size:
        yield name, array


def same(path: Path) -> int:
    """Compare all real numbers of a file; return how many arrays there are."""
    found = dict(leaf for name, value in read_arrays(path) for leaf in ours(name, value))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        content = io.loadmat(path, squeeze_me=True)
    expected = dict(
        leaf
        for name, value in content.items()
        if not name.startswith("__")
        for leaf in theirs(name, value)
    )
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values)
    return len(found)


def test_files_of_every_matlab_are_read_as_scipy_reads_them() -> None:
    paths = [p for p in sorted(MADE_BY_MATLAB.glob("*.mat")) if p.stem not in NO_MATLAB_WRITES]
    whole = [path for path in paths if path.stem not in DAMAGED]
    assert len(whole) > 90
    assert sum(map(same, whole)) > 40


def test_damaged_files_of_scipys_tests_are_refused() -> None:
    for name in DAMAGED - {"bad_miutf8_array_name"}:  # a name that is UTF-8 indeed
        with pytest.raises(IdentificationError, match=r"not a MAT file|version 7\.3"):
            read_foreign(MADE_BY_MATLAB / f"{name}.mat")


@pytest.mark.parametrize("packed", [False, True])
def test_any_numbers_in_any_structs_are_what_scipy_reads(packed: bool, tmp_path: Path) -> None:
    rng = np.random.default_rng(46)
    kinds = ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8", "?"]

    def value(depth: int) -> Any:
        what = int(rng.integers(0, 8))
        if what < 2 and depth < 3:
            return {f"f{k}": value(depth + 1) for k in range(rng.integers(1, 4))}
        if what == 2:
            return ["text", np.array([[1, "a"]], dtype=object), 1 + 2j][int(rng.integers(3))]
        shape = rng.integers(0, 5, int(rng.integers(1, 4)))
        return rng.normal(0.0, 50.0, shape).astype(kinds[int(rng.integers(len(kinds)))])

    count = 0
    for _ in range(60):
        content = {f"v{k}": value(0) for k in range(4)}
        io.savemat(tmp_path / "x.mat", content, do_compression=packed)
        count += same(tmp_path / "x.mat")
    assert count > 150
    plain = {"a": rng.normal(size=(3, 2)), "b": np.arange(5, dtype="i2"), "c": 1j, "d": "text"}
    io.savemat(tmp_path / "old.mat", plain, format="4")
    assert same(tmp_path / "old.mat") == 2


def element(kind: int, data: bytes) -> bytes:
    return struct.pack("<2I", kind, len(data)) + data + bytes(-len(data) % 8)


def array(kind: int, shape: tuple[int, ...], name: bytes, rest: bytes) -> bytes:
    head = element(6, struct.pack("<2I", kind, 0)) + element(
        5, struct.pack(f"<{len(shape)}i", *shape)
    )
    return element(14, head + element(1, name) + rest)


def packed(data: bytes) -> bytes:
    body = zlib.compress(data, 9)
    return HEAD + struct.pack("<2I", 15, len(body)) + body


def nested(deep: int) -> bytes:
    inner = array(6, (1, 1), b"", element(9, bytes(8)))
    for _ in range(deep):
        inner = array(1, (1, 1), b"a", inner)
    return HEAD + inner


FIELD = element(5, struct.pack("<i", 8)) + element(1, b"field\0\0\0")
HOSTILE: dict[str, tuple[Callable[[], bytes], str]] = {
    "zeros": (
        lambda: packed(struct.pack("<2I", 14, 400_000_000) + bytes(400_000_000)),
        "compressed parts expand",
    ),
    "deep": (lambda: nested(200), "more than 32 deep"),
    "many": (
        lambda: packed(array(2, (1, 3_000_000), b"s", FIELD + element(14, b"") * 3_000_000)),
        "more than 100000 arrays",
    ),
    "none": (lambda: HEAD + array(2, (2**31 - 1,) * 4, b"s", FIELD), "ends within"),
    "no fields": (
        lambda: HEAD + array(2, (2**31 - 1,) * 4, b"s", FIELD[:16] + element(1, b"")),
        "",
    ),
    "larger": (lambda: HEAD + array(6, (2**31 - 1,) * 9, b"a", element(9, bytes(8))), "8 bytes of"),
    "bytes": (
        lambda: packed(array(9, (60_000_000, 1), b"a", element(2, bytes(60_000_000)))),
        "become columns",
    ),
    "old": (lambda: bytes(20) * 200_000, "more than 100000 arrays"),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_cost_what_is_promised(name: str, tmp_path: Path) -> None:
    make, says = HOSTILE[name]
    path = tmp_path / "x.mat"
    path.write_bytes(make())
    tracemalloc.start()
    began_s = time.process_time()
    if says:
        with pytest.raises(IdentificationError, match=says):
            read_foreign(path)
    else:
        assert not read_foreign(path).columns
    took_s = time.process_time() - began_s
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert took_s < 8.0  # tracing takes most of it
    assert peak < 300e6 + 8 * path.stat().st_size


def test_a_byte_order_that_is_none_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.mat").write_bytes(HEAD[:126] + b"XX")
    with pytest.raises(MatError, match="byte order"):
        list(read_arrays(tmp_path / "x.mat"))
