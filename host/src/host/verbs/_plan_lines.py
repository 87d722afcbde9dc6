"""Lines of `host plan`: excursions, bounds and promised widths of a card."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from host.planning.card_planning import Bound, Plan, Point
    from host.planning.point_widths import PointPromise
    from host.planning.predicted_widths import PredictedWidth, Prediction

# A derivative whose predicted half-width is above this is named.
WEAK_PERCENT = 20.0
BY_TOLERANCES = "by tolerances, not by the card"
NO_SIGN_PERCENT = 100.0  # wider half-widths leave the sign unknown too
COEFFICIENTS = (
    "CL_alpha", "Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "Cn_r", "Cn_dr",
)  # fmt: skip


def print_plan(plan: Plan) -> None:
    from host.planning.home_turns import turns_before

    print(f"{plan.card.title}  [{plan.aircraft.title}, predicted, calm air, exact inputs]\n")
    print("  n  input                     amplitude  pulse   test   dV     alpha  beta   p      q "
          "     r      bank   pitch  load")  # fmt: skip
    print("                                 deg         s      s     m/s    deg    deg    deg/s  "
          "deg/s  deg/s  deg    deg    g")  # fmt: skip
    last: Point | None = None
    count = 0
    rows: list[tuple[int, Point]] = []
    for point in plan.points:
        same = last is not None and (point.kind, point.axes, point.amplitudes, point.width_s) == (
            last.kind, last.axes, last.amplitudes, last.width_s,
        )  # fmt: skip
        count = count + 1 if same else 1
        if same:
            rows.pop()
        rows.append((count, point))
        last = point
    for times, p in rows:
        name = f"{p.kind} {'+'.join(p.axes)}"
        size = "/".join(f"{a:g}" for a in p.amplitudes)
        pulse = f"{p.width_s:5.2f}" if p.width_s else "  -  "
        low, high = p.load_factor
        print(
            f"  {times}x {name:24s} {size:>10s}  {pulse}  {p.duration_s:5.1f}"
            f"  {p.airspeed_mps:5.1f}  {p.alpha_deg:5.1f}  {p.beta_deg:5.1f}"
            f"  {p.roll_rate_degps:5.0f}  {p.pitch_rate_degps:5.0f}  {p.yaw_rate_degps:5.0f}"
            f"  {p.bank_deg:5.0f}  {p.pitch_deg:5.0f}  {low:4.1f} to {high:3.1f}"
        )
    before = ", ".join(map(str, turns_before(plan.card)))
    if before:
        print(f"  Turn until home is ahead (30 deg of bank) before test point {before}.")


def point_as_json(point: PointPromise) -> dict[str, object]:
    """Return a promise without its spectra, which nobody reads."""
    found = asdict(replace(point, noise={}))
    del found["noise"]
    return found


def print_single_points(alone: list[PointPromise]) -> None:
    """Print the half-widths that each test point alone will give."""
    if alone:
        by = "through the recorder"
        if not all(point.recorded for point in alone):
            by = "without the recorder (no C++ compiler: expect N_r and L_p wider)"
        print(f"\n  One test point alone, {by}, the same gusts and tolerances:")
    for point in alone:
        size = "/".join(f"{a:g}" for a in point.amplitudes)
        widths_text = ", ".join(f"{w.name} {w.percent:.0f} %" for w in point.widths) or "nothing"
        print(f"    {point.kind} {'+'.join(point.axes)}, {size} deg: {widths_text}".rstrip())
        for text in point.failures:
            print(f"      {text}")


def _remedy(width: PredictedWidth | None) -> str:
    """Return the remedy for a wide interval."""
    if width is not None and width.noise_share < 0.5:
        return BY_TOLERANCES
    return "fly more of it, or larger"


def print_intervals(plan: Plan, prediction: Prediction | None) -> None:
    """Print what identification will state, and the bound of white noise."""
    least = {b.name: b for b in plan.bounds}
    widths = {w.name: w for w in prediction.widths} if prediction is not None else {}
    rows: list[tuple[str, float, float, float, Bound | None]]
    if prediction is None:
        print("\n  What the data will tell, at best (white sensor noise only, 95 % half-width):")
        rows = [(b.name, b.value, b.half_width, b.percent, None) for b in plan.bounds]
    else:
        print(
            f"\n  What `host identify` will state: 95 % half-widths with gusts of"
            f" {prediction.gusts_mps:g} m/s, coloured\n  residuals and every tolerance of"
            f" instrument and aircraft (medians of virtual flights).\n  At best: white noise alone."
        )
        shown = (*least, *COEFFICIENTS)
        rows = [
            (n, widths[n].value, widths[n].half_width, widths[n].percent, least.get(n))
            for n in shown
            if n in widths
        ]
    for name, value, half, percent, best in rows:
        bound = f"  at best {best.percent:5.1f} %" if best is not None else 17 * " "
        weak = f"  weak: {_remedy(widths.get(name))}" if percent > WEAK_PERCENT else ""
        share = f"{percent:5.1f} %" if percent < NO_SIGN_PERCENT else "no sign"
        line = f"    {name:8s} {value:+10.4g} +- {half:8.2g}  ({share})"
        print(f"{line}{bound if prediction is not None else ''}{weak}".rstrip())
    if any(_remedy(widths.get(name)) == BY_TOLERANCES for name, _, _, percent, _ in rows
           if percent > WEAK_PERCENT):  # fmt: skip
        print(
            "    Tolerances are those of calibration and aircraft file: no card makes them smaller."
        )
    for text in (*plan.refused, *(prediction.failures if prediction is not None else ())):
        print(f"    {text}")
