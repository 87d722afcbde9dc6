"""How well pitch, roll, yaw, and speed with drag are known: as well as what moves them."""

from __future__ import annotations

from collections.abc import Mapping

from host.sysid.answer.parameter_words import FAIR_WORD, GOOD, NOT, TINY, coefficient_of, word_of

# The principal derivatives of each motion; of the last those of them that were fitted.
MOVERS = {
    "pitch": ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_de"),
    "roll": ("Cl_p", "Cl_da"),
    "yaw": ("Cn_beta", "Cn_r", "Cn_dr"),
    "speed and drag": ("CD_V", "CD_alpha", "CD_0"),
}
_ORDER = (GOOD, TINY, FAIR_WORD, NOT)


def known_axes(marks: Mapping[str, str]) -> dict[str, str]:
    """Return a word for each motion: that of the least known of its principal derivatives.

    Parameters
    ----------
    marks : mapping
        Marks of derivatives or coefficients.

    Returns
    -------
    dict
        ``good``, ``fair`` or ``not``; without motions of which no principal derivative was fitted.
    """
    words = {coefficient_of(name): word_of(mark) for name, mark in marks.items()}
    found = {}
    for axis, names in MOVERS.items():
        if own := [words[name] for name in names if name in words]:
            worst = max(own, key=_ORDER.index)
            found[axis] = GOOD if worst == TINY else worst
    return found
