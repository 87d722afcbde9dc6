"""Aircraft files from dimensions: `python -m host.aircraft.handbook [--check]`.

The estimates an engineer makes with a handbook and an afternoon: lifting-surface slopes, tail
volumes, strip theory. Good to 10-30 % per derivative, which is what a prior is; as a truth model
they need only be consistent. Sources, by the numbers in the code:

[1] USAF Stability and Control Datcom, 4.1.3.2 (lift slope, Helmbold-Polhamus), 4.4.1 (downwash),
    5.4.1 (sidewash); [2] Etkin & Reid, Dynamics of Flight, chapter 5 and appendix B; [3] Pamadi,
    Performance, Stability, Dynamics, and Control of Airplanes, chapters 3 and 4; [4] Munk, NACA
    TR 184 (slender bodies); [5] Glauert, thin-aerofoil theory with a hinged flap; [6] Roskam,
    Airplane Design V, table B (radii of gyration of light singles).
"""

from __future__ import annotations

import math
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from host.aircraft import usual_servo
from host.aircraft.airframe import COEFFICIENTS, Array
from host.constants import GRAVITY_MPS2
from host.export.toml import dumps

DIMENSIONS = Path(__file__).parent / "dimensions"
SECTION_SLOPE_PERRAD = 0.95 * 2.0 * math.pi  # model sections at Reynolds numbers of 3e5
TAIL_EFFICIENCY = 0.9
FLAP_EFFICIENCY = 0.8  # of the thin-aerofoil value: gaps and boundary layer
OSWALD = 0.75
BODY_MASS_FACTOR = 0.85  # k2 - k1 of Munk for a fineness ratio of about 8
NODES = 5


def lift_slope(aspect_ratio: float) -> float:
    """Return the lift slope of an unswept wing, 1/rad: Helmbold-Polhamus [1].

    Parameters
    ----------
    aspect_ratio : float
        Span squared over area.
    """
    kappa = SECTION_SLOPE_PERRAD / (2.0 * math.pi)
    return 2.0 * math.pi * aspect_ratio / (2.0 + math.sqrt(4.0 + (aspect_ratio / kappa) ** 2))


def rolling_slope(aspect_ratio: float) -> float:
    """Return the lift slope under antisymmetric load, 1/rad: the section's times A / (A + 4) [2].

    Parameters
    ----------
    aspect_ratio : float
        A, span squared over area.
    """
    return SECTION_SLOPE_PERRAD * aspect_ratio / (aspect_ratio + 4.0)


def flap(chord_share: float) -> float:
    """Return the effectiveness of a plain flap, rad of zero-lift line per rad of flap [5].

    Parameters
    ----------
    chord_share : float
        Chord of the flap over that of the surface, 0 to 1.
    """
    theta = math.acos(2.0 * chord_share - 1.0)
    return FLAP_EFFICIENCY * (1.0 - (theta - math.sin(theta)) / math.pi)


def downwash_slope(aspect_ratio: float, arm_spans: float, height_spans: float) -> float:
    """Return the downwash slope d epsilon / d alpha of a rectangular, unswept wing [1].

    Parameters
    ----------
    aspect_ratio : float
        Aspect ratio of the wing.
    arm_spans, height_spans : float
        Place of the tail behind and above the wing, in spans.
    """
    by_aspect = 1.0 / aspect_ratio - 1.0 / (1.0 + aspect_ratio**1.7)
    by_height = (1.0 - abs(height_spans)) / (2.0 * arm_spans) ** (1.0 / 3.0)
    return 4.44 * float(np.power(by_aspect * by_height, 1.19))


def derive(d: Mapping[str, object]) -> dict[str, Array]:
    """Return the aerodynamic tables of an aircraft file from its dimensions.

    Parameters
    ----------
    d : mapping
        A file of `dimensions/`, each key ending in its unit; the wing is rectangular.

    Returns
    -------
    dict of Array, shape (NODES,)
        ``alpha_rad`` from fastest to slowest flight, and all of `airframe.COEFFICIENTS` there,
        per radian, moments about the CG.

    Raises
    ------
    KeyError
        If a dimension is missing.
    """

    def n(key: str) -> float:
        return float(str(d[key]))

    s, b = n("wing_area_m2"), n("span_m")
    chord, aspect = s / b, b * b / s
    a_wing = lift_slope(aspect)
    a_roll = rolling_slope(aspect)
    dihedral = math.radians(n("dihedral_deg"))
    zero_lift = math.radians(n("section_zero_lift_deg") - n("wing_incidence_deg"))

    tail = TAIL_EFFICIENCY * n("tail_area_m2") / s
    a_tail = lift_slope(n("tail_span_m") ** 2 / n("tail_area_m2"))
    arm = n("tail_arm_m") / chord
    wash = downwash_slope(
        aspect, n("tail_arm_m") / b, (n("tail_above_axis_m") + n("wing_below_axis_m")) / b
    )
    tau_e = flap(n("elevator_chord"))

    width, depth = n("fuselage_width_m"), n("fuselage_depth_m")
    volume = 0.7 * n("fuselage_length_m") * width * depth
    body = 2.0 * BODY_MASS_FACTOR * volume / s  # [4]

    cl_alpha = a_wing + tail * a_tail * (1.0 - wash)
    cm_alpha = a_wing * (n("cg_chord") - 0.25) + body / chord - tail * arm * a_tail * (1.0 - wash)
    # The stabiliser is set so that the elevator stands at -2 deg in cruise, as a builder trims it.
    weight = n("mass_kg") * GRAVITY_MPS2
    qbar = 0.5 * 1.225 * n("airspeed_mps") ** 2
    cl_cruise = weight / (qbar * s)
    trim_elevator = math.radians(-2.0)
    cl_elevator, cm_elevator = tail * a_tail * tau_e, -tail * arm * a_tail * tau_e
    cl_wing_0 = -a_wing * zero_lift
    cm_wing_0 = n("section_cm") + cl_wing_0 * (n("cg_chord") - 0.25)
    # Two equations, lift and moment in cruise, for alpha and the tail's own lift at alpha = 0.
    system = np.array([[cl_alpha, 1.0], [cm_alpha, -arm]])
    right = np.array(
        [
            cl_cruise - cl_wing_0 - cl_elevator * trim_elevator,
            -cm_wing_0 - cm_elevator * trim_elevator,
        ]
    )
    tail_lift_0 = float(np.linalg.solve(system, right)[1])
    cl_0, cm_0 = cl_wing_0 + tail_lift_0, cm_wing_0 - arm * tail_lift_0

    fin = n("fin_area_m2") / s
    a_fin = lift_slope(1.55 * n("fin_height_m") ** 2 / n("fin_area_m2"))
    sidewash = 0.724 + 1.53 * fin + 0.4 * n("wing_below_axis_m") / depth + 0.009 * aspect  # [1]
    fin_slope = a_fin * fin * sidewash
    tau_r = flap(n("rudder_chord"))
    tau_a = flap(n("aileron_chord"))
    reach = (n("aileron_outer") ** 2 - n("aileron_inner") ** 2) * (0.5 * b) ** 2

    speeds = np.linspace(n("maximum_airspeed_mps"), n("minimum_airspeed_mps"), NODES)
    cl = weight / (0.5 * 1.225 * speeds**2 * s)
    # alpha of trimmed flight: elevator from the moment, inserted into the lift.
    ratio = cl_elevator / cm_elevator
    alpha = (cl - cl_0 + ratio * cm_0) / (cl_alpha - ratio * cm_alpha)

    arm_fin = n("fin_arm_m") * np.cos(alpha) + n("fin_centre_above_m") * np.sin(alpha)
    up_fin = n("fin_centre_above_m") * np.cos(alpha) - n("fin_arm_m") * np.sin(alpha)
    one = np.ones(NODES)
    roll_aileron = a_roll * tau_a * chord * reach / (s * b)
    return {
        "alpha_rad": alpha,
        "cl_0": cl_0 * one,
        "cl_alpha": cl_alpha * one,
        "cl_q": (0.5 + 2.0 * (0.25 - n("cg_chord"))) * a_wing * one + 2.0 * tail * arm * a_tail,
        "cl_elevator": cl_elevator * one,
        "cm_0": cm_0 * one,
        "cm_alpha": cm_alpha * one,
        "cm_q": -1.1 * 2.0 * tail * arm * arm * a_tail * one,  # a tenth for the wing [2]
        "cm_elevator": cm_elevator * one,
        "cd_elevator": 0.01 * one,
        "cy_beta": (-fin_slope - 1.5 * 2.0 * width * depth / s) * one,
        "cy_p": -2.0 * fin_slope * up_fin / b,
        "cy_r": 2.0 * fin_slope * arm_fin / b,
        "cy_aileron": 0.0 * one,
        "cy_rudder": a_fin * fin * tau_r * one,
        "croll_beta": -0.25 * a_wing * dihedral
        + 1.2 * math.sqrt(aspect) * n("wing_below_axis_m") / b * 2.0 * depth / b
        - fin_slope * up_fin / b,  # [3]
        "croll_p": (-a_roll / 8.0) * one - 2.0 * fin_slope * (up_fin / b) ** 2,
        "croll_r": cl / 4.0 + 2.0 * fin_slope * arm_fin * up_fin / b**2,
        "croll_aileron": roll_aileron * one,
        "croll_rudder": a_fin * fin * tau_r * up_fin / b,
        "cn_beta": fin_slope * arm_fin / b - body / b,
        "cn_p": -cl / 8.0 + 2.0 * fin_slope * arm_fin * up_fin / b**2,
        "cn_r": -2.0 * fin_slope * (arm_fin / b) ** 2 - n("profile_drag") / 4.0 - 0.02 * cl**2,
        "cn_aileron": -0.1 * cl * roll_aileron,
        "cn_rudder": -a_fin * fin * tau_r * arm_fin / b,
    }


def document(d: Mapping[str, object]) -> dict[str, object]:
    """Return the whole aircraft file of a set of dimensions.

    Parameters
    ----------
    d : mapping
        A file of `dimensions/`.

    Returns
    -------
    dict
        As `host.export.toml.dumps` writes it and `host.aircraft.file.load` reads it.

    Raises
    ------
    KeyError
        If a dimension is missing.
    """

    def n(key: str) -> float:
        return float(str(d[key]))

    estimate = "estimate from trainer practice, dimensions file"
    published = str(d["published"])
    s, b, length, mass = n("wing_area_m2"), n("span_m"), n("length_m"), n("mass_kg")
    chord = s / b
    tables = {key: np.round(values, 6) for key, values in derive(d).items()}
    tip = round(0.47 * b, 3)
    ahead = round(0.25 * chord + 0.7 * chord, 3)
    power = d["motor_power_w"]
    return {
        "format": 1,
        "kind": "nonlinear",
        "name": d["name"],
        "title": d["title"],
        "mass": {
            "mass_kg": mass,
            "ixx_kgm2": round(mass * (0.25 * b / 2.0) ** 2, 5),
            "iyy_kgm2": round(mass * (0.38 * length / 2.0) ** 2, 5),
            "izz_kgm2": round(mass * (0.39 * (b + length) / 4.0) ** 2, 5),
            "ixz_kgm2": 0.0,
            "cg_m": [0.0, 0.0, 0.0],
            "mass_tolerance": 0.01,
            "inertia_tolerance": 0.05,
            "cg_tolerance_m": 0.01,
            "source": published,
            "sources": {
                "ixx_kgm2": "Roskam V: radius of gyration 0.25 of half the span",
                "iyy_kgm2": "Roskam V: radius of gyration 0.38 of half the length",
                "izz_kgm2": "Roskam V: radius of gyration 0.39 of half the mean of span and length",
                "ixz_kgm2": "zero: principal axes assumed",
                "cg_m": "the tables hold about the nominal CG",
                "mass_tolerance": "kitchen scale, 1 %",
                "inertia_tolerance": "bifilar pendulum, 5 %",
                "cg_tolerance_m": "balance on two fingers, 10 mm",
            },
        },
        "geometry": {
            "wing_area_m2": s,
            "span_m": b,
            "chord_m": round(chord, 6),
            "source": published,
            "sources": {"chord_m": "rectangular wing: area over span"},
        },
        "trim": {
            "airspeed_mps": n("airspeed_mps"),
            "minimum_airspeed_mps": n("minimum_airspeed_mps"),
            "maximum_airspeed_mps": n("maximum_airspeed_mps"),
            "source": estimate,
        },
        "aerodynamics": {
            "alpha_rad": tables["alpha_rad"],
            **{name: tables[name] for name in COEFFICIENTS},
            "cd_0": n("profile_drag"),
            "induced_factor": round(s / (math.pi * b * b * OSWALD), 6),
            "stall_alpha_rad": [-0.16, round(float(tables["alpha_rad"][-1]) + 0.07, 4)],
            "stall_lift_perrad2": 8.0,
            "stall_drag_perrad2": 3.0,
            "source": "handbook methods, host/aircraft/handbook.py, from the dimensions file",
            "sources": {
                "cd_0": estimate,
                "induced_factor": f"Oswald factor {OSWALD}",
                "stall_alpha_rad": "assumption: 4 deg beyond slowest flight",
                "stall_lift_perrad2": "assumption, mild",
                "stall_drag_perrad2": "assumption, mild",
            },
        },
        "propulsion": {
            "diameter_m": n("propeller_diameter_m"),
            "ct_polynomial": [-0.4314, 1.08, -0.896, 0.1089, 0.0604],
            "cp_polynomial": [0.5054, -0.5304, 0.0412, 0.01664, 0.0223],
            "advance_ratio_max": 0.8,
            "rotor_inertia_kgm2": n("rotor_inertia_kgm2"),
            "motor_power_polynomial_w": power,
            "motor_torque_max_nm": 1.2,
            "friction_torque_nm": 0.02,
            "brake_torque_nm": 0.1,
            "stopped_drag_area_m2": 0.006,
            "thrust_pitch_rad": -0.0349066,
            "hub_m": [n("hub_ahead_m"), 0.0, 0.0],
            "source": estimate,
            "sources": {
                "ct_polynomial": "APC 12x6E, UASLab OpenFlight: same pitch to diameter ratio",
                "cp_polynomial": "APC 12x6E, UASLab OpenFlight: same pitch to diameter ratio",
                "advance_ratio_max": "the polynomials diverge above 0.8",
            },
        },
        "servo": {
            "bandwidth_hz": usual_servo.BANDWIDTH_HZ,
            "rate_limit_radps": usual_servo.RATE_LIMIT_RADPS,
            "source": usual_servo.RATE_LIMIT_SOURCE,
            "sources": {"bandwidth_hz": usual_servo.BANDWIDTH_SOURCE},
        },
        "surfaces": {
            "elevator_limit_rad": 0.3491,
            "aileron_limit_rad": 0.3491,
            "rudder_limit_rad": 0.4363,
            "source": "usual throws of trainers: 20, 20 and 25 deg",
        },
        "sensors": {
            "imu_m": [0.02, 0.0, 0.01],
            "vane_a_m": [ahead, -tip, 0.0],
            "vane_b_m": [ahead, tip, 0.0],
            "pitot_a_m": [ahead, round(-0.4 * b, 3), 0.0],
            "pitot_b_m": [ahead, round(0.4 * b, 3), 0.0],
            "gps_m": [-0.1, 0.0, -0.05],
            "position_tolerance_m": 0.01,
            "upwash": 0.1,
            "upwash_tolerance": 0.2,
            "vane_frequency_hz_per_mps": 0.8,
            "vane_damping": 0.35,
            "vane_friction_rad": 0.0017,
            "pitot_lag_s": 0.01,
            "source": "as on the Ultra Stick 25e: tip booms, 0.7 chord ahead of the wing",
        },
    }


def generate(source: Path) -> str:
    """Return the text of the aircraft file of one dimensions file.

    Parameters
    ----------
    source : Path
        TOML file of `dimensions/`.

    Raises
    ------
    KeyError, tomllib.TOMLDecodeError
        If a dimension is missing, or the file is no TOML.
    """
    d = tomllib.loads(source.read_text(encoding="utf-8"))
    head = f"# Generated by host/aircraft/handbook.py from dimensions/{source.name}.\n"
    return head + dumps(document(d))


def main(arguments: list[str]) -> int:
    """Write every generated aircraft file, or with ``--check`` compare them.

    Returns
    -------
    int
        Exit code: 0, or 6 if a committed file is not what the dimensions give.
    """
    stale = []
    for source in sorted(DIMENSIONS.glob("*.toml")):
        target = DIMENSIONS.with_name("airframes") / source.name
        text = generate(source)
        if "--check" in arguments:
            if not target.is_file() or target.read_text(encoding="utf-8") != text:
                stale.append(target.name)
        else:
            target.write_text(text, encoding="utf-8")
    if stale:
        sys.stderr.write(f"stale: {', '.join(stale)}; run python -m host.aircraft.handbook\n")
    return 6 if stale else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
