"""The original ASCII rows: as printed, damaged, overflowed."""

import json
from pathlib import Path

import numpy as np
import pytest
from host.cli import main
from host.errors import NotALogError
from host.original.row_rate import RowRate, row_rate
from host.original.row_table import make_table, printed_vane, undo_relative_vane, undo_vane
from host.original.rows import VARIANTS, looks_like_rows, parse_rows, read_rows
from host.physical.calibration import load_calibration
from hypothesis import given
from hypothesis import strategies as st

# The row of thesis 4.3.1, separators as printed.
PRINTED = (
    "RLL:0.07,PCH:0.08,YAW:0.33,altitude:-0.50,velocity:0.00,elev:-683,ail:-713,rdr:-713,"
    "alpha:-737,beta:-690,AN0:0.13,AN1:-0.62,AN2:0.22,AN3:17.78, AN4:-0.08,AN5:8190.33,"
    "lat:0.00,lon:0.00,gpsalt:17.00 , gpsgc0.00,gpsgs0.00, fix:0,numsat:0,elevs:0,ails:0, "
    "ruds:0,throts:0"
)
APPENDIX = (
    "RLL:{0:.2f},PCH:5.00,YAW:-170.50,altitude:12,velocity:54.00,alpha:-30,beta:20,"
    "AN0:164.00,AN1:0.00,AN2:-82.00,AN3:0.00,AN4:0.00,AN5:8192.00,lat:30.05123,lon:31.20000,"
    "gpsgc:90.00,gpsgs:15.00,fix:1,numsat:7,elevs:-3.50,ails:2.25,rdrs:0.50,throts:491,"
    "000000000000000\r\n"
)
SECOND = (
    "{0:.2f},PCH:5.00,YAW:-170.50,altitude:12,velocitya:54.00,velocityb:50.40,alphaa:-30,"
    "alphab:-20,betaa:10,betab:1500,AN0:164.00,AN1:0.00,AN2:-82.00,AN3:0.00,AN4:0.00,"
    "AN5:8192.00,lat:30.05123,lon:31.20000,gpsgc:90.00,gpsgs:15.00,fix:1,numsat:7,"
    "elevs:-3.50,ails:2.25,rdrs:0.50,throts:491\r"
)
CALIBRATION = load_calibration()


def test_printed_row_gives_the_five_counts() -> None:
    rows = parse_rows(PRINTED.encode())
    assert rows.variant == "27 readings"
    assert not rows.damaged.any()
    found = [undo_vane(rows.values[name])[0] for name in ("elev", "ail", "rdr", "alpha", "beta")]
    assert found == [523, 514, 514, 507, 521]
    columns = make_table(rows, CALIBRATION).columns
    assert columns["az_mps2"][0] == pytest.approx(-9.8046, abs=1e-3)
    assert columns["alpha_rad"][0] == pytest.approx(np.deg2rad((507 - 512) * 0.3))
    assert np.isnan(columns["latitude_deg"][0])  # no fix
    assert columns["throttle"][0] == pytest.approx(0.009)


def test_rows_of_the_appendix() -> None:
    rows = parse_rows("".join(APPENDIX.format(roll / 10) for roll in range(20)).encode())
    assert rows.variant == "23 readings"
    assert len(rows) == 20
    assert not rows.damaged.any()
    table = make_table(rows, CALIBRATION, 10.0)
    columns = table.columns
    np.testing.assert_allclose(columns["phi_rad"], np.deg2rad(np.arange(20) / 10))
    np.testing.assert_allclose(columns["t_s"], np.arange(20) / 10.0)
    np.testing.assert_allclose(columns["p_radps"], np.deg2rad(10.0), rtol=1e-6)
    np.testing.assert_allclose(columns["r_radps"], np.deg2rad(-5.0), rtol=1e-6)
    np.testing.assert_allclose(columns["airspeed_mps"], 15.0)  # 54 km/h
    np.testing.assert_allclose(columns["alpha_a_rad"], np.deg2rad(-30 * 0.09))
    np.testing.assert_allclose(columns["elevator_rad"], np.deg2rad(-3.5))
    np.testing.assert_allclose(columns["latitude_deg"], 30.05123)
    np.testing.assert_allclose(columns["throttle"], 0.5)
    assert make_table(rows, CALIBRATION, 5.0).columns["t_s"][-1] == pytest.approx(19 / 5)


def test_rows_of_the_second_flight_without_their_head() -> None:
    rows = parse_rows("".join(SECOND.format(1.25) for _ in range(10)).encode())
    assert rows.variant == "26 readings"
    assert not rows.damaged.any()
    table = make_table(rows, CALIBRATION, 20.0)
    columns = table.columns
    np.testing.assert_allclose(columns["phi_rad"], np.deg2rad(1.25))
    np.testing.assert_allclose(columns["t_s"][-1], 9 / 20.0)
    np.testing.assert_allclose(columns["alpha_rad"], np.deg2rad(-25 * 0.09))
    # 1500 printed is an overflow: 450 - 728 counts from the start.
    np.testing.assert_allclose(columns["beta_b_rad"], np.deg2rad((450 - 65536 / 90) * 0.3))
    assert table.undone["betab"] == 10
    impact = 0.5 * 1.225 * np.mean([15.0**2, 14.0**2])
    np.testing.assert_allclose(columns["qbar_pa"], impact)


@given(st.integers(0, 1023))
def test_undone_value_is_the_count_or_invalid(count: int) -> None:
    printed = printed_vane(np.array([count]))
    found = undo_vane(printed.astype(float))[0]
    alike = np.flatnonzero(printed_vane(np.arange(1024)) == printed[0])
    assert np.isnan(found) if len(alike) > 1 else found == count


@given(st.integers(205, 818), st.integers(-205, 205))
def test_undone_relative_value(start: int, turn: int) -> None:
    # The sensor's range is 0..1023, the vane's +-90 deg are +-307 counts; here both hold.
    printed = (printed_vane(np.array([start + turn])) - printed_vane(np.array([start])))[0]
    assert undo_relative_vane(np.array([float(printed)]))[0] == pytest.approx(turn, abs=0.6)


@pytest.mark.parametrize(
    ("spoiled", "label"),
    [
        (("PCH:5.00", "PCH:5.0"), "PCH"),
        (("PCH:5.00", "PCH:5x00"), "PCH"),
        (("PCH:5.00", "PC:5.00"), "PCH"),
        (("PCH:5.00", "PCH:555.00"), "PCH"),
        (("AN5:8192.00", "AN5:99999.00"), "AN5"),
        (("gpsgs:15.00,", ""), "gpsgs"),
        (("throts:491", "throts:"), "throts"),
    ],
)
def test_damaged_field_is_invalid_and_only_it(spoiled: tuple[str, str], label: str) -> None:
    good = APPENDIX.format(1.0)
    rows = parse_rows((good * 5 + good.replace(*spoiled) + good).encode())
    assert rows.damaged.tolist() == [0, 0, 0, 0, 0, 1, 0]
    assert np.isnan(rows.values[label][5])
    columns = make_table(rows, CALIBRATION).columns
    assert not any((column == 500).any() for column in columns.values())


def test_row_cut_in_a_number_loses_that_number() -> None:
    good = APPENDIX.format(1.0)
    for cut in range(1, len(good) - 20):
        rows = parse_rows((good * 3 + good[:cut]).encode())
        for label, values in rows.values.items():
            assert set(values[~np.isnan(values)]) == {values[0]}, (cut, label)


def test_rows_that_ran_together_are_parted() -> None:
    good = APPENDIX.format(1.0)
    rows = parse_rows((good + good[:100] + good + good).encode())
    assert len(rows) == 4
    assert rows.damaged.tolist()[0] == rows.damaged.tolist()[3] == 0
    assert rows.damaged.tolist()[2] == 1  # "ANRLL:1.00": nobody knows whose number that is


@given(st.binary(max_size=300), st.integers(0, 600))
def test_never_a_wrong_number_of_columns(noise: bytes, at: int) -> None:
    clean = APPENDIX.format(1.0).encode() * 3
    try:
        rows = parse_rows(clean[:at] + noise + clean[at:])
    except NotALogError:
        return
    assert {len(values) for values in rows.values.values()} == {len(rows)}
    assert set(rows.values) == set(VARIANTS[rows.variant])


def test_files_are_told_apart(tmp_path: Path) -> None:
    assert looks_like_rows(PRINTED.encode())
    assert looks_like_rows(SECOND.format(1.0).encode())
    assert not looks_like_rows(b"t_s,alpha_rad\n0.0,0.1\n")
    file = tmp_path / "empty.txt"
    file.write_bytes(b"")
    with pytest.raises(NotALogError):
        read_rows(file)


def test_a_field_of_a_million_spaces_is_no_field() -> None:
    """Two runs of optional spaces next to each other once took the square of their length."""
    spaces = b"PCH" + b" " * 1_000_000 + b"x"
    rows = parse_rows(b"RLL:1.00,PCH:2.00,YAW:3.00,AN0:4.00\nRLL:1.00," + spaces + b",YAW:3.00\n")
    assert len(rows) == 1


def test_a_file_of_fragments_is_no_log_of_the_original() -> None:
    fragments = b"PCH:1,AN0:1,f\n" * 200
    with pytest.raises(NotALogError, match=r"200 rows of 14 bytes .* prints 150 to 250"):
        parse_rows(fragments)
    whole = APPENDIX.format(1.0).encode()
    assert len(parse_rows(whole * 100 + fragments)) == 300  # a damaged part costs no other row


def flown(rate_hz: float, seconds: float = 60.0, row: str = SECOND, speed_mps: float = 15.0) -> str:
    """Return rows of a flight in circles, its GPS solved four times a second to 1 m."""
    rng = np.random.default_rng(5)
    t = np.floor(np.arange(0.0, seconds, 1.0 / rate_hz) * 4.0) / 4.0
    course = 0.1 * t
    north, east = speed_mps / 0.1 * np.sin(course), -speed_mps / 0.1 * np.cos(course)
    noise = rng.normal(0.0, 0.5, (2, int(seconds * 4) + 1))[:, (t * 4).astype(int)]
    lines = []
    for k in range(len(t)):
        lat = 30.0 + (north[k] + noise[0, k]) / 111_195.0
        lon = 31.0 + (east[k] + noise[1, k]) / 111_195.0 / np.cos(np.radians(30.0))
        text = row.format(1.0).replace("lat:30.05123,lon:31.20000", f"lat:{lat:.5f},lon:{lon:.5f}")
        turn = np.degrees(course[k]) % 360.0
        lines.append(text.replace("gpsgc:90.00", f"gpsgc:{turn:.2f}"))
    return "".join(lines).replace("gpsgs:15.00", f"gpsgs:{speed_mps:.2f}")


@pytest.mark.parametrize("row", [APPENDIX, SECOND])
@pytest.mark.parametrize("rate_hz", [5.0, 10.0, 20.0])
def test_the_rate_comes_from_gps_whatever_the_layout(rate_hz: float, row: str) -> None:
    """Our recorder prints rows of the second flight at 5 Hz; the first one's came at 10 and 20."""
    rate = row_rate(parse_rows(flown(rate_hz, row=row).encode()), None)
    assert rate.origin == "GPS"
    assert rate.half_width_hz < 0.05 * rate_hz
    assert abs(rate.rate_hz - rate_hz) < rate.half_width_hz


def test_a_rate_that_nobody_knows_is_none(tmp_path: Path) -> None:
    for text in (
        SECOND.format(1.0) * 400,  # 15 m/s, and no way
        flown(20.0, seconds=2.0),
        flown(20.0).replace("fix:1", "fix:0"),
        flown(20.0, speed_mps=1.0),
    ):
        rows = parse_rows(text.encode())
        rate = row_rate(rows, None)
        assert not rate.known
        assert np.isnan(make_table(rows, CALIBRATION).columns["t_s"]).all()
        assert row_rate(rows, 20.0) == RowRate(20.0, 0.0, "given")


def test_verbs_that_need_time_refuse_rows_of_an_unknown_rate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "rows.txt"
    source.write_text(SECOND.format(1.0) * 400)
    for verb in ("maneuvers", "identify"):
        assert main([verb, str(source)]) == 2
        assert "give --row-rate" in capsys.readouterr().err
    assert main(["decode", str(source), "-o", str(tmp_path / "rows.csv"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["row_rate_hz"], said["duration_s"], said["times"]) == (None, None, "unknown")
    assert "paired" in said["layout"]
    source.write_text(flown(5.0))
    assert main(["maneuvers", str(source), "--json"]) == 0
    notes = json.loads(capsys.readouterr().out)["notes"]
    assert any("estimated from the way that GPS saw" in note for note in notes)
