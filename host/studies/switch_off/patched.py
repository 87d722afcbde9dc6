"""Put other functions in place of a module's own, wherever they were imported."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Mapping
from typing import Any

from studies.switch_off.switches import ROOM


def switch_off(off: Mapping[str, Any]) -> None:
    """Replace functions and constants in every module that has them; for a process of its own.

    Parameters
    ----------
    off : mapping
        ``module:name`` below `host.sysid` to what replaces it.
    """
    for path, value in off.items():
        module, _, name = path.partition(":")
        own = importlib.import_module(ROOM + module)
        was = getattr(own, name)
        for loaded in list(sys.modules.values()):
            if (
                getattr(loaded, "__name__", "").startswith("host.")
                and loaded.__dict__.get(name) is was
            ):
                setattr(loaded, name, value)
        assert getattr(own, name) is value
