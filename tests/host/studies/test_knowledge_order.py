"""Who knows less is never surer: the same flight, maneuvers and methods, knowledge taken away."""

import numpy as np
import pytest
from studies.judgement.knowledge_order import MEDIAN, TENTH, flown, ratios


@pytest.mark.costs(20, "a flight of the recorder, identified by both models three times")
def test_without_a_vane_or_the_aircraft_file_no_interval_is_narrower() -> None:
    """One vane alone takes no part in the reconstruction; its scale was in no interval then, and
    Z_alpha without the other vane known to 0.89 of what both gave."""
    found = ratios(flown(1), ("beta vane", "aircraft file"))
    for less, own in found.items():
        assert {"Z_alpha", "M_alpha", "N_beta"} <= own.keys()
        assert sorted(own.values())[len(own) // 2] > MEDIAN, (less, own)
    every = [one for own in found.values() for one in own.values()]
    assert np.percentile(every, 10, method="lower") > TENTH, found
