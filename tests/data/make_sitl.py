"""Record format-1-sitl*.bin: the firmware in simulated time, its button, a reset, its card.

Kept for the record, never run by a test: a released log is never made anew. Needs `make sitl`.

    python tests/data/make_sitl.py FOLDER NAME
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "host/src"))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from host.wire.schema_text import packed_schema

from tests.protocol.expected_text import text_of_oracle
from tests.protocol.log_writer import LogWriter
from tests.protocol.oracle import decode
from tests.sitl.bench import Bench, flight
from tests.sitl.card_image import read_file

BROWN_OUT = packed_schema().number("reset_cause", "brown_out")


def main() -> int:
    """Record, reset in flight, record on until the throttle is idle, stop; write log and text."""
    folder, name = Path(sys.argv[1]), sys.argv[2]
    bench = Bench()
    flight(17.8).give(bench.sitl)
    bench.power_on_and_record(1.0)
    bench.sitl.reset(BROWN_OUT)
    bench.sitl.run_for(1.7)
    bench.stop()
    data = read_file(bytes(bench.image), "FLT00001.BIN")
    read = decode(data)
    assert read is not None
    (folder / f"{name}.bin").write_bytes(data)
    text = text_of_oracle(read, list(LogWriter().layouts))
    (folder / f"{name}.txt").write_text(text, encoding="ascii")
    return 0


if __name__ == "__main__":
    sys.exit(main())
