"""Free simulation of a linear model over the maneuvers fitted and those held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from host.arrays import Array
from host.sysid.linear.linear_stages import LinearEstimate, LinearIntervals, LinearValidation
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.residual_delays import advance_outputs, delays_of
from host.sysid.models.state_space_model import DelayGroup, LinearModel
from host.sysid.validation.free_simulation import fits_of, free_simulation, frozen_model
from host.sysid.validation.prediction_limits import missed, predictions


def linear_validation(
    estimate: LinearEstimate, intervals: LinearIntervals, own: LinearModel | None
) -> LinearValidation:
    """Simulate the model freely over the maneuvers fitted and those held out.

    Parameters
    ----------
    estimate : LinearEstimate
    intervals : LinearIntervals
    own : LinearModel or None
        The user's own, whose delays stand in it.
    """
    e, result, total = estimate, intervals.statistical, intervals.total
    model, maneuvers, noise = e.found.model, e.found.maneuvers, intervals.coherence
    # Residuals of a fit in frequency are not those of samples.
    ours = result.residual_kind == "output" and all(
        y.shape == m.outputs.shape for y, m in zip(result.fitted, maneuvers, strict=True)
    )
    same = ours and not intervals.shifts
    frozen = frozen_model(model, result)
    simulated = (
        list(result.fitted) if same else _simulated(frozen, maneuvers, e.at_trim(result.estimate))
    )
    late = delays_of(model.outputs) if own is None else own.delays
    kept = e.columns.held_out
    held_out = [_without_delays(m.cut(model), model, late, e.found.delays) for m in kept]
    at_trim = (
        held_out
        if e.departure is None
        else e.departure.removed_from_held_out(
            held_out, [m.departing() for m in kept], result.estimate
        )
    )
    runs = _simulated(frozen, held_out, at_trim)
    fits, held_out_fits = fits_of(model, maneuvers, simulated), fits_of(model, held_out, runs)
    airspeed_mps = e.trim.airspeed_mps
    asked_mps = airspeed_mps if missed(held_out_fits) else None
    return LinearValidation(
        tuple(simulated),
        fits,
        held_out_fits,
        predictions(model, result, total, noise, held_out, runs, asked_mps),
        tuple(zip(held_out, runs, strict=True)),
    )


def _simulated(
    frozen: LinearModel, maneuvers: Sequence[Maneuver], at_trim: Sequence[Maneuver]
) -> list[Array]:
    """Return a free simulation, constants fitted at the trim, with the departures from it."""
    return [
        y + m.outputs - still.outputs
        for y, m, still in zip(free_simulation(frozen, at_trim), maneuvers, at_trim, strict=True)
    ]


def _without_delays(
    maneuver: Maneuver,
    model: LinearModel,
    groups: tuple[DelayGroup, ...],
    delays: Mapping[str, tuple[float, float]],
) -> Maneuver:
    if not delays:
        return maneuver
    late = replace(model, delays=groups)
    return advance_outputs(maneuver, late, {name: value for name, (value, _) in delays.items()})
