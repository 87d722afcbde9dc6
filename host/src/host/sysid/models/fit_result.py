"""Result of a fit, the same type for every method."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.uncertainty import Uncertainty


@dataclass(frozen=True)
class FitResult:
    """Estimate, covariance, residuals and diagnostics of one fit.

    Attributes
    ----------
    method : str
        Method name as given to `fit`.
    model : LinearModel
        The model that was fitted.
    names : tuple of str
        Parameter names in the order of `estimate`: common ones first, then per maneuver.
    estimate : Array, shape (P,)
    covariance : Array, shape (P, P)
        Covariance of the intervals (corrected for colour or prewhitened where the method says so).
    covariance_white : Array, shape (P, P)
        Covariance if the residuals were white.
    degrees_of_freedom : Array, shape (P,)
        Degrees of freedom of the t distribution of each interval; infinite means normal.
    residuals : tuple of Array
        Per maneuver (samples, columns): measured minus model, of the outputs or of the rates.
    fitted : tuple of Array
        Per maneuver the modelled values of those columns.
    residual_kind : str
        ``output`` (free simulation), ``rate`` (equation error), ``innovation`` (one step) or
        ``spectrum`` (lines of output error in frequency, real and imaginary parts).
    noise_covariance : Array
        Covariance of the residual columns.
    iterations : int
    converged : bool
    warnings : tuple of str
        One sentence for each reason to trust the estimate less.
    details : dict
        Method-specific numbers for reports: name to value or array.
    """

    method: str
    model: LinearModel
    names: tuple[str, ...]
    estimate: Array
    covariance: Array
    covariance_white: Array
    degrees_of_freedom: Array
    residuals: tuple[Array, ...]
    fitted: tuple[Array, ...]
    residual_kind: str
    noise_covariance: Array
    iterations: int
    converged: bool
    warnings: tuple[str, ...] = ()
    details: dict[str, float | Array] = field(default_factory=dict)

    def index(self, name: str) -> int:
        """Return the position of a parameter.

        Raises
        ------
        IdentificationError
            If the result has no such parameter.
        """
        if name not in self.names:
            raise IdentificationError(
                f"no parameter '{name}' in this {self.method} result; it has"
                f" {', '.join(self.names)}"
            )
        return self.names.index(name)

    @property
    def values(self) -> dict[str, float]:
        """The estimate of each parameter by its name."""
        return dict(zip(self.names, self.estimate.tolist(), strict=True))

    def value(self, name: str) -> float:
        """Return the estimate of one parameter."""
        return float(self.estimate[self.index(name)])

    @property
    def uncertainty(self) -> Uncertainty:
        """What is not known of the estimate."""
        return Uncertainty(self.covariance, self.degrees_of_freedom, self.warnings, self.details)

    def with_uncertainty(self, known: Uncertainty) -> FitResult:
        """Return the same estimate, known as well as that."""
        return replace(
            self,
            covariance=known.covariance,
            degrees_of_freedom=known.degrees_of_freedom,
            warnings=known.warnings,
            details=dict(known.details),
        )

    @property
    def standard_error(self) -> Array:
        """Standard deviation of each estimate."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def half_width(self, confidence: float = 0.95) -> Array:
        """Return half-widths of two-sided intervals, units of the estimate, shape (P,)."""
        from scipy import special  # 0.2 s, and who only looks at a flight needs no interval

        dof = np.minimum(self.degrees_of_freedom, 1e9)
        quantile = np.asarray(special.stdtrit(dof, 0.5 + confidence / 2.0), dtype=np.float64)
        return quantile * self.standard_error

    @property
    def correlation(self) -> Array:
        """Correlation matrix of the estimates."""
        sd = self.standard_error
        safe = np.where(sd > 0.0, sd, 1.0)
        return np.asarray(self.covariance / np.outer(safe, safe), dtype=np.float64)

    def matrices(self) -> tuple[Array, Array, Array, Array]:
        """Return A, B, C, D at the estimate."""
        return self.model.matrices(self.estimate[: len(self.model.parameters)])


def without_parameters(
    result: FitResult, model: LinearModel, names: Collection[str], known: Uncertainty | None = None
) -> FitResult:
    """Return a result on a model that has not these parameters; the others stay as uncertain.

    Parameters
    ----------
    result : FitResult
    model : LinearModel
        Without them.
    names : collection of str
    known : Uncertainty, optional
        Uncertainty of all parameters, in place of that of the result.
    """
    kept = [k for k, name in enumerate(result.names) if name not in names]
    if len(kept) == len(result.names):
        return result if known is None else result.with_uncertainty(known)
    known = known or result.uncertainty
    by_maneuver = {
        key: value[:, kept]
        for key, value in known.details.items()
        if key in ("maneuver_influence", "information_share") and isinstance(value, np.ndarray)
    }
    return replace(
        result,
        model=model,
        names=tuple(result.names[k] for k in kept),
        estimate=result.estimate[kept],
        covariance=known.covariance[np.ix_(kept, kept)],
        covariance_white=result.covariance_white[np.ix_(kept, kept)],
        degrees_of_freedom=known.degrees_of_freedom[kept],
        warnings=known.warnings,
        details={**known.details, **by_maneuver},
    )
