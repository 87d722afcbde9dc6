"""One log has several clocks: each is found, and what it timed is right."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.errors import IdentificationError
from host.placed_arguments import of_each_flight
from host.readers.autopilot_flight import AutopilotFlight, read_autopilot
from host.readers.autopilot_log import FlightChoiceError
from host.readers.clock_epochs import clock_sets, epoch_starts
from host.sysid.flight import FlightColumns, chosen_flights, read_flight_columns

from tests.host.readers import changed_logs as logs

pytestmark = pytest.mark.costs(30, "the first of them flies the virtual flight, which is kept")


def assert_same(found: AutopilotFlight, control: AutopilotFlight, *, late_s: float = 0.0) -> None:
    """Fail unless all channels of two flights agree."""
    assert found.channels.signals.keys() == control.channels.signals.keys()
    for name, own in found.channels.signals.items():
        other = control.channels.signals[name]
        np.testing.assert_allclose(own.t_s, other.t_s + late_s, atol=2e-6, err_msg=name)
        np.testing.assert_allclose(own.values, other.values, rtol=1e-7, atol=1e-9, err_msg=name)


def test_a_boot_on_the_bench_before_the_flight(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Half of each message had an impossible time."""
    control = logs.ardupilot(tmp_path / "same.bin")
    first = logs.ardupilot(tmp_path / "bench.bin", logs.bench)
    both = tmp_path / "both.bin"
    both.write_bytes(first.read_bytes() + control.read_bytes())
    found = read_autopilot(both)
    assert found.number == 2
    assert [one.number for one in found.listed] == [1, 2]
    assert_same(found, read_autopilot(control))
    assert not found.log.damage
    assert read_autopilot(both, flight=1).flown.time_s == 0.0
    assert main(["info", str(both)]) == 0
    told = capsys.readouterr().out
    assert "flight 1: from 0.0 s, 2 s long, 0 s in the air" in told
    assert "s in the air, up to " in told
    assert ", 7 maneuvers (described here" in told
    with pytest.raises(FlightChoiceError, match="no flight 3; it has 1 to 2"):
        read_autopilot(both, flight=3)


def test_the_same_as_text(tmp_path: Path) -> None:
    control = logs.as_text(tmp_path / "same.log", logs.ardupilot(tmp_path / "same.bin"))
    both = tmp_path / "both.log"
    both.write_text(control.read_text() * 2)
    found = read_autopilot(both, flight=2)
    assert len(found.listed) == 2
    assert_same(found, read_autopilot(control))


def test_a_station_that_stays_on_between_flights(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    every = logs.frames()
    control = read_autopilot(logs.telemetry(tmp_path / "same.tlog", every))
    later_us = every[-1][0] - every[0][0] + 120_000_000
    again = [(stamp + later_us, frame) for stamp, frame in every]
    path = logs.telemetry(tmp_path / "two.tlog", every + again)
    for number in (1, 2):
        assert_same(read_autopilot(path, flight=number), control)
    assert main(["maneuvers", str(path), "--session", "1", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert any("flight 1" in note and "used, of 2" in note for note in told["notes"])
    assert main(["identify", str(path), "--flight", "all", "--model", "roll", "--json"]) == 0
    joint = capsys.readouterr().out
    assert f"{path}#1" in joint
    assert f"{path}#2" in joint


def test_a_station_whose_clock_is_set_in_flight(tmp_path: Path) -> None:
    """Airspeed came 2 s late, and nothing said so: VFR_HUD has no time of its own."""
    every = logs.frames()
    middle = every[len(every) // 2][0]
    moved = [(stamp + 2_000_000 * (stamp > middle), frame) for stamp, frame in every]
    found = read_autopilot(logs.telemetry(tmp_path / "set.tlog", moved))
    control = read_autopilot(logs.telemetry(tmp_path / "same.tlog", every))
    for name in ("airspeed_mps", "qbar_pa"):
        own, other = found.channels.signals[name], control.channels.signals[name]
        np.testing.assert_allclose(own.t_s, other.t_s, atol=5e-3)
    assert any("clock was set by +2.0 s" in note for note in found.notes())
    assert not any("clock was set" in note for note in control.notes())


def test_px4_on_a_computer_that_counts_since_1970(tmp_path: Path) -> None:
    """Every message was dropped and a good flight refused."""

    def since_1970(topics: logs.Topics) -> None:
        for columns in topics.values():
            for key in [k for k in columns if k.startswith("timestamp")]:
                columns[key] = columns[key] + np.uint64(1_710_773_350_000_000)

    found = read_autopilot(logs.px4(tmp_path / "unix.ulg", since_1970))
    control = read_autopilot(logs.px4(tmp_path / "same.ulg"))
    shift_s = found.channels.signals["q_radps"].t_s[0] - control.channels.signals["q_radps"].t_s[0]
    assert_same(found, control, late_s=float(shift_s))
    assert not found.log.damage
    assert not found.judgement.refusal


def test_the_week_of_gps_in_old_logs_is_no_boot_clock(tmp_path: Path) -> None:
    """Releases before 3.2: TimeMS of a GPS record counts since Sunday, its T since boot."""

    def old(kinds: logs.Kinds) -> None:
        fields = kinds["GPS"][1]
        own = np.round(fields["TimeUS"] * 1e-3)
        kept = {name: fields[name] for name in ("TimeUS", "Status", "Spd", "GCrs", "VZ")}
        kinds["GPS"] = "QBfffII", {**kept, "TimeMS": own + 345_600_000, "T": own}

    path = logs.ardupilot(tmp_path / "old.bin", old)
    whole = path.read_bytes()
    # Its clock is not called TimeUS then: only the description of GPS changes.
    at = whole.index(b"GPS\0")
    cut = whole[at : at + 84].replace(b"TimeUS", b"Unused")
    path.write_bytes(whole[:at] + cut + whole[at + 84 :])
    found = read_autopilot(path).channels.signals["v_north_mps"]
    control = read_autopilot(logs.ardupilot(tmp_path / "same.bin")).channels.signals["v_north_mps"]
    np.testing.assert_allclose(found.t_s, control.t_s, atol=1e-3)


@pytest.mark.parametrize("period_s", [2**16 * 1e-6, 2**16 * 1e-3, 2**32 * 1e-6, 86400.0])
def test_a_counter_that_begins_again(period_s: float, tmp_path: Path) -> None:
    rows = logs.table()
    control = read_table(tmp_path / "same.csv", logs.lines(rows))
    wrapped = rows.assign(t_s=(rows["t_s"] + period_s - 0.027) % period_s)
    found = read_table(tmp_path / "wrap.csv", logs.lines(wrapped))
    assert any("begins again" in note and "counted on" in note for note in found.notes)
    t, true = found.columns["t_s"], control.columns["t_s"]
    most = slice(0, len(true) - 2)  # the last may round to a row less
    np.testing.assert_allclose((t - t[0])[most], (true - true[0])[most], atol=1e-5)
    for name in ("q_radps", "az_mps2"):
        np.testing.assert_allclose(
            found.columns[name][most], control.columns[name][most], atol=1e-2
        )


def test_time_with_too_few_digits_is_made_even(tmp_path: Path) -> None:
    """90 % of the rows were dropped."""
    rows = logs.table()
    control = read_table(tmp_path / "same.csv", logs.lines(rows))
    found = read_table(tmp_path / "coarse.csv", logs.lines(rows.assign(t_s=rows["t_s"].round(1))))
    assert len(found.columns["t_s"]) == pytest.approx(len(control.columns["t_s"]), abs=5)
    (finding,) = [f for f in found.findings if f.check == "time-digits"]
    assert "digits of 0.1 s where rows come at 99.99 Hz" in finding.text
    kept = read_flight_columns(tmp_path / "coarse.csv", accept=("time-digits",))
    (finding,) = [f for f in kept.findings if f.check == "time-digits"]
    assert finding.accepted
    assert len(kept.columns["t_s"]) < 0.2 * len(found.columns["t_s"])
    late = found.columns["t_s"][1000] - control.columns["t_s"][1000]
    assert abs(late) < 0.01
    still = read_table(tmp_path / "twice.csv", repeated(logs.lines(rows)))
    assert not [f for f in still.findings if f.check == "time-digits"]


def repeated(every: list[str]) -> list[str]:
    """Return a table each row of which stands there twice."""
    return [every[0], *(line for line in every[1:] for _ in range(2))]


def test_recordings_behind_each_other_in_a_table(tmp_path: Path) -> None:
    every = logs.lines(logs.table())
    short = every[1:1000]
    control = read_table(tmp_path / "same.csv", every)
    found = read_table(tmp_path / "two.csv", [every[0], *short, *every[1:]])
    assert any("2 flights" in note and "2 is used" in note for note in found.notes)
    np.testing.assert_array_equal(found.columns["q_radps"], control.columns["q_radps"])
    first = read_flight_columns(tmp_path / "two.csv#1")
    assert len(first.columns["t_s"]) == 999
    with pytest.raises(IdentificationError, match="no flight 3"):
        read_flight_columns(tmp_path / "two.csv#3")
    source = tmp_path / "two.csv"
    every_flight = chosen_flights([source, tmp_path / "same.csv"], "all")
    assert every_flight == [[Path(f"{source}#1"), Path(f"{source}#2")], [tmp_path / "same.csv"]]
    assert of_each_flight(["a", "b"], every_flight) == ["a", "a", "b"]


def test_all_flights_of_a_log_of_ours_are_its_sessions_with_rows() -> None:
    log = Path(__file__).parents[2] / "data" / "format-1-sitl-causes.bin"
    (every,) = chosen_flights([log], "all")
    assert every == [Path(f"{log}#2"), Path(f"{log}#3")]
    rows = [len(read_flight_columns(one).columns["t_s"]) for one in every]
    assert rows == pytest.approx([95, 359], abs=2)


@pytest.mark.parametrize("dated", [True, False])
def test_midnight_in_text(dated: bool, tmp_path: Path) -> None:
    """A time of the day and one with its date go on alike."""
    rows = logs.table()
    control = read_table(tmp_path / "same.csv", logs.lines(rows))
    start = pd.Timestamp("2026-03-01 23:59:50.5")
    instants = start + pd.to_timedelta(rows["t_s"], unit="s")
    form = "%Y-%m-%d %H:%M:%S.%f" if dated else "%H:%M:%S.%f"
    written = rows.assign(t_s=instants.dt.strftime(form))
    found = read_table(tmp_path / "midnight.csv", logs.lines(written))
    assert any("after a day" in note for note in found.notes) != dated
    t, true = found.columns["t_s"], control.columns["t_s"]
    np.testing.assert_allclose(t - t[0], true - true[0], atol=1e-5)
    np.testing.assert_allclose(found.columns["q_radps"], control.columns["q_radps"], atol=1e-2)


def read_table(path: Path, every: list[str]) -> FlightColumns:
    return read_flight_columns(logs.text(path, every))


def test_a_changed_bit_is_no_start_of_a_clock() -> None:
    t_s = np.arange(0.0, 100.0, 0.1)
    places = np.arange(len(t_s))
    for row, wrong in ((500, 3.0), (500, 1e6), (999, 3.0), (0, 1e6)):
        changed = t_s.copy()
        changed[row] = wrong
        assert epoch_starts([(places, changed)]) == []
    twice = np.concatenate([t_s, t_s])
    every = np.arange(2 * len(t_s))
    # The first record of the new clock comes sooner if it is of a second kind.
    assert epoch_starts([(10 * every, twice), (10 * every - 7, twice)]) == [9991]
    offset = np.zeros(500)
    offset[200:210] = 3.0  # a burst behind an outage
    assert not len(clock_sets(offset))
    offset[300:] += 2.0
    assert clock_sets(offset).tolist() == [300]
