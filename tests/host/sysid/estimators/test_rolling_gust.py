"""Air that rolls: a state of its own, with a lag that is a parameter."""

import numpy as np
from host.sysid.estimators.filter_error_gust import fit_with_gust, gust_process
from host.sysid.estimators.gust_model import ROLL_GUST, gust_model
from host.sysid.estimators.gust_penetration import (
    GUST_LAG,
    PREFIX,
    ROLL_LAG,
    with_gust_penetration,
    without_gust_penetration,
)
from host.sysid.models import LinearModel, Maneuver, Trim, template
from scipy import linalg

SPEED_MPS, DT_S, FINE = 18.0, 0.02, 10
TRUE = {
    "Y_beta": -0.5, "Y_da": 0.0, "Y_dr": 0.15, "L_beta": -30.0, "L_p": -16.0, "L_r": 4.0,
    "L_da": 180.0, "L_dr": 3.0, "N_beta": 30.0, "N_p": -0.8, "N_r": -1.5, "N_da": -4.0,
    "N_dr": -25.0, GUST_LAG: SPEED_MPS / 1.5, ROLL_LAG: 8.0,
}  # fmt: skip
DEVIATION = {"beta_rad": 0.003, "p_radps": 0.0003, "r_radps": 0.0003, "phi_rad": 0.002}
RECORDS_S = ((1.5, 4.5), (7.5, 10.5), (12.5, 15.5), (17.5, 20.5), (5.0, 7.5), (21.0, 24.0))


def _model() -> LinearModel:
    return template("lateral", Trim(SPEED_MPS), accelerometers=False, delays=())


def _flown(seed: int) -> Maneuver:
    """Fly 24 s of doublets in air that moves sideways and rolls, but does not turn."""
    count = len(_model().parameters)
    wide = gust_model(with_gust_penetration(_model(), SPEED_MPS, np.ones(count))[0], SPEED_MPS)
    A, B, C, _ = wide.matrices(np.array([TRUE.get(p.name, 0.0) for p in wide.parameters]))
    rng, n = np.random.default_rng(seed), len(wide.states)
    drives = np.zeros((n, 2))
    drives[wide.states.index("gust_rad"), 0] = 0.03
    drives[wide.states.index(ROLL_GUST), 1] = 1.0
    whole = np.zeros((n + 4, n + 4))
    whole[:n, :n], whole[:n, n : n + 2], whole[:n, n + 2 :] = A, B, drives
    fine = DT_S / FINE
    step = linalg.expm(whole * fine)[:n]
    inputs = np.zeros((round(24.0 / DT_S), 2))
    for surface, begin, unit in ((0, 2.0, 0.4), (0, 8.0, 0.3), (1, 13.0, 0.5), (1, 18.0, 0.6)):
        for k, sign in enumerate((1.0, -1.0)):
            at = round((begin + k * unit) / DT_S)
            inputs[at : at + round(unit / DT_S), surface] = np.deg2rad(5.0) * sign
    x, rows = np.zeros(n), []
    for k, held in enumerate(inputs):
        rows.append(C @ x)
        after = inputs[min(k + 1, len(inputs) - 1)]
        for j in range(FINE):
            u = held + (after - held) * (j + 0.5) / FINE
            x = step @ np.concatenate([x, u, rng.standard_normal(2) / np.sqrt(fine)])
    noise = np.array([DEVIATION[name] for name in wide.outputs])
    outputs = np.array(rows) + noise * rng.standard_normal((len(rows), len(noise)))
    return Maneuver(dt_s=DT_S, inputs=inputs, outputs=outputs)


def test_only_a_model_with_sideslip_and_roll_rate_feels_it() -> None:
    model = _model()
    wide, _ = with_gust_penetration(model, SPEED_MPS, np.ones(len(model.parameters)))
    more = [p.name for p in wide.parameters if p.name.startswith(PREFIX)]
    assert more == ["gust_L", "gust_N", GUST_LAG, ROLL_LAG]
    assert ROLL_GUST in gust_model(wide, SPEED_MPS).states
    assert gust_process(model) == ("gust_rad", ROLL_GUST, "phi_rad")
    assert without_gust_penetration(wide).terms == model.terms
    for name in ("dutch-roll", "short-period"):
        other = template(name, Trim(SPEED_MPS), delays=())
        wide, _ = with_gust_penetration(other, SPEED_MPS, np.ones(len(other.parameters)))
        assert ROLL_LAG not in wide.parameter_names
        assert ROLL_GUST not in gust_process(other)


def test_roll_derivatives_are_right_in_air_that_rolls() -> None:
    """As an angle of sideslip alone it left them 10 % off (rms), now 5."""
    errors = []
    seed = 0
    found = fit_with_gust(_model(), [_flown(seed)], SPEED_MPS).result
    assert found.method == "filter error with gust"
    half = found.half_width()
    for name in ("L_p", "L_da", "N_beta", "N_r", "N_dr"):
        k = found.index(name)
        error = found.estimate[k] - TRUE[name]
        assert abs(error) < 1.6 * half[k], name
        errors += [error / TRUE[name]] if name in ("L_p", "L_da") else []
    assert np.sqrt(np.mean(np.square(errors))) < 0.075


def test_the_air_rolls_already_where_a_short_record_begins() -> None:
    """Taken for still there, it seemed quicker than it is, and L_p came out 8 % small."""
    missed = []
    for seed in range(6):
        whole = _flown(seed)
        cut = [slice(round(a / DT_S), round(b / DT_S)) for a, b in RECORDS_S]
        records = [Maneuver(DT_S, whole.inputs[c], whole.outputs[c]) for c in cut]
        found = fit_with_gust(_model(), records, SPEED_MPS).result
        missed.append(found.value("L_p") / TRUE["L_p"] - 1.0)
    assert abs(np.mean(missed)) < 0.06
