"""What pictures are made of: outputs beside outputs, degrees, the largest and the emptiest."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.arrays import Array
from host.cli import main
from host.export.pictures import save, save_all
from host.sysid.answer.answer_figures import draw
from host.sysid.answer.figure_kinds import (
    Bar,
    Cloud,
    Excitation,
    Trace,
    histories,
    interval_bars,
    pole_map,
    shown,
    spectra,
)
from host.sysid.answer.frequency_pictures import frequency_pictures, pairs_of
from host.sysid.checks import Finding
from host.sysid.flight import read_columns
from host.sysid.models import Maneuver

from tests.host.short_period_table import short_period_table
from tests.host.sysid.at_hand import identify
from tests.host.sysid.verdicts import verdict_of


@pytest.fixture(scope="module")
def columns(simulated: Callable[[str, int], Path]) -> dict[str, Array]:
    return read_columns(simulated("calm", 4) / "flight.csv")[0]


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


def test_frequency_responses_are_drawn_with_their_band_and_warn_of_feedback(
    tmp_path: Path, columns: dict[str, Array]
) -> None:
    (answer,) = identify(columns, names=("short-period",))
    loop = Finding("feedback", (), "elevator_rad is a function of q_radps")
    figures, lines = frequency_pictures([answer], [loop])
    pairs, method = pairs_of(answer)
    assert [(p.input, p.output) for p in pairs] == [
        ("elevator_rad", "q_radps"),
        ("elevator_rad", "az_mps2"),
    ]
    low, high = pairs[0].band_hz or (0.0, 0.0)
    assert high / low > 4.0  # calm air: what the elevator moves is coherent beyond the short period
    # What the model flies itself has the model's response: hold, delays and order are the same.
    flown = [replace(m, outputs=y) for m, y in zip(answer.maneuvers, answer.simulated, strict=True)]
    own = pairs_of(replace(answer, maneuvers=tuple(flown), held_out_runs=()))[0]
    assert np.median(np.abs(np.log(own[0].recorded / own[0].model))) < 0.05
    words = save(figures[0], tmp_path / "bode.svg").read_text()
    title = figures[0].get_suptitle()
    assert method in " ".join(title.split()) and "elevator to az, m/s2 per deg" in words
    assert max(map(len, title.splitlines())) < 100  # both ends ran out of the picture
    assert any("controller's inverse" in line for line in lines) and "controller" in words
    assert not any("inverse" in line for line in frequency_pictures([answer])[1])
    still = replace(answer, maneuvers=(_short(answer.maneuvers[0]),), held_out_runs=())
    assert frequency_pictures([still])[0] == []
    assert "fly a longer input" in frequency_pictures([still])[1][0]


def _short(maneuver: Maneuver) -> Maneuver:
    cut = {n: getattr(maneuver, n)[:12] for n in ("inputs", "outputs")}
    return Maneuver(maneuver.dt_s, name="short", **cut)


def test_host_plot_bode_writes_a_page_and_pictures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flight = str(short_period_table(tmp_path))
    asked = ["plot", flight, "--bode", "--model", "short-period"]
    both = ["--png", str(tmp_path / "band.png"), "-o", str(tmp_path / "band.html")]
    assert main([*asked, *both]) == 0
    assert "elevator to q: coherence above 0.6 from" in capsys.readouterr().out
    assert (tmp_path / "band.png").read_bytes().startswith(b"\x89PNG")
    page = (tmp_path / "band.html").read_text()
    assert page.count("<img") == 1 and "chirp-z" in page and "<script" not in page
    assert main([*asked, "--png", str(tmp_path / "band.pdf")]) == 2
    assert main(["plot", flight, "--model", "short-period"]) == 2
    assert "only --bode fits a model" in capsys.readouterr().err
