"""A prior from TOML, AVL or Datcom is compared with the answer, in our axes at the flight's alpha.

The layouts are those of the programs; numbers and aircraft are made up.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from host.aircraft.handbook import DIMENSIONS
from host.aircraft.prior.datcom import read_datcom
from host.aircraft.prior.prior_file import read_prior
from host.aircraft.prior.prior_table import PriorError, PriorTable, about_body_axes
from host.errors import UsageError
from host.sysid.aerodynamics import Coefficient, CoefficientTable
from host.sysid.answer.prior_comparison import prior_document, prior_lines

DEGREE = 180.0 / np.pi
DATCOM = Path(__file__).with_name("datcom_layout.dat").read_text()


def read(tmp_path: Path, name: str, text: str, airspeed_mps: float = 0.0) -> PriorTable:
    (tmp_path / name).write_text(text)
    return read_prior(tmp_path / name, airspeed_mps)


STANDARD = "Standard axis orientation,  X fwd, Z down"


def avl_header(alpha_deg: float) -> str:
    return f"""
 ---------------------------------------------------------------
 Vortex Lattice Output -- Total Forces

 Configuration: made-up model
     # Surfaces =   5
  Sref = 0.33000       Cref = 0.26000       Bref =  1.2700
  Xref = 0.31000       Yref =  0.0000       Zref = 0.20000E-01

 {STANDARD}

  Alpha =   {alpha_deg:.5f}     pb/2V =  -0.00000     p'b/2V =  -0.00000
  Beta  =   0.00000     qc/2V =   0.00000
  Mach  =     0.060     rb/2V =  -0.00000     r'b/2V =  -0.00000

  CXtot =   0.03000     Cltot =  -0.00000     Cl'tot =  -0.00000
  CYtot =   0.00000     Cmtot =   0.01000
  CZtot =  -0.50000     Cntot =  -0.00000     Cn'tot =  -0.00000
"""


def stability(alpha_deg: float, lift_slope: float = 4.123456) -> str:
    return f"""{avl_header(alpha_deg)}
 Stability-axis derivatives...

                             alpha                beta
                  ----------------    ----------------
 z' force CL |    CLa =   {lift_slope:.6f}    CLb =   0.000000
 y  force CY |    CYa =   0.000000    CYb =  -0.300000
 x' mom.  Cl'|    Cla =   0.000000    Clb =  -0.041000
 y  mom.  Cm |    Cma =  -1.210000    Cmb =   0.000000
 z' mom.  Cn'|    Cna =   0.000000    Cnb =   0.060000

                     roll rate  p'      pitch rate  q'        yaw rate  r'
                  ----------------    ----------------    ----------------
 z' force CL |    CLp =   0.000000    CLq =   7.000000    CLr =   0.000000
 y  force CY |    CYp =   0.020000    CYq =   0.000000    CYr =   0.200000
 x' mom.  Cl'|    Clp =  -0.440000    Clq =   0.000000    Clr =   9.8E-02
 y  mom.  Cm |    Cmp =   0.000000    Cmq = -10.500000    Cmr =   0.000000
 z' mom.  Cn'|    Cnp =  -0.030000    Cnq =   0.000000    Cnr =  -0.080000

                  aileron      d01     elevator     d02     rudder       d03
                  ----------------    ----------------    ----------------
 z' force CL |   CLd01 =   0.000000   CLd02 =   0.008000   CLd03 =   0.000000
 y  force CY |   CYd01 =   0.000100   CYd02 =   0.000000   CYd03 =   0.003000
 x' mom.  Cl'|   Cld01 =  -0.004000   Cld02 =   0.000000   Cld03 =   0.000100
 y  mom.  Cm |   Cmd01 =   0.000000   Cmd02 =  -0.016000   Cmd03 =   0.000000
 z' mom.  Cn'|   Cnd01 =   0.000100   Cnd02 =   0.000000   Cnd03 =  -0.001000
 Trefftz drag| CDffd01 =   0.000000 CDffd02 =   0.000200 CDffd03 =   0.000000
 span eff.   |    ed01 =   0.000000    ed02 =   0.010000    ed03 =   0.000000

 Neutral point  Xnp =   0.390000
 Clb Cnr / Clr Cnb  =   1.023000    (  > 1 if spirally stable )
"""


def test_avl_stability_axes_are_read_and_turned(tmp_path: Path) -> None:
    level = read(tmp_path, "level.st", stability(0.0)).at(0.0)
    assert level["CL_alpha"] == 4.123456
    assert (level["Cl_beta"], level["Cl_p"], level["Cl_r"]) == (-0.041, -0.44, 0.098)
    assert level["Cn_beta"] == 0.06
    silent = "\n".join(x for x in stability(0.0).splitlines() if "Cna" not in x)
    rest = read(tmp_path, "silent.st", silent).at(0.0)
    assert "Cn_beta" not in rest  # the spiral figure, "Clb Cnr / Clr Cnb =", is no derivative
    # One run is turned by its own angle, wherever it is asked for.
    turned = read(tmp_path, "up.st", stability(6.0)).at(np.radians(9.0))
    # The same moments by turning vectors: both the moment and the rate it is taken by.
    a = np.radians(6.0)
    to_stability = np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])
    printed = np.array([[-0.44, 0.098], [-0.03, -0.08]])
    expected = to_stability.T @ printed @ to_stability
    ours = [[turned["Cl_p"], turned["Cl_r"]], [turned["Cn_p"], turned["Cn_r"]]]
    np.testing.assert_allclose(ours, expected, rtol=1e-12)
    np.testing.assert_allclose(
        [turned["Cl_beta"], turned["Cn_beta"]], to_stability.T @ [-0.041, 0.06], rtol=1e-12
    )
    assert turned["CY_r"] == pytest.approx(0.02 * np.sin(a) + 0.2 * np.cos(a))
    assert turned["Cm_q"] == -10.5


def test_controls_of_avl_are_per_radian_with_our_signs(tmp_path: Path) -> None:
    """Aileron of this file is positive right edge down; ours rolls to the right."""
    prior = read(tmp_path, "level.st", stability(0.0)).at(0.0)
    assert prior["Cl_da"] == pytest.approx(0.004 * DEGREE)
    assert prior["Cn_da"] == pytest.approx(-0.0001 * DEGREE)
    assert prior["Cm_de"] == pytest.approx(-0.016 * DEGREE)
    assert prior["CL_de"] == pytest.approx(0.008 * DEGREE)
    assert prior["Cn_dr"] == pytest.approx(-0.001 * DEGREE)
    assert prior["CY_dr"] == pytest.approx(0.003 * DEGREE)
    other = stability(0.0).replace("Cmd02 =  -", "Cmd02 =   ").replace("CLd02 =   ", "CLd02 =  -")
    opposite = read(tmp_path, "opposite.st", other).at(0.0)
    assert opposite["Cm_de"] == prior["Cm_de"]
    assert opposite["CL_de"] == prior["CL_de"]


def test_several_runs_of_avl_are_a_table_over_alpha(tmp_path: Path) -> None:
    text = stability(-2.0, 4.0) + stability(6.0, 5.0)
    prior = read(tmp_path, "polar.st", text)
    assert prior.at(np.radians(2.0))["CL_alpha"] == pytest.approx(4.5)
    assert prior.limits_rad == pytest.approx((np.radians(-2.0), np.radians(6.0)))
    assert any("Sref 0.33, Cref 0.26, Bref 1.27" in line for line in prior.source)


def forces(u: float, w: float) -> tuple[float, float]:
    """Return CX and CZ of a made-up body, force over the dynamic pressure of the nominal speed."""
    V2, alpha = u * u + w * w, np.arctan2(w, u)
    lift, drag = V2 * (0.3 + 4.4 * alpha), V2 * (0.03 + 0.6 * alpha**2)
    return (
        float(lift * np.sin(alpha) - drag * np.cos(alpha)),
        float(-lift * np.cos(alpha) - drag * np.sin(alpha)),
    )


def test_avl_body_axes_come_to_the_same_lift_slope(tmp_path: Path) -> None:
    """Derivatives by u and w of a body whose lift slope is 4.4, as AVL would print them."""
    a, step = np.radians(5.0), 1e-6
    u, w = np.cos(a), np.sin(a)
    by_u = (np.array(forces(u + step, w)) - np.array(forces(u - step, w))) / (2.0 * step)
    by_w = (np.array(forces(u, w + step)) - np.array(forces(u, w - step))) / (2.0 * step)
    CX, CZ = forces(u, w)
    header = avl_header(5.0).replace("CXtot =   0.03000", f"CXtot = {CX:.6f}")
    header = header.replace("CZtot =  -0.50000", f"CZtot = {CZ:.6f}")
    text = f"""{header}
 Geometry-axis derivatives...

                    axial   vel. u     sideslip vel. v      normal  vel. w
                  ----------------    ----------------    ----------------
 x force CX  |    CXu = {by_u[0]:.6f}    CXv =   0.000000    CXw = {by_w[0]:.6f}
 y force CY  |    CYu =   0.000000    CYv =  -0.300000    CYw =   0.000000
 z force CZ  |    CZu = {by_u[1]:.6f}    CZv =   0.000000    CZw = {by_w[1]:.6f}
 x mom.  Cl  |    Clu =   0.000000    Clv =  -0.041000    Clw =   0.000000
 y mom.  Cm  |    Cmu =   0.020000    Cmv =   0.000000    Cmw =  -1.200000
 z mom.  Cn  |    Cnu =   0.000000    Cnv =   0.060000    Cnw =   0.000000

                      roll rate  p       pitch rate  q         yaw rate  r
                  ----------------    ----------------    ----------------
 x force CX  |    CXp =   0.000000    CXq =   0.500000    CXr =   0.000000
 y force CY  |    CYp =   0.020000    CYq =   0.000000    CYr =   0.200000
 z force CZ  |    CZp =   0.000000    CZq =  -7.000000    CZr =   0.000000
 x mom.  Cl  |    Clp =  -0.440000    Clq =   0.000000    Clr =   0.098000
 y mom.  Cm  |    Cmp =   0.000000    Cmq = -10.500000    Cmr =   0.000000
 z mom.  Cn  |    Cnp =  -0.030000    Cnq =   0.000000    Cnr =  -0.080000
"""
    prior = read(tmp_path, "body.sb", text).at(a)
    assert prior["CL_alpha"] == pytest.approx(4.4, abs=1e-4)
    assert prior["CD_alpha"] == pytest.approx(1.2 * a, abs=1e-4)
    assert prior["CL_q"] == pytest.approx(7.0 * np.cos(a) + 0.5 * np.sin(a))
    assert prior["Cm_alpha"] == pytest.approx(-1.2 * np.cos(a) - 0.02 * np.sin(a))
    assert (prior["CY_beta"], prior["Cl_beta"], prior["Cl_p"]) == (-0.3, -0.041, -0.44)
    with pytest.raises(PriorError, match="ST and SB"):
        read(tmp_path, "mixed.txt", text + stability(5.0))


@pytest.mark.parametrize(
    ("alpha_deg", "slope"), [(-2.0, 0.07), (0.0, 0.075), (2.0, 0.08), (6.0, 0.035), (20.0, -0.01)]
)
def test_datcom_is_read_at_the_angle_of_attack_flown(
    tmp_path: Path, alpha_deg: float, slope: float
) -> None:
    """Between rows, across a row where no method tells, and beyond the end."""
    prior = read(tmp_path, "for006.dat", DATCOM).at(np.radians(alpha_deg))
    assert prior["CL_alpha"] == pytest.approx(DEGREE * slope)
    assert prior["CL_q"] == pytest.approx(DEGREE * 0.13)  # printed once


def test_datcom_tables_are_those_of_the_whole_aircraft(tmp_path: Path) -> None:
    prior = read(tmp_path, "for006.dat", DATCOM)
    printed = {
        "CL_alpha": 0.075, "Cm_alpha": -0.022, "CY_beta": -0.005, "Cn_beta": 0.0015,
        "Cl_beta": -0.0011, "CL_q": 0.13, "Cm_q": -0.19, "Cl_p": -0.0072, "CY_p": -0.0011,
        "Cn_p": -0.0004, "Cn_r": -0.0012, "Cl_r": 0.0016,
    }  # fmt: skip
    assert prior.at(0.0) == pytest.approx({k: DEGREE * v for k, v in printed.items()})
    source = "\n".join(prior.source)
    assert "wing-body-vertical tail-horizontal tail, Mach 0.05" in source
    assert "reference area 0.33 M**2, chord 0.26, span 1.27" in source
    assert prior.stability_axes
    pitched = read(tmp_path, "for006.dat", DATCOM).at(np.radians(2.0))
    a = np.radians(2.0)
    assert pitched["Cl_beta"] == pytest.approx(DEGREE * (-0.0012 * np.cos(a) - 0.0015 * np.sin(a)))
    assert pitched["CY_p"] == pytest.approx(DEGREE * -0.0012)  # no CY_r to turn it with


@pytest.mark.parametrize(("airspeed_mps", "slope"), [(17.0, 0.075), (25.0, 0.075), (34.0, 0.08)])
def test_datcom_page_of_the_nearest_mach_number_is_taken(
    tmp_path: Path, airspeed_mps: float, slope: float
) -> None:
    prior = read(tmp_path, "for006.dat", DATCOM, airspeed_mps=airspeed_mps)
    assert prior.at(0.0)["CL_alpha"] == pytest.approx(DEGREE * slope)


def test_datcom_per_radian_and_in_ground_effect(tmp_path: Path) -> None:
    radian = read(tmp_path, "radian.dat", DATCOM.replace("PER DEGREE", "PER RADIAN"))
    assert radian.at(0.0)["Cm_q"] == pytest.approx(-0.19)
    grounded = DATCOM.replace("MADE-UP MODEL AIRCRAFT, NO REAL ONE\n \n", "IN GROUND EFFECT\n \n")
    assert read_datcom(grounded) is None


def test_toml_holds_numbers_or_a_table_over_alpha(tmp_path: Path) -> None:
    plain = read(tmp_path, "p.toml", "[coefficients]\nCm_q = -10.9\n")
    assert plain.at(0.1) == {"Cm_q": -10.9}
    text = "alpha_deg = [-4, 0, 8]\n[coefficients]\nCL_alpha = [4.0, 4.4, 3.6]\nCm_q = -10\n"
    prior = read(tmp_path, "table.toml", text)
    assert prior.at(np.radians(2.0)) == pytest.approx({"CL_alpha": 4.2, "Cm_q": -10.0})


def test_turning_there_and_back_changes_nothing() -> None:
    rng = np.random.default_rng(3)
    names = [f"{c}_{x}" for c in ("CY", "Cl", "Cn") for x in ("beta", "p", "r", "da", "dr")]
    first = {name: float(rng.standard_normal()) for name in names}
    back = about_body_axes(about_body_axes(first, 0.2), -0.2)
    assert back == pytest.approx(first)


def test_disagreement_is_named_at_the_alpha_of_each_answer() -> None:
    found = (Coefficient("Cm_q", -9.0, 0.4, 1.0), Coefficient("Cl_p", -0.4, 0.0, 0.2))
    points = {"Cm_q": [(0.0, -10.9), (0.2, -8.9)], "Cl_p": [(0.0, -0.5)], "CL_q": [(0.0, 1.0)]}
    prior = PriorTable(points, stability_axes=False, source=("a handbook", ""))
    tables = [
        CoefficientTable("all", "slow flight", 0.2, found),
        CoefficientTable("all", "fast flight", 0.0, found),
        CoefficientTable("other", "nothing shared", 0.0, ()),
    ]
    lines = prior_lines(tables, prior)
    assert lines[0] == "prior: a handbook"
    assert lines[1].startswith(
        "all, slow flight: prior read at alpha 11.5 deg of a table from 0 to"
    )
    assert [line.split()[0] for line in lines[2:5]] == ["coefficient", "Cm_q", "Cl_p"]
    assert lines[3].endswith("  inside")
    assert lines[5].startswith("all, fast flight")
    assert lines[7].endswith("outside the interval")
    assert len(lines) == 9
    far = prior_lines([CoefficientTable("all", "stalled", 0.5, found)], prior)
    assert "beyond its end" in far[1]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[coefficients]\nCm_q = 'x'\n",
        "[coefficients]\nCm_q = nan\n",
        "[coefficients]\nCm_q = [1.0, 2.0]\n",
        "alpha_deg = [2, 1]\n[coefficients]\nCm_q = 1.0\n",
        "alpha_deg = 3\n[coefficients]\nCm_q = 1.0\n",
        "= 3",
        "coefficients = 1",
    ],
)
def test_garbage_is_one_clear_line(tmp_path: Path, text: str) -> None:
    with pytest.raises(PriorError, match=r"p\.toml") as caught:
        read(tmp_path, "p.toml", text)
    assert "\n" not in str(caught.value)


DAMAGE: list[Callable[[str], str]] = [
    lambda text: text[: len(text) // 7],
    lambda text: text.replace("ALPHA", "OMEGA").replace("axis derivatives", "axis numbers"),
    lambda text: "".join(c if k % 3 else "#" for k, c in enumerate(text)),
    lambda text: "".join(line[40:] + "\n" for line in text.splitlines()),
]


@pytest.mark.parametrize("damage", DAMAGE)
@pytest.mark.parametrize("name", ["for006.dat", "level.st"])
def test_damaged_output_is_one_clear_line(
    tmp_path: Path, name: str, damage: Callable[[str], str]
) -> None:
    text = DATCOM if name.startswith("for") else stability(3.0)
    with pytest.raises(PriorError, match="no coefficient") as caught:
        read(tmp_path, name, damage(text))
    assert "\n" not in str(caught.value)


def test_geometric_orientation_of_avl_is_refused(tmp_path: Path) -> None:
    text = stability(3.0).replace(STANDARD, "Geometric axis orientation,  X aft, Z up  ")
    with pytest.raises(PriorError, match="x forward, z down"):
        read(tmp_path, "level.st", text)


@pytest.mark.parametrize("printed", ["***********", "        NaN", "  -Infinity"])
def test_what_avl_could_not_print_is_named(tmp_path: Path, printed: str) -> None:
    text = stability(6.0).replace("Cnp =  -0.030000", f"Cnp ={printed}")
    prior = read(tmp_path, "over.st", text)
    assert "Cn_p" not in prior.points
    assert "Cnp printed as no number: left out" in prior.source
    found = tuple(Coefficient(n, -0.4, 0.1, 0.2) for n in ("Cl_p", "Cl_beta"))
    lines = prior_lines([CoefficientTable("lateral", "by hand", 0.1, found)], prior)
    # Cl_p turns with Cn_p, which is not there; Cl_beta and Cn_beta are.
    (apart,) = [line for line in lines if "wholly turned" in line]
    assert apart.endswith(": Cl_p")


def test_a_run_of_avl_without_its_angle_is_refused(tmp_path: Path) -> None:
    text = stability(6.0).replace("Alpha =   6.00000", "Alpha =**********")
    with pytest.raises(PriorError, match="missing or no number"):
        read(tmp_path, "over.st", text)


def test_elevons_are_what_they_move_and_flaps_are_named(tmp_path: Path) -> None:
    plain = read(tmp_path, "plain.st", stability(0.0)).at(0.0)
    text = stability(0.0).replace("aileron      d01", "elevon_diff  d01")
    text = text.replace("elevator     d02", "elevon_sym   d02")
    assert read(tmp_path, "wing.st", text).at(0.0) == plain
    text = stability(0.0).replace("aileron      d01", "flap         d01")
    prior = read(tmp_path, "flap.st", text)
    assert "control flap no elevator, aileron or rudder: left out" in prior.source
    assert "Cl_da" not in prior.points
    assert "Cm_de" in prior.points


def test_what_datcom_does_not_print_is_named(tmp_path: Path) -> None:
    whole = read(tmp_path, "for006.dat", DATCOM)
    assert not any("not printed" in line for line in whole.source)
    cut = read(tmp_path, "cut.dat", DATCOM[: DATCOM.index("DYNAMIC DERIVATIVES")])
    assert any("CL_q, Cm_q, Cl_p" in line for line in cut.source)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("coefficients = 3", "coefficients is 3, expected a table"),
        ("alpha_deg = 3\n[coefficients]\nCm_q = 1.0", "alpha_deg is 3, expected a list"),
        ("[coefficients]\nCm_q = 'a'", "Cm_q is 'a', expected a number"),
        ("[coefficients]\nCm_q = true", "Cm_q is True, expected a number"),
    ],
)
def test_a_broken_table_says_where(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(PriorError, match=words):
        read(tmp_path, "prior.toml", text)


def test_a_prior_of_other_names_says_so(tmp_path: Path) -> None:
    prior = read(tmp_path, "prior.toml", "\ufeff[coefficients]\nCmq = -10.9\n")
    found = (Coefficient("Cm_q", -9.0, 0.4, 1.0),)
    (line,) = prior_lines([CoefficientTable("all", "by hand", 0.1, found)], prior)
    assert line == ("prior: none of its coefficients (Cmq) is in the answer, which has Cm_q")


def test_a_prior_with_half_widths_is_weighed_with_the_flight(tmp_path: Path) -> None:
    text = "[coefficients]\nCm_q = -10.0\nCL_alpha = 4.0\n[half_width]\nCm_q = 1.0\n"
    prior = read(tmp_path, "type.toml", text)
    flown = tuple(
        Coefficient(n, v, h, h) for n, v, h in (("Cm_q", -12.0, 2.0), ("CL_alpha", 5.0, 0.5))
    )
    table = CoefficientTable("longitudinal", "one", 0.1, flown)
    # Precisions 1/4 and 1: four fifths are the type's. 2 apart is inside sqrt(5), not inside 2.
    found = prior_document([table], prior)["longitudinal, one"]
    assert found["Cm_q"]["together"] == pytest.approx(-10.4)
    assert found["Cm_q"]["together_half_width"] == pytest.approx(np.sqrt(0.8))
    assert found["Cm_q"]["inside"]
    assert not found["CL_alpha"]["inside"]
    assert "together" not in found["CL_alpha"]
    assert any("-10.4" in line and "inside" in line for line in prior_lines([table], prior))


@pytest.mark.parametrize(
    ("width", "said"),
    [("Cm_q = 0.0", "half_width.Cm_q"), ("Cm_r = 1.0", "no coefficient of this name")],
)
def test_a_wrong_half_width_is_refused(tmp_path: Path, width: str, said: str) -> None:
    with pytest.raises(PriorError, match=said):
        read(tmp_path, "type.toml", f"[coefficients]\nCm_q = -10.0\n[half_width]\n{width}\n")


def test_an_aircraft_is_a_prior_by_name_by_file_and_by_its_dimensions(tmp_path: Path) -> None:
    """Before it is flown a handbook's aircraft is all that is known of it."""
    named = read_prior(Path("kadetlt40"))
    assert "handbook estimates" in named.source[0]
    measured = tmp_path / "mine.toml"
    measured.write_text((DIMENSIONS / "kadetlt40.toml").read_text())
    taped = read_prior(measured)
    for name in ("CL_alpha", "Cm_q", "Cn_dr"):
        assert taped.at(0.05)[name] == pytest.approx(named.at(0.05)[name], rel=0.05)
    with pytest.raises(UsageError, match=r"no aircraft 'kadetlt4' \(did you mean kadetlt40\?\)"):
        read_prior(Path("kadetlt4"))
