"""Frequency responses of an answer: the record's with its coherence, the model's over it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.answer.figure_kinds import MODEL, empty_figure, shown
from host.sysid.checks.data_finding import Finding
from host.sysid.estimators.frequency_response import (
    COHERENT,
    LINES,
    model_response,
    recorded_response,
)
from host.sysid.linear.linear_answer import Answer
from host.sysid.maneuvers.maneuver_detection import runs_of
from host.sysid.maneuvers.maneuver_selection import SURFACES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from host.sysid.answer.autotune_opinion import Opinion

OUTPUTS = ("p_radps", "q_radps", "r_radps", "az_mps2")  # that a picture has
RECORD, FAINT, BAND, TUNED = "0.25", "0.75", "#dbeafe", "C2"
ACROSS = 4  # pairs side by side
TICKS_HZ = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
ABOUT = (
    f"dots: the record, dark where its coherence is above {COHERENT:g}; red: the model with its"
    " 95 % interval; shaded: the band where coherence holds"
)
TUNED_ABOUT = "green: an autotune with its 95 % interval"
LETTERS_PER_IN = 14  # of a title
DECIBEL = 20.0 / np.log(10.0)
Curve = tuple[Array, NDArray[np.complexfloating], NDArray[np.complexfloating]]


def frequency_pictures(
    answers: Sequence[Answer],
    findings: Sequence[Finding] = (),
    opinions: Sequence[Sequence[Opinion]] = (),
) -> tuple[list[Figure], list[str]]:
    """Return one picture of answers' frequency responses, none if no record tells one; and lines.

    Parameters
    ----------
    answers : sequence of Answer
        Linear models.
    findings : sequence of Finding
        Those of feedback say which responses lean towards the controller's inverse.
    opinions : sequence of sequence of Opinion
        What autotunes say of each answer, drawn over it.

    Raises
    ------
    IdentificationError
        If matplotlib is missing.
    """
    pairs: list[Pair] = []
    titles, lines = [], []
    for number, answer in enumerate(answers):
        own_opinions = opinions[number] if opinions else ()
        try:
            own, method = pairs_of(answer)
        except IdentificationError as error:
            lines.append(f"{answer.template}: no frequency response: {error}")
            continue
        pairs += [replace(pair, opinions=opinions_of(pair, own_opinions)) for pair in own]
        titles.append(f"{answer.template}, {answer.method}: {method}")
        warned = feedback_lines(answer.model.inputs, findings)
        titles += warned
        lines += [titles[-1 - len(warned)], *(f"  {line}" for line in (*band_lines(own), *warned))]
        lines += [f"  {one.line}" for one in own_opinions]
    return ([frequency_figure(pairs, "\n".join(titles))] if pairs else []), lines


def opinions_of(pair: Pair, opinions: Sequence[Opinion]) -> tuple[Curve, ...]:
    """Return what autotunes say of a pair, over its surface."""
    return tuple(
        (one.frequency_hz, one.theirs / one.surface_per_torque, one.half_width)
        for one in opinions
        if (one.tuned.rate, one.input) == (pair.output, pair.input)
    )


@dataclass(frozen=True, slots=True)
class Pair:
    """One output over one input, (f,) each; `half_width` as `ModelResponse` has it.

    `opinions` are those of autotunes: frequencies, the response to the surface, and its half-width.
    """

    output: str
    input: str
    frequency_hz: Array
    recorded: NDArray[np.complexfloating]
    coherence: Array
    model: NDArray[np.complexfloating]
    half_width: NDArray[np.complexfloating]
    opinions: tuple[Curve, ...] = ()

    @property
    def band_hz(self) -> tuple[float, float] | None:
        """The widest band whose coherence is above `COHERENT`, as far as the window resolves it."""
        coherent = self.coherence > COHERENT
        for gap in runs_of(~coherent):
            coherent[gap] = len(gap) <= LINES
        runs = [run for run in runs_of(coherent) if len(run) > LINES]
        if not runs:
            return None
        widest = max(runs, key=lambda run: self.frequency_hz[run[-1]] / self.frequency_hz[run[0]])
        return float(self.frequency_hz[widest[0]]), float(self.frequency_hz[widest[-1]])


def pairs_of(answer: Answer) -> tuple[list[Pair], str]:
    """Return the responses of an answer's inputs to body rates and az, and the record's method.

    Maneuvers fitted and held out count alike: a record's response knows no fit.

    Raises
    ------
    IdentificationError
        If no surface moves an output of the picture, or the records are too short.
    """
    model = answer.model
    inputs = [k for k, name in enumerate(model.inputs) if name in SURFACES]
    outputs = [k for k, name in enumerate(model.outputs) if name in OUTPUTS]
    if not inputs or not outputs:
        raise IdentificationError(f"it has no surface to {', '.join(OUTPUTS)}")
    records = [
        replace(m, inputs=m.inputs[:, inputs], outputs=m.outputs[:, outputs], rates=None,
                sampled=None, resolution=None, least_noise=None)
        for m in (*answer.maneuvers, *(run for run, _ in answer.held_out_runs))
    ]  # fmt: skip
    found = recorded_response(records)
    own = model_response(answer.result, found.frequency_hz, records[0].dt_s)
    pairs = [
        Pair(
            model.outputs[y],
            model.inputs[u],
            found.frequency_hz,
            found.response[:, row, column],
            found.coherence[:, row, column],
            own.response[:, y, u],
            own.half_width[:, y, u],
        )
        for column, u in enumerate(inputs)
        for row, y in enumerate(outputs)
    ]
    return pairs, found.method


def band_lines(pairs: Sequence[Pair]) -> list[str]:
    """Return in words where each pair is coherent."""
    said = []
    for pair in pairs:
        band = pair.band_hz
        where = f"above {COHERENT:g} from {band[0]:.2g} to {band[1]:.2g} Hz" if band else "too low"
        said.append(f"{_short(pair.input)} to {_short(pair.output)}: coherence {where}")
    return said


def feedback_lines(inputs: Sequence[str], findings: Sequence[Finding]) -> list[str]:
    """Return a line for each input that follows the motion, found by the check of feedback."""
    return [
        f"{_short(name)} follows the motion: what the record says of it leans towards the"
        " controller's inverse, as no input from outside of the loop is known"
        for name in inputs
        if any(f.check == "feedback" and f.text.startswith(name) for f in findings)
    ]


def frequency_figure(pairs: Sequence[Pair], title: str) -> Figure:
    """Draw magnitude, phase and coherence of each pair; the coherent band is shaded."""
    across = min(ACROSS, len(pairs))
    blocks = -(-len(pairs) // across)
    width_in = max(3.2 * across, 5.0)
    figure = empty_figure((width_in, 5.2 * blocks + 0.4))
    heights = [3, 2, 1.4] * blocks
    panels = figure.subplots(3 * blocks, across, squeeze=False, height_ratios=heights)
    shown_pairs = [_as_shown(pair) for pair in pairs]
    for k, pair in enumerate(shown_pairs):
        block, column = divmod(k, across)
        _draw(panels[3 * block : 3 * block + 3, column], pair, first=column == 0)
    for k in range(len(pairs), blocks * across):
        for axis in panels[3 * (k // across) : 3 * (k // across) + 3, k % across]:
            axis.set_visible(False)
    about = ABOUT + (f"; {TUNED_ABOUT}" if any(pair.opinions for pair in pairs) else "")
    fitting = [fill(line, int(LETTERS_PER_IN * width_in)) for line in (*title.splitlines(), about)]
    figure.suptitle("\n".join(fitting[:-1]), fontsize=9)
    figure.supxlabel(fitting[-1], fontsize=8)
    return figure


def _as_shown(pair: Pair) -> Pair:
    """Return a pair without what is two octaves beyond its band: noise alone."""
    end = int(np.searchsorted(pair.frequency_hz, 4.0 * pair.band_hz[1])) if pair.band_hz else None
    whole = ("output", "input", "opinions")
    cut = {f.name: getattr(pair, f.name)[:end] for f in fields(pair) if f.name not in whole}
    return replace(pair, **cut)


def _draw(axes: Any, pair: Pair, *, first: bool) -> None:
    f, scale = pair.frequency_hz, shown(pair.output)[1] / shown(pair.input)[1]
    coherent, band = pair.coherence > COHERENT, pair.band_hz
    phase = np.unwrap(np.angle(pair.model))
    recorded = phase + np.angle(pair.recorded / pair.model)  # the turn that is nearest to the model
    for their_hz, theirs, their_half in pair.opinions:
        own = np.interp(their_hz, f, phase)
        turn = own + np.angle(theirs * np.exp(-1j * own))  # that is nearest to the model
        size = DECIBEL * np.log(np.abs(scale * theirs))
        for axis, values, half in (
            (axes[0], size, DECIBEL * their_half.real),
            (axes[1], np.degrees(turn), np.degrees(their_half.imag)),
        ):
            axis.plot(their_hz, values, color=TUNED, lw=1.0, ls="--")
            axis.fill_between(their_hz, values - half, values + half, color=TUNED, alpha=0.2, lw=0)
    for axis, dots, line, half in (
        (axes[0], DECIBEL * np.log(np.maximum(np.abs(scale * pair.recorded), 1e-300)),
         DECIBEL * np.log(np.abs(scale * pair.model)), DECIBEL * pair.half_width.real),
        (axes[1], np.degrees(recorded), np.degrees(phase), np.degrees(pair.half_width.imag)),
    ):  # fmt: skip
        axis.plot(f[~coherent], dots[~coherent], ".", color=FAINT, ms=2)
        axis.plot(f[coherent], dots[coherent], ".", color=RECORD, ms=3)
        axis.plot(f, line, color=MODEL, lw=1.0)
        axis.fill_between(f, line - half, line + half, color=MODEL, alpha=0.25, lw=0)
        seen = np.concatenate([line, dots[coherent]])
        room = 0.05 * float(np.ptp(seen)) + 1.0
        axis.set_ylim(float(seen.min()) - room, float(seen.max()) + room)
    axes[2].plot(f, pair.coherence, color=RECORD, lw=0.9)
    axes[2].axhline(COHERENT, color="0.6", lw=0.6, ls="--")
    axes[2].set_ylim(0.0, 1.02)
    for axis in axes:
        if band is not None:
            axis.axvspan(*band, color=BAND, lw=0.0, zorder=-1)
        axis.set_xscale("log")
        axis.set_xlim(float(f[0]), float(f[-1]))
        shown_hz = [hz for hz in TICKS_HZ if f[0] <= hz <= f[-1]]
        axis.set_xticks(shown_hz, [f"{hz:g}" for hz in shown_hz])
        axis.set_xticks([], minor=True)
        axis.tick_params(labelsize=7, labelbottom=axis is axes[2])
        axis.grid(color="0.93", lw=0.5)
    out, into = (shown(name)[0].split(", ") for name in (pair.output, pair.input))
    axes[0].set_title(f"{into[0]} to {out[0]}, {out[1]} per {into[1]}", fontsize=8)
    axes[2].set_xlabel("frequency, Hz", fontsize=8)
    if first:
        for axis, label in zip(axes, ("magnitude, dB", "phase, deg", "coherence"), strict=True):
            axis.set_ylabel(label, fontsize=8)


def _short(name: str) -> str:
    return shown(name)[0].partition(",")[0]
