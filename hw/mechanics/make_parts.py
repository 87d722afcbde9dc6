"""Build the solids, prove that they fit, balance and print, and write what a shop wants.

.venv-hw/bin/python hw/mechanics/make_parts.py           check, then write hw/mechanics/generated
.venv-hw/bin/python hw/mechanics/make_parts.py --check   check, and compare masses and vane file

Needs build123d (`.ci/setup.sh hw`); PDFs need rsvg-convert too.
"""

from __future__ import annotations

import argparse
import itertools
import math
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import drawing
import drawing_rows
import dynamics
import kicad_text
import pictures
import solids
import stack
from build123d import Color, Compound, Rot, export_step, export_stl
from sources import SHIELD

HERE = Path(__file__).resolve().parent
OUT = HERE / "generated"
GRAVITY_MPS2 = 9.81
# 0.5 % of pressure: a sixth of what tube and static port may be off (pitot_scale in
# instrument/standard.toml).
PITOT_SPEED_CHANGE = 0.0025


def overlap_mm3(one: solids.Body, other: solids.Body) -> float:
    """Return the volume two bodies share."""
    shared = one.shape & other.shape
    return float(shared.volume) if shared else 0.0


def faults(sizes: solids.Sizes, vane: list[solids.Body], every: list[solids.Body]) -> list[str]:
    """Name every fit, balance, limit, wall and size that is wrong.

    Parameters
    ----------
    sizes
        vane.toml.
    vane
        The parts of one vane, standing in each other.
    every
        All bodies.
    """
    found = [
        f"{a.name} and {b.name} share {overlap_mm3(a, b):.2f} mm3"
        for a, b in itertools.combinations(vane, 2)
        if overlap_mm3(a, b) > 1e-3
    ]
    rest = abs(solids.moment_gmm(vane, sizes)) * 1e-6 * GRAVITY_MPS2
    if rest > sizes["bearing"]["friction_Nm"]:
        found.append(
            f"balance: {rest:.1e} N m left, friction {sizes['bearing']['friction_Nm']:.1e}"
        )
    hub, housing = (next(b for b in vane if b.name == name) for name in ("hub", "housing"))
    limit = sizes["housing"]["limit_deg"]
    for turn, stopped in (
        (limit - 1, False),
        (1 - limit, False),
        (limit + 3, True),
        (-limit - 3, True),
    ):
        shared = (Rot(0, 0, turn) * hub.shape) & housing.shape
        if bool(shared and shared.volume > 1e-3) != stopped:
            found.append(f"limiter: at {turn:g} deg the hub {'passes' if stopped else 'touches'}")
    gap = sizes["magnet"]["air_gap"]
    if not 0.5 <= gap <= 3.0:
        found.append(f"air gap {gap} mm, AS5600 wants 0.5 to 3")
    found += jig_faults(sizes, vane, every) + pitot_faults(sizes)
    least = sizes["print"]["wall_least"]
    found += [f"{n}: wall {w:.2f} mm, least {least}" for n, w in walls(sizes).items() if w < least]
    for body in every:
        if body.material == "petg":
            size = body.shape.bounding_box().size
            if max(size.X, size.Y, size.Z) > sizes["print"]["bed"]:
                found.append(f"{body.name} is larger than the bed")
            if not body.shape.is_valid or len(body.shape.solids()) != 1:
                found.append(f"{body.name} is not one sound solid")
    return found


def jig_faults(sizes: solids.Sizes, vane: list[solids.Body], every: list[solids.Body]) -> list[str]:
    """Name what the protractor jig touches on the vane, and a fork that does not hold the fin."""
    parts = {body.name: body for body in every}
    if "protractor jig" not in parts:
        return []
    jig, fork = parts["protractor jig"], parts["protractor fork"].shape
    found = [
        f"protractor jig and {body.name} share {overlap_mm3(jig, body):.2f} mm3"
        for body in vane
        if overlap_mm3(jig, body) > 1e-3
    ]
    (fin,) = (body.shape for body in vane if body.name == "fin")
    for turn in (-40.0, 0.0, 20.0):
        for off, touches in ((0.0, False), (1.0, True)):
            shared = (Rot(0, 0, turn + off) * fin) & (Rot(0, 0, turn) * fork)
            if bool(shared and shared.volume > 1e-3) != touches:
                word = "lets the fin turn" if touches else "bends the fin"
                found.append(f"protractor fork at {turn:g} deg {word} by {off:g} deg")
        shared = (Rot(0, 0, turn) * fork) & jig.shape
        if shared and shared.volume > 1e-3:
            found.append(f"protractor fork does not enter its slot at {turn:g} deg")
    return found


def pitot_faults(sizes: solids.Sizes) -> list[str]:
    """Name a pitot that stands near enough to a vane to feel its housing.

    The housing moves the air beside it as a sphere of its frontal area does: `(a / r)**3 / 2` of
    the airspeed (Batchelor, An Introduction to Fluid Dynamics, 6.8).
    """
    beside = sizes["pitot"]["beside_vane"]
    change = (sizes["housing"]["side"] / math.sqrt(math.pi) / beside) ** 3 / 2
    if change <= PITOT_SPEED_CHANGE:
        return []
    return [
        f"pitot {beside:g} mm beside a vane: its housing changes the speed there by {change:.1%}"
    ]


def walls(sizes: solids.Sizes) -> dict[str, float]:
    """Return the thinnest wall of each printed part, in mm, from its sizes."""
    housing, bearing, sensor = sizes["housing"], sizes["bearing"], sizes["sensor"]
    magnet, boom, pot, hub = sizes["magnet"], sizes["boom"], sizes["pot"], sizes["hub"]
    seat = bearing["outer"] / 2 + housing["press"]
    recess = sensor["side"] / 2 + housing["play"]
    return {
        "housing, bearing seat": housing["collar"] / 2 - seat,
        "housing, board recess": housing["side"] / 2 - recess,
        "housing, boom socket": housing["socket_outer"] / 2 - boom["outer"] / 2 - 0.1,
        "magnet holder": magnet["holder_diameter"] / 2 - magnet["diameter"] / 2 - housing["press"],
        "hub, beside the shaft": hub["diameter"] / 2 - sizes["shaft"]["diameter"] / 2,
        "boom clamp": sizes["clamp"]["wall"],
        "pitot holder": sizes["pitot"]["wall"],
        "pot arm, pin": pot["width"] / 2 - pot["pin"] / 2,
        "pot arm, shaft": pot["width"] / 2 - pot["shaft"] / 2 - 0.05,
        "box": sizes["box"]["wall"],
        "IMU tray": sizes["imu_tray"]["base"],
    }


def masses(sizes: solids.Sizes, vane: list[solids.Body], every: list[solids.Body]) -> str:
    """Return masses.csv: inertia and balance, then each body; printed ones as if solid."""
    rows = [
        f"# made by hw/mechanics/make_parts.py from {', '.join(dynamics.SOURCES)},"
        f" sha256 {dynamics.sources_hash()}",
        f"# inertia_kgm2={solids.inertia_kgm2(vane, sizes):.4e},"
        f" residual_Nm={abs(solids.moment_gmm(vane, sizes)) * 1e-6 * GRAVITY_MPS2:.1e}",
        "name,group,quantity,material,mass_g,file",
    ]
    for body in every:
        file = (
            f"{body.name.replace(' ', '-')}.step"
            if body.material not in ("bought", "magnet")
            else ""
        )
        rows.append(
            f"{body.name},{body.group},{body.quantity},{body.material},"
            f"{solids.mass_g(body, sizes):.2f},{file}"
        )
    return "\n".join(rows) + "\n"


def sheets(
    sizes: solids.Sizes, vane: list[solids.Body], every: list[solids.Body]
) -> dict[str, str]:
    """Return the drawings by file name."""
    found = {}
    assembly = Compound([body.shape for body in vane])
    rows = [(f"{b.name}, {b.material}", f"{solids.mass_g(b, sizes):.2f} g") for b in vane]
    found["vane"] = drawing.draw(assembly, "vane, assembled", rows, "one of four")
    for body in every:
        if body.material == "bought" or body.name == "magnet":
            continue
        note = f"{body.material}, {solids.mass_g(body, sizes):.2f} g, {body.quantity} of it"
        found[body.name.replace(" ", "-")] = drawing.draw(
            body.shape, body.name, drawing_rows.rows(body, sizes), note
        )
    return found


def write_components(folder: Path) -> int:
    """Write what stands on the boards as STEP, for KiCad's pictures; return how many."""
    folder.mkdir(parents=True, exist_ok=True)
    boards = [SHIELD, *sorted((SHIELD.parent / "sensors").glob("*.kicad_pcb"))]
    outlines = {
        part.package: part.outline
        for path in boards
        for part in kicad_text.placed(path.read_text(encoding="utf-8"))
        if not part.below  # those are stored as seen from below
    }
    table = stack.components()["package"]
    for package, row in table.items():
        body = stack.body_of(package, outlines[package], row["height"])
        body.color = Color(row["colour"])
        export_step(body, folder / f"{package}.step")
    return len(table)


def write(sizes: solids.Sizes, vane: list[solids.Body], every: list[solids.Body]) -> int:
    """Write every file; return how many."""
    for folder in ("step", "stl", "drawings"):
        (OUT / folder).mkdir(parents=True, exist_ok=True)
    assembly = Compound([body.shape for body in vane])
    export_step(assembly, OUT / "step" / "vane.step")
    for body in every:
        if body.material == "bought" or body.name == "magnet":
            continue
        name = body.name.replace(" ", "-")
        export_step(body.shape, OUT / "step" / f"{name}.step")
        if body.material == "petg":
            export_stl(
                body.shape, OUT / "stl" / f"{name}.stl", tolerance=0.05, angular_tolerance=0.3
            )
    found = sheets(sizes, vane, every)
    tool = shutil.which("rsvg-convert")
    for name, text in found.items():
        path = OUT / "drawings" / f"{name}.svg"
        path.write_text(text, encoding="utf-8", newline="\n")
        if tool:
            subprocess.run([tool, "-f", "pdf", path, "-o", path.with_suffix(".pdf")], check=True)
    write_components(OUT / "components")
    pictures.write(sizes, OUT / "pictures")
    bodies = stack.everything(sizes, SHIELD.read_text(encoding="utf-8"))
    (OUT / "stack.csv").write_text(stack.report(sizes, bodies), encoding="utf-8", newline="\n")
    text = masses(sizes, vane, every)
    (OUT / "masses.csv").write_text(text, encoding="utf-8", newline="\n")
    fin = dynamics.load((HERE / "vane.toml").read_text(encoding="utf-8"), text)
    (OUT / "vane.toml").write_text(dynamics.vane_file(fin), encoding="utf-8", newline="\n")
    return len(found)


def main(arguments: list[str] | None = None) -> int:
    """Check, then write or compare; 0 ok, 5 a body is wrong, 6 a file is not current."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--check", action="store_true", help="compare with what is committed")
    check = parser.parse_args(arguments).check
    sizes = solids.load_sizes()
    vane = solids.vane(sizes)
    every = vane + solids.mounts(sizes) + solids.jigs(sizes) + solids.cases(sizes)
    bodies = stack.everything(sizes, SHIELD.read_text(encoding="utf-8"))
    found = faults(sizes, vane, every) + stack.faults(bodies)
    if found:
        print("hw/mechanics: " + "\nhw/mechanics: ".join(found), file=sys.stderr)
        return 5
    if check:
        made = {
            "masses.csv": masses(sizes, vane, every),
            "stack.csv": stack.report(sizes, bodies),
        }
        for name, text in made.items():
            path = OUT / name
            if not path.exists() or path.read_text(encoding="utf-8") != text:
                print(
                    f"hw/mechanics/generated/{name} is not current: run make_parts.py",
                    file=sys.stderr,
                )
                return 6
        return 0
    count = write(sizes, vane, every)
    grams = Counter()  # type: Counter[str]
    for body in every:
        grams[body.group] += round(body.quantity * solids.mass_g(body, sizes))
    print(f"{count} drawings; g by group, printed parts solid: {dict(grams)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
