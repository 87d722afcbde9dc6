"""What the other lateral states do to a model that leaves them out.

Wings do not stay level in a dutch roll, nor the nose ahead in a roll. A term that acts so is no
part of the reduced model, but its column is measured: it is a further input, its derivative
estimated with those of the model. On a record of 1.5 s no test of the residual sees what is
missing (N_beta is 16 % large, known to 1.5): the prior says how large it may be.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.sysid.models.state_space_model import LinearModel, Term
from host.sysid.models.templates import Trim

# In place of an airspeed that nobody measured: gravity is then a term of its own.
UNKNOWN_MPS = 1e6


@dataclass(frozen=True, slots=True)
class LeftOutTerm:
    """A derivative that a template has not.

    Attributes
    ----------
    name : str
    row : str
        State in whose equation it stands.
    column : str
        What it multiplies.
    like : str
        Derivative of the template that its size is compared with; none: `share` is that size.
    share : float
        One deviation, over the derivative that it is compared with.
    mean : float
        What is usual, over that derivative.
    attenuated : bool
        Its column is nearly made of the states: what is left of it to tell the term is no larger
        than its noise, which makes the term small. Its deviation stands whatever the data say.
    gain : float
        Gain of its column: the term is per 1 over it.
    """

    name: str
    row: str
    column: str
    like: str
    share: float
    mean: float = 0.0
    attenuated: bool = False
    gain: float = 1.0

    @property
    def input_name(self) -> str:
        """What the further input is called that it makes of its column."""
        return f"{self.column} left out of {self.row}"


GRAVITY = LeftOutTerm("G_phi", "beta_rad", "phi_rad", "", 0.4, 0.5)  # g/V, of 10 m/s on
# Handbooks have C_np and C_nda at a third to the whole, and a tenth to a half, of C_nr and C_ndr;
# dihedral turns a small aircraft at up to three times a second of its roll damping.
LEFT_OUT_TERMS: dict[str, tuple[LeftOutTerm, ...]] = {
    "dutch-roll": (
        LeftOutTerm("N_p", "r_radps", "p_radps", "N_r", 0.5, 0.4, attenuated=True),
        LeftOutTerm("N_da", "r_radps", "aileron_rad", "N_dr", 0.5),
        LeftOutTerm("Y_p", "beta_rad", "p_radps", "Y_beta", 0.1),
        LeftOutTerm("Y_r", "beta_rad", "r_radps", "Y_beta", 0.1),
    ),
    "roll": (
        LeftOutTerm("L_beta", "p_radps", "beta_rad", "L_p", 3.0),
        LeftOutTerm("L_r", "p_radps", "r_radps", "L_p", 0.5, -0.3),
        LeftOutTerm("L_dr", "p_radps", "rudder_rad", "L_da", 0.3),
    ),
}
# Without these nothing tells what is left out.
NEEDED = {"dutch-roll": ("p_radps", "beta_rad"), "roll": ("beta_rad", "r_radps")}


def terms_left_out(axis: str, columns: Collection[str], trim: Trim) -> tuple[LeftOutTerm, ...]:
    """Return the terms that a template leaves out and the columns tell.

    Parameters
    ----------
    axis : str
        The template.
    columns : collection of str
    trim : Trim
    """
    known = LEFT_OUT_TERMS.get(axis, ())
    more = () if trim.known or axis != "dutch-roll" else (GRAVITY,)
    rolled = {"phi_rad"} if "p_radps" in columns else set()
    return tuple(t for t in (*known, *more) if t.column in {*columns, *rolled})


def expected_left_out(
    terms: Sequence[LeftOutTerm], like: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """Return what is expected of each term, and one deviation of it.

    Parameters
    ----------
    terms : sequence of LeftOutTerm
    like : mapping
        Value and deviation of the derivatives that they are compared with.
    """
    found = {}
    for term in terms:
        value, deviation = like.get(term.like, (1.0, 0.0))
        found[term.name] = (term.mean * value, term.share * float(np.hypot(value, deviation)))
    return found


def acting_terms(
    model: LinearModel, trim: Trim, name: str, row: str, column: int, gain: float = 1.0
) -> list[Term]:
    """Return the entries of a derivative of an input: accelerometers measure a force too.

    Parameters
    ----------
    model : LinearModel
    trim : Trim
    name : str
        Name of the derivative.
    row : str
        State in whose equation it stands.
    column : int
        Column of the input.
    gain : float
        Gain of the input.
    """
    V, sine, cosine = trim.airspeed_mps, np.sin(trim.alpha_rad), np.cos(trim.alpha_rad)
    measured = {
        "airspeed_mps": {"ax_mps2": cosine, "az_mps2": sine},
        "alpha_rad": {"ax_mps2": -V * sine, "az_mps2": V * cosine},
        "beta_rad": {"ay_mps2": V},
    }
    found = [Term("B", model.states.index(row), column, name, gain)]
    for output, share in measured.get(row, {}).items():
        if output in model.outputs:
            at = model.outputs.index(output)
            found.append(Term("D", at, column, name, float(share) * gain))
    return found
