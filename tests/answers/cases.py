"""The cases: what users have, and the options with which they call."""

from typing import Any

from tests.answers.case import Case

STICK = "ultrastick25e"
THOR = "../data/thor75/flight75_240_270.csv"
MAP = {"mapping": "../data/thor75/map.toml"}
AXES: dict[str, Any] = {"aircraft": STICK, "calibration": "inputs/axes.calibration.toml"}
AUTOPILOT: dict[str, Any] = {"aircraft": STICK, "models": ["short-period", "lateral"]}


def axes(name: str, log: str, **options: Any) -> Case:
    """Return a case of the virtual flight of all axes, in a log of one format or another."""
    return Case(name, (f"inputs/axes.{log}.gz",), options, "inputs/axes.truth.json")


def trainer(name: str, table: str, **options: Any) -> Case:
    """Return a case of the independent simulator."""
    return Case(name, (f"inputs/{table}.npz",), options, "inputs/trainer-pitch.truth.json")


def with_file(name: str, table: str, *models: str) -> Case:
    """Return a case of the independent simulator with its owner's aircraft file."""
    options = {
        "aircraft": f"inputs/{table}.aircraft.toml",
        "calibration": "inputs/trainer-sensors.toml",
        "models": models,
    }
    return trainer(name, f"{table}-errors", **options)


def users(name: str, *tables: str, model: str = "inputs/users.toml", **options: Any) -> Case:
    """Return a case of a user's linear model, fitted to the whole of its records."""
    sources = tuple(f"inputs/users-{table}.npz" for table in tables)
    whole = {"models": model, "from_s": 0.0, **options}
    return Case(name, sources, whole, "inputs/users.truth.json")


def clean(name: str, table: str, model: str) -> Case:
    """Return a case of a record without noise."""
    options = {"models": model, "from_s": 0.0}
    return Case(name, (f"inputs/clean-{table}.npz",), options, "inputs/clean.truth.json")


CASES = (
    # Virtual flights: our log with what an owner has, tables, original rows.
    axes("twin-log-calibrated", "bin", **AXES),
    axes("twin-log-coefficients", "bin", **AXES, models="coefficients"),
    axes("twin-log-terms", "bin", **AXES, models="inputs/terms.toml"),
    Case("twin-log-alone", ("inputs/axes.bin.gz",)),
    Case(
        "twin-two-logs",
        ("inputs/axes.bin.gz", "inputs/pitch.bin.gz"),
        {
            "aircraft": STICK,
            "calibration": ["inputs/axes.calibration.toml", "inputs/pitch.calibration.toml"],
            "models": "short-period",
        },
        "inputs/axes.truth.json",
    ),
    Case(
        "twin-two-coefficients",
        ("inputs/pitch.bin.gz", "inputs/again.bin.gz"),
        {
            "aircraft": STICK,
            "calibration": ["inputs/pitch.calibration.toml", "inputs/again.calibration.toml"],
            "models": "coefficients",
        },
        "inputs/pitch.truth.json",
    ),
    Case(
        "twin-multisine",
        ("inputs/multisine.npz",),
        {"aircraft": STICK, "models": ["short-period", "coefficients"]},
        "inputs/multisine.truth.json",
    ),
    Case(
        "twin-true",
        ("inputs/multisine-true.npz",),
        {"aircraft": STICK, "models": "longitudinal"},
        "inputs/multisine.truth.json",
    ),
    Case("rows", ("inputs/rows.txt.gz",), {"models": ["short-period", "dutch-roll"]}),
    Case("rows-thesis-model", ("inputs/rows.txt.gz",), {"models": "thesis-forces-rate"}),
    Case(
        "rows-paired",
        ("inputs/rows-paired.txt.gz",),
        {"models": "longitudinal", "row_rate_hz": 20.0, "maneuvers": [2, 3]},
    ),
    # Autopilots.
    axes("px4", "ulg", **AUTOPILOT),
    axes("ardupilot", "ardupilot.bin", **AUTOPILOT),
    axes("telemetry", "tlog", aircraft=STICK),
    Case(
        "ardupilot-elevons",
        ("inputs/elevons.ardupilot.bin.gz",),
        {"aircraft": STICK, "models": "short-period"},
        "inputs/pitch.truth.json",
    ),
    Case("px4-bench", ("../data/px4/sample_appended_multiple.ulg",)),
    Case("px4-on-the-ground", ("../data/px4/sample_log_small.ulg",)),
    # Flown.
    Case("thor75", (THOR,), {**MAP, "from_s": 240.0, "to_s": 262.0}),
    Case(
        "thor75-stretches",
        (THOR,),
        {**MAP, "models": ["short-period", "dutch-roll"], "stretches": [(241, 250), (255, 268)]},
    ),
    Case(
        "thor75-coefficients",
        (THOR,),
        {**MAP, "aircraft": STICK, "models": "coefficients", "stretches": [(241, 270)]},
    ),
    # The independent simulator, without and with its owner's files.
    trainer("trainer-pitch", "trainer-pitch"),
    trainer("trainer-turn", "trainer-turn"),
    trainer("trainer-turn-parts", "trainer-turn", models=["dutch-roll", "roll"]),
    with_file("trainer-pitch-aircraft", "trainer-pitch", "longitudinal", "coefficients"),
    with_file("trainer-turn-aircraft", "trainer-turn", "lateral", "coefficients"),
    trainer("trainer-gusty", "trainer-gusty", models="longitudinal"),
    trainer(
        "trainer-gusty-plain",
        "trainer-gusty",
        models="short-period",
        maneuvers=[1, 2],
        delays=False,
        corrections=False,
    ),
    # Tables that something is wrong with.
    trainer("quantised", "trainer-quantised", models="short-period"),
    trainer("held", "trainer-held", models="short-period"),
    trainer("stuck", "trainer-stuck", models="short-period"),
    trainer("degrees", "trainer-degrees", models="short-period"),
    trainer("backwards", "trainer-backwards", models="short-period"),
    trainer(
        "backwards-accepted", "trainer-backwards", models="short-period", accept="surface-sign"
    ),
    trainer("weightless", "trainer-weightless", models="longitudinal"),
    trainer("no-vane", "trainer-no-vane", models="short-period"),
    Case("no-airspeed", ("inputs/trainer-no-airspeed.npz",)),
    trainer("gap", "trainer-gap", models="longitudinal"),
    # Users' models.
    users("users-linear-white", "white"),
    users("users-linear-coloured", "coloured"),
    users("users-linear-gust", "gust"),
    users("users-known-noise", "white", model="inputs/users-noise.toml"),
    users("users-two-rates", "white", "quick", methods="output-error-white"),
    users(
        "users-methods",
        "white",
        methods=[
            "equation-error",
            "output-error",
            "filter-error",
            "frequency-output-error",
            "recursive",
        ],
    ),
    users(
        "users-thesis-methods",
        "white",
        methods=[
            "hopfield-whitened",
            "neural-delta",
            "genetic",
            "unscented-kalman",
            "extended-kalman",
        ],
    ),
    clean("clean-servo", "servo", "short-period"),
    clean("clean-steps", "steps", "inputs/users.toml"),
    clean("clean-steps-held", "steps-held", "inputs/users.toml"),
    Case(
        "equations-bend",
        ("inputs/bend-1.npz", "inputs/bend-2.npz"),
        {"models": "inputs/bend.toml", "from_s": 0.0},
        "inputs/bend.truth.json",
    ),
    Case(
        "equations-pendulum",
        ("inputs/pendulum.npz",),
        {"models": "inputs/pendulum.toml", "from_s": 0.0, "methods": "output-error-white"},
        "inputs/pendulum.truth.json",
    ),
)
