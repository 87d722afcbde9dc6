"""Names of derivatives and coefficients in words, and a mark in one."""

from __future__ import annotations

from host.aircraft.gains import COEFFICIENT_ROWS
from host.sysid.answer.marks import CAREFUL, SMALL, TRUSTED

GOOD, FAIR_WORD, TINY, NOT = "good", "fair", "tiny", "not"
WORDS = {TRUSTED: GOOD, CAREFUL: FAIR_WORD, SMALL: TINY}
LABELS = {
    "V": "speed", "alpha": "alpha", "beta": "sideslip", "p": "roll rate", "q": "pitch rate",
    "r": "yaw rate", "de": "elevator", "da": "aileron", "dr": "rudder",
}  # fmt: skip
ROWS = {"CL": "lift", "CD": "drag", "CX": "X force", "CZ": "Z force", "CY": "side",
        "Cm": "pitch", "Cl": "roll", "Cn": "yaw"}  # fmt: skip
# What textbooks call them (Etkin & Reid, Dynamics of Flight, ch. 4 and 5); others by row and cause.
CALLED = {
    "CL_alpha": "lift slope", "CL_de": "elevator lift", "CD_0": "zero-lift drag",
    "Cm_alpha": "pitch stiffness", "Cm_q": "pitch damping", "Cm_de": "elevator power",
    "CY_beta": "side force",
    "Cl_beta": "dihedral", "Cl_p": "roll damping", "Cl_da": "aileron power",
    "Cn_beta": "weathercock", "Cn_r": "yaw damping", "Cn_dr": "rudder power",
}  # fmt: skip


def coefficient_of(name: str) -> str:
    """Return the coefficient of a derivative: ``Cm_q`` for ``M_q`` and for ``Cm_q``."""
    row, _, label = name.partition("_")
    return f"{COEFFICIENT_ROWS.get(row, row)}_{label}"


def in_words(name: str) -> str:
    """Return what a derivative or coefficient is called; empty of one that is the user's own."""
    own = coefficient_of(name)
    row, _, label = own.partition("_")
    by_cause = f"{ROWS[row]} by {LABELS[label]}" if row in ROWS and label in LABELS else ""
    return CALLED.get(own, by_cause)


def word_of(mark: str) -> str:
    """Return a mark in one word: `GOOD`, `FAIR_WORD`, `TINY` or `NOT`."""
    return WORDS.get(mark, NOT)
