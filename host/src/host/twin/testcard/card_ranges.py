"""Permitted range of each number of a flight card, with the reason."""

from __future__ import annotations

from collections.abc import Mapping

from host.files.quantities import Quantity

_DAY = "longer than any battery; longer flights are several cards"
_STANDARD = "from the Dead Sea to 11 km, ICAO standard atmosphere"
_CIRCLE = "a circle"
_STORM = "gale: 30 m/s"
_HAND = "a person: 0.1 to 1 s"
_ANGLE = "a quarter turn"
_NYQUIST = "half of the fastest rate"

LONGEST_FLIGHT_S = 4 * 3600.0  # 1.4 million rows at 100 Hz
_SECONDS = Quantity("s", 0.0, LONGEST_FLIGHT_S, _DAY)
_SHARE = Quantity("", 0.0, 10.0, "a share: 0.1 is 10 %")
_LENGTH_M = Quantity("m", 0.0, 1e5, "MIL-F-8785C: at most 533 m; 0 is its own")
_HAND_S = Quantity("s", 0.0, 60.0, _HAND)
_SPEED_MPS = Quantity("m/s", 0.0, 2000.0, "X-15; 0 is the aircraft's own")
_WIND_MPS = Quantity("m/s", -60.0, 60.0, _STORM)
_BAND_HZ = Quantity("Hz", 0.0, 500.0, _NYQUIST)

RANGES: Mapping[str, Quantity] = {
    "flight.airspeed_mps": _SPEED_MPS,
    "flight.height_m": Quantity("m", 0.0, 15_000.0, _STANDARD, above=True),
    "flight.climb_m": Quantity("m", 0.0, 1000.0, "higher climbs are a flight of their own"),
    "flight.rate_hz": Quantity("Hz", 1.0, 1000.0, "the recorder's fastest is 200 Hz"),
    "flight.ground_s": Quantity("s", 0.0, 600.0, "the pitot's zero takes 5 s"),
    "flight.heading_deg": Quantity("deg", -360.0, 360.0, _CIRCLE),
    "flight.field_pressure_pa": Quantity("Pa", 20_000.0, 110_000.0, _STANDARD),
    "flight.field_temperature_degc": Quantity("degC", -70.0, 60.0, "coldest and hottest places"),
    "flight.latitude_deg": Quantity("deg", -90.0, 90.0, _CIRCLE),
    "flight.longitude_deg": Quantity("deg", -360.0, 360.0, _CIRCLE),
    "air.wind_north_mps": _WIND_MPS,
    "air.wind_east_mps": _WIND_MPS,
    "air.turbulence_mps": Quantity("m/s", 0.0, 15.0, "MIL-F-8785C, severe: 7 m/s"),
    "air.length_w_m": _LENGTH_M,
    "air.length_u_m": _LENGTH_M,
    "air.ratio_u": Quantity("", 0.0, 10.0, "MIL-F-8785C: 1 to 2.5"),
    "pilot.timing_s": _HAND_S,
    "pilot.amplitude": _SHARE,
    "pilot.drift": _SHARE,
    "pilot.hand_s": _HAND_S,
    "pilot.remnant": Quantity("", 0.0, 1.0, "of full throw"),
    "pilot.delay_s": Quantity("s", 0.0, 5.0, _HAND),
    "pilot.gain": Quantity("", 0.0, 10.0, "1: crossover at 1.2 rad/s"),
    "pilot.early": Quantity("", 0.0, 1.0, "a share of the maneuvers"),
    "pilot.breaks_off": Quantity("", 0.0, 1.0, "a share of the step inputs"),
    "pilot.hands_off_s": Quantity("s", 0.0, 600.0, "a phugoid: 60 s"),
    "segment.duration_s": _SECONDS,
    "segment.bank_deg": Quantity("deg", -85.0, 85.0, "a level turn at 85 deg pulls 11 g"),
    "segment.amplitude": Quantity("deg", -90.0, 90.0, _ANGLE),
    "segment.width_s": Quantity("s", 0.0, 600.0, "a phugoid: 60 s"),
    "segment.tone_share": Quantity("", 0.0, 1.0, "of the amplitude", above=True),
    "segment.tone_phase": Quantity("", 0.0, 1.0, "a turn"),
    "segment.low_hz": _BAND_HZ,
    "segment.high_hz": _BAND_HZ,
    "segment.before_s": Quantity("s", 0.0, 600.0, "trim before an input: 3 s"),
    "segment.airspeed_mps": _SPEED_MPS,
    "segment.attention": Quantity("", -1.0, 1.0, "a share; -1 is the kind's own"),
    "fault.at_s": _SECONDS,
    "fault.duration_s": Quantity("s", 0.0, 1e9, "1e9 is for ever"),
    "fault.value": Quantity("", -1e9, 1e9, "ms, V, Hz, us or a share, by kind"),
}
