"""Cards of many gigabytes, 95 % full with small clusters: room must be looked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tests.cards.flights import State, add_flight
from tests.cards.sparse import BLOCK, END, SparseCard

CLUSTER_BLOCKS = 8  # 4 kB
CLUSTER_BYTES = CLUSTER_BLOCKS * BLOCK
MUSIC_CLUSTERS = 2000  # of each file that fills the card: 8 MB
LAST_FLIGHT = 41
UNKNOWN_HINT = 0xFFFFFFFF


def clusters_of(gigabytes: float) -> int:
    """Return the clusters of a card sold by that name."""
    return round(gigabytes * 1e9) // CLUSTER_BYTES


def nearly_full(
    gigabytes: float,
    free: Sequence[tuple[float, int]],
    *,
    hint: float | None,
    flight_at: float = 0.0,
) -> SparseCard:
    """Fill a card but for some runs of clusters.

    Parameters
    ----------
    gigabytes : float
        Size of the card.
    free : sequence of (float, int)
        Runs left free: where each begins, as a share of the card, and its bytes.
    hint : float or None
        FSInfo's hint as a share of the card; None: not known.
    flight_at : float
        Where the last flight lies, closed.
    """
    count = clusters_of(gigabytes)
    card = SparseCard(CLUSTER_BLOCKS, clusters=count)
    table = np.arange(1, count + 3, dtype=np.uint32)
    table[MUSIC_CLUSTERS - 1 :: MUSIC_CLUSTERS] = END
    table[:3] = [0x0FFFFFF8, END, END]
    table[-1] = END
    for share, size in free:
        first = 3 + int(share * (count - 3))
        table[first - 1] = END
        table[first : first + size // CLUSTER_BYTES] = 0
    card.set_fat(0, table)
    add_flight(card, LAST_FLIGHT, 3 + int(flight_at * (count - 3)), State.CLOSED)
    card.set_hint(UNKNOWN_HINT if hint is None else 3 + int(hint * (count - 3)))
    return card
