"""Switches of steps name what there is."""

import importlib

from studies.switch_off.switches import ROOM, SWITCHES


def test_every_switch_names_a_part_that_there_is() -> None:
    paths = [path.partition(":") for switch in SWITCHES for path in switch.off]
    gone = [
        f"{module}:{name}"
        for module, _, name in paths
        if not hasattr(importlib.import_module(ROOM + module), name)
    ]
    assert gone == []
