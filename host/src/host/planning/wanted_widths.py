"""Which half-widths are wanted: principal derivatives trusted, others for use with care."""

from __future__ import annotations

from collections.abc import Mapping

from host.constants import CARE_SHARE, TRUST_SHARE
from host.errors import UsageError
from host.near_names import like

WANTED_PERCENT: Mapping[str, float] = dict.fromkeys(
    (
        "CL_alpha", "Cm_alpha", "Cm_q", "Cm_de",
        "Cl_p", "Cl_da", "Cn_beta", "Cn_r", "Cn_dr",
    ),
    100.0 * TRUST_SHARE,
)  # fmt: skip
OTHERS_PERCENT = 100.0 * CARE_SHARE
_MOST_PERCENT = 1000.0


def wanted_widths(text: str | None) -> dict[str, float]:
    """Return the wanted half-width of each derivative, per cent of its value.

    Parameters
    ----------
    text : str or None
        ``8`` for all, ``Cm_q=15,Cn_r=25`` for some; both may stand in one list. The standard ones
        without.

    Raises
    ------
    UsageError
        In one line: no such derivative, no such number.

    Examples
    --------
    >>> wanted_widths("Cm_q=15")["Cm_q"], wanted_widths("8")["Cm_q"]
    (15.0, 8.0)
    """
    wanted = dict(WANTED_PERCENT)
    for part in (text or "").split(",") if text else ():
        name, equals, number = (one.strip() for one in part.rpartition("="))
        percent = _percent(number, part)
        if not equals:
            wanted = dict.fromkeys(wanted, percent)
        elif name in wanted:
            wanted[name] = percent
        else:
            raise UsageError(
                f"--wanted {part.strip()}: no such derivative{like(name, tuple(wanted))}; there are"
                f" {', '.join(wanted)}"
            )
    return wanted


def _percent(number: str, part: str) -> float:
    try:
        value = float(number)
    except ValueError:
        value = 0.0
    if not 0.0 < value <= _MOST_PERCENT:
        raise UsageError(
            f"--wanted {part.strip()}: expected per cent of the value, such as 10 or Cm_q=20"
        )
    return value
