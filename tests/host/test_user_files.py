"""Files of the user: what cannot be is refused by its name and range, what is odd is said."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from host.aircraft import file as aircraft
from host.aircraft import linear_aircraft
from host.aircraft.aircraft_ranges import RANGES
from host.aircraft.file import AircraftError, load_measured
from host.cli import main
from host.twin.testcard import cards

from tests.host.logs import ROOT, flight, written
from tests.host.user_files import KINDS, judged, sources

ULTRASTICK = (ROOT / "host/src/host/aircraft/airframes/ultrastick25e.toml").read_text()
COEFFICIENTS = "[coefficients]\nCL_alpha = 5.0\nCm_q = -10.0\n"


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def changed(**values: object) -> Path:
    """Return an aircraft with other numbers, by the last part of their name."""
    text = ULTRASTICK
    for key, value in values.items():
        text, count = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", text, count=1)
        assert count, key
    path = Path("own.toml")
    path.write_text(text)
    return path


@pytest.mark.parametrize("kind", KINDS)
def test_altered_files_are_refused_or_used(kind: str) -> None:
    """`make fuzz FULL=1` does 2500 of each."""
    ends, examples = judged(kind, 80, seed=0)
    assert {what: words for what, (words, _) in examples.items()} == {}
    assert ends["refused"] > 20
    assert ends["used"] > 4


def test_the_files_that_are_altered_are_good() -> None:
    for kind, (ending, use) in KINDS.items():
        for text in sources(kind):
            if b'kind = "linear"' in text:
                continue  # has no mass of its own to convert with
            Path(f"good{ending}").write_bytes(text)
            use(Path(f"good{ending}"), np.random)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"mass_kg": -1.8}, "mass.mass_kg is -1.8 kg, expected 0.001 to 700000 kg"),
        ({"span_m": 1264.0}, "geometry.span_m is 1264 m, expected 0.03 to 130 m"),
        ({"wing_area_m2": -0.3}, "geometry.wing_area_m2 is -0.3 m2"),
        ({"iyy_kgm2": 0.3}, "exceeds the sum of the others"),
        ({"ixz_kgm2": 0.08}, "a principal moment of inertia is"),
        ({"mass_tolerance": 50}, "mass.mass_tolerance is 50, expected 0 to 0.5"),
        ({"cg_m": "[1e9, 0, 0]"}, "mass.cg_m[0] is 1e+09 m, expected -100 to 100 m"),
        ({"cg_m": "[90, 0, 0]"}, "distance of mass.cg_m / span"),
        ({"chord_m": 0}, "geometry.chord_m is 0 m"),
        ({"chord_m": 15.0}, "chord over area / span"),
        ({"upwash": -1}, "sensors.upwash is -1, expected -0.5 to 2"),
        ({"wing_area_m2": 310.0}, "aspect ratio"),
        ({"mass_kg": 1943}, "mass / area^1.5 (mass_kg 1943"),
        ({"iyy_kgm2": 89000, "izz_kgm2": 89000}, "radius of gyration / span"),
        ({"airspeed_mps": "nan"}, "trim.airspeed_mps is nan"),
        ({"airspeed_mps": 60.0}, "are not minimum, trim, maximum"),
        ({"ixx_kgm2": "true"}, "mass.ixx_kgm2 is True, expected a number"),
        ({"alpha_rad": "[]"}, "aerodynamics.alpha_rad has 0 numbers, expected 2 to 200"),
        ({"stall_alpha_rad": "[0.2, 0.1]"}, "stall_alpha_rad must increase"),
        ({"rotor_inertia_kgm2": 0}, "rotor_inertia_kgm2 is 0 kg m2, expected above 0"),
        ({"elevator_limit_rad": 25}, "elevator_limit_rad is 25 rad, expected above 0 to 1.6 rad"),
    ],
)
def test_what_no_aircraft_can_be_is_refused(
    values: dict[str, object], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("prior.toml").write_text(COEFFICIENTS)
    path = changed(**values)
    assert main(["convert", "prior.toml", "--aircraft", str(path)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err
    assert str(path) in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"wing_area_m2": 3.1}, "chord over area / span (chord_m 0.25306, wing_area_m2 3.1"),
        ({"span_m": 0.38, "chord_m": 0.8}, "aspect ratio, span2 / area"),
        ({"chord_m": 0.05}, "chord over area / span (chord_m 0.05"),
        ({"mass_kg": 0.02}, "mass / area^1.5 (mass_kg 0.02"),
        ({"iyy_kgm2": 8.9, "izz_kgm2": 9.0}, "radius of gyration / span (iyy_kgm2 8.9"),
        ({"izz_kgm2": 0.132}, "the largest principal moment of inertia exceeds"),
    ],
)
def test_what_no_known_aircraft_has_is_told(
    values: dict[str, object], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("prior.toml").write_text(COEFFICIENTS)
    path = changed(**values)
    assert main(["convert", "prior.toml", "--aircraft", str(path), "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)
    assert said in err
    assert all(line.startswith("host: ") for line in err.splitlines())


# Mass, area, span, chord, Ixx, Iyy, Izz, Ixz, airspeed: Stevens & Lewis (F-16); NASA CR-2144
# (747, X-15); Roskam part I (Cessna 172); estimates of the same proportions for the others.
REAL = {
    "f16": (9295, 27.87, 9.144, 3.45, 12875, 75674, 85552, 1331, 150),
    "x15": (7056, 18.6, 6.81, 3.13, 4960, 108000, 110000, -800, 600),
    "b747": (288773, 511, 59.6, 8.32, 24.6e6, 45e6, 67e6, 1.3e6, 150),
    "cessna172": (1043, 16.2, 10.9, 1.49, 1285, 1825, 2667, 0, 60),
    "sailplane15": (360, 10.5, 15, 0.72, 1200, 500, 1650, 0, 25),
    "sailplane31": (850, 18.6, 30.9, 0.65, 9000, 1300, 10000, 0, 30),
    "airliner600": (600000, 905, 88, 12.3, 6e7, 6e7, 1.1e8 - 1e7, 0, 130),
    "indoor50g": (0.05, 0.16, 0.8, 0.2, 0.0005, 0.0006, 0.001, 0, 4),
    "giant150kg": (150, 6, 8, 0.75, 60, 55, 110, 0, 35),
    "biplane": (1.5, 0.6, 1.1, 0.27, 0.03, 0.06, 0.08, 0, 12),
    "glider_rc": (6.5, 0.9, 5, 0.18, 0.9, 0.25, 1.1, 0, 15),
    "delta_rc": (1.2, 0.35, 0.8, 0.55, 0.02, 0.05, 0.065, 0, 18),
}


@pytest.mark.parametrize("name", REAL)
def test_real_aircraft_are_taken_without_a_word(name: str) -> None:
    keys = (
        *("mass_kg", "wing_area_m2", "span_m", "chord_m"),
        *("ixx_kgm2", "iyy_kgm2", "izz_kgm2", "ixz_kgm2", "airspeed_mps"),
    )
    values: dict[str, object] = dict(zip(keys, REAL[name], strict=True))
    speed = REAL[name][-1]
    values |= {"minimum_airspeed_mps": 0.8 * speed, "maximum_airspeed_mps": 1.2 * speed}
    # Booms of the model that is changed would be longer than the smallest of these.
    values |= dict.fromkeys(("vane_a_m", "vane_b_m", "pitot_a_m", "pitot_b_m"), "[0, 0, 0]")
    loaded = load_measured(changed(**values))
    assert loaded.doubts == ()


def test_every_number_of_an_aircraft_has_a_range_and_its_source() -> None:
    known = {
        f"{section}.{key}"
        for table in (aircraft._SCALARS, aircraft._VECTORS, aircraft._OPTIONAL)
        for section, keys in table.items()
        for key in keys
    }
    assert known == RANGES.keys()
    for key, quantity in RANGES.items():
        assert quantity.source, key
        assert quantity.least < quantity.most, key
        unit = key.rsplit("_", 1)[-1]
        units = {"m": "m", "kg": "kg", "kgm2": "kg m2", "m2": "m2", "mps": "m/s", "rad": "rad",
                 "s": "s", "nm": "N m", "hz": "Hz", "radps": "rad/s", "w": "W"}  # fmt: skip
        if unit in units and not key.endswith("hz_per_mps"):
            assert quantity.unit == units[unit], key


def test_what_comes_with_the_package_is_without_doubt() -> None:
    for name in aircraft.names():
        assert linear_aircraft.load(name).doubts == ()
    for name in cards.names():
        assert cards.load(name)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('unit = "deg"', "[channel.alpha_a] unit is 'deg', expected 'rad'"),
        ("slope = 0.3", "[channel.alpha_a] slope is 0.3 rad per raw unit, expected -0.1 to 0.1"),
        ("slope = 0.0", "no slope of 0"),
        ("zero = 1e9", "zero is 1e+09"),
        ("zero_sigma = -1.0", "zero_sigma is -1, expected 0 to 2e+07"),
        ("slope_sigma = 50", "slope_sigma is 50, expected 0 to 10"),
        ("zero_sigma = []", "zero_sigma has 0 numbers"),
        ("zero = nan", "channel.alpha_a.zero is nan"),
    ],
)
def test_calibrations_that_cannot_be(
    line: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("flight.bin").write_bytes(written(*flight(1.0)))
    text = (ROOT / "hw/calibration/default.toml").read_text()
    key = line.split(" ")[0]
    Path("own.toml").write_text(re.sub(rf"(?m)^{key} = .*$", line, text, count=1))
    assert main(["decode", "flight.bin", "--calibration", "own.toml"]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("[flight]\nheight_m = -5\n", "flight.height_m is -5 m, expected above 0 to 15000 m"),
        ("[flight]\nrate_hz = 1e9\n", "flight.rate_hz is 1e+09 Hz, expected 1 to 1000 Hz"),
        ("[air]\nwind_east_mps = 500\n", "air.wind_east_mps is 500 m/s, expected -60 to 60 m/s"),
        ("[pilot]\nearly = 5\n", "pilot.early is 5, expected 0 to 1"),
        ("[flight]\nlatitude_deg = 120\n", "flight.latitude_deg is 120 deg"),
        ('[[segment]]\nkind="trim"\nduration_s=14000\nrepeat=2\n', "expected up to 14400 s"),
        ('[[segment]]\nkind="trim"\nduration_s=1e-3\nrepeat=100\n' * 21, "more than 2000 segments"),
        ('[[fault]]\nkind=["x"]\nat_s=1\n', "kind is ['x'], expected one of"),
        (
            '[[segment]]\nkind="multisine"\naxis="elevator"\namplitude=2\nduration_s=9000\n'
            "low_hz=0.1\nhigh_hz=400\n",
            "expected up to 1000",
        ),
    ],
)
def test_cards_that_cannot_be_flown(
    card: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    base = 'format = 1\naircraft = "ultrastick25e"\n'
    segment = '[[segment]]\nkind = "trim"\nduration_s = 5\n'
    Path("own.toml").write_text(base + card + segment)
    for verb in ("plan", "simulate"):
        assert main([verb, "own.toml"]) == 2
        assert said in capsys.readouterr().err


def test_a_refused_number_of_a_thousand_digits_is_cut() -> None:
    with pytest.raises(AircraftError, match=r"expected a number up to") as refused:
        load_measured(changed(mass_kg="1" + "0" * 300))
    assert len(str(refused.value)) < 200
