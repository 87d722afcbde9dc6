"""Every error that a calibration states reaches an interval, larger and smaller."""

from pathlib import Path

import pytest
from host.aircraft.file import load
from host.arrays import Array
from host.instrument.deviations import sensor_error_model
from host.physical.calibration import load_calibration
from host.readers.even_grid import even_columns
from host.twin.outcome.virtual_calibration import calibration
from host.twin.virtual import virtual_flight

from tests.host.sysid.at_hand import identify_coefficients
from tests.host.sysid.recorded import STRAIGHT_ON

NAME = "ultrastick25e"
TEXT = calibration(load(NAME))
# Lines of a calibration, the number in them, and a coefficient whose interval it rules.
LINES = {
    "alpha": (("alpha_a", "alpha_b"), "slope_sigma", "CL_alpha"),
    "pitot": (("dp_a", "dp_b"), "slope_sigma", "CL_alpha"),
    "pitot zero": (("dp_a", "dp_b"), "zero_sigma", "CL_alpha"),
    "elevator": (("pot_elevator",), "slope_sigma", "Cm_de"),
    "rudder": (("pot_rudder",), "slope_sigma", "Cn_dr"),
    "gyro": (("gyro",), "slope_sigma", "Cl_da"),
    "accelerometer": (("accel",), "slope_sigma", "CL_alpha"),
}
BETA = ("beta_a", "beta_b")
TABLES = {"thrust": ("thrust_share", "CD_0"), "misalignment": ("misalignment_rad", "Cn_da")}


@pytest.fixture(scope="module")
def columns() -> dict[str, Array]:
    """Return a flight at 50 Hz: half of the rows show what widens as well as all."""
    return even_columns(virtual_flight(STRAIGHT_ON, 41, chain="none").table.iloc[::2])[0]


def halves(columns: dict[str, Array], path: Path, text: str) -> dict[str, float]:
    """Return the half-widths of an answer with a calibration of that text."""
    path.write_text(text, encoding="utf-8")
    data = sensor_error_model(NAME, load_calibration(path))
    answer = identify_coefficients(columns, NAME, instrument=data)
    return {d.name: d.half_width for d in answer.fit.derivatives}


def scaled(text: str, tables: tuple[str, ...], key: str, factor: float) -> str:
    """Return a calibration with one number of some tables so many times as large."""
    lines, inside = [], False
    for line in text.splitlines():
        if line.startswith("["):
            inside = line.strip("[]").rpartition(".")[2] in tables
        name, _, value = line.partition(" = ")
        if inside and name == key:
            numbers = [factor * float(x) for x in value.strip("[]").split(",")]
            line = f"{name} = {numbers[0] if len(numbers) == 1 else numbers}"
        lines.append(line)
    return "\n".join(lines) + "\n"


GROUPS = {
    **LINES,
    **{
        group: ((table,), "sigma" if table == "thrust_share" else "half_width", coefficient)
        for group, (table, coefficient) in TABLES.items()
    },
}


@pytest.fixture(scope="module")
def usual(columns: dict[str, Array], tmp_path_factory: pytest.TempPathFactory) -> dict[str, float]:
    return halves(columns, tmp_path_factory.mktemp("usual") / "mine.toml", TEXT)


@pytest.mark.parametrize("group", GROUPS)
def test_a_line_or_table_of_a_calibration_widens_an_interval(
    group: str, columns: dict[str, Array], usual: dict[str, float], tmp_path: Path
) -> None:
    tables, key, coefficient = GROUPS[group]
    wide = halves(columns, tmp_path / "mine.toml", scaled(TEXT, tables, key, 10.0))
    assert wide[coefficient] > 1.05 * usual[coefficient]


def test_a_flight_tells_the_scale_of_its_own_sideslip_vane(
    columns: dict[str, Array], usual: dict[str, float], tmp_path: Path
) -> None:
    """By yaw rate and side force: a line ten times better or worse moves Cn_beta by 2 % at most."""
    narrow, wide = (
        halves(columns, tmp_path / "mine.toml", scaled(TEXT, BETA, "slope_sigma", factor))
        for factor in (0.1, 10.0)
    )
    assert 0.98 * usual["Cn_beta"] < narrow["Cn_beta"] < usual["Cn_beta"]
    assert usual["Cn_beta"] < wide["Cn_beta"] < 1.02 * usual["Cn_beta"]


def test_better_lines_of_a_calibration_narrow_intervals(
    columns: dict[str, Array], usual: dict[str, float], tmp_path: Path
) -> None:
    narrow = TEXT
    for tables, key, _ in LINES.values():
        narrow = scaled(narrow, tables, key, 0.1)
    small = halves(columns, tmp_path / "mine.toml", narrow)
    for coefficient in ("CL_alpha", "Cn_beta", "Cm_de"):
        assert small[coefficient] < 0.95 * usual[coefficient], coefficient
