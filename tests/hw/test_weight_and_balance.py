"""Weight and balance: known bodies, what is refused, the page's example."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest

from tests.hw.test_pin_map import load_module

HW = Path(__file__).resolve().parents[2] / "hw"
TOOL: ModuleType = load_module("weight_and_balance")
HEAD = "what,mass_g,x_m,y_m,z_m\n"


def test_a_dumbbell_has_the_inertia_of_the_textbook() -> None:
    # Two points of 1 kg, 2 m apart: reduced mass 0.5 kg times the distance squared.
    after = TOOL.balance(1.0, (0.0, 0.0, 0.0), TOOL.read(HEAD + "weight,1000,2,0,0\n"))
    assert after.mass_kg == pytest.approx(2.0)
    assert after.cg_m == pytest.approx((1.0, 0.0, 0.0))
    assert after.inertia_kgm2 == pytest.approx((0.0, 2.0, 2.0))


def test_two_equal_tips_move_no_cg_sideways() -> None:
    things = TOOL.read(HEAD + "left,50,0.1,-0.8,0\nright,50,0.1,0.8,0\n")
    after = TOOL.balance(2.0, (0.1, 0.1, 0.1), things)
    assert after.cg_m[1] == 0.0
    assert after.inertia_kgm2[0] - 0.1 == pytest.approx(0.1 * 0.8**2)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "found no line"),
        (HEAD, "found no line"),
        (HEAD + "a,b,0,0,0\n", "line 2: expected"),
        (HEAD + "a,1,0,0\n", "line 2: expected"),
        (HEAD + "a,-5,0,0,0\n", "line 2: found mass -5 g"),
        (HEAD + "a,nan,0,0,0\n", "line 2: found mass nan g"),
    ],
)
def test_what_is_no_list_is_refused(
    text: str, complaint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "things.csv"
    path.write_text(text)
    assert TOOL.main([str(path), "--mass", "2", "--inertia", "1", "1", "1"]) == 2
    assert complaint in capsys.readouterr().err


def test_page_shows_what_the_example_prints(capsys: pytest.CaptureFixture[str]) -> None:
    page = (HW / "install.md").read_text(encoding="utf-8")
    arguments = ["--mass", "2.605", "--inertia", "0.129", "0.197", "0.258"]
    assert TOOL.main([str(HW / "installation.csv"), *arguments]) == 0
    for line in capsys.readouterr().out.splitlines():
        assert f"    {line}\n" in page
