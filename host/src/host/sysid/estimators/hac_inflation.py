"""How much wider intervals must be because the model is not quite right, told by the fit itself.

Under a right model the score of every sample (slopes of the whitened innovations times these) is
independent of its neighbours and as large as the information says. Where airspeed, attitude and
gusts bend what a filter of constant gain takes for straight, scores of neighbours go together, and
an estimate scatters by more than the bound. The covariance with that memory in it is that of White
(Econometrica 50, 1982), summed over lags as Newey & West (Econometrica 55, 1987) do. A record holds
few such memories, so that this variance is itself uncertain: quantiles that allow for it are those
of Kiefer & Vogelsang (Econometric Theory 21, 2005), a cubic in the share of the record.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array
from host.constants import NORMAL_95
from host.sysid.models.state_space_model import LinearModel

WINDOW_S = 1.0  # longest memory looked for: more than a short period, most of a dutch roll
REPORTED_FACTOR = 1.25  # times wider
QUANTILE = (NORMAL_95, 2.9694, 0.416, -0.5324)  # 97.5 %, lags weighted by a triangle


def hac_inflation(
    slopes: Sequence[Array], white: Sequence[Array], steps_s: Sequence[float], inverse: Array
) -> Array:
    """Return by how much each standard error is too small, at least 1, (P,).

    Parameters
    ----------
    slopes : sequence of Array
        Per maneuver, of the whitened innovations, (samples, p, P).
    white : sequence of Array
        Per maneuver, the whitened innovations, (samples, p).
    steps_s : sequence of float
        Sample period of each maneuver.
    inverse : Array, shape (P, P)
        Of the whole information.
    """
    found, expected = np.zeros(len(inverse)), np.zeros(len(inverse))
    record_s = sum(len(e) * dt_s for e, dt_s in zip(white, steps_s, strict=True))
    share = min(WINDOW_S / record_s, 1.0)
    wider = sum(c * share**k for k, c in enumerate(QUANTILE)) / QUANTILE[0]
    for slope, e, dt_s in zip(slopes, white, steps_s, strict=True):
        pull = np.einsum("tpk,tp->tk", slope, e) @ inverse
        window = max(1, round(WINDOW_S / dt_s))
        # Sums over every window, also those that reach over an end: weights of lags fall linearly.
        total = np.cumsum(np.pad(pull, ((window, window), (0, 0))), axis=0)
        found += np.sum((total[window:] - total[:-window]) ** 2, axis=0) / window
        flat = slope.reshape(-1, len(inverse))
        expected += np.einsum("ka,ab,bk->k", inverse, flat.T @ flat, inverse)
    ratio = np.sqrt(found / np.maximum(expected, 1e-300))
    return np.asarray(np.maximum(wider * ratio, 1.0), dtype=np.float64)


def inflation_lines(model: LinearModel, factor: Array) -> list[str]:
    """Return a sentence that names the parameters widened by much, or nothing."""
    said = [
        f"{parameter.name} {times:.1f}"
        for parameter, times in zip(model.parameters, factor, strict=False)
        if times >= REPORTED_FACTOR
    ]
    if not said:
        return []
    return [
        f"the model does not follow this motion throughout: intervals widened {', '.join(said)}"
        " times; such ones held 90-92 % of cases in gusts, not 95, Cm_alpha 83"
        " (host/studies/nonlinear_gusts.md)"
    ]
