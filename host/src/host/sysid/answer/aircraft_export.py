"""An answer as an aircraft: a file that `host simulate` flies again, and JSBSim's XML of it.

What was identified replaces the coefficients of the aircraft file the answer was made with;
everything else (mass, propeller, servos, what the data could not tell) stays and says so.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from host.sysid.aircraft.airframe import CoefficientTable
from host.sysid.errors import IdentificationError

# Names of the aircraft file for the names of the answer.
AXES = {"CL": "cl", "Cm": "cm", "CY": "cy", "Cl": "croll", "Cn": "cn"}
CONTROLS = {"de": "elevator", "da": "aileron", "dr": "rudder"}
ROTOR_RADPS = 500.0  # where JSBSim's rotor starts; it finds its own speed within a second


def aircraft_document(
    tables: Sequence[CoefficientTable], source: str
) -> tuple[dict[str, Any], list[str]]:
    """Return the aircraft file with identified coefficients, and the names that were replaced.

    A coefficient whose 95 % half-width exceeds its value is not used. `cl_0` and `cm_0` move so
    that lift and pitching moment at the trim's angle of attack stay what the file had.

    Parameters
    ----------
    tables : sequence of CoefficientTable
    source : str
        The aircraft they were made with: a name or a file.

    Raises
    ------
    IdentificationError
        If no coefficient can be used.
    """
    from host.twin.aircraft import file as aircraft

    loaded = aircraft.load(source)
    document: dict[str, Any] = dict(aircraft.read_document(source))
    table = dict(document["aerodynamics"])
    origins = dict(table.get("sources", {}))
    nodes = np.asarray(table["alpha_rad"], dtype=np.float64)
    replaced = []
    for found in tables:
        for c in found.coefficients:
            axis, _, label = c.name.partition("_")
            key = f"{AXES.get(axis, axis)}_{CONTROLS.get(label, label)}"
            if axis not in AXES or key not in table or not c.half_width < abs(c.value):
                continue
            if label == "alpha":
                base = f"{AXES[axis]}_0"
                kept = np.asarray(table[base]) + np.asarray(table[key]) * found.alpha_rad
                table[base] = (kept - c.value * found.alpha_rad).tolist()
                origins[base] = f"such that {axis} at the trim stays, after {key} was identified"
            table[key] = [c.value] * len(nodes)
            origins[key] = f"identified, {found.method}: {c.value:.5g} +- {c.half_width:.2g} (95 %)"
            replaced.append(c.name)
    if not replaced:
        raise IdentificationError("no coefficient is known well enough to make an aircraft of")
    table["sources"] = origins
    document["aerodynamics"] = table
    document["name"] = f"{loaded.name}_identified"
    document["title"] = f"{loaded.title}, identified"
    return document, replaced


def save_aircraft(path: Path, tables: Sequence[CoefficientTable], source: str) -> list[str]:
    """Write ``.toml`` for `host simulate` or ``.xml`` for JSBSim; return what was replaced."""
    from host.twin.aircraft import file as aircraft
    from host.twin.aircraft import tomlout
    from host.twin.aircraft.jsbsim_model import aircraft_xml

    document, replaced = aircraft_document(tables, source)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "identified.toml"
        file.write_text(tomlout.dumps(document), encoding="utf-8")
        loaded = aircraft.load(file)  # whatever is written can be read
        text = file.read_text(encoding="utf-8")
    path.write_text(aircraft_xml(loaded, ROTOR_RADPS) if path.suffix == ".xml" else text)
    return replaced
