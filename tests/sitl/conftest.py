"""Let tests name their siblings in full (tests.protocol.log_writer) however pytest is started."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
