"""What an answer says of the servos of inputs that are commands."""

from __future__ import annotations

from typing import TYPE_CHECKING

from host.sysid.answer.command_lag import lag_lookalikes, unknown_lag

if TYPE_CHECKING:
    from host.sysid.estimators.servo_parameters import ServoEstimate
    from host.sysid.linear.linear_answer import Answer

UNITS = {"servo_delay_s": "s", "servo_bandwidth_hz": "Hz", "servo_rate_limit_radps": "rad/s"}


def servo_lines(answer: Answer) -> list[str]:
    """Return the lines of the verdict on commanded surfaces; none without any."""
    servo = answer.servo
    if servo is None:
        return []
    delay, bandwidth, rate = servo.numbers
    whose = "estimated" if delay.data_informed else "as known before the flight"
    surfaces = ", ".join(u.removesuffix("_rad") for u in servo.surfaces)
    lines = [
        f"  {surfaces} is a command: the surface comes {1e3 * delay.value:.0f}"
        f" +- {1e3 * delay.half_width:.0f} ms later ({whose}), behind a servo of"
        f" {bandwidth.value:.2g} +- {bandwidth.half_width:.2g} Hz and {rate.value:.2g}"
        f" +- {rate.half_width:.2g} rad/s (carried)"
    ]
    if alike := lag_lookalikes(answer):
        lines.append(
            f"  the servos' lag and {', '.join(alike)} are not separable: measure the"
            " surface (a pot), or the servo on the ground"
        )
    return lines


def servo_estimate_lines(servo: ServoEstimate | None) -> list[str]:
    """Return the servos' numbers as lines of the table of estimates."""
    return [
        f"  {n.name:22s} {n.value:9.4g}  +- {n.half_width:9.3g}  {UNITS[n.name]:7s}"
        + ("" if n.data_informed else "as known before the flight")
        for n in (servo.numbers if servo is not None else ())
    ]


def servo_document(answer: Answer) -> dict[str, object] | None:
    """Return the servos for JSON; None where every surface was measured."""
    servo = answer.servo
    if servo is None:
        return None
    return {
        "commanded": list(servo.surfaces),
        "numbers": {
            n.name: {
                "value": n.value,
                "half_width": n.half_width,
                "prior_half_width": n.prior_half_width,
                "told": n.data_informed,
            }
            for n in servo.numbers
        },
        "correlation": servo.correlation,
        "unknown_lag": unknown_lag(answer),
        "not_told_apart": list(lag_lookalikes(answer)),
    }
