"""Methods that packages plug in by entry point: used like our own, and in one line where wrong."""

import json
import textwrap
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.sysid import fit, methods
from studies.data import with_rates
from studies.navion import navion_free

from host import plugins
from tests.host.short_period_table import identified, short_period_table

HALVES = """
import numpy as np
from dataclasses import replace
from host.files.quantities import Quantity
from host.sysid import Method, MethodOption, fit, number

def fit_halves(model, maneuvers, *, shrink=1.0):
    '''Least squares, reached in two steps, times a number.'''
    found = fit("equation-error", model, maneuvers)
    end = shrink * found.estimate
    details = {"history": np.array([0.5 * end, end]), "history_step": np.arange(2.0),
               "history_share": np.array([0.5, 1.0])}
    return replace(found, method="halves", estimate=end, details=details)

SHRINK = MethodOption("shrink", number(Quantity("", 0.0, 2.0, "an example")))
METHOD = Method(function=fit_halves, about="least squares in two steps", options=(SHRINK,),
                history=lambda result: ["  two steps"])
"""


def installed(folder: Path, package: str, entries: str, module: str = "") -> Path:
    """Put a package into a folder as pip would; `module` is its source."""
    about = folder / f"{package}-1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(textwrap.dedent(entries))
    (folder / f"{package}.py").write_text(module)
    return folder


@pytest.fixture
def halves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    entries = """
        [host.identification_methods]
        halves = plugged_halves:METHOD
        output-error = plugged_halves:METHOD
    """
    monkeypatch.syspath_prepend(installed(tmp_path / "site", "plugged_halves", entries, HALVES))


@pytest.mark.usefixtures("halves")
def test_a_method_of_another_package_is_one_like_any(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", "--method", "list"]) == 0
    assert "least squares in two steps (options: shrink)" in capsys.readouterr().out
    table, path = short_period_table(tmp_path), tmp_path / "h.csv"
    words = ["--method-option", "shrink=0.5", "--history", str(path)]
    assert identified(table, "halves", *words) == 0
    assert "  two steps" in capsys.readouterr().out
    history = pd.read_csv(path)
    assert list(history.columns[:3]) == ["iteration", "share", "Z_alpha"]
    found = {}
    for method in ("equation-error", "halves"):
        assert identified(table, method, "--json") == 0
        [found[method]] = json.loads(capsys.readouterr().out)["answers"]
    assert found["halves"]["parameters"] == found["equation-error"]["parameters"]
    assert found["halves"]["settling"]["step"] == "iteration"
    whole = found["halves"]["parameters"]["M_alpha"]["value"]
    assert history["M_alpha"].iloc[-1] == pytest.approx(0.5 * whole)


@pytest.mark.usefixtures("halves")
def test_a_name_of_ours_stays_ours() -> None:
    found = fit("output-error", navion_free(), [with_rates(1, snr=10.0)])
    assert found.method != "halves"


WRONG = {
    "gone": "cannot be loaded (ModuleNotFoundError: No module named 'plugged_gone')",
    "missing": "cannot be loaded (AttributeError: module 'plugged_wrong' has no attribute",
    "raising": "cannot be loaded (ValueError: two lines); install that package again",
    "number": "is of type int, expected a host.sysid.Method",
    "dictionary": "dictionary returned a dict, expected a host.sysid.FitResult",
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_with_a_plug_is_one_line(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    entries = """
        [host.identification_methods]
        gone = plugged_gone:METHOD
        missing = plugged_wrong:METHOD
        raising = plugged_raising:METHOD
        number = plugged_wrong:NUMBER
        dictionary = plugged_wrong:DICTIONARY
    """
    module = """
from host.sysid import Method
NUMBER = 3
DICTIONARY = Method(function=lambda model, maneuvers: {}, about="no result")
"""
    site = installed(tmp_path / "site", "plugged_wrong", entries, module)
    (site / "plugged_raising.py").write_text('raise ValueError("two\\nlines")')
    monkeypatch.syspath_prepend(site)
    assert identified(short_period_table(tmp_path), name) == 2
    said = capsys.readouterr().err
    assert WRONG[name] in said
    [line] = [x for x in said.splitlines() if name in x]
    assert line.startswith("host")
    assert main(["identify", "--method", "list"]) == 0  # the others are listed all the same
    assert "the printed network iteration" in capsys.readouterr().out


def test_two_packages_of_one_name_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for package in ("plugged_one", "plugged_two"):
        entries = f"[host.identification_methods]\ntwice = {package}:METHOD\n"
        monkeypatch.syspath_prepend(installed(tmp_path / package, package, entries, HALVES))
    assert identified(short_period_table(tmp_path), "twice") == 2
    said = capsys.readouterr().err
    assert "twice is plugged in by plugged_two and plugged_one; uninstall all but one" in said


def test_an_install_older_than_the_entry_points_of_a_clone_does_no_harm(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    about = tmp_path / "flight_test_host-0.1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: flight-test-host\nVersion: 0.1\n")
    stale = "[host.identification_methods]\nhopfield = host.sysid.gone:METHOD\nold = gone:METHOD\n"
    (about / "entry_points.txt").write_text(stale)
    monkeypatch.syspath_prepend(tmp_path)
    found = methods()
    assert found["hopfield"] == "the printed network iteration"
    assert "unscented-kalman" in found
    assert "old" not in found


def test_methods_of_our_own_look_for_no_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Looking takes 50 ms and may meet a broken package: only who names a method of one pays."""

    def looked(group: str, path: tuple[str, ...]) -> None:
        raise AssertionError(group)

    monkeypatch.setattr(plugins, "_read", looked)
    table = short_period_table(tmp_path)
    assert identified(table, "flight") == 0
    assert identified(table, "recursive", "--method-option", "forgetting=0.99") == 0
    assert "settled, within 10 %" in capsys.readouterr().out
    with pytest.raises(AssertionError, match=r"host\.identification_methods"):
        methods()
    assert np.isfinite(fit("equation-error", navion_free(), [with_rates(1)]).estimate).all()
