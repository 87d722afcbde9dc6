"""Numbers of one flown input against those of the card's: what a verdict is made of."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.planning.aircraft_response import STEP_S, AircraftResponse
from host.planning.point_widths import point_derivatives
from host.planning.wanted_input import RESPONSE_S, SURFACES, wanted_surfaces
from host.sysid.maneuvers.maneuver_detection import FLYING_SHARE, LEAST_EDGE_RAD, DetectedManeuver
from host.twin.testcard.cards import Segment, input_s

LEAD_S = 0.7  # before the input, of which every row counts for an estimate
TRIM_S = 1.0  # before the input, which is where the surfaces' trim is read
GUST_S = 0.25  # over which a change of the vanes is no motion of the whole aircraft
GUSTS_OVER_S, GUSTS_LEAST_S = 7.0, 1.5
LAUNCH_S = 1.0  # after the last row slower than flight
CHANGE_OF_GUST = 0.26  # rms change over `GUST_S` of the gust's deviation, as flown
_RATE_OF = {"elevator": "q_radps", "aileron": "p_radps", "rudder": "r_radps"}


@dataclass(frozen=True, slots=True)
class PointMeasures:
    """What was flown, and what was wanted.

    Attributes
    ----------
    axis : str
        The surface that moved most.
    axis_wanted : bool
        It is one of the card's, or one of these moved by half of what is wanted.
    amplitude : float
        Largest deflection over the wanted one.
    edge : float
        The same over the least step that `host maneuvers` takes for one of an input.
    length : float
        Length of the input over the wanted one.
    deviations : (k,) array
        Deviations of the wanted derivatives, as the flown movement of the surfaces allows, over
        those of the card's input.
    unquiet : float
        Rate about the axis in the second before, over its largest afterwards: rms.
    others : float
        Largest movement of another surface during the input, over the wanted amplitude.
    corrected : float
        Movement of the surface after the input, over the wanted amplitude: largest.
    airspeed : float
        Mean over the card's, less one.
    airspeed_change : float
        Largest change during the point, share.
    gusts : float
        Gusts of the air before, over those of the card (of a calm morning where it names none).
    lost : float
        Share of the rows that did not arrive, of the point and of the moment before that an
        estimate uses too.
    """

    axis: str
    axis_wanted: bool
    amplitude: float
    edge: float
    length: float
    deviations: Array
    unquiet: float
    others: float
    corrected: float
    airspeed: float
    airspeed_change: float
    gusts: float
    lost: float


def measure(
    columns: Mapping[str, Array],
    found: DetectedManeuver,
    wanted: Segment,
    response: AircraftResponse,
    gusts_mps: float,
    since_s: float = -math.inf,
) -> PointMeasures:
    """Measure one input that is over.

    Parameters
    ----------
    columns : mapping of str to (n,) Array
        SI, on an even grid, as `RecentFlight.columns` gives them.
    found : DetectedManeuver
    wanted : Segment
        The card's.
    response : AircraftResponse
    """
    t = columns["t_s"]
    moved = flown_surfaces(columns, found)
    asked = wanted_surfaces(wanted, response)
    during = round((found.input_end_s - found.start_s) / STEP_S) + 1
    own = [axis for axis in wanted.axes if axis in SURFACES]
    size = max((float(np.abs(asked[axis]).max()) for axis in own), default=1.0)
    swings = {axis: float(np.abs(moved[axis][:during]).max()) for axis in SURFACES}
    most = max(swings, key=lambda axis: swings[axis])
    amplitude = max((swings[axis] for axis in own), default=0.0) / size
    before = (t >= found.start_s - TRIM_S) & (t < found.start_s - 0.05)
    inside = (t >= found.start_s) & (t <= found.input_end_s + RESPONSE_S)
    lead = (t >= found.start_s - LEAD_S) & (t < found.start_s)
    rate = columns[_RATE_OF.get(own[0] if own else "elevator", "q_radps")]
    speed = columns["airspeed_mps"]
    names = point_derivatives(wanted)
    # Handling on other axes, and a trim that was read wrongly there, tell nothing of this one.
    own_motion = {axis: moved[axis] if axis in own else 0.0 * moved[axis] for axis in SURFACES}
    return PointMeasures(
        axis=most,
        axis_wanted=most in own or amplitude > 0.5,
        amplitude=amplitude,
        edge=amplitude * size / LEAST_EDGE_RAD,
        length=(found.input_end_s - found.start_s) / input_s(wanted),
        deviations=response.deviations(names, own_motion) / response.deviations(names, asked),
        unquiet=_rms(rate[before] - rate[before].mean())
        / max(float(np.abs(rate[inside]).max()), 1e-6),
        others=max((swings[axis] for axis in SURFACES if axis not in own), default=0.0) / size,
        corrected=max(
            (float(np.abs(moved[axis][during + 30 :]).max(initial=0.0)) for axis in own),
            default=0.0,
        )
        / size,
        airspeed=float(speed[before].mean()) / response.airspeed_mps - 1.0,
        airspeed_change=float(np.ptp(speed[inside])) / response.airspeed_mps,
        gusts=gust_change_mps(columns, since_s, found.start_s) / (CHANGE_OF_GUST * gusts_mps),
        lost=1.0 - float(columns["arrived"][inside | lead].mean()),
    )


def flown_surfaces(columns: Mapping[str, Array], found: DetectedManeuver) -> dict[str, Array]:
    """Return deflections from the trim before, rad, every `STEP_S`, from an input's start on."""
    t = columns["t_s"]
    at = np.arange(found.start_s, min(found.input_end_s + RESPONSE_S, float(t[-1])), STEP_S)
    before = (t >= found.start_s - TRIM_S) & (t < found.start_s - 0.05)
    out = {}
    for axis in SURFACES:
        series = columns[f"{axis}_rad"]
        rest = float(np.median(series[before])) if before.any() else float(series[0])
        out[axis] = np.interp(at, t, series) - rest
    return out


def gust_change_mps(columns: Mapping[str, Array], since_s: float, until_s: float) -> float:
    """Return the rms change of the vertical air over `GUST_S` in the seconds before an input.

    Zero where they are fewer than `GUSTS_LEAST_S`.
    """
    t = columns["t_s"]
    lag = max(1, round(GUST_S / float(t[1] - t[0])))
    from_s = max(until_s - GUSTS_OVER_S, since_s)
    speed, before = columns["airspeed_mps"], t < until_s
    standing = before & (speed < FLYING_SHARE * float(np.median(speed[before][-lag:])))
    if standing.any():  # a launch is no gust
        from_s = max(from_s, float(t[standing][-1]) + LAUNCH_S)
    quiet = (t >= from_s) & before
    if until_s - from_s < GUSTS_LEAST_S or quiet.sum() <= lag:
        return 0.0
    air = columns["alpha_rad"][quiet] * speed[quiet]
    return _rms(air[lag:] - air[:-lag])


def _rms(values: Array) -> float:
    return math.sqrt(float(np.mean(np.square(values)))) if len(values) else 0.0
