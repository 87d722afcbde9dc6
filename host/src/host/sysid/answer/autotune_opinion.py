"""What an autopilot's autotune says of the same response: a third opinion next to model and record.

Both answer the torque setpoint. An answer's model is driven by a surface: the torque comes to it by
the share that the log shows, and through the servo.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from host.arrays import Array
from host.constants import DEG_PER_RAD, NORMAL_95, RAD_PER_DEG
from host.errors import IdentificationError
from host.readers.autotune_model import HIGH_PASS_HZ, TunedModel
from host.sysid.answer.frequency_pictures import pairs_of
from host.sysid.estimators.frequency_response import model_response
from host.sysid.flight.reconstructed_flight import ReconstructedFlight
from host.sysid.linear.linear_answer import Answer

SURFACE = {"p_radps": "aileron_rad", "q_radps": "elevator_rad", "r_radps": "rudder_rad"}
AXIS = {"p_radps": "roll", "q_radps": "pitch", "r_radps": "yaw"}
FREQUENCIES = 20
# Cost of a mismatch of frequency responses, and what is acceptable (Tischler & Remple, Aircraft and
# Rotorcraft System Identification, ch. 11).
ACCEPTABLE = 100.0
DECIBEL = 20.0 / np.log(10.0)
SAMPLES_OF_PERIOD = 4.0
STEP_S = 1.0 / (2.0 * np.pi * HIGH_PASS_HZ)  # a step is known for the time of the high-pass
FOLLOWS = 0.9  # correlation of a surface with the torque that moves it alone


@dataclass(frozen=True, slots=True, eq=False)
class Opinion:
    """One axis: an autotune's model and an answer's, both over the torque setpoint.

    Attributes
    ----------
    tuned : TunedModel
    input : str
        The surface that the answer's model is driven by.
    surface_per_torque : (f,) array, complex
        What brings the torque to it: share and servo.
    frequency_hz : (f,) Array
    theirs, ours : (f,) array, complex
        rad/s per unit of torque.
    half_width : (f,) array, complex
        Half-width of theirs, by the variances in the log: relative in magnitude, and of phase, rad.
    step_theirs, step_ours : float
        The rate `STEP_S` after a step of full torque, rad/s.
    airspeed_mps : float
        Airspeed of the autotune.
    """

    tuned: TunedModel
    input: str
    surface_per_torque: NDArray[np.complexfloating]
    frequency_hz: Array
    theirs: NDArray[np.complexfloating]
    ours: NDArray[np.complexfloating]
    half_width: NDArray[np.complexfloating]
    step_theirs: float
    step_ours: float
    airspeed_mps: float

    @property
    def mismatch(self) -> float:
        """Cost of the mismatch: of magnitude in dB and of phase in degrees."""
        apart = np.log(self.theirs / self.ours)
        db, deg = DECIBEL * apart.real, DEG_PER_RAD * apart.imag
        return float(20.0 * np.mean(db**2 + RAD_PER_DEG * deg**2))

    @property
    def verdict(self) -> str:
        """Whether both agree, in words behind a subject."""
        if self.mismatch <= ACCEPTABLE:
            return "agrees"
        turned = float(np.median(np.abs(np.angle(self.theirs / self.ours)))) > 0.5 * np.pi
        return "has the opposite sign" if turned else "does not agree"

    @property
    def short(self) -> str:
        """That with its figure, in a line of 80 columns."""
        return (
            f"PX4's autotune of {AXIS[self.tuned.rate]} {self.verdict}: mismatch"
            f" {self.mismatch:.0f}, {ACCEPTABLE:.0f} is acceptable"
        )

    @property
    def line(self) -> str:
        """Both in words, and whether they agree."""
        tuned = self.tuned
        gain, phase = np.abs(self.theirs / self.ours), np.angle(self.theirs / self.ours)
        f = self.frequency_hz
        when = f"{tuned.from_s:.0f} to {tuned.to_s:.0f} s"
        at = f" at {self.airspeed_mps:.1f} m/s" if np.isfinite(self.airspeed_mps) else ""
        loose = "" if tuned.converged else "; it had not converged"
        return (
            f"{self.short} ({when}{at}: {tuned.rate} by torque, {f[0]:.2g} to {f[-1]:.2g} Hz);"
            f" gain {gain.min():.2f} to {gain.max():.2f} of this model's, phase"
            f" within {DEG_PER_RAD * np.abs(phase).max():.0f} deg; {STEP_S:.2f} s after a step of"
            f" full torque {self.step_theirs:.3g} rad/s, this model {self.step_ours:.3g}{loose}"
        )


def opinions(answer: Answer, flights: Sequence[ReconstructedFlight]) -> tuple[Opinion, ...]:
    """Return an opinion for each autotune of an axis whose rate and surface an answer has.

    Parameters
    ----------
    answer : Answer
    flights : sequence of ReconstructedFlight
        With what their logs have of an autotune.
    """
    found = [_opinion(answer, flight, one) for flight in flights for one in flight.tuned]
    return tuple(one for one in found if one is not None)


def _opinion(answer: Answer, flight: ReconstructedFlight, tuned: TunedModel) -> Opinion | None:
    model, surface = answer.model, SURFACE[tuned.rate]
    if tuned.rate not in model.outputs or surface not in model.inputs:
        return None
    share = _surface_share(flight, tuned, surface)
    if share is None:
        return None
    own_dt_s = answer.maneuvers[0].dt_s
    f = np.geomspace(HIGH_PASS_HZ, _highest_hz(answer, tuned, surface), FREQUENCIES)
    by_torque = share * _servo(answer, flight, f)
    row, column = model.outputs.index(tuned.rate), model.inputs.index(surface)
    ours = by_torque * model_response(answer.result, f, own_dt_s).response[:, row, column]
    theirs, half_width = response_of(tuned, f)
    t, speed = flight.recorded["t_s"], flight.recorded.get("airspeed_mps")
    during = (t >= tuned.from_s) & (t <= tuned.to_s)
    airspeed = float(np.mean(speed[during])) if speed is not None and during.any() else np.nan
    steps = (_after_step(tuned), _model_after_step(answer, flight, share, (row, column)))
    return Opinion(tuned, surface, by_torque, f, theirs, ours, half_width, *steps, airspeed)


def _highest_hz(answer: Answer, tuned: TunedModel, surface: str) -> float:
    """Return the end of the band: of the record's coherence, if that reaches far enough."""
    highest_hz = 1.0 / (SAMPLES_OF_PERIOD * max(answer.maneuvers[0].dt_s, tuned.dt_s))
    with contextlib.suppress(IdentificationError):
        for pair in pairs_of(answer)[0]:
            if (pair.output, pair.input) == (tuned.rate, surface) and pair.band_hz is not None:
                ends = pair.band_hz[1]
                return min(highest_hz, ends) if ends > 2.0 * HIGH_PASS_HZ else highest_hz
    return highest_hz


def _surface_share(flight: ReconstructedFlight, tuned: TunedModel, surface: str) -> float | None:
    """Return the surface's angle per torque; None where something else moves it too."""
    moved = flight.commands.get(surface, flight.recorded.get(surface))
    torque = tuned.torque.values
    if moved is None or len(torque) < FREQUENCIES or not np.ptp(torque) > 0.0:
        return None
    at = np.interp(tuned.torque.t_s, flight.recorded["t_s"], moved)
    torque, at = torque - np.mean(torque), at - np.mean(at)
    slope = float(torque @ at) / float(torque @ torque)
    alike = abs(slope) * float(np.sqrt(torque @ torque)) / max(float(np.sqrt(at @ at)), 1e-300)
    return slope if alike > FOLLOWS else None


def _servo_numbers(answer: Answer, flight: ReconstructedFlight) -> tuple[float, float]:
    """Return delay (s) and bandwidth (Hz) of an answer's servo; zero and infinite without."""
    if answer.servo is not None:
        return answer.servo.setting[0], answer.servo.setting[1]
    if flight.servo is not None:
        return flight.servo.mean[0], flight.servo.mean[1]
    return 0.0, np.inf


def _servo(
    answer: Answer, flight: ReconstructedFlight, frequency_hz: Array
) -> NDArray[np.complexfloating]:
    delay_s, bandwidth_hz = _servo_numbers(answer, flight)
    late = np.exp(-2j * np.pi * frequency_hz * delay_s)
    return np.asarray(late / (1.0 + 1j * frequency_hz / bandwidth_hz))


def response_of(
    tuned: TunedModel, frequency_hz: Array
) -> tuple[NDArray[np.complexfloating], NDArray[np.complexfloating]]:
    """Return the frequency response of an autotune's model, (f,), and its half-width.

    The half-width is as that of `model_response`; the log has no covariances, only variances.
    """
    z = np.exp(-2j * np.pi * frequency_hz * tuned.dt_s)[:, None] ** np.arange(1, 4)
    below = 1.0 + z[:, :2] @ tuned.coefficients[:2]
    response = z @ tuned.coefficients[2:] / below
    slopes = np.hstack([-response[:, None] * z[:, :2], z]) / below[:, None]
    relative = slopes / response[:, None]
    real, imaginary = (
        NORMAL_95 * np.sqrt(part**2 @ tuned.variances) for part in (relative.real, relative.imag)
    )
    return response, real + 1j * imaginary


def _after_step(tuned: TunedModel) -> float:
    """Return the rate `STEP_S` after a step of full torque."""
    a1, a2, *b = tuned.coefficients.tolist()
    y = [0.0, 0.0]
    for k in range(1, round(STEP_S / tuned.dt_s) + 1):
        y.append(-a1 * y[-1] - a2 * y[-2] + sum(b[: min(k, 3)]))
    return y[-1]


def _model_after_step(
    answer: Answer, flight: ReconstructedFlight, share: float, place: tuple[int, int]
) -> float:
    """Return the same of an answer's model behind its servo."""
    from scipy.linalg import expm

    delay_s, bandwidth_hz = _servo_numbers(answer, flight)
    A, B, C, D = answer.model.matrices(answer.result.estimate)
    row, column = place
    n = len(A)
    # States, the surface, and where it goes: share of the torque.
    whole, start = np.zeros((n + 2, n + 2)), np.zeros(n + 2)
    whole[:n, :n], whole[:n, n] = A, B[:, column]
    start[n + 1] = share
    if np.isinf(bandwidth_hz):
        start[n] = share
    else:
        whole[n, n:] = 2.0 * np.pi * bandwidth_hz * np.array([-1.0, 1.0])
    end = expm(whole * max(STEP_S - delay_s, 0.0)) @ start
    return float(C[row] @ end[:n] + D[row, column] * end[n])
