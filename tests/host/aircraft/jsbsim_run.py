"""Run one JSBSim flight in its own process: `jsbsim_run.py FOLDER`, input.npz in, output.npz
out."""

from __future__ import annotations

import sys
from pathlib import Path

import jsbsim
import numpy as np

M_PER_FT = 0.3048


def main(folder: Path) -> None:
    """Fly the model in `folder` from the state and along the surfaces in its input.npz."""
    given = np.load(folder / "input.npz")
    start, surfaces, throttle = given["start"], given["surfaces"], float(given["throttle"])
    fdm = jsbsim.FGFDMExec(str(folder))
    fdm.set_debug_level(0)
    fdm.load_planet(str(folder / "planet.xml"), False)
    fdm.set_dt(float(given["step_s"]))
    fdm.set_aircraft_path("aircraft")
    if not fdm.load_model(str(given["name"])):
        raise SystemExit("JSBSim does not read the model")
    for name, value in zip("uvw", start[:3], strict=True):
        fdm[f"ic/{name}-fps"] = value / M_PER_FT
    for name, value in zip("pqr", start[3:6], strict=True):
        fdm[f"ic/{name}-rad_sec"] = value
    fdm["ic/h-sl-ft"] = 1000.0
    fdm["ic/phi-rad"], fdm["ic/theta-rad"], fdm["ic/psi-true-rad"] = given["angles"]
    # The body velocities are set once more: setting angles turns them.
    for name, value in zip("uvw", start[:3], strict=True):
        fdm[f"ic/{name}-fps"] = value / M_PER_FT
    fdm["atmosphere/override/density"] = float(given["density_kgpm3"]) / 515.3788183931961
    fdm["simulation/gravity-model"] = 0
    fdm["fcs/throttle-shaft"] = throttle

    def place(row: np.ndarray) -> None:
        fdm["fcs/elevator-pos-rad"] = row[0]
        fdm["fcs/left-aileron-pos-rad"] = row[1]
        fdm["fcs/rudder-pos-rad"] = row[2]

    place(surfaces[0])
    if not fdm.run_ic():
        raise SystemExit("JSBSim does not start")
    names = (
        "velocities/u-fps", "velocities/v-fps", "velocities/w-fps",
        "velocities/p-rad_sec", "velocities/q-rad_sec", "velocities/r-rad_sec",
        "attitude/phi-rad", "attitude/theta-rad", "rotor/omega",
        "accelerations/gravity-ft_sec2", "atmosphere/rho-slugs_ft3",
    )  # fmt: skip
    out = np.empty((len(surfaces), len(names)))
    for i, row in enumerate(surfaces):
        out[i] = [fdm[name] for name in names]
        place(row)
        fdm.run()
    out[:, :3] *= M_PER_FT
    np.savez(folder / "output.npz", states=out)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
