"""A prior from TOML or from AVL stands beside the answer."""

from pathlib import Path

import numpy as np
import pytest
from host.sysid.aircraft.airframe import Coefficient
from host.sysid.aircraft.prior import prior_lines, read_prior
from host.sysid.errors import IdentificationError

AVL = """
 Stability-axis derivatives...
                             alpha                beta
 z' force CL |    CLa =   4.123456    CLb =   0.000000
 x' mom.  Cl'|    Cla =   0.000000    Clb =  -0.041000
 y  mom.  Cm |    Cma =  -1.210000    Cmb =   0.000000
                     roll rate  p'      pitch rate  q'        yaw rate  r'
 x' mom.  Cl'|    Clp =  -0.440000    Clq =   0.000000    Clr =   9.8E-02
 Clb Cnr / Clr Cnb  =   1.023000
"""


def test_avl_and_toml_are_read(tmp_path: Path) -> None:
    (tmp_path / "ultra.st").write_text(AVL)
    prior = read_prior(tmp_path / "ultra.st")
    assert prior["CL_alpha"] == 4.123456
    assert (prior["Cl_beta"], prior["Cl_p"], prior["Cl_r"]) == (-0.041, -0.44, 0.098)
    assert "Cn_beta" not in prior  # the spiral figure is no derivative
    (tmp_path / "p.toml").write_text("[coefficients]\nCm_q = -10.9\n")
    assert read_prior(tmp_path / "p.toml") == {"Cm_q": -10.9}


# Written to the layout of Datcom's FORTRAN formats; no real aircraft.
DATCOM = Path(__file__).with_name("datcom_layout.dat").read_text()


def test_datcom_is_read_at_the_angle_of_attack_flown(tmp_path: Path) -> None:
    (tmp_path / "for006.dat").write_text(DATCOM)
    degree = 180.0 / np.pi
    prior = read_prior(tmp_path / "for006.dat", np.radians(0.0))
    expected = {
        "CL_alpha": 0.075, "Cm_alpha": -0.022, "CY_beta": -0.005, "Cn_beta": 0.0015,
        "Cl_beta": -0.0011, "CL_q": 0.13, "Cm_q": -0.19, "Cl_p": -0.0072, "CY_p": -0.0011,
        "Cn_p": -0.0004, "Cn_r": -0.0012, "Cl_r": 0.0016,
    }  # fmt: skip
    assert prior == pytest.approx({k: degree * v for k, v in expected.items()})
    # Beyond the last row that knows the slope, that row stands.
    far = read_prior(tmp_path / "for006.dat", np.radians(6.0))
    assert far["CL_alpha"] == pytest.approx(degree * 0.08)
    assert far["Cl_beta"] == pytest.approx(degree * -0.0014)
    (tmp_path / "radian.dat").write_text(DATCOM.replace("PER DEGREE", "PER RADIAN"))
    assert read_prior(tmp_path / "radian.dat")["Cm_q"] == pytest.approx(-0.19)


def test_disagreement_is_named() -> None:
    found = [Coefficient("Cm_q", -9.0, 0.4, 0.5, 1.0), Coefficient("Cl_p", -0.4, 0.0, 0.1, 0.2)]
    lines = prior_lines(found, {"Cm_q": -10.9, "Cl_p": -0.5, "CL_q": 1.0})
    assert len(lines) == 3
    assert lines[1].endswith("outside the interval")
    assert lines[2].endswith("inside")


@pytest.mark.parametrize("text", ["", "[coefficients]\nCm_q = 'x'\n", "= 3", "coefficients = 1"])
def test_garbage_is_one_clear_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "p.toml").write_text(text)
    with pytest.raises(IdentificationError, match=r"p\.toml"):
        read_prior(tmp_path / "p.toml")
