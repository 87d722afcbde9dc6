"""From the columns of a flight to answers: maneuvers, joint fits, validation, coefficients."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.aircraft.mass_properties import AirframeData, Condition
from host.aircraft.powerplant import Powerplant
from host.arrays import Array
from host.instrument.deviations import SensorErrorModel, deviations, unknown_sensors
from host.sysid.aerodynamics.coefficient_table import (
    Coefficient,
    CoefficientTable,
    Moved,
    coefficients,
    trim_of,
)
from host.sysid.compatibility.at_cg import at_cg
from host.sysid.compatibility.corrections import (
    Correction,
    corrections,
    pressure_part,
    without_delays,
    without_errors,
)
from host.sysid.compatibility.path_data import NOTHING
from host.sysid.compatibility.position_correction import transfer_to_cg
from host.sysid.compatibility.reconstruction import Compatibility
from host.sysid.errors import IdentificationError
from host.sysid.estimators.fit import fit
from host.sysid.estimators.gust import VANES, fit_with_gust
from host.sysid.estimators.output_error_fit import fit_output_error
from host.sysid.estimators.start import regressed
from host.sysid.flight.carried import carried, systematic_error_shifts
from host.sysid.flight.chosen import moving, once
from host.sysid.flight.column_map import like
from host.sysid.flight.departures import departed
from host.sysid.flight.finder import Found, Grade, find, grade
from host.sysid.models.delays import DELAYS, without_usual_delays
from host.sysid.models.diagnostics import (
    Collinearity,
    Refusal,
    SignalFit,
    collinearity,
    constant_inputs,
    judge,
    signal_fits,
)
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.model import LinearModel, without_outputs
from host.sysid.models.modes import Mode, modes
from host.sysid.models.result import FitResult
from host.sysid.models.templates import TEMPLATES, Trim, template
from host.sysid.numerics.problem import OutputProblem
from host.sysid.numerics.repeats import repeats, widened

AXIS_OF = {
    "longitudinal": ("elevator_rad",),
    "short-period": ("elevator_rad",),
    "phugoid": ("elevator_rad",),
    "lateral": ("aileron_rad", "rudder_rad"),
    "roll": ("aileron_rad",),
    "dutch-roll": ("rudder_rad",),
}
FREE = ("output", "innovation")  # residuals of methods that simulate
WEAK_GRADE = 0.2
# Output error takes turbulence for sensor noise. Simulated flights of the demonstration card, error
# of Cm_alpha, Cm_q, Cm_de: 5, 10, 7 % by white output error, 2, 3, 3 % with the gust as a state.
# Laterally the gust hardly moves the wings, and the filter leans on high frequencies where attitude
# and rate filters are modelled worst: Cl_p 18 % low against 13 %, 6 of 15 intervals hold, not 12.
GUST = "filter-error-gust"
DEFAULT_METHOD = "flight"
# One equation at a time: accelerations repeat the entries of others, and are left out.
UNTIED = ("equation-error-total", "recursive", "neural-delta")
STAGED = {
    "flight": "gust filter where alpha is a state, white output error else (default)",
    GUST: "delays by output error, then filter error with the gust as a state",
}


@dataclass(frozen=True)
class Answer:
    """What one model of one axis says, and what it rests on."""

    template: str
    method: str
    model: LinearModel
    trim: Trim
    condition: Condition
    maneuvers: tuple[Maneuver, ...]
    used: tuple[Found, ...]
    held_out: tuple[Found, ...]
    result: FitResult
    fits: tuple[SignalFit, ...]
    validation: tuple[SignalFit, ...]
    refused: tuple[Refusal, ...]
    together: Collinearity
    modes: tuple[Mode, ...]
    coefficients: tuple[Coefficient, ...]
    still: tuple[str, ...]
    delays: dict[str, tuple[float, float]]
    corrections: tuple[Correction, ...] = ()
    simulated: tuple[Array, ...] = ()  # outputs of the maneuvers by free simulation

    @property
    def at_bound(self) -> tuple[str, ...]:
        """Delays that the search wanted larger than a sensor can be late."""
        limits = {d.name: d.limit_s for d in (*DELAYS, *self.model.delays)}
        values = {name: value for name, (value, _) in self.delays.items()}
        values |= {
            d.name: self.result.value(d.name)
            for d in self.model.delays
            if d.name in self.result.names
        }
        return tuple(n for n, v in values.items() if abs(v) >= limits[n] * (1.0 - 1e-9))

    @property
    def table(self) -> CoefficientTable:
        """The coefficients and what they rest on."""
        return CoefficientTable(self.template, self.method, self.trim.alpha_rad, self.coefficients)


def maneuvers_of(columns: Mapping[str, Array]) -> list[tuple[Found, Grade]]:
    """Return the maneuvers of a flight with their grades."""
    return [(item, grade(columns, item)) for item in find(columns)]


def identify(
    columns: dict[str, Array],
    *,
    names: Sequence[str] = ("longitudinal", "lateral"),
    method: str = DEFAULT_METHOD,
    airframe: AirframeData | None = None,
    windows: Sequence[Found] | None = None,
    user_model: LinearModel | None = None,
    with_delays: bool = True,
    compatibility: Compatibility | None = None,
    powerplant: Powerplant | None = None,
) -> list[Answer]:
    """Fit every model that has maneuvers.

    Parameters
    ----------
    columns : dict
        SI columns on an even grid.
    names : sequence of str
        Templates to fit.
    method : str
        A method of `fit`.
    airframe : AirframeData, optional
        Gives sensor corrections and coefficients.
    windows : sequence of Found, optional
        Use these instead of finding them.
    user_model : LinearModel, optional
        Fit this instead of templates, to every window where one of its inputs moved.
    with_delays : bool
        Estimate residual delays and accelerometer offsets where the method can.
    compatibility : Compatibility, optional
        What reconstruction found: told errors are taken out of the columns, and what stays open
        of all errors is carried into the intervals.
    powerplant : Powerplant, optional
        Gives the rotor's spin.

    Raises
    ------
    IdentificationError
        If no maneuver is there for any model.
    """
    strangers = [n for n in names if user_model is None and n not in AXIS_OF]
    if strangers:
        raise IdentificationError(
            f"no template '{strangers[0]}'; there are {', '.join(AXIS_OF)}, or give a TOML file"
        )
    if "airspeed_mps" not in columns:
        raise IdentificationError(
            "identification needs airspeed_mps, which the data do not have; name its column in a"
            " map (--map)"
        )
    told = {c.name: c.value for c in corrections(compatibility)} if compatibility else {}
    if airframe is not None and compatibility is not None and compatibility.instrument is not None:
        columns = at_cg(columns, airframe, compatibility)
        with_delays = False
    else:
        columns = without_delays(columns, told)
        if airframe is not None:
            columns = transfer_to_cg(columns, airframe)
    if compatibility is not None:
        columns = without_errors(columns, told, pressure_part(compatibility))
    found = list(windows) if windows is not None else find(columns)
    if not found:
        raise IdentificationError(
            "no maneuver found: no surface moved by more than 1.4 degrees at once; give --from and"
            " --to, or fly a doublet or 3-2-1-1 of 3 degrees or more"
        )
    answers: list[Answer] = []
    needed: list[str] = []
    for name in names:
        axes = AXIS_OF[name] if user_model is None else moving(user_model.inputs)
        mine = once([f for f in found if f.axis in axes])
        needed += axes
        if mine:
            answers.append(
                _answer(
                    columns,
                    name,
                    method,
                    airframe,
                    mine,
                    user_model,
                    with_delays,
                    compatibility,
                    powerplant,
                )
            )
    if not answers:
        raise IdentificationError(
            f"no maneuver of {', '.join(dict.fromkeys(needed))} for {', '.join(names)}; found"
            f" only {', '.join(sorted({f.axis for f in found}))}"
        )
    return answers


def _answer(
    columns: dict[str, Array],
    name: str,
    method: str,
    airframe: AirframeData | None,
    found: list[Found],
    user_model: LinearModel | None,
    with_delays: bool,
    compatibility: Compatibility | None,
    powerplant: Powerplant | None,
) -> Answer:
    graded = [(f, grade(columns, f)) for f in found]
    good = [f for f, g in graded if g.score >= WEAK_GRADE] or found
    held = _held_out(good)
    used = [f for f in good if f not in held]
    t = columns["t_s"]
    cut = np.zeros(len(t), dtype=bool)
    for f in used:
        cut |= (t >= f.start_s) & (t <= f.end_s)
    trim, condition = trim_of({k: v[cut] for k, v in columns.items() if k != "t_s"})
    able = with_delays and _frees_places(method)
    if user_model is None:
        model = _template(columns, name, trim, method, able)
    else:
        model = user_model if able else without_usual_delays(user_model)
    known = None if compatibility is None else compatibility.instrument
    if user_model is None and known is not None and _frees_places(method):
        model = _drag_arm(model, trim, known)
    if method == DEFAULT_METHOD:
        method = GUST if "alpha_rad" in model.states else "output-error-white"
        if user_model is None and method != GUST and name == "lateral":
            model = _without_attitude(columns, model, used)
    fitted = [_cut(columns, model, f) for f in used]
    delays: dict[str, tuple[float, float]] = {}
    unseen = [_cut(columns, model, f) for f in held]
    if method == GUST and user_model is None and set(model.states) & set(VANES):
        staged = fit_with_gust(model, fitted, trim.airspeed_mps)
        result, model, fitted, delays = (
            staged.result, staged.model, list(staged.maneuvers), staged.delays,
        )  # fmt: skip
    else:
        single = "output-error-white" if method == GUST else method
        calm: dict[str, object] = {"doubting": False} if single.startswith("output-error") else {}
        result = fit(single, model, fitted, **calm)
    result = widened(result, repeats(result))
    alone = result
    moved: tuple[Moved, ...] = ()
    cuts = [_inside(columns, f) for f in used]
    if airframe is not None and user_model is None and result.residual_kind in FREE:
        result, moved = departed(result, fitted, cuts, airframe, trim, powerplant)
        alone = result
    if compatibility is not None:
        moved += systematic_error_shifts(result, fitted, cuts, compatibility, trim)
    result = carried(result, moved)
    # Of frequencies the residuals are not those of samples.
    ours = result.residual_kind == "output" and all(
        y.shape == m.outputs.shape for y, m in zip(result.fitted, fitted, strict=True)
    )
    simulated = list(result.fitted) if ours and not moved else _simulated(model, result, fitted)
    residuals = [m.outputs - y for m, y in zip(fitted, simulated, strict=True)]
    return Answer(
        template=name if user_model is None else model.name,
        method=method,
        model=model,
        trim=trim,
        condition=condition,
        maneuvers=tuple(fitted),
        used=tuple(used),
        held_out=tuple(held),
        result=result,
        fits=signal_fits(model.outputs, [m.outputs for m in fitted], residuals),
        validation=_validate(model, result, unseen),
        refused=judge(result, fitted).named,
        together=collinearity(alone),
        modes=modes(result),
        coefficients=(() if airframe is None else coefficients(alone, airframe, condition, moved)),
        still=constant_inputs(model, fitted),
        delays=delays,
        corrections=() if compatibility is None else corrections(compatibility),
        simulated=tuple(simulated),
    )


def from_zero(coefficient: Coefficient) -> bool:
    """Return whether a coefficient is told from zero: its interval does not reach it."""
    return abs(coefficient.value) > coefficient.half_width


def _held_out(found: list[Found]) -> list[Found]:
    """Hold out the last maneuver of every axis that was flown at least three times."""
    held = []
    for axis in dict.fromkeys(f.axis for f in found):
        mine = [f for f in found if f.axis == axis]
        if len(mine) >= 3:
            held.append(mine[-1])
    return held


def _template(
    columns: Mapping[str, Array], name: str, trim: Trim, method: str, able: bool
) -> LinearModel:
    if name not in TEMPLATES:
        raise IdentificationError(f"no template '{name}'; there are {', '.join(TEMPLATES)}")
    forces = ("ax_mps2", "az_mps2") if "elevator_rad" in AXIS_OF[name] else ("ay_mps2",)
    return template(
        name,
        trim,
        accelerometers=method not in UNTIED and all(c in columns for c in forces),
        delays=DELAYS if able else (),
        imu_sd_m=imu_place_m(unknown_sensors()) if able else 0.0,
    )


def _frees_places(method: str) -> bool:
    """Return whether a method can estimate delays and places of accelerometers."""
    return method.startswith("output-error") or method in STAGED


def imu_place_m(i: SensorErrorModel) -> float:
    """Return one deviation of the IMU's height above the CG, m: tape measure and balance."""
    sd = deviations(i, NOTHING)
    return float(np.hypot(sd["imu_z_m"], sd["cg_z_m"]))


def _drag_arm(model: LinearModel, trim: Trim, i: SensorErrorModel) -> LinearModel:
    """Free the height of the accelerometers where drag is told: a pitch rate makes none.

    Every other place is carried. This one moves drag by more than its size, and the pitch rate
    beside angle and elevator tells it.
    """
    if "ax_mps2" not in model.outputs:
        return model
    sd_m = imu_place_m(i)
    free = template(model.name, trim, accelerometers=True, imu_sd_m=sd_m)
    kept = [x for x in free.levers if x.output == "ax_mps2"]
    names = {x.parameter for x in free.levers} - {x.parameter for x in kept}
    return replace(
        model,
        levers=tuple(kept),
        parameters=tuple(p for p in free.parameters if p.name not in names),
    )


def _without_attitude(
    columns: Mapping[str, Array], model: LinearModel, used: Sequence[Found]
) -> LinearModel:
    """Leave the bank angle of the attitude filter out of the fit, started from one with it.

    It is made of the same gyro and of accelerometers that take side force for gravity: on the
    recorded demonstration flight 15 of 15 intervals hold the truth without it, 12 with it.
    """
    told = regressed(model, [_cut(columns, model, f) for f in used])
    model = model.with_start([told.get(p.name, p.start) for p in model.parameters])
    reduced = without_outputs(model, ("phi_rad",))
    return replace(reduced, state_biases=tuple(s for s in reduced.state_biases if s != "phi_rad"))


def _cut(columns: Mapping[str, Array], model: LinearModel, item: Found) -> Maneuver:
    missing = [c for c in (*model.inputs, *model.outputs) if c not in columns]
    if missing:
        meant = like(missing[0], tuple(columns))
        raise IdentificationError(
            f"model {model.name} needs {', '.join(missing)}{meant}, which the data do not have"
        )
    cut = _inside(columns, item)
    return Maneuver(
        dt_s=float(cut["t_s"][1] - cut["t_s"][0]),
        inputs=np.column_stack([cut[c] for c in model.inputs]),
        outputs=np.column_stack([cut[c] for c in model.outputs]),
        name=f"{item.kind} on {item.axis.split('_')[0]} at {item.start_s:.1f} s",
    )


def _inside(columns: Mapping[str, Array], item: Found) -> dict[str, Array]:
    t = columns["t_s"]
    first, last = item.fit_window()
    inside = (t >= first) & (t <= last)
    return {name: values[inside] for name, values in columns.items()}


def _constants_only(model: LinearModel, result: FitResult) -> tuple[LinearModel, Array]:
    """Return the model frozen at the estimate, biases and start states left free."""
    count = len(model.parameters)
    A, B, C, D = model.matrices(result.estimate[:count])
    frozen = replace(model, A=A, B=B, C=C, D=D, terms=(), parameters=(), delays=(), levers=())
    return frozen, A


def _simulated(model: LinearModel, result: FitResult, maneuvers: Sequence[Maneuver]) -> list[Array]:
    """Return free simulations of a fitted model, constants fitted to each maneuver."""
    frozen, _ = _constants_only(model, result)
    simulated = []
    for maneuver in maneuvers:
        try:
            problem = OutputProblem(frozen, [maneuver])
            # Nothing but constants is free here, which the door would refuse.
            best = fit_output_error(
                frozen, [maneuver], memory=False, start=problem.first_guess(), doubting=False
            )
            simulated.append(best.fitted[0])
        except IdentificationError:
            simulated.append(np.full_like(maneuver.outputs, np.nan))
    return simulated


def _validate(
    model: LinearModel, result: FitResult, unseen: Sequence[Maneuver]
) -> tuple[SignalFit, ...]:
    """Predict unseen maneuvers: dynamics frozen, only biases and start states are free."""
    if not unseen:
        return ()
    simulated = _simulated(model, result, unseen)
    residuals = [m.outputs - y for m, y in zip(unseen, simulated, strict=True)]
    return signal_fits(model.outputs, [m.outputs for m in unseen], residuals)
