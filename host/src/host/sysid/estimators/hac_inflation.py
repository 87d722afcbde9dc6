"""Standard errors that allow for autocorrelated scores (HAC) where a model is misspecified.

The score of a sample is its whitened innovation times the sensitivities. Under a correct model the
scores of neighbouring samples are independent, and their variance is the information. Where
airspeed, attitude and gusts make the aircraft nonlinear, neighbouring scores correlate, and an
estimate scatters by more than the Cramer-Rao bound.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array
from host.constants import NORMAL_95
from host.sysid.models.state_space_model import LinearModel

WINDOW_S = 1.0  # longest lag: more than a short period, most of a dutch roll
REPORTED_FACTOR = 1.25  # times wider
QUANTILE = (NORMAL_95, 2.9694, 0.416, -0.5324)  # 97.5 %, lags weighted by a triangle


def hac_inflation(
    sensitivities: Sequence[Array], white: Sequence[Array], steps_s: Sequence[float], inverse: Array
) -> Array:
    """Return the factor by which each standard error is too small, at least 1, (P,).

    The covariance is M^-1 Omega M^-1 (White, Econometrica 50, 1982), with Omega the long-run
    variance of the scores, lags weighted by a triangle (Newey & West, Econometrica 55, 1987). Omega
    is uncertain itself: the quantile that allows for it is a cubic in the share of the record that
    the window covers (Kiefer & Vogelsang, Econometric Theory 21, 2005).

    Parameters
    ----------
    sensitivities : sequence of Array
        Per maneuver, of the whitened innovations, (samples, p, P).
    white : sequence of Array
        Per maneuver, the whitened innovations, (samples, p).
    steps_s : sequence of float
        Sample period of each maneuver.
    inverse : Array, shape (P, P)
        Of the whole information.
    """
    hac_variance, score_variance = np.zeros(len(inverse)), np.zeros(len(inverse))
    record_s = sum(len(e) * dt_s for e, dt_s in zip(white, steps_s, strict=True))
    share = min(WINDOW_S / record_s, 1.0)
    quantile_ratio = sum(c * share**k for k, c in enumerate(QUANTILE)) / QUANTILE[0]
    for sensitivity, e, dt_s in zip(sensitivities, white, steps_s, strict=True):
        score = np.einsum("tpk,tp->tk", sensitivity, e) @ inverse
        window = max(1, round(WINDOW_S / dt_s))
        # Sums over every window, also those beyond an end, weight the lags by a triangle.
        total = np.cumsum(np.pad(score, ((window, window), (0, 0))), axis=0)
        hac_variance += np.sum((total[window:] - total[:-window]) ** 2, axis=0) / window
        flat = sensitivity.reshape(-1, len(inverse))
        score_variance += np.einsum("ka,ab,bk->k", inverse, flat.T @ flat, inverse)
    ratio = np.sqrt(hac_variance / np.maximum(score_variance, 1e-300))
    return np.asarray(np.maximum(quantile_ratio * ratio, 1.0), dtype=np.float64)


def inflation_lines(model: LinearModel, factor: Array) -> list[str]:
    """Return a sentence that names the parameters widened by much, or nothing."""
    named = [
        f"{parameter.name} {times:.1f}"
        for parameter, times in zip(model.parameters, factor, strict=False)
        if times >= REPORTED_FACTOR
    ]
    if not named:
        return []
    return [
        f"the model does not follow this motion throughout: intervals widened {', '.join(named)}"
        " times; such ones held 90-92 % of cases in gusts, not 95, Cm_alpha 83"
        " (host/studies/nonlinear_gusts.md)"
    ]
