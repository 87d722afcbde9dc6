"""Counts of a campaign: how far the recorder came with how many cards, and which are wrong."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from tests.cards.judge import Judgement, Stage

LEAST_MOUNTED, LEAST_FOUND = 0.7, 0.5
ENOUGH = 100  # cards whose shares mean something


@dataclass(slots=True)
class Result:
    """What came of one card.

    Attributes
    ----------
    seed : int
        Seed of `draw`.
    judgement : Judgement
        Judgement of its flight.
    altered : list of str
        What was done to it.
    """

    seed: int
    judgement: Judgement
    altered: list[str] = field(default_factory=list)


@dataclass(slots=True)
class Tally:
    """Counts of a campaign.

    Attributes
    ----------
    stages, messages : Counter
        Cards by how far the recorder came, and by what it said.
    wrong : list of Result
        Cards with which something was wrong.
    """

    stages: Counter[Stage] = field(default_factory=Counter)
    messages: Counter[str] = field(default_factory=Counter)
    wrong: list[Result] = field(default_factory=list)

    def show(self, result: Result) -> None:
        """Count a card and print what is wrong with it."""
        self.stages[result.judgement.stage] += 1
        self.messages[result.judgement.message.rstrip("0123456789% ") or "nothing"] += 1
        if not result.judgement.wrong:
            return
        self.wrong.append(result)
        altered = "; ".join(result.altered)
        for text in result.judgement.wrong:
            print(f"card {result.seed}: {text} ({altered})", flush=True)

    def reached(self, stage: Stage) -> float:
        """Return the share of cards that came so far."""
        count = sum(number for at, number in self.stages.items() if at >= stage)
        return count / max(1, self.stages.total())

    def passed(self) -> bool:
        """Whether nothing is wrong and enough cards came far enough."""
        far = self.reached(Stage.MOUNTED) >= LEAST_MOUNTED
        far = far and self.reached(Stage.FOUND) >= LEAST_FOUND
        return not self.wrong and (far or self.stages.total() < ENOUGH)

    def table(self) -> str:
        """Lay out the shares."""
        names = {
            Stage.MOUNTED: f"past the mount (at least {LEAST_MOUNTED:.0%})",
            Stage.FOUND: f"past finding the newest file (at least {LEAST_FOUND:.0%})",
            Stage.RECORDING: "recording",
        }
        lines = [f"{name:50} {100 * self.reached(stage):6.1f} %" for stage, name in names.items()]
        said = ", ".join(f"{words} {number}" for words, number in self.messages.most_common())
        return "\n".join([*lines, f"said after ten seconds: {said}"])
