"""The comparison of imported logs with our own: what counts as held, and as the same answer."""

import numpy as np
import pytest
from studies.imported_logs import OWN, Estimate, rows


def test_rows_count_what_is_held_and_what_agrees() -> None:
    found = [
        Estimate(OWN, 1, "Cm_q", -10.0, -10.5, 1.0),
        Estimate(OWN, 1, "Cl_p", -0.4, -0.5, 0.05),
        Estimate("ulog, vtail", 1, "Cm_q", -10.0, -11.5, 2.0),
        Estimate("ulog, vtail", 1, "Cl_p", -0.4, -0.6, 0.05),
    ]
    own, theirs = rows(found)
    assert own[:4] == (OWN, 2, 50.0, 100.0)
    assert theirs[:3] == ("ulog, vtail", 2, 50.0)
    assert theirs[3] == 50.0  # 1.0 apart within 2.24; 0.1 apart, the joint interval is 0.07
    assert theirs[4] == pytest.approx(np.median([2.0, 1.0]))
    assert theirs[5] == pytest.approx(100.0 * np.median([0.15, 0.5]))
