"""An answer as an aircraft: a file that `host simulate` flies again, and JSBSim's XML of it.

What was identified replaces the coefficients of the aircraft file the answer was made with;
everything else (mass, propeller, servos, what the data could not tell) stays and says so. Between
two angles of attack the tables of a file are straight, so a slope that changes with alpha has its
place in it (Cm_alpha2 in cm_alpha, Cm_alpha_q in cm_q); other bends have none and are named.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from host.errors import IdentificationError
from host.export.atomic_files import atomic_write

if TYPE_CHECKING:
    from host.aircraft.file import Aircraft
    from host.arrays import Array
    from host.sysid.aerodynamics.coefficient import Coefficient, CoefficientTable
    from host.sysid.coefficients.coefficient_fit import MeanCondition

# Names of the aircraft file for the names of the answer.
AXES = {"CL": "cl", "Cm": "cm", "CY": "cy", "Cl": "croll", "Cn": "cn"}
CONTROLS = {"de": "elevator", "da": "aileron", "dr": "rudder"}
CONVENTIONS = (
    "Coefficients per radian, moments at the CG in body axes, rates over 2V/b and 2V/c.",
    "Surfaces are the inputs: fcs/elevator-pos-rad, trailing edge down; fcs/left-aileron-pos-rad,",
    "(left - right)/2, each trailing edge down; fcs/rudder-pos-rad, trailing edge left. Motor:",
    "fcs/throttle-shaft, 0 to 1.",
)
ROTOR_RADPS = 500.0  # where JSBSim's rotor starts; it finds its own speed within a second


def aircraft_document(
    tables: Sequence[CoefficientTable], source: str, condition: MeanCondition | None = None
) -> tuple[dict[str, Any], list[str]]:
    """Return the aircraft file with identified coefficients, and the names that were replaced.

    A coefficient whose 95 % half-width exceeds its value is not used. `cl_0` and `cm_0` move so
    that lift and pitching moment at the trim's angle of attack stay what the file had. What is
    known and has no place in the file stands under ``not_carried`` in its sources.

    Parameters
    ----------
    tables : sequence of CoefficientTable
    source : str
        The aircraft they were made with: a name or a file.
    condition : MeanCondition, optional
        Condition of a direct fit of coefficients: gives the drag polar and the range of angles of
        attack.

    Raises
    ------
    IdentificationError
        If no coefficient can be used.
    """
    from host.aircraft import file as aircraft

    loaded = aircraft.load(source)
    document: dict[str, Any] = dict(aircraft.read_document(source))
    table = dict(document["aerodynamics"])
    origins = dict(table.get("sources", {}))
    replaced: list[str] = []
    for found in tables:
        known = {c.name: c for c in found.coefficients if c.half_width < abs(c.value)}
        bent = [n for n in known if n.split("_")[1:2] in (["alpha"], ["alpha2"])]
        if condition is not None and any(not n.endswith("_alpha") for n in bent):
            _add_nodes(table, condition.alpha_range_rad)
        for c in known.values():
            replaced += _put_slope(table, origins, known, c, found)
        if condition is not None:
            replaced += _put_drag(table, origins, known, condition, found.method)
            _note_rest(origins, known, replaced)
    if not replaced:
        raise IdentificationError("no coefficient is known well enough to make an aircraft of")
    table["sources"] = origins
    document["aerodynamics"] = table
    document["name"] = f"{loaded.name}_identified"
    document["title"] = f"{loaded.title}, identified"
    return document, replaced


def _put_slope(
    table: dict[str, Any],
    origins: dict[str, str],
    known: Mapping[str, Coefficient],
    c: Coefficient,
    found: CoefficientTable,
) -> list[str]:
    """Put a derivative, with what it changes by along alpha, in its column; return what was put."""
    axis, _, label = c.name.partition("_")
    key = f"{AXES.get(axis, axis)}_{CONTROLS.get(label, label)}"
    if axis not in AXES or key not in table:
        return []
    nodes = np.asarray(table["alpha_rad"], dtype=np.float64)
    of_alpha = label == "alpha"
    bend = known.get(f"{axis}_alpha2" if of_alpha else f"{axis}_alpha_{label}")
    steeper = 0.0 if bend is None else bend.value
    if of_alpha:
        base = f"{AXES[axis]}_0"
        at = found.alpha_rad
        kept = np.asarray(table[base]) + np.asarray(table[key]) * at
        there = float(np.interp(at, nodes, kept)) - c.value * at + steeper * at**2
        table[base] = [there] * len(nodes)
        origins[base] = f"such that {axis} at the trim stays, after {key} was identified"
    from_rad = (2.0 if of_alpha else 1.0) * found.alpha_rad
    table[key] = (c.value + steeper * (nodes - from_rad)).tolist()
    origins[key] = _origin(found.method, c) + ("" if bend is None else f"; {_said(bend)}")
    return [c.name] if bend is None else [c.name, bend.name]


def _note_rest(
    origins: dict[str, str], known: Mapping[str, Coefficient], replaced: Sequence[str]
) -> None:
    """Name what is known and has no place in the file; forces in body axes are those of CL, CD."""
    left = [c for n, c in known.items() if n not in replaced and n[:2] not in ("CX", "CZ")]
    if left:
        before = [origins["not_carried"]] if "not_carried" in origins else []
        origins["not_carried"] = "; ".join([*before, *map(_said, left)])


def _said(c: Coefficient) -> str:
    return f"{c.name} {c.value:.5g} +- {c.half_width:.2g} (95 %)"


def _origin(method: str, c: Coefficient) -> str:
    return f"identified, {method}: {c.value:.5g} +- {c.half_width:.2g} (95 %)"


def _add_nodes(table: dict[str, Any], range_rad: tuple[float, float]) -> None:
    """Add the ends of the flown angles of attack to the tables, which stay what they are."""
    old = np.asarray(table["alpha_rad"], dtype=np.float64)
    new: Array = np.unique(np.concatenate([old, range_rad]))
    for key, column in table.items():
        if isinstance(column, list) and len(column) == len(old) and key != "stall_alpha_rad":
            table[key] = np.interp(new, old, np.asarray(column)).tolist()
    table["alpha_rad"] = new.tolist()


def _put_drag(
    table: dict[str, Any],
    origins: dict[str, str],
    known: Mapping[str, Coefficient],
    condition: MeanCondition,
    method: str,
) -> list[str]:
    """Put the parabola in lift that has the slope and the drag at zero lift that were identified.

    The file counts the elevator's drag at the same lift, an answer at the same angle of attack.
    """
    if not {"CD_0", "CD_alpha", "CL_alpha"} <= known.keys() or condition.lift <= 0.0:
        return []
    induced = known["CD_alpha"].value / (2.0 * condition.lift * known["CL_alpha"].value)
    table["cd_0"], table["induced_factor"] = known["CD_0"].value, induced
    origins["cd_0"] = _origin(method, known["CD_0"])
    origins["induced_factor"] = (
        f"{_origin(method, known['CD_alpha'])}, over 2 CL CL_alpha at CL {condition.lift:.3f}"
    )
    used = [n for n in ("CD_0", "CD_alpha", "CD_CL2") if n in known]
    if {"CD_de", "CL_de"} <= known.keys():
        own = known["CD_de"].value - 2.0 * induced * condition.lift * known["CL_de"].value
        table["cd_elevator"] = [own] * len(table["alpha_rad"])
        origins["cd_elevator"] = f"{_origin(method, known['CD_de'])}, less what lift makes of it"
        used.append("CD_de")
    return used


def save_aircraft(
    path: Path,
    tables: Sequence[CoefficientTable],
    source: str,
    condition: MeanCondition | None = None,
) -> list[str]:
    """Write ``.toml`` for `host simulate` or ``.xml`` for JSBSim; return what was replaced."""
    made = identified_aircraft(tables, source, condition)
    with atomic_write(path) as part:
        text = made.jsbsim_xml() if path.suffix.lower() == ".xml" else made.text
        part.write_text(text, encoding="utf-8")
    return made.replaced


@dataclass(frozen=True, slots=True)
class IdentifiedAircraft:
    """An answer as an aircraft: as loaded again, as TOML, and which coefficients were replaced."""

    loaded: Aircraft
    document: dict[str, Any]
    text: str
    replaced: list[str]

    @property
    def identified(self) -> list[str]:
        """What was identified, with its interval, a line each."""
        sources = self.document["aerodynamics"]["sources"]
        return [f"{key}: {origin}" for key, origin in sources.items() if "+-" in origin]

    def jsbsim_xml(self) -> str:
        """Return the aircraft as XML for JSBSim."""
        from host.aircraft.jsbsim_model import aircraft_xml

        return _with_header(aircraft_xml(self.loaded, ROTOR_RADPS), self)


def identified_aircraft(
    tables: Sequence[CoefficientTable], source: str, condition: MeanCondition | None = None
) -> IdentifiedAircraft:
    """Return the aircraft of an answer; parameters and errors as `aircraft_document`."""
    from host.aircraft import file as aircraft
    from host.export import toml as tomlout

    document, replaced = aircraft_document(tables, source, condition)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "identified.toml"
        file.write_text(tomlout.dumps(document), encoding="utf-8")
        loaded = aircraft.load(file)  # whatever is written can be read
        return IdentifiedAircraft(loaded, document, file.read_text(encoding="utf-8"), replaced)


def _with_header(xml: str, made: IdentifiedAircraft) -> str:
    """Return JSBSim's XML in lines, with units, signs and intervals at its head."""
    root = ElementTree.fromstring(xml)
    header = ElementTree.Element("fileheader")
    root.insert(0, header)
    ElementTree.SubElement(header, "author").text = "host identify"
    ElementTree.SubElement(header, "description").text = "\n".join(
        [made.loaded.title, *CONVENTIONS, *made.identified, ""]
    )
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"
