"""Record format-1-card.bin and format-1-learned.bin: a flight card's row, flown on a PC.

Kept for the record, never run by a test: a released log is never made anew. Needs `make sitl`.

    python tests/data/make_card.py FOLDER NAME
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "host/src"))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))


from tests.protocol.expected_text import text_of_oracle
from tests.protocol.log_writer import LogWriter
from tests.protocol.oracle import decode
from tests.sitl import flight_cards as cards
from tests.sitl.bench import Bench
from tests.sitl.card_image import read_file
from tests.sitl.input_flight import TRIGGER_S
from tests.sitl.test_learning import AXES, moved

RATE_HZ = 100  # no row is flown at less


def main() -> int:
    """Enable the card on the ground, fly its row, which teaches pitch; write log and text."""
    folder, name = Path(sys.argv[1]), sys.argv[2]
    row = cards.row(quiet_ms=200, duration_ms=2900)
    bench = Bench()
    bench.sitl.set_eeprom(cards.eeprom_with(cards.card([row], AXES[:1], [1])))
    bench.set_rate(RATE_HZ)
    given = moved(TRIGGER_S + 3.8)
    given.give(bench.sitl)
    bench.sitl.power_on()
    bench.sitl.run_until(round(given.seconds * 2_000_000))
    # The battery was pulled: what lies behind the last block was never written.
    data = read_file(bytes(bench.image), "FLT00001.BIN").rstrip(b"\0")
    data += bytes(-len(data) % 512)
    read = decode(data)
    assert read is not None
    (folder / f"{name}.bin").write_bytes(data)
    text = text_of_oracle(read, list(LogWriter().layouts))
    (folder / f"{name}.txt").write_text(text, encoding="ascii")
    return 0


if __name__ == "__main__":
    sys.exit(main())
