"""What pictures are made of: outputs beside outputs, degrees, the largest and the emptiest."""

from pathlib import Path

import numpy as np
import pytest
from host.arrays import Array
from host.cli import main
from host.sysid.answer.answer_figures import draw, save_all
from host.sysid.answer.figure_kinds import (
    Bar,
    Cloud,
    Excitation,
    Trace,
    histories,
    interval_bars,
    pole_map,
    save,
    shown,
    spectra,
)
from host.sysid.flight import read_columns

from tests.host.sysid.at_hand import identify
from tests.host.sysid.verdicts import verdict_of


@pytest.fixture(scope="module")
def columns(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Array]:
    folder = tmp_path_factory.mktemp("pictures")
    quiet = ["--firmware", "none", "--no-picture"]
    assert main(["simulate", "calm", *quiet, "--seed", "4", "-o", str(folder)]) == 0
    return read_columns(folder / "flight.csv")[0]


# Residuals of these are of rates, of spectra and of one step: as many columns as rates, lines as
# frequencies, and neither may be drawn as outputs.
@pytest.mark.parametrize("method", ["equation-error", "frequency-output-error", "extended-kalman"])
def test_every_method_shows_outputs_beside_outputs(
    tmp_path: Path, columns: dict[str, Array], method: str
) -> None:
    (answer,) = identify(columns, names=("short-period",), method=method)
    for maneuver, simulated in zip(answer.maneuvers, answer.simulated, strict=True):
        assert simulated.shape == maneuver.outputs.shape
        gap = np.std(simulated - maneuver.outputs, axis=0) / np.std(maneuver.outputs, axis=0)
        assert gap.max() < 0.6
    drawn = draw(answer, "x", verdict_of(answer))
    # All are written once; of the other methods the picture of outputs, which is asked for here.
    written = save_all(drawn if method == "equation-error" else {"x_fit": drawn["x_fit"]}, tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(p.name for p in written)
    words = (tmp_path / "x_fit.svg").read_text()
    kind = "one step" if method == "extended-kalman" else "free simulation"
    assert f"{kind}, fitted data" in words
    assert "alpha, deg" in words
    assert "alpha_rad" not in words


def test_angles_are_shown_in_degrees() -> None:
    label, scale = shown("q_radps")
    assert (label, round(scale * np.pi, 4)) == ("q, deg/s", 180.0)
    assert shown("az_mps2") == ("az, m/s2", 1.0)
    assert shown("thrust_n") == ("thrust, N", 1.0)
    assert shown("CL") == ("CL", 1.0)


def test_the_largest_and_the_emptiest_are_drawn(tmp_path: Path) -> None:
    t = np.linspace(0.0, 1.0, 50)
    many = [Trace(t + 2.0 * k, t, t, f"doublet on rudder at {k}.0 s") for k in range(12)]
    inputs = [Excitation(f"input {k}", 0.02, np.sin(9.0 * t + k)) for k in range(24)]
    bars = [Bar("a", 1.0, 9.0, 1.0, True, -50.0), Bar("b", 0.0, 0.0, 1e-300, False)]
    close = [Cloud(n, p, np.full(9, p.real), np.full(9, p.imag)) for n, p in
             (("phugoid", -0.3 + 0.7j), ("spiral", 0.1 + 0j), ("roll", -20.0 + 0j))]  # fmt: skip
    for number, figure in enumerate(
        (
            histories({"p_radps": many}, "many"),
            spectra(inputs, [("roll", 3.0)], "many"),
            spectra([], [], "none"),
            interval_bars(bars, "two"),
            interval_bars([], "none"),
            pole_map(close, "close"),
            pole_map([], "none"),
        )
    ):
        path = save(figure, tmp_path / f"{number}.svg")
        assert path.read_text().rstrip().endswith("</svg>")
