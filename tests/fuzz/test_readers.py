"""The worst inputs that campaigns have met cost what was promised, and those that broke a rule."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

from tests.fuzz.readers import SUFFIX, judge, mutated

LISTED = Path(__file__).resolve().parents[1] / "data" / "fuzz" / "readers.txt"
BROKE_A_RULE = {
    "text": (632, 650, 1244, 1286),
    "dataflash": (504,),
    "mat": (524,),
    "csv": (27375, 57138, 77138, 94908),
    "parquet": (47383, 51741, 69737),
}


def seeds(kind: str) -> list[int]:
    lines = [line.split() for line in LISTED.read_text().splitlines() if not line.startswith("#")]
    return [int(seed) for one, seed in lines if one == kind] + list(BROKE_A_RULE.get(kind, ()))


@pytest.mark.parametrize("kind", sorted(SUFFIX))
def test_the_worst_inputs_cost_what_was_promised(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"file{SUFFIX[kind]}"
    listed = seeds(kind)
    assert len(listed) >= 20
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for seed in listed:
            data = mutated(kind, seed)
            judge(kind, data, path)
            judge(kind, data, path, traced=True)
