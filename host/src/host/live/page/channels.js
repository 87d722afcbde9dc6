// What is plotted together: title, unit, least span of the axis, and series of column, label, colour.
// A strip has one unit. `times`: the last row of the page.

const LEFT = "#0b3d91"; // left vane and pitot, stick, x axis
const RIGHT = "#c43b00"; // right vane and pitot, servo, y axis
const THIRD = "#00642c"; // z axis
const FOURTH = "#6a1b9a";

// What the pilot asks for and what the servo gets; where the surface stands is a strip of its own.
function pulses(name) {
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
    ],
  };
}

// Below it a pitot tells nothing: its first count stands for 2.8 m/s.
export const LEAST_AIRSPEED_MPS = 5;

export function words(value, digits, least = 0) {
  if (value === null) return "-";
  if (Math.abs(value) < least) return `< ${least}`;
  const text = value.toFixed(digits);
  return Number(text) === 0 ? text.replace("-", "") : text;
}

export const PLOTS = [
  pulses("elevator"),
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
  pulses("aileron"),
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
  pulses("rudder"),
  {
    id: "airspeed",
    title: "airspeed",
    unit: "m/s",
    span: 5,
    digits: 1,
    least: LEAST_AIRSPEED_MPS,
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
  { ...pulses("throttle"), times: true },
  {
    id: "height",
    times: true,
    title: "height",
    unit: "m",
    span: 20,
    digits: 0,
    series: [["height_m", "over start", LEFT]],
  },
  {
    id: "surfaces",
    times: true,
    title: "surfaces",
    unit: "deg",
    span: 10,
    digits: 1,
    series: [
      ["elevator_pot_deg", "E", LEFT],
      ["aileron_left_deg", "AL", RIGHT],
      ["aileron_right_deg", "AR", FOURTH],
      ["rudder_pot_deg", "R", THIRD],
    ],
  },
];
