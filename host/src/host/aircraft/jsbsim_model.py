"""An aircraft file as a JSBSim model: an independent implementation to test ours against.

All forces and moments, propulsion included, are functions in body axes, so that no default of
JSBSim's own engine or propeller models comes in. Surfaces are inputs (``fcs/elevator-pos-rad`` and
so on); the rotor's speed is integrated by JSBSim from ``fcs/throttle-shaft``.
"""

from __future__ import annotations

import math
from xml.etree import ElementTree

from host.aircraft.file import Aircraft
from host.constants import GRAVITY_MPS2

Element = ElementTree.Element

N_PER_LBF = 4.4482216152605
M_PER_FT = 0.3048
KG_PER_SLUG = N_PER_LBF / M_PER_FT
PLANET_RADIUS_M = 1e9  # gravity turns by 0.2 urad per 200 m flown: flat to double precision


def planet_xml() -> str:
    """Return a planet without rotation and so large that its gravity is flat and constant."""
    return f"""<?xml version="1.0"?>
<planet name="flat">
  <semimajor_axis unit="M"> {PLANET_RADIUS_M!r} </semimajor_axis>
  <semiminor_axis unit="M"> {PLANET_RADIUS_M!r} </semiminor_axis>
  <rotation_rate unit="RAD/SEC"> 0.0 </rotation_rate>
  <GM unit="M3/SEC2"> {GRAVITY_MPS2 * PLANET_RADIUS_M**2!r} </GM>
  <J2> 0.0 </J2>
</planet>
"""


def _node(tag: str, *children: Element, text: str = "", **attributes: str) -> Element:
    element = ElementTree.Element(tag, attributes)
    element.text = text
    element.extend(children)
    return element


def _value(number: float) -> Element:
    return _node("value", text=repr(float(number)))


def _property(name: str) -> Element:
    return _node("property", text=name)


def _product(*children: Element) -> Element:
    return _node("product", *children)


def _sum(*children: Element) -> Element:
    return _node("sum", *children)


def _difference(*children: Element) -> Element:
    return _node("difference", *children)


def _polynomial(coefficients: list[float], name: str) -> Element:
    result = _value(coefficients[0])
    for c in coefficients[1:]:
        result = _sum(_product(result, _property(name)), _value(c))
    return result


def _function(name: str, body: Element) -> Element:
    return _node("function", body, name=name)


def aircraft_xml(aircraft: Aircraft, rotor_start_radps: float) -> str:
    """Return the model as JSBSim's XML.

    Parameters
    ----------
    aircraft : Aircraft
        With the CG at the reference point.
    rotor_start_radps : float
        Rotor speed at the start of the run.

    Returns
    -------
    str
        An ``fdm_config`` document.
    """
    s = aircraft.scalars
    root = _node("fdm_config", name=aircraft.name, version="2.0", release="BETA")
    root.append(
        _node(
            "metrics",
            _node("wingarea", text=repr(s["geometry.wing_area_m2"]), unit="M2"),
            _node("wingspan", text=repr(s["geometry.span_m"]), unit="M"),
            _node("chord", text=repr(s["geometry.chord_m"]), unit="M"),
            _location("AERORP"),
        )
    )
    balance = _node("mass_balance", negated_crossproduct_inertia="true")
    for tag, key in (("ixx", "ixx"), ("iyy", "iyy"), ("izz", "izz"), ("ixz", "ixz")):
        balance.append(_node(tag, text=repr(s[f"mass.{key}_kgm2"]), unit="KG*M2"))
    balance.append(_node("emptywt", text=repr(s["mass.mass_kg"]), unit="KG"))
    balance.append(_location("CG"))
    root.append(balance)
    root.append(_node("ground_reactions"))
    root.append(_node("propulsion"))
    root.append(_rotor(aircraft, rotor_start_radps))
    root.append(_aerodynamics(aircraft))
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True)


def _location(name: str) -> Element:
    axes = (_node(axis, text="0.0") for axis in ("x", "y", "z"))
    return _node("location", *axes, name=name, unit="M")


def _rotor(aircraft: Aircraft, start_radps: float) -> Element:
    s, v = aircraft.scalars, aircraft.vectors
    diameter = s["propulsion.diameter_m"]
    tilt = s["propulsion.thrust_pitch_rad"]
    limit = s["propulsion.advance_ratio_max"]
    rho = _product(_property("atmosphere/rho-slugs_ft3"), _value(KG_PER_SLUG / M_PER_FT**3))
    n = _product(_property("rotor/omega"), _value(0.5 / math.pi))
    axial = _sum(
        _product(_property("velocities/u-aero-fps"), _value(M_PER_FT * math.cos(tilt))),
        _product(_property("velocities/w-aero-fps"), _value(-M_PER_FT * math.sin(tilt))),
    )
    nd = _product(n, _value(diameter))
    scale = _product(rho, n, n, _value(diameter**4))
    stopped = _node(
        "max",
        _value(0.0),
        _difference(
            _value(1.0),
            _node("quotient", _product(nd, _value(limit)), _property("rotor/axial-mps")),
        ),
    )
    speed = _property("rotor/axial-mps")
    blades = _product(
        _value(0.5 * s["propulsion.stopped_drag_area_m2"]), rho, speed, speed, stopped
    )
    power = _node(
        "max",
        _value(0.0),
        _polynomial(v["propulsion.motor_power_polynomial_w"].tolist(), "fcs/throttle-shaft"),
    )
    drive = _difference(
        _node(
            "min",
            _value(s["propulsion.motor_torque_max_nm"]),
            _node("quotient", power, _node("max", _value(1.0), _property("rotor/omega"))),
        ),
        _value(s["propulsion.friction_torque_nm"]),
    )
    steps = [
        ("rotor/omega", _sum(_value(start_radps), _property("rotor/gained"))),
        ("rotor/axial-mps", _node("max", _value(0.1), axial)),
        (
            "rotor/advance",
            _node("min", _value(limit), _node("quotient", _property("rotor/axial-mps"), nd)),
        ),
        (
            "rotor/thrust-n",
            _difference(
                _product(
                    scale, _polynomial(v["propulsion.ct_polynomial"].tolist(), "rotor/advance")
                ),
                blades,
            ),
        ),
        ("rotor/drive-nm", drive),
        (
            "rotor/acceleration",
            _product(
                _value(1.0 / s["propulsion.rotor_inertia_kgm2"]),
                _difference(
                    _property("rotor/drive-nm"),
                    _product(
                        scale,
                        _value(diameter / (2 * math.pi)),
                        _polynomial(v["propulsion.cp_polynomial"].tolist(), "rotor/advance"),
                    ),
                ),
            ),
        ),
    ]
    control = _node("flight_control", name="rotor")
    for name in ("fcs/throttle-shaft", "rotor/gained"):
        control.append(_node("property", text=name, value="0"))
    channel = _node("channel", name="rotor")
    for name, body in steps:
        channel.append(
            _node(
                "fcs_function",
                _node("function", body),
                _node("output", text=name),
                name=name.replace("/", "-"),
            )
        )
    channel.append(
        _node(
            "integrator",
            _node("input", text="rotor/acceleration"),
            _node("c1", text="1.0"),
            _node("output", text="rotor/gained"),
            name="rotor-integrator",
        )
    )
    control.append(channel)
    return control


def _aerodynamics(aircraft: Aircraft) -> Element:
    s, v = aircraft.scalars, aircraft.vectors
    nodes = v["aerodynamics.alpha_rad"]

    def table(name: str) -> Element:
        rows = "\n".join(
            f"{float(a)!r} {float(c)!r}"
            for a, c in zip(nodes, v[f"aerodynamics.{name}"], strict=True)
        )
        return _node(
            "table",
            _node("independentVar", text="aero/alpha-rad", lookup="row"),
            _node("tableData", text=f"\n{rows}\n"),
        )

    alpha, beta = _property("aero/alpha-rad"), _property("aero/beta-rad")
    p_hat = _product(_property("velocities/p-aero-rad_sec"), _property("aero/bi2vel"))
    q_hat = _product(_property("velocities/q-aero-rad_sec"), _property("aero/ci2vel"))
    r_hat = _product(_property("velocities/r-aero-rad_sec"), _property("aero/bi2vel"))
    de, da, dr = (
        _property(f"fcs/{name}-pos-rad") for name in ("elevator", "left-aileron", "rudder")
    )
    low, high = v["aerodynamics.stall_alpha_rad"]
    beyond = _difference(
        _node("max", _value(0.0), _difference(alpha, _value(high))),
        _node("max", _value(0.0), _difference(_value(low), alpha)),
    )
    lift = _difference(
        _sum(table("cl_0"), _product(table("cl_alpha"), alpha), _product(table("cl_elevator"), de)),
        _product(
            _value(s["aerodynamics.stall_lift_perrad2"]),
            _property("aero/beyond"),
            _node("abs", _property("aero/beyond")),
        ),
    )
    drag = _sum(
        _value(s["aerodynamics.cd_0"]),
        _product(
            _value(s["aerodynamics.induced_factor"]),
            _property("aero/lift-static"),
            _property("aero/lift-static"),
        ),
        _product(table("cd_elevator"), de),
        _product(
            _value(s["aerodynamics.stall_drag_perrad2"]),
            _property("aero/beyond"),
            _property("aero/beyond"),
        ),
    )

    def lateral(name: str) -> Element:
        return _sum(
            _product(table(f"{name}_beta"), beta),
            _product(table(f"{name}_p"), p_hat),
            _product(table(f"{name}_r"), r_hat),
            _product(table(f"{name}_aileron"), da),
            _product(table(f"{name}_rudder"), dr),
        )

    pitch = _sum(
        table("cm_0"),
        _product(table("cm_alpha"), alpha),
        _product(table("cm_q"), q_hat),
        _product(table("cm_elevator"), de),
    )
    force = [_property("aero/qbar-psf"), _property("metrics/Sw-sqft")]
    span, chord = _property("metrics/bw-ft"), _property("metrics/cbarw-ft")
    sine, cosine = _node("sin", alpha), _node("cos", alpha)
    cl, cd = _property("aero/lift-total"), _property("aero/drag-total")
    tilt = s["propulsion.thrust_pitch_rad"]
    tx, tz = math.cos(tilt), -math.sin(tilt)
    hub = v["propulsion.hub_m"]
    thrust = _property("rotor/thrust-n")
    drive = _property("rotor/drive-nm")
    spin = _product(_property("rotor/omega"), _value(s["propulsion.rotor_inertia_kgm2"]))
    ft_lbf = 1.0 / (N_PER_LBF * M_PER_FT)
    p, q, r = (_property(f"velocities/{axis}-rad_sec") for axis in "pqr")
    axes = {
        "X": [
            _product(*force, _difference(_product(cl, sine), _product(cd, cosine))),
            _product(thrust, _value(tx / N_PER_LBF)),
        ],
        "Y": [_product(*force, lateral("cy"))],
        "Z": [
            _product(
                *force, _value(-1.0), _sum(_product(cl, cosine), _product(cd, sine))
            ),
            _product(thrust, _value(tz / N_PER_LBF)),
        ],
        "ROLL": [
            _product(*force, span, lateral("croll")),
            _product(thrust, _value(hub[1] * tz * ft_lbf)),
            _product(drive, _value(-tx * ft_lbf)),
            _product(q, spin, _value(-tz * ft_lbf)),
        ],
        "PITCH": [
            _product(*force, chord, pitch),
            _product(thrust, _value((hub[2] * tx - hub[0] * tz) * ft_lbf)),
            _product(r, spin, _value(-tx * ft_lbf)),
            _product(p, spin, _value(tz * ft_lbf)),
        ],
        "YAW": [
            _product(*force, span, lateral("cn")),
            _product(thrust, _value(-hub[1] * tx * ft_lbf)),
            _product(drive, _value(-tz * ft_lbf)),
            _product(q, spin, _value(tx * ft_lbf)),
        ],
    }  # fmt: skip
    result = _node(
        "aerodynamics",
        _function("aero/beyond", beyond),
        _function("aero/lift-static", lift),
        _function(
            "aero/lift-total",
            _sum(_property("aero/lift-static"), _product(table("cl_q"), q_hat)),
        ),
        _function("aero/drag-total", drag),
    )
    for axis, terms in axes.items():
        result.append(
            _node(
                "axis",
                *(_function(f"aero/{axis}/term-{i}", term) for i, term in enumerate(terms)),
                name=axis,
            )
        )
    return result
