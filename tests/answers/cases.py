"""The cases: what users have, one line of options each."""

from tests.answers.case import Case

STICK = "ultrastick25e"
CASES = (
    Case(
        "twin-log-calibrated",
        ("inputs/axes.bin.gz",),
        {"aircraft": STICK, "calibration": "inputs/axes.calibration.toml"},
        "inputs/axes.truth.json",
    ),
    Case(
        "twin-log-coefficients",
        ("inputs/axes.bin.gz",),
        {
            "aircraft": STICK,
            "calibration": "inputs/axes.calibration.toml",
            "models": "coefficients",
        },
        "inputs/axes.truth.json",
    ),
    Case("twin-log-alone", ("inputs/axes.bin.gz",)),
    Case(
        "px4",
        ("inputs/axes.ulg.gz",),
        {"aircraft": STICK, "models": ["short-period", "lateral"]},
        "inputs/axes.truth.json",
    ),
    Case(
        "ardupilot",
        ("inputs/axes.ardupilot.bin.gz",),
        {"aircraft": STICK, "models": ["short-period", "lateral"]},
        "inputs/axes.truth.json",
    ),
    Case("telemetry", ("inputs/axes.tlog.gz",), {"aircraft": STICK}, "inputs/axes.truth.json"),
    Case("trainer-pitch", ("inputs/trainer-pitch.npz",), {}, "inputs/trainer-pitch.truth.json"),
    Case("trainer-turn", ("inputs/trainer-turn.npz",), {}, "inputs/trainer-turn.truth.json"),
    Case(
        "trainer-pitch-aircraft",
        ("inputs/trainer-pitch-errors.npz",),
        {
            "aircraft": "inputs/trainer-pitch.aircraft.toml",
            "calibration": "inputs/trainer-sensors.toml",
            "models": ["longitudinal", "coefficients"],
        },
        "inputs/trainer-pitch.truth.json",
    ),
    Case(
        "thor75",
        ("../data/thor75/flight75_240_270.csv",),
        {"mapping": "../data/thor75/map.toml", "from_s": 240.0, "to_s": 262.0},
    ),
    Case("px4-bench", ("../data/px4/sample_appended_multiple.ulg",)),
    Case(
        "users-linear-gust",
        ("inputs/users-gust.npz",),
        {"models": "inputs/users.toml", "from_s": 0.0, "to_s": 12.0},
        "inputs/users.truth.json",
    ),
)
