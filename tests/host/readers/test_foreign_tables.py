"""Tables of others: every dialect gives the same flight, nothing doubtful passes in silence."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.errors import IdentificationError, NotALogError
from host.sysid.flight import read_columns, read_flight_columns
from host.sysid.maneuvers import detect_maneuvers
from scipy import io

LINES = {
    "t_s": 'from = "TimeUS", unit = "us"',
    "airspeed_mps": 'from = "TAS", unit = "kt"',
    "alpha_rad": 'from = "AOA", unit = "deg"',
    "beta_rad": 'from = "Beta", unit = "deg"',
    "p_radps": 'from = "P", unit = "deg/s"',
    "q_radps": 'from = "Q", unit = "deg/s"',
    "r_radps": 'from = "R", unit = "deg/s"',
    "ay_mps2": 'from = "Ny", unit = "g"',
    "az_mps2": 'from = "Nz", unit = "g", sign = -1',
    "phi_rad": 'from = "Roll", unit = "deg"',
    "theta_rad": 'from = "Pitch", unit = "deg"',
    "psi_rad": 'from = "Yaw", unit = "deg"',
    "elevator_rad": 'from = "Elev", unit = "deg", sign = -1',
    "aileron_rad": 'from = "Ail", unit = "deg"',
    "rudder_rad": 'from = "Rud", unit = "deg"',
    "qbar_pa": 'from = "Qc", unit = "hPa"',
    "throttle": 'from = "Throttle", unit = ""',
}


def text_of(lines: dict[str, str]) -> str:
    return "[columns]\n" + "".join(f"{name} = {{ {line} }}\n" for name, line in lines.items())


@pytest.fixture(scope="module")
def flight() -> dict[str, np.ndarray]:
    """A made flight in SI: motion as kinematics has it, forces and moments with our signs."""
    t = np.arange(0.0, 60.0, 0.02)
    phi, theta, psi = 0.3 * np.sin(0.7 * t), 0.1 * np.sin(1.1 * t), 0.1 * t + 0.2 * np.sin(0.5 * t)
    dphi, dtheta, dpsi = (np.gradient(x, t) for x in (phi, theta, psi))
    p = dphi - dpsi * np.sin(theta)
    q = dtheta * np.cos(phi) + dpsi * np.sin(phi) * np.cos(theta)
    r = -dtheta * np.sin(phi) + dpsi * np.cos(phi) * np.cos(theta)
    speed = 20.0 + np.sin(0.2 * t)
    alpha, beta = np.full(len(t), 0.1), np.zeros(len(t))
    for k in range(len(t) - 1):  # turned by rates, held by forces
        a, b = alpha[k], beta[k]
        up = q[k] - b * (p[k] * np.cos(a) + r[k] * np.sin(a)) - 60.0 * (a - 0.1) / speed[k]
        right = p[k] * np.sin(a) - r[k] * np.cos(a) - 60.0 * b / speed[k]
        right += 9.80665 * np.cos(theta[k]) * np.sin(phi[k]) / speed[k]
        alpha[k + 1], beta[k + 1] = a + 0.02 * up, b + 0.02 * right
    az = -9.80665 * np.cos(theta) * np.cos(phi) - 60.0 * (alpha - 0.1)
    pd_, qd, rd = (np.gradient(x, t) for x in (p, q, r))
    rudder = (8.0 * beta - r - rd) / 20.0
    return {
        "t_s": t, "airspeed_mps": speed, "alpha_rad": alpha, "beta_rad": beta,
        "p_radps": p, "q_radps": q, "r_radps": r, "ay_mps2": -60.0 * beta,
        "az_mps2": az, "phi_rad": phi, "theta_rad": theta, "psi_rad": psi,
        "elevator_rad": -(qd + 60.0 * (alpha - 0.1) + 8.0 * q) / 70.0,
        "aileron_rad": (pd_ + 20.0 * beta + 10.0 * p - r) / 100.0, "rudder_rad": rudder,
        "qbar_pa": 0.5 * 1.225 * speed**2, "throttle": np.full(len(t), 0.5),
    }  # fmt: skip


@pytest.fixture(scope="module")
def foreign(flight: dict[str, np.ndarray]) -> pd.DataFrame:
    """The same in microseconds, knots, degrees, g, hPa, elevator and Nz turned round."""
    scale = {"us": 1e-6, "kt": 1852 / 3600, "deg": np.pi / 180, "deg/s": np.pi / 180,
             "g": 9.80665, "hPa": 100.0, "": 1.0}  # fmt: skip
    columns = {}
    for name, line in LINES.items():
        _, label, _, unit, *_ = line.split('"')
        sign = -1.0 if "-1" in line else 1.0
        columns[label] = np.round(sign * flight[name] / scale[unit], 9)
    return pd.DataFrame(columns)


@pytest.fixture
def read(tmp_path: Path) -> Callable[[Path], tuple[dict[str, np.ndarray], list[str]]]:
    """Read a table through the map."""
    (tmp_path / "map.toml").write_text(text_of(LINES))
    return lambda path: read_columns(path, tmp_path / "map.toml")


def same(columns: dict[str, np.ndarray], flight: dict[str, np.ndarray]) -> None:
    for name, values in flight.items():
        np.testing.assert_allclose(columns[name], values, atol=1e-6, err_msg=name)


def unit_row(table: pd.DataFrame, path: Path) -> None:
    first = pd.DataFrame([["unit"] * table.shape[1]], columns=table.columns)
    pd.concat([first, table.astype(object)]).to_csv(path, index=False)


def preamble(table: pd.DataFrame, path: Path) -> None:
    path.write_text("Logger 7, flight 3\nweather: calm\n\n" + table.to_csv(index=False))


def quoted(table: pd.DataFrame, path: Path) -> None:
    rows = (",".join('"' + str(v).replace(".", ",") + '"' for v in row) for row in table.to_numpy())
    path.write_text("\n".join([",".join(table.columns), *rows]))


def data_end_in_a_comma(table: pd.DataFrame, path: Path) -> None:
    names, rows = table.to_csv(index=False).split("\n", 1)
    path.write_text(names + "\n" + rows.replace("\n", ",\n"))


def units_and_types(table: pd.DataFrame, path: Path) -> None:
    width = table.shape[1]
    names, rows = table.to_csv(index=False).split("\n", 1)
    path.write_text(
        "\n".join([names, ",".join(["m/s"] * width), ",".join(["float"] * width), rows])
    )


TEXTS: dict[str, Callable[[pd.DataFrame, Path], object]] = {
    "comma": lambda t, p: t.to_csv(p, index=False),
    "semicolon": lambda t, p: t.to_csv(p, index=False, sep=";"),
    "decimal comma": lambda t, p: t.to_csv(p, index=False, sep=";", decimal=","),
    "tab": lambda t, p: t.to_csv(p, index=False, sep="\t"),
    "UTF-16": lambda t, p: t.to_csv(p, index=False, encoding="utf-16"),
    "byte order mark": lambda t, p: t.to_csv(p, index=False, encoding="utf-8-sig"),
    "Latin-1": lambda t, p: t.assign(**{"Temp °C": 15.0}).to_csv(p, index=False, encoding="cp1252"),
    "spaces": lambda t, p: t.rename(columns=lambda c: f" {c} ").to_csv(p, index=False),
    "unit row": unit_row,
    "lines before": preamble,
    "sep=; of a spreadsheet": lambda t, p: p.write_text("sep=;\n" + t.to_csv(index=False, sep=";")),
    "decimal comma in quotes": quoted,
    "comma after every row": data_end_in_a_comma,
    "units and types": units_and_types,
    "names behind #": lambda t, p: p.write_text("# " + t.to_csv(index=False)),
    "blanks": lambda t, p: p.write_text(t.to_csv(index=False, sep=" ").replace(" ", "   ")),
    "carriage returns": lambda t, p: p.write_text(t.to_csv(index=False).replace("\n", "\r")),
}
NOTED = ("lines before", "sep=; of a spreadsheet")


def beside_density(notes: list[str]) -> list[str]:
    """Return notes without the one that every table without air has."""
    kept = [note for note in notes if not note.startswith("density is not known")]
    assert len(kept) == len(notes) - 1
    return kept


@pytest.mark.parametrize("dialect", TEXTS)
def test_every_dialect_of_text_is_the_same_flight(
    dialect: str,
    tmp_path: Path,
    foreign: pd.DataFrame,
    flight: dict[str, np.ndarray],
    read: Callable[[Path], tuple[dict[str, np.ndarray], list[str]]],
) -> None:
    TEXTS[dialect](foreign, tmp_path / "x.csv")
    columns, notes = read(tmp_path / "x.csv")
    same(columns, flight)
    assert bool(beside_density(notes)) == (dialect in NOTED), notes


@pytest.mark.parametrize("shape", ["rows", "columns", "struct", "nested", "index", "text", "clock"])
def test_every_shape_of_mat_and_parquet_is_the_same_flight(
    shape: str,
    tmp_path: Path,
    foreign: pd.DataFrame,
    flight: dict[str, np.ndarray],
    read: Callable[[Path], tuple[dict[str, np.ndarray], list[str]]],
) -> None:
    data = {str(name): values.to_numpy() for name, values in foreign.items()}
    path = tmp_path / ("x.parquet" if shape in ("index", "text", "clock") else "x.mat")
    if shape == "index":
        foreign.set_index("TimeUS").to_parquet(path)
    elif shape == "clock":  # an index without a name
        table = foreign.drop(columns="TimeUS")
        table.index = pd.Timestamp("2026-05-01") + pd.to_timedelta(foreign["TimeUS"], unit="us")
        table.index.name = None
        table.to_parquet(path)
        (tmp_path / "map.toml").write_text(text_of({**LINES, "t_s": 'from = "index"'}))
    elif shape == "text":
        foreign.astype({"Q": "string", "AOA": "Float64"}).to_parquet(path)
    elif shape == "nested":
        rates = {k: data.pop(k) for k in "PQR"}
        io.savemat(path, {"flight": {"imu": rates, "rest": data}, "note": "calm"})
    elif shape == "struct":
        io.savemat(path, {"data": {k: v[:, None] for k, v in data.items()}})
    else:
        io.savemat(path, data, oned_as="row" if shape == "rows" else "column")
    same(read(path)[0], flight)


def test_text_cells_repeats_and_swaps_are_told(
    tmp_path: Path,
    foreign: pd.DataFrame,
    read: Callable[[Path], tuple[dict[str, np.ndarray], list[str]]],
) -> None:
    table = foreign.astype({"AOA": object})
    table.loc[500:502, "AOA"] = "INVALID"
    table = pd.concat([table.iloc[:900], table.iloc[[901, 900, 900]], table.iloc[902:]])
    table.to_csv(tmp_path / "x.csv", index=False)
    columns, notes = read(tmp_path / "x.csv")
    assert len(columns["t_s"]) == len(foreign)
    assert any("alpha_rad: 3 of" in n and "'INVALID' in row 501" in n for n in notes)
    assert any("1 rows came before their time" in n for n in notes)
    assert any("1 of 3001 rows repeat an instant" in n for n in notes)


def test_a_date_is_a_time(tmp_path: Path, foreign: pd.DataFrame) -> None:
    clock = pd.Timestamp("2026-05-01 10:00") + pd.to_timedelta(foreign["TimeUS"], unit="us")
    lines = {**LINES, "t_s": 'from = "Clock"'}
    (tmp_path / "map.toml").write_text(text_of(lines))
    foreign.assign(Clock=clock).to_csv(tmp_path / "x.csv", index=False)
    foreign.assign(Clock=clock).to_parquet(tmp_path / "x.parquet")
    for name in ("x.csv", "x.parquet"):
        columns, _ = read_columns(tmp_path / name, tmp_path / "map.toml")
        np.testing.assert_allclose(columns["t_s"], foreign["TimeUS"] * 1e-6, atol=1e-6)


@pytest.mark.parametrize("how", ["cells", "rows"])
def test_a_gap_divides_a_maneuver(
    how: str,
    tmp_path: Path,
    foreign: pd.DataFrame,
    read: Callable[[Path], tuple[dict[str, np.ndarray], list[str]]],
) -> None:
    t = foreign["TimeUS"] * 1e-6
    table = foreign.assign(Elev=0.0, Ail=0.0, Rud=0.0)
    for start_s in (10.0, 30.0, 50.0):
        half = np.floor((t - start_s) / 0.4)
        table["Elev"] += np.where(half == 0.0, 5.0, np.where(half == 1.0, -5.0, 0.0))
    table.to_csv(tmp_path / "x.csv", index=False)
    whole = detect_maneuvers(read(tmp_path / "x.csv")[0])
    assert [round(f.start_s) for f in whole] == [10, 30, 50]
    gap = (t > 31.0) & (t < 31.5)
    if how == "cells":
        table.loc[gap, ["AOA", "Q"]] = np.nan
    else:
        table = table[~gap]
    table.to_csv(tmp_path / "x.csv", index=False)
    columns, notes = read(tmp_path / "x.csv")
    # The doublet up to the gap, and the response behind it.
    assert [round(f.start_s) for f in detect_maneuvers(columns)] == [10, 30, 32, 50]
    assert any("over" in n and "is divided" in n and "0.5" in n for n in notes)


FAULTS: dict[str, tuple[Callable[[pd.DataFrame], pd.DataFrame], str]] = {
    "no rows": (lambda t: t.iloc[:0], "no row below"),
    "few": (lambda t: t.iloc[:20], "20 samples with a time"),
    "no such column": (lambda t: t.rename(columns={"AOA": "aoa"}), "did you mean aoa"),
    "text": (lambda t: t.assign(Q="fast"), "'Q' is text"),
    "still": (lambda t: t.assign(TimeUS=5.0), "time stands still"),
    "milliseconds": (lambda t: t.assign(TimeUS=t["TimeUS"] / 1e3), "is the unit of t_s right"),
    "clock set": (lambda t: t.assign(TimeUS=t["TimeUS"] + 1e15 * (t.index > 9)), "time jumps from"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_table_that_cannot_be_used_says_why(
    fault: str,
    tmp_path: Path,
    foreign: pd.DataFrame,
    read: Callable[[Path], tuple[dict[str, np.ndarray], list[str]]],
) -> None:
    change, reason = FAULTS[fault]
    change(foreign).to_csv(tmp_path / "x.csv", index=False)
    with pytest.raises(IdentificationError, match=reason):
        read(tmp_path / "x.csv")


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("x.csv", b"", "the file is empty"),
        ("x.csv", b"1,2,3\n4,5,6\n", "no column 'TimeUS'; they have 1, 2, 3"),
        ("x.csv", b"<html><body>404</body></html>", "not a CSV table"),
        ("x.csv", b"\0\1\2\0\0\7" * 50, "the file is binary"),
        ("x.parquet", b"PAR1 is not enough", "not a Parquet file"),
        ("x.mat", b"x" * 500, "not a MAT file"),
        ("x.mat", b"MATLAB 5.0 MAT-file".ljust(130), "not a MAT file"),
        ("x.mat", b"MATLAB 7.3 MAT-file".ljust(600), "version 7.3"),
    ],
)
def test_what_is_no_table_says_so(
    name: str,
    content: bytes,
    reason: str,
    tmp_path: Path,
    read: Callable[[Path], tuple[dict[str, np.ndarray], list[str]]],
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises((IdentificationError, NotALogError), match=reason):
        read(tmp_path / name)


def test_columns_of_several_rates_are_refused(
    tmp_path: Path,
    foreign: pd.DataFrame,
    read: Callable[[Path], tuple[dict[str, np.ndarray], list[str]]],
) -> None:
    data = {str(name): values.to_numpy() for name, values in foreign.items()}
    io.savemat(tmp_path / "x.mat", {**data, "AOA": data["AOA"][::2]})
    with pytest.raises(IdentificationError, match="alpha_rad has 1500 values, t_s 3000"):
        read(tmp_path / "x.mat")


@pytest.mark.parametrize(
    ("name", "line", "reason"),
    [
        ("alpha_rad", 'from = "AOA", units = "deg"', "unknown key units"),
        ("alpha_rad", 'from = "AOA", unit = "kt"', "unit 'kt' unknown; use one of rad, deg"),
        ("alpha_rad", 'from = "AOA", sign = "-"', "sign is '-', expected a number"),
        ("alpha_rad", 'from = "AOA", sign = 2', "sign must be 1 or -1"),
        ("alpha_rad", 'from = ["AOA"]', "expected"),
        ("aplha_rad", 'from = "AOA"', "did you mean alpha_rad"),
        ("beta_rad", 'from = "AOA", unit = "deg"', "beta_rad both come from 'AOA'"),
    ],
)
def test_a_wrong_line_of_the_map_is_refused(
    name: str, line: str, reason: str, tmp_path: Path, foreign: pd.DataFrame
) -> None:
    foreign.to_csv(tmp_path / "x.csv", index=False)
    (tmp_path / "map.toml").write_text(text_of({**LINES, name: line}))
    with pytest.raises(IdentificationError, match=reason):
        read_columns(tmp_path / "x.csv", tmp_path / "map.toml")


@pytest.mark.parametrize(
    ("name", "line", "words"),
    [
        ("alpha_rad", 'from = "AOA"', "alpha_rad reaches .* likely degrees"),
        ("az_mps2", 'from = "Nz", sign = -1', "likely g: give its unit"),
        ("az_mps2", 'from = "Nz", unit = "g"', "points up"),
        ("q_radps", 'from = "Q", unit = "deg/s", sign = -1', "turn opposite ways"),
        ("r_radps", 'from = "R"', "another unit"),
        ("alpha_rad", 'from = "AOA", unit = "deg", sign = -1', "alpha_rad and az_mps2 rise"),
        ("ay_mps2", 'from = "Ny", unit = "g", sign = -1', "beta_rad and ay_mps2 rise"),
        ("airspeed_mps", 'from = "TAS"', "qbar_pa is .* another unit"),
    ],
)
def test_a_wrong_unit_in_the_map_is_a_finding_and_read_right(
    name: str,
    line: str,
    words: str,
    tmp_path: Path,
    foreign: pd.DataFrame,
    flight: dict[str, np.ndarray],
) -> None:
    foreign.to_csv(tmp_path / "x.csv", index=False)
    (tmp_path / "map.toml").write_text(text_of({**LINES, name: line}))
    found = read_flight_columns(tmp_path / "x.csv", tmp_path / "map.toml")
    said = "\n".join(finding.line for finding in found.findings)
    assert re.search(words, said), said
    assert any(f.wrong_unit and name in f.channels for f in found.findings)
    assert f"read as {name}" in said, said
    np.testing.assert_allclose(found.columns[name], flight[name], atol=1e-6)


@pytest.mark.parametrize("surface", ["elevator_rad", "aileron_rad", "rudder_rad"])
def test_a_surface_that_works_backwards_is_told(
    surface: str, tmp_path: Path, foreign: pd.DataFrame
) -> None:
    foreign.to_csv(tmp_path / "x.csv", index=False)
    turned = LINES[surface].removesuffix(", sign = -1")
    turned += "" if turned != LINES[surface] else ", sign = -1"
    (tmp_path / "map.toml").write_text(text_of({**LINES, surface: turned}))
    _, notes = read_columns(tmp_path / "x.csv", tmp_path / "map.toml")
    [note] = beside_density(notes)
    assert note.startswith(f"finding surface-sign: {surface} positive seems to")


NUMBERED = {k: line.replace(line.split('"')[1], "{}") for k, line in LINES.items()}


@pytest.mark.parametrize("shape", ["text", "matrix", "wide matrix"])
def test_columns_without_names_go_by_number(
    shape: str, tmp_path: Path, foreign: pd.DataFrame, flight: dict[str, np.ndarray]
) -> None:
    path = tmp_path / ("x.txt" if shape == "text" else "x.mat")
    if shape == "text":
        np.savetxt(path, foreign.to_numpy())
    else:
        data = foreign.to_numpy()
        io.savemat(path, {"fdata": data.T if shape == "wide matrix" else data})
    label = {"text": "{}", "matrix": "fdata(:,{})", "wide matrix": "fdata({},:)"}[shape]
    lines = {k: s.format(label.format(n)) for n, (k, s) in enumerate(NUMBERED.items(), start=1)}
    (tmp_path / "map.toml").write_text(text_of(lines))
    same(read_columns(path, tmp_path / "map.toml")[0], flight)


def test_a_name_that_two_columns_have_is_refused(
    tmp_path: Path,
    foreign: pd.DataFrame,
    read: Callable[[Path], tuple[dict[str, np.ndarray], list[str]]],
) -> None:
    foreign.assign(more=0.0).rename(columns={"more": "AOA"}).to_csv(tmp_path / "x.csv", index=False)
    with pytest.raises(IdentificationError, match="several columns 'AOA': rename them"):
        read(tmp_path / "x.csv")


def test_a_line_of_the_map_outside_its_table_is_refused(
    tmp_path: Path, foreign: pd.DataFrame
) -> None:
    foreign.to_csv(tmp_path / "x.csv", index=False)
    (tmp_path / "map.toml").write_text('q_radps = "Q"\n' + text_of(LINES))
    with pytest.raises(IdentificationError, match=r"unknown key q_radps; all lines .* \[columns\]"):
        read_columns(tmp_path / "x.csv", tmp_path / "map.toml")


@pytest.mark.parametrize(("ours", "theirs"), [("deg", "Degrees"), ("deg/s", "dps"), ("g", "g")])
def test_units_as_people_write_them(
    ours: str, theirs: str, tmp_path: Path, foreign: pd.DataFrame, flight: dict[str, np.ndarray]
) -> None:
    foreign.to_csv(tmp_path / "x.csv", index=False)
    text = text_of(LINES).replace(f'unit = "{ours}"', f'unit = "{theirs}"')
    (tmp_path / "map.toml").write_text(text)
    same(read_columns(tmp_path / "x.csv", tmp_path / "map.toml")[0], flight)


RATES = {"TAS": 10, "AOA": 2, "Beta": 2, "Pitch": 5, "Roll": 5, "Yaw": 5}  # rows for each value


@pytest.mark.parametrize("how", ["empty cells", "rows of their own", "repeated"])
def test_sensors_of_several_rates_share_a_table(
    how: str,
    tmp_path: Path,
    foreign: pd.DataFrame,
    flight: dict[str, np.ndarray],
    read: Callable[[Path], tuple[dict[str, np.ndarray], list[str]]],
) -> None:
    table = foreign.astype({"TimeUS": float})
    for name, rows in RATES.items():
        table.loc[table.index % rows != 0, name] = np.nan
    if how == "repeated":
        table = table.ffill()
    elif how == "rows of their own":
        slow = [table[["TimeUS", k]].dropna() for k in RATES]
        table = pd.concat([table.drop(columns=list(RATES)), *slow])
        table["TimeUS"] += 3.0 * (np.arange(len(table)) % 7)  # no two stamps alike
        table = table.sort_values("TimeUS")
    table.to_csv(tmp_path / "x.csv", index=False)
    columns, notes = read(tmp_path / "x.csv")
    assert len(columns["t_s"]) == pytest.approx(len(foreign), abs=2)
    for name in ("alpha_rad", "theta_rad", "airspeed_mps", "q_radps"):
        there = np.interp(columns["t_s"], flight["t_s"], flight[name])
        assert np.std(columns[name] - there) < 0.02 * np.std(there), name
    assert any("theta_rad 0.1 s" in n for n in notes), notes
    assert any("theta_rad every 5 rows" in n for n in notes) == (how == "repeated")


def test_spikes_and_dropouts_count_as_missing(
    tmp_path: Path,
    foreign: pd.DataFrame,
    flight: dict[str, np.ndarray],
    read: Callable[[Path], tuple[dict[str, np.ndarray], list[str]]],
) -> None:
    table = foreign.copy()
    table.loc[700, "Q"] = 1e9
    table.loc[1000:1030, "AOA"] = 0.0
    table.loc[2000:2030, "Beta"] = -9999.0
    table.to_csv(tmp_path / "x.csv", index=False)
    columns, notes = read(tmp_path / "x.csv")
    np.testing.assert_allclose(columns["q_radps"], flight["q_radps"], atol=1e-3)
    assert any(n.startswith("q_radps: 1 value far out") for n in notes)
    assert any("alpha_rad stands still at 0 deg for 0.60 s from 20 s" in n for n in notes)
    assert any(n.startswith("beta_rad: 31 values far out") for n in notes)
    assert any("missing within the flight" in n and "beta_rad" in n for n in notes)


@pytest.mark.filterwarnings("error")
def test_infinities_count_as_missing(tmp_path: Path) -> None:
    """A division by zero of somebody's export: no warning on the screen, a note with the column."""
    t = np.arange(0.0, 12.0, 0.02)
    table = pd.DataFrame({"t_s": t, "airspeed_mps": 17.0 + 0.1 * np.sin(t)})
    for name in ("alpha_rad", "q_radps", "p_radps", "r_radps", "beta_rad", "elevator_rad"):
        table[name] = 0.05 * np.sin(3.0 * t + len(name))
    table.loc[200:205, "alpha_rad"] = np.inf
    table.loc[206, "alpha_rad"] = -1e300  # the square of it was an internal error
    path = tmp_path / "t.csv"
    table.to_csv(path, index=False)
    columns, notes = read_columns(path)
    assert np.isfinite(columns["alpha_rad"]).all()
    assert any("alpha_rad: 7 of 600 values are infinite and count as missing" in n for n in notes)
