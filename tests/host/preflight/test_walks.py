"""Fifty healthy aircraft fly; of every fault the item and the cause are named."""

import pytest
from host.twin.ground.ground_faults import GROUND_FAULTS

from tests.host.preflight.walks import broken, healthy

# Looked at once with these limits; limits were set on seeds 9000-9012 and 9100-9105.
HEALTHY = range(9200, 9250)
BROKEN = 9300


def test_none_of_fifty_healthy_aircraft_is_refused() -> None:
    refused = {seed: one.reasons for seed in HEALTHY if not (one := healthy(seed)).preflight.go}
    assert refused == {}


@pytest.mark.parametrize("fault", GROUND_FAULTS)
def test_a_fault_is_found_by_its_item_and_its_cause_is_named(fault: str) -> None:
    seed = BROKEN + list(GROUND_FAULTS).index(fault)
    found = broken(fault, seed)
    assert GROUND_FAULTS[fault].cause in found.reasons[found.item]
