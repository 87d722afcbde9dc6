"""Our writers and readers against pyulog and pymavlink, value for value."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import numpy as np
from host.export.dataflash_writer import Records, write_dataflash
from host.readers.dataflash_binary import read_records
from host.readers.dataflash_messages import WANTED
from host.readers.dataflash_text import read_text_records
from host.readers.log_formats import format_of_file
from host.readers.tlog_messages import read_tlog
from host.readers.ulog_binary import SAID, read_content

from tests.host.readers.autopilot_flights import rows_of, write


def test_dataflash_is_what_pymavlink_reads(tmp_path: Path) -> None:
    from pymavlink.DFReader import DFReader_binary

    path = write("dataflash", tmp_path)
    found = read_records(path)
    theirs: dict[str, list[object]] = {}
    with contextlib.redirect_stderr(io.StringIO()):
        reader = DFReader_binary(str(path))
        while (message := reader.recv_msg()) is not None:
            theirs.setdefault(message.get_type(), []).append(message)
        reader.filehandle.close()
    assert not found.lost
    numbers = {kind.name: k for k, kind in found.kinds.items()}
    for name in ("IMU", "ATT", "ARSP", "BARO", "GPS", "RCOU", "VIBE", "MODE"):
        ours = rows_of(found, numbers[name])
        assert len(next(iter(ours.values()))) == len(theirs[name]) > 0
        for column, values in ours.items():
            expected = [getattr(m, column) for m in theirs[name]]
            np.testing.assert_allclose(values, np.array(expected, dtype=float), rtol=1e-12)
    read = {m.Name: m.Value for m in theirs["PARM"]}  # type: ignore[attr-defined]
    names = [n.rstrip(b"\0").decode() for n in rows_of(found, numbers["PARM"])["Name"]]
    assert read == dict(zip(names, rows_of(found, numbers["PARM"])["Value"].tolist(), strict=True))


def test_the_text_form_is_the_binary_one(tmp_path: Path) -> None:
    """As mavlogdump and Mission Planner write it: a line a record."""
    found = read_records(write("dataflash", tmp_path))
    lines = []
    for kind in found.kinds.values():
        lines.append(f"FMT, 0, {kind.length}, {kind.name}, {kind.letters}, "
                     + kind.columns.replace(",", ", "))  # fmt: skip
    numbers = {kind.name: k for k, kind in found.kinds.items()}
    for name in ("IMU", "ATT", "RCOU"):
        rows = rows_of(found, numbers[name])
        for row in zip(*rows.values(), strict=True):
            lines.append(", ".join([name, *(repr(v.item()) for v in row)]))
    path = tmp_path / "flight.log"
    path.write_text("\n".join([*lines, "IMU, 12, 3", "", "no record"]))
    assert format_of_file(path) == "dataflash-text"
    text = read_text_records(path, WANTED)
    assert text.bad_lines == 2
    for name in ("IMU", "ATT", "RCOU"):
        for column, values in rows_of(found, numbers[name]).items():
            np.testing.assert_allclose(text.tables[name][column], values, rtol=1e-9)


def test_ulog_is_what_pyulog_reads(tmp_path: Path) -> None:
    """Our own log and two of PX4: topics, columns, values, parameters, damage."""
    from pyulog import ULog

    folder = Path(__file__).parents[2] / "data" / "px4"
    own = write("ulog", tmp_path)
    for path in (own, *sorted(folder.glob("*.ulg"))):
        theirs = ULog(str(path))
        ours = read_content(path, lambda name: True, lambda name, column: True)
        assert (ours.strange, ours.rest, ours.refused) == (0, 0, {}), path
        assert (ours.dropouts, ours.dropped_ms) == (
            len(theirs.dropouts), sum(one.duration for one in theirs.dropouts),
        )  # fmt: skip
        first = {name: value for name, value, _ in reversed(ours.written)}
        assert first == {k: float(v) for k, v in theirs.initial_parameters.items()}
        later = [(name, value) for name, value, at_us in ours.written if at_us > 0.0]
        assert later == [(name, float(v)) for _, name, v in theirs.changed_parameters]
        assert ours.said == {k: v for k, v in theirs.msg_info_dict.items() if k in SAID}
        found = {(t.name, t.instance): t for t in ours.topics if t.data}
        assert len(found) == len(theirs.data_list) > 5
        for data in theirs.data_list:
            topic = found[data.name, data.multi_id]
            theirs_of = {k: v for k, v in data.data.items() if "_padding" not in k}
            assert set(topic.columns) == set(theirs_of), data.name
            for name, values in theirs_of.items():
                column = topic.column(name)
                np.testing.assert_array_equal(column, values.astype(column.dtype))
    servos = ULog(str(own)).get_dataset("actuator_servos").data
    assert np.isnan(servos["control[7]"]).all()
    assert np.nanmax(np.abs(servos["control[2]"])) > 0.1


def test_tlog_is_what_mavutil_reads(tmp_path: Path) -> None:
    from pymavlink import mavutil

    path = write("tlog", tmp_path)
    link = mavutil.mavlink_connection(str(path))
    theirs: dict[str, int] = {}
    while (message := link.recv_match()) is not None:
        theirs[message.get_type()] = theirs.get(message.get_type(), 0) + 1
    link.close()
    assert "BAD_DATA" not in theirs
    (ours,) = read_tlog(path)
    assert not ours.damage
    for name, messages in ours.messages.items():
        assert len(messages[0]) == theirs[name]
    assert len(ours.parameters) == theirs["PARAM_VALUE"]


def test_a_head_inside_a_record_is_no_record(tmp_path: Path) -> None:
    """A payload that looks like the start of a record splits none."""
    inside = np.frombuffer(b"\xa3\x95\x20\xa3\x95\x21\xa3\x95", dtype="<u8")[0]
    path = tmp_path / "trap.bin"
    steps = np.arange(50)
    write_dataflash(path, [
        Records("AAA", "QQ", {"TimeUS": steps * 1000, "Trap": np.full(50, inside)}),
        Records("BBB", "Qf", {"TimeUS": steps * 1000 + 500, "X": steps * 0.5}),
    ])  # fmt: skip
    found = read_records(path)
    assert [len(found.places[k]) for k in sorted(found.kinds)] == [50, 50, 3]
    np.testing.assert_array_equal(rows_of(found, 33)["X"], steps * 0.5)
    assert not found.lost
