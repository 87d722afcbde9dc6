"""Coefficients of the air that JSBSim finds at a condition, for a process of its own."""

# With the folder and the model as arguments; the program behind it defines `controls(de, da, dr)`.
JSBSIM_AIR = """
import json, math, sys, jsbsim
fdm = jsbsim.FGFDMExec(sys.argv[1])
fdm.set_debug_level(0)
fdm.set_aircraft_path("aircraft")
assert fdm.load_model(sys.argv[2])
FT, LB, V, TILT, HUB, SPIN = 0.3048, 4.4482216152605, 17.0, -0.0523599, 0.297, 0.00012991
S, b, c = (fdm["metrics/" + k] * FT**n for k, n in (("Sw-sqft", 2), ("bw-ft", 1), ("cbarw-ft", 1)))
def air(alpha, beta, p, q, r, de, da, dr):
    p, q, r = p * 2 * V / b, q * 2 * V / c, r * 2 * V / b
    fdm["ic/h-sl-ft"], fdm["ic/theta-rad"] = 1000.0, 0.0
    fdm["ic/u-fps"] = V * math.cos(alpha) * math.cos(beta) / FT
    fdm["ic/v-fps"] = V * math.sin(beta) / FT
    fdm["ic/w-fps"] = V * math.sin(alpha) * math.cos(beta) / FT
    fdm["ic/p-rad_sec"], fdm["ic/q-rad_sec"], fdm["ic/r-rad_sec"] = p, q, r
    controls(de, da, dr)
    assert fdm.run_ic()
    force = fdm["aero/qbar-psf"] * LB / FT**2 * S
    X, Y, Z = (fdm["forces/fb" + k + "-aero-lbs"] * LB for k in "xyz")
    L, M, N = (fdm["moments/" + k + "-aero-lbsft"] * LB * FT for k in "lmn")
    T, D, turn = fdm["rotor/thrust-n"], fdm["rotor/drive-nm"], fdm["rotor/omega"] * SPIN
    tx, tz = math.cos(TILT), -math.sin(TILT)
    X, Z, M = X - T * tx, Z - T * tz, M + HUB * tz * T + r * turn * tx - p * turn * tz
    L, N = L + D * tx + q * turn * tz, N + D * tz - q * turn * tx
    s, k = math.sin(alpha), math.cos(alpha)
    return [v / force for v in (X * s - Z * k, -X * k - Z * s, Y, L / b, M / c, N / b)]
"""
