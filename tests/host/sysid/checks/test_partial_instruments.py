"""Records of part of the instruments: what the model needs is enough, and what is assumed is said.

Tables of linear aircraft with a known truth, small sensor noise, columns left out.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.constants import GRAVITY_MPS2
from host.errors import IdentificationError
from host.people_units import people_name
from host.sysid.flight import read_columns
from host.twin.virtual import virtual_flight
from scipy.signal import lsim
from studies.foreign.flight import Air, derivatives, fly

import host
from tests.host.sysid.held import assert_held

DT_S = 0.02
TRIM_ALPHA_RAD, SPEED_MPS = 0.06, 17.0
SHORT_PERIOD = {"Z_alpha": -6.0, "Z_de": -0.9, "M_alpha": -80.0, "M_q": -9.0, "M_de": -90.0}
LATERAL = {
    "Y_beta": -0.5, "L_beta": -30.0, "L_p": -12.0, "L_r": 4.0, "L_da": 120.0,
    "N_beta": 18.0, "N_p": -0.6, "N_r": -1.5, "N_da": 2.0,
}  # fmt: skip


def doublet(t: np.ndarray, at_s: float, side_s: float, size_rad: float) -> np.ndarray:
    first = (t >= at_s) & (t < at_s + side_s)
    second = (t >= at_s + side_s) & (t < at_s + 2.0 * side_s)
    return np.asarray(size_rad * (first.astype(float) - second))


def simulated(A: np.ndarray, B: np.ndarray, u: np.ndarray, seed: int) -> np.ndarray:
    t = DT_S * np.arange(len(u))
    _, _, x = lsim((A, B, np.eye(len(A)), np.zeros_like(B)), u, t)
    rng = np.random.default_rng(seed)
    return np.asarray(x + 2e-4 * rng.standard_normal(x.shape))


@pytest.fixture(scope="module")
def pitching() -> pd.DataFrame:
    """Three elevator doublets of a short period; airspeed is there but constant."""
    t = np.arange(0.0, 24.0, DT_S)
    de = np.sum([doublet(t, at, 0.3, 0.06) for at in (2.0, 9.0, 16.0)], axis=0)
    s = SHORT_PERIOD
    x = simulated(
        np.array([[s["Z_alpha"], 1.0], [s["M_alpha"], s["M_q"]]]),
        np.array([[s["Z_de"]], [s["M_de"]]]),
        de[:, None],
        1,
    )
    return pd.DataFrame(
        {"t_s": t, "alpha_rad": TRIM_ALPHA_RAD + x[:, 0], "q_radps": x[:, 1], "elevator_rad": de}
    )


@pytest.fixture(scope="module")
def rolling() -> pd.DataFrame:
    """Three aileron doublets of a wing without a rudder."""
    t = np.arange(0.0, 24.0, DT_S)
    da = np.sum([doublet(t, at, 0.4, 0.05) for at in (2.0, 9.0, 16.0)], axis=0)
    s, g = LATERAL, 9.80665
    A = np.array(
        [
            [s["Y_beta"], np.sin(TRIM_ALPHA_RAD), -np.cos(TRIM_ALPHA_RAD),
             g / SPEED_MPS * np.cos(TRIM_ALPHA_RAD)],
            [s["L_beta"], s["L_p"], s["L_r"], 0.0],
            [s["N_beta"], s["N_p"], s["N_r"], 0.0],
            [0.0, 1.0, np.tan(TRIM_ALPHA_RAD), 0.0],
        ]
    )  # fmt: skip
    B = np.array([[0.0], [s["L_da"]], [s["N_da"]], [0.0]])
    x = simulated(A, B, da[:, None], 2)
    names = ("beta_rad", "p_radps", "r_radps", "phi_rad")
    table = {"t_s": t, "airspeed_mps": SPEED_MPS + 0.01 * np.sin(t), "aileron_rad": da}
    table |= {"alpha_rad": TRIM_ALPHA_RAD + 1e-3 * np.sin(t)}
    table |= {"theta_rad": TRIM_ALPHA_RAD + 1e-3 * np.cos(t)}
    return pd.DataFrame(table | dict(zip(names, x.T, strict=True)))


def held(found: host.Identification, truth: dict[str, float]) -> None:
    """Every parameter within its interval plus 1 % of the truth (the vane's angle is clipped)."""
    [answer] = found.linear
    half = answer.result.half_width()
    for name, true in truth.items():
        k = answer.result.index(name)
        miss = abs(float(answer.result.estimate[k]) - true)
        assert miss < 1.5 * half[k] + 0.01 * abs(true), (name, answer.result.estimate[k], half[k])


def test_a_short_period_needs_no_airspeed_and_says_so(pitching: pd.DataFrame) -> None:
    found = host.identify(pitching, models="short-period", delays=False)
    held(found, SHORT_PERIOD)
    assert any("no airspeed_mps: it is taken as constant" in line for line in found.verdict)
    assert "at unknown airspeed" in found.to_text()
    assert '"airspeed_mps": null' in found.to_json()


def test_without_airspeed_an_aircraft_file_gives_no_coefficients(pitching: pd.DataFrame) -> None:
    [answer] = host.identify(pitching, models="short-period", aircraft="ultrastick25e").linear
    assert answer.coefficients == ()


@pytest.mark.parametrize("method", ["filter-error-gust", "flight"])
def test_what_needs_the_airspeed_says_so(pitching: pd.DataFrame, method: str) -> None:
    model = "longitudinal" if method == "flight" else "short-period"
    with pytest.raises(IdentificationError, match="needs airspeed_mps"):
        host.identify(pitching, models=model, methods=method)


def test_without_airspeed_the_default_models_are_those_that_need_none(
    pitching: pd.DataFrame,
) -> None:
    found = host.identify(pitching)
    assert [a.template for a in found.linear] == ["short-period"]
    assert any("without airspeed_mps longitudinal and lateral" in note for note in found.notes)


def test_without_attitude_the_default_models_are_those_that_need_none(
    pitching: pd.DataFrame,
) -> None:
    """Lift, pitch and airspeed were refused: longitudinal needs theta."""
    table = pitching.assign(airspeed_mps=SPEED_MPS, r_radps=2e-4 * np.sin(pitching["t_s"]))
    found = host.identify(table, delays=False)
    held(found, SHORT_PERIOD)
    assert [a.template for a in found.linear] == ["short-period"]
    for missing, model in (("theta_rad", "short-period"), ("phi_rad", "dutch-roll")):
        assert any(f"without {missing}" in n and f"{model} in its place" in n for n in found.notes)


def test_a_table_without_a_surface_says_so(pitching: pd.DataFrame) -> None:
    with pytest.raises(IdentificationError, match=r"no column of a surface .*argument mapping"):
        host.identify(pitching.drop(columns="elevator_rad"), models="short-period")


def test_a_model_saved_without_airspeed_can_be_read(pitching: pd.DataFrame, tmp_path: Path) -> None:
    table, saved = tmp_path / "pitch.csv", tmp_path / "m.toml"
    pitching.to_csv(table, index=False)
    words = ["identify", str(table), "--model", "short-period", "--save-model", str(saved)]
    assert main(words) == 0
    assert main(["identify", str(table), "--model", str(saved)]) == 0


def test_a_flying_wing_has_no_rudder(rolling: pd.DataFrame) -> None:
    found = host.identify(rolling, models="lateral", delays=False)
    held(found, LATERAL)
    assert found.linear[0].model.inputs == ("aileron_rad",)
    assert any(
        "rudder_rad is not in the data: Y_dr, L_dr, N_dr left out" in x for x in found.verdict
    )


def test_a_rudder_that_never_moved_is_left_out(rolling: pd.DataFrame) -> None:
    found = host.identify(rolling.assign(rudder_rad=0.0), models="lateral", delays=False)
    held(found, LATERAL)
    assert any("rudder_rad never moved: Y_dr, L_dr, N_dr left out" in x for x in found.verdict)


def test_no_delay_is_estimated_where_none_is_wanted(pitching: pd.DataFrame) -> None:
    [free] = host.identify(pitching, models="short-period").linear
    [none] = host.identify(pitching, models="short-period", delays=False).linear
    assert "delay_vanes_s" in free.result.names
    assert not any("delay" in name for name in none.result.names)
    assert none.delays == {}


def test_constants_of_each_maneuver_are_printed(pitching: pd.DataFrame) -> None:
    found = host.identify(pitching, models="short-period", delays=False)
    text = found.to_text()
    for name in ("bias_rate.alpha_rad", "bias_rate.q_radps", "initial.alpha_rad"):
        shown, _ = people_name(name)
        [line] = [x for x in text.splitlines() if x.strip().startswith(shown)]
        assert line.count("+-") == len(found.linear[0].used)
        assert f'"{name}@1"' in found.to_json()


def mapped(folder: Path, table: pd.DataFrame, lines: str) -> tuple[Path, Path]:
    source, mapping = folder / "theirs.csv", folder / "map.toml"
    table.to_csv(source, index=False)
    mapping.write_text("[columns]\n" + lines)
    return source, mapping


THREE = 'alpha_rad = "alpha_rad"\nq_radps = "q_radps"\nelevator_rad = "elevator_rad"\n'


def test_a_map_hides_what_it_does_not_name(pitching: pd.DataFrame, tmp_path: Path) -> None:
    """A stranger's psi_rad stands in the table under our name, and nobody means it."""
    table = pitching.assign(psi_rad=np.linspace(0.0, 3.0, len(pitching)), throttle=40.0)
    assert "psi_rad" not in read_columns(*mapped(tmp_path, table, THREE))[0]
    shown = THREE + 'throttle = { from = "throttle", unit = "percent" }\n'
    columns, _ = read_columns(*mapped(tmp_path, table, shown))
    assert columns["throttle"][0] == pytest.approx(0.4)
    assert "psi_rad" not in columns
    assert "psi_rad" in read_columns(tmp_path / "theirs.csv")[0]


def test_a_map_takes_any_extra_column(pitching: pd.DataFrame, tmp_path: Path) -> None:
    table = pitching.assign(Flap=10.0)
    lines = THREE + 'flap_rad = { from = "Flap", unit = "deg" }\n'
    columns, _ = read_columns(*mapped(tmp_path, table, lines))
    assert columns["flap_rad"][0] == pytest.approx(np.deg2rad(10.0))
    slip = THREE.replace("q_radps =", "q_rapds =")
    with pytest.raises(IdentificationError, match=r"q_rapds \(did you mean q_radps\?\)"):
        read_columns(*mapped(tmp_path, table, slip))


def test_delays_that_the_sensors_tell_are_not_taken_out_either() -> None:
    """Vanes later than their file says are found by reconstruction: not where none is wanted."""
    table = virtual_flight("demo", 3, chain="none").table
    for name in ("alpha_rad", "beta_rad"):
        table[name] = np.interp(table["t_s"] - 0.020, table["t_s"], table[name])
    both = [
        host.identify(
            table, aircraft="ultrastick25e", models="short-period", methods="equation-error",
            delays=delays,
        )
        for delays in (True, False)
    ]  # fmt: skip
    corrected_names = [[c.name for c in one.linear[0].corrections] for one in both]
    assert "vane_delay_s" in corrected_names[0]
    assert "vane_delay_s" not in corrected_names[1]


def test_known_constants_of_a_model_file_are_printed(
    pitching: pd.DataFrame, tmp_path: Path
) -> None:
    """The start is known here, and so is the bias: alpha is measured about its trim."""
    path = tmp_path / "m.toml"
    path.write_text(
        """states = ["alpha_rad", "q_radps"]
inputs = ["elevator_rad"]
outputs = ["alpha_rad", "q_radps"]
A = [["Z_alpha", 1.0], ["M_alpha", "M_q"]]
B = [["Z_de"], ["M_de"]]
delays = []
initial_states = { alpha_rad = 0.06, q_radps = 0.0 }
state_biases = { alpha_rad = 0.36, q_radps = 4.8 }
noise = { alpha_rad = 2e-4, q_radps = 2e-4 }
"""
    )
    found = host.identify(pitching, models=path, from_s=float(pitching["t_s"].iloc[0]))
    held(found, SHORT_PERIOD)
    text = found.to_text()
    assert (
        "known: bias_rate.alpha_rad 0.36, bias_rate.q_radps 4.8, initial.alpha_rad 0.06,"
        " initial.q_radps 0, noise.alpha_rad 0.0002, noise.q_radps 0.0002"
    ) in text
    assert '"bias_rate.q_radps": 4.8' in found.to_json()
    assert "constants of each maneuver" not in text


def test_without_accelerations_a_gust_is_no_delay_of_the_vane() -> None:
    """A vane seemed 14 ms early, known to 5, and M_q was 12 % off, known to 7."""
    columns = ("t_s", "airspeed_mps", "alpha_rad", "q_radps", "theta_rad", "elevator_rad")
    measured, _ = fly(Air(intensity_mps=0.3, spread=True), 17025)
    table = pd.DataFrame({k: measured[k] for k in columns})
    [answer] = host.identify(table, models="short-period").linear
    true = derivatives(answer.trim.airspeed_mps)
    assert_held(answer.result, true, ("Z_alpha", "M_alpha", "M_q"))


LONGITUDINAL = ("t_s", "airspeed_mps", "q_radps", "theta_rad", "az_mps2", "elevator_rad")
LATERAL_COLUMNS = (
    "t_s", "airspeed_mps", "beta_rad", "p_radps", "r_radps", "phi_rad", "ay_mps2", "aileron_rad",
    "rudder_rad",
)  # fmt: skip


def flown_on(table: pd.DataFrame, axis: str) -> pd.DataFrame:
    """Return the part of a trainer's flight in which an axis is flown: elevator first."""
    lateral = table["t_s"] > 41.0
    return table[lateral if axis == "lateral" else ~lateral].reset_index(drop=True)


@pytest.fixture(scope="module")
def trainer() -> pd.DataFrame:
    """A flight in calm air, airspeed and attitude vary."""
    return pd.DataFrame(fly(Air(), 22900)[0])


@pytest.mark.parametrize(
    ("columns", "model", "known"),
    [
        # One axis alone: M_q was known to 43 %, N_p to 35.
        ((*LONGITUDINAL, "ax_mps2", "alpha_rad"), "longitudinal", {"M_alpha": 0.05, "M_q": 0.08}),
        (LATERAL_COLUMNS, "lateral", {"L_p": 0.06, "N_beta": 0.06, "N_p": 0.4}),
        # Without a vane, by one accelerometer: refused before. The airspeed's scale is in them.
        (LONGITUDINAL, "longitudinal", {"Z_alpha": 0.1, "M_alpha": 0.06, "M_q": 0.1, "M_de": 0.05}),
        (LONGITUDINAL, "short-period", {"M_q": 0.3, "M_de": 0.1}),
    ],
)
def test_columns_of_one_axis_are_enough(
    trainer: pd.DataFrame, columns: tuple[str, ...], model: str, known: dict[str, float]
) -> None:
    [answer] = host.identify(flown_on(trainer, model)[list(columns)], models=model).linear
    assert_held(answer.result, derivatives(answer.trim.airspeed_mps), known=known)


def test_lateral_motion_needs_no_accelerometers() -> None:
    """What airspeed does stayed in: L_da 6.1 % off, known to 3.0, under trust."""
    measured, _ = fly(Air("karman", 0.5, turns=False), 24410)
    forces = ["ax_mps2", "ay_mps2", "az_mps2"]
    table = flown_on(pd.DataFrame(measured), "lateral").drop(columns=forces)
    [answer] = host.identify(table, models="lateral").linear
    known = dict.fromkeys(("L_beta", "L_p", "L_da", "N_beta", "N_dr"), 0.1)
    assert_held(answer.result, derivatives(answer.trim.airspeed_mps), known=known)


def test_a_side_force_of_doubtful_unit_is_in_no_linear_fit(trainer: pd.DataFrame) -> None:
    """In g it put L_r of a light aircraft 10 to 16 % off, under trust."""
    table = flown_on(trainer, "lateral")[::2].reset_index(drop=True)
    table = table.assign(ay_mps2=table["ay_mps2"] / GRAVITY_MPS2)
    [answer] = host.identify(table, models="lateral").linear
    assert "ay_mps2" not in answer.result.model.outputs
    assert any("ay_mps2 has an open finding" in w for w in answer.result.warnings)
    names = ("L_p", "L_r", "L_da", "N_beta", "N_r", "N_dr")
    assert_held(answer.result, derivatives(answer.trim.airspeed_mps), names)
    [kept] = host.identify(
        table, models="lateral", methods="equation-error", accept=("beta-against-ay",)
    ).linear
    assert "ay_mps2" in kept.result.model.outputs


def test_an_angle_that_nothing_tells_is_refused_with_the_reason(trainer: pd.DataFrame) -> None:
    table = trainer[list(LONGITUDINAL)].drop(columns="az_mps2")
    with pytest.raises(IdentificationError, match="az_mps2 with the airspeed, or a vane") as why:
        host.identify(table, models="longitudinal")
    assert "data compatibility" not in str(why.value)
