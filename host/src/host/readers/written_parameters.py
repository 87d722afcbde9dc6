"""Parameters of an autopilot: each value counts from the time at which it was written.

Where a parameter of an output changed, a surface is made stretch by stretch: a reversal that was
changed after the landing turns no flight round.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from itertools import pairwise

import numpy as np

from host.arrays import Array
from host.readers.ardupilot_outputs import Outputs

# Parameters of outputs: what each moves, its ends, its middle, its sense.
OF_OUTPUTS = re.compile(
    r"(SERVO|RC)\d+_(FUNCTION|MIN|MAX|TRIM|REVERSED|REV)|PWM_(MAIN|AUX)_(FUNC|MIN|MAX|CENT|REV)\d*"
    r"|CA_SV_CS(\d+_TYPE|_COUNT)"
)
MOST_CHANGES = 1000  # of outputs: a trim that is learned in flight is written every 10 s


class Parameters(dict[str, float]):
    """The value of each parameter that stood longest; `changes` has all of those that changed.

    Attributes
    ----------
    changes : dict of str to list of (float, float)
        Time, s, and value, in order; the first counts from the beginning of the log.
    """

    def __init__(
        self, written: Iterable[tuple[str, float, float]] = (), end_s: float = 0.0
    ) -> None:
        """Take values as they were written: name, value, time; `end_s` is that of the log."""
        super().__init__()
        self.changes: dict[str, list[tuple[float, float]]] = {}
        for name, value, t_s in written:
            every = self.changes.setdefault(name, [])
            if not every or every[-1][1] != value:
                every.append((t_s, value))
        for name, every in self.changes.items():
            ends = [*(t for t, _ in every[1:]), end_s]
            stood = [end - max(t, 0.0) for end, (t, _) in zip(ends, every, strict=True)]
            longest = max(range(len(every)), key=lambda k: (stood[k], k))
            self[name] = every[longest][1]
        self.changes = {name: every for name, every in self.changes.items() if len(every) > 1}

    def replaced(self, values: Mapping[str, float]) -> Parameters:
        """Return them with these values all the time."""
        found = Parameters()
        found.update({**self, **values})
        found.changes = {k: own for k, own in self.changes.items() if k not in values}
        return found

    def lines(self) -> list[str]:
        """Return a line on each parameter of an output that changed."""
        return [
            f"{name} changed from {every[0][1]:g} to {every[-1][1]:g}"
            f" {'at' if len(every) == 2 else f'in {len(every) - 1} steps, the first at'}"
            f" {every[1][0]:.1f} s: each value counts while it stood"
            for name, every in self.changes.items()
            if OF_OUTPUTS.fullmatch(name)
        ]


def made_of_outputs(
    t_s: Array,
    parameters: Mapping[str, float],
    make: Callable[[slice, Mapping[str, float]], Outputs],
) -> Outputs:
    """Return the surfaces behind outputs, each stretch made by the parameters of its time.

    Parameters
    ----------
    t_s : (n,) array
        Times of the outputs.
    parameters : mapping of str to float
    make : callable
        Makes outputs of rows and the parameters that stood then.
    """
    every = parameters.changes if isinstance(parameters, Parameters) else {}
    changes = {name: own for name, own in every.items() if OF_OUTPUTS.fullmatch(name)}
    times = sorted({t for own in changes.values() for t, _ in own[1:]})
    if not times or len(times) > MOST_CHANGES:
        return make(slice(None), parameters)
    parts = []
    for first, end in pairwise([0, *np.searchsorted(t_s, times).tolist(), len(t_s)]):
        if end > first:
            stood = {
                name: next((v for t, v in reversed(own) if t <= t_s[first]), own[0][1])
                for name, own in changes.items()
            }
            parts.append((end - first, make(slice(first, end), {**parameters, **stood})))
    if not parts:
        return make(slice(None), parameters)
    names = dict.fromkeys(name for _, one in parts for name in one.shares)
    shares = {
        name: np.concatenate([one.shares.get(name, np.full(n, np.nan)) for n, one in parts])
        for name in names
    }
    made_of: dict[str, str] = {}
    for _, one in sorted(parts, key=lambda part: part[0]):
        made_of |= one.made_of
    clipped = {name: sum(one.clipped.get(name, 0) for _, one in parts) for name in names}
    return Outputs(shares, made_of, clipped)
