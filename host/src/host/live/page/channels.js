// What is plotted together: title, unit, least span of the axis, and series of column, label, colour
// (and unit, where it has an axis of its own that is not drawn). `times`: the last row of the page.

const LEFT = "#0b3d91"; // left vane and pitot, stick, x axis
const RIGHT = "#c43b00"; // right vane and pitot, servo, y axis
const THIRD = "#00642c"; // measured surface, z axis

function surface(name, pots) {
  return {
    id: name,
    title: name,
    unit: "us",
    span: 200,
    digits: 0,
    jumps: name,
    series: [
      [`rc_${name}_us`, "stick", LEFT],
      [`servo_${name}_us`, "servo", RIGHT],
      ...pots.map(([column, label]) => [column, label, THIRD, "deg"]),
    ],
  };
}

export const PLOTS = [
  surface("elevator", [["elevator_pot_deg", "pot"]]),
  {
    id: "alpha",
    title: "alpha",
    unit: "deg",
    span: 8,
    digits: 1,
    difference: ["alpha_a_deg", "alpha_b_deg"],
    series: [["alpha_a_deg", "L", LEFT], ["alpha_b_deg", "R", RIGHT]],
  },
  {
    id: "rates",
    title: "rates",
    unit: "deg/s",
    span: 40,
    digits: 0,
    series: [["p_degps", "p", LEFT], ["q_degps", "q", RIGHT], ["r_degps", "r", THIRD]],
  },
  surface("aileron", [["aileron_left_deg", "L"], ["aileron_right_deg", "R"]]),
  {
    id: "beta",
    title: "beta",
    unit: "deg",
    span: 8,
    digits: 1,
    difference: ["beta_a_deg", "beta_b_deg"],
    series: [["beta_a_deg", "L", LEFT], ["beta_b_deg", "R", RIGHT]],
  },
  {
    id: "attitude",
    title: "attitude",
    unit: "deg",
    span: 20,
    digits: 0,
    series: [["phi_deg", "roll", LEFT], ["theta_deg", "pitch", RIGHT]],
  },
  surface("rudder", [["rudder_pot_deg", "pot"]]),
  {
    id: "airspeed",
    title: "airspeed",
    unit: "m/s",
    span: 5,
    digits: 1,
    difference: ["airspeed_a_mps", "airspeed_b_mps"],
    series: [["airspeed_a_mps", "L", LEFT], ["airspeed_b_mps", "R", RIGHT]],
  },
  {
    id: "accelerations",
    title: "acceleration",
    unit: "m/s2",
    span: 10,
    digits: 1,
    series: [["ax_mps2", "x", LEFT], ["ay_mps2", "y", RIGHT], ["az_mps2", "z", THIRD]],
  },
  { ...surface("throttle", []), times: true },
  {
    id: "altitude",
    times: true,
    title: "height",
    unit: "m",
    span: 20,
    digits: 0,
    series: [["altitude_m", "pressure", LEFT]],
  },
  {
    id: "heading",
    times: true,
    title: "heading",
    unit: "deg",
    span: 40,
    digits: 0,
    series: [["psi_deg", "heading", LEFT], ["rc_switch_us", "switch", THIRD, "us"]],
  },
];
