"""Altered files of the user: what comes of each, by the reader and the first who computes with it.

    .venv/bin/python -m tests.host.user_files KIND [--count 2500] [--seed 1]

An altered file is refused in one line or used; a number that could not be ends in no other error,
no warning of numpy, and in no infinite answer. Ends with 1 and the worst example if one does not.
"""

import argparse
import contextlib
import copy
import json
import math
import os
import random
import shutil
import sys
import tempfile
import tomllib
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from host.errors import HostError

from tests.host.logs import ROOT, flight, written

COUNT = 2500
LONG = 10**400
FACTORS = (-1.0, 0.0, 1e-6, 1e-3, 0.1, 0.5, 0.9, 1.01, 1.1, 2.0, 3.0, 10.0, 1e3, 1e6, 1e12)
ODD: tuple[Any, ...] = (
    0, 0.0, -0.0, -1, 1, 50, 1264.0, -1.8, 1e-9, -1e9, 1e9, 1e18, 1e19, 1e300, -1e300, 2**63, LONG,
    math.nan, math.inf, -math.inf, True, False, "", "x", "0.0.0", "\x1b[2J", "é" * 99, "a" * 30_000,
    [], [[]], [0.0], [1e9, -1e9], [[1.0, 2.0]], ["x"], {}, {"x": 1}, {"from": "q"}, [{}], "../x",
)  # fmt: skip


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the path of every value of a document."""
    if path:
        yield path
    if isinstance(value, dict | list):
        pairs = value.items() if isinstance(value, dict) else enumerate(value)
        for key, one in pairs:
            yield from places(one, (*path, key))


def alter(document: dict[str, Any], rng: random.Random) -> None:
    """Alter one value, or leave it out, or put it twice."""
    path = rng.choice(list(places(document)))
    holder: Any = document
    for step in path[:-1]:
        holder = holder[step]
    key, value = path[-1], holder[path[-1]]
    kind = rng.randrange(12)
    if kind == 0:
        del holder[key]
    elif kind == 1 and isinstance(holder, list):
        holder.insert(key, value)
    elif kind == 1:
        holder[rng.choice(("unknown", f"{key}_", ""))] = value
    elif kind < 8 and isinstance(value, int | float) and value not in (True, False, LONG):
        holder[key] = value * rng.choice(FACTORS)
    elif kind == 8:
        others = list(places(document))
        other: Any = document
        for step in rng.choice(others):
            other = other[step]
        holder[key] = json.loads(json.dumps(other)) if len(json.dumps(other)) < 3000 else 0
    else:
        holder[key] = copy.deepcopy(rng.choice(ODD))


def toml(value: Any) -> str:
    """Return any value as TOML writes it."""
    if isinstance(value, dict):
        inner = ", ".join(f"{json.dumps(str(k))} = {toml(v)}" for k, v in value.items())
        return "{" + inner + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int) and abs(value) > 1 << 70:
        return "1" + "0" * 400
    return json.dumps(value) if isinstance(value, str) else repr(value)


def damaged(text: bytes, rng: random.Random) -> bytes:
    """Return a text with bytes, lines or its end altered."""
    kind = rng.randrange(6)
    at = rng.randrange(len(text))
    lines = text.split(b"\n")
    if kind == 0:
        return text[:at] + bytes([rng.randrange(256)]) + text[at + 1 :]
    if kind == 1:
        return text[:at]
    if kind == 2:
        return text[:at] + text[at : at + rng.randrange(60)] * rng.choice((2, 3, 500)) + text[at:]
    line = rng.randrange(len(lines))
    if kind == 3:
        del lines[line]
    elif kind == 4:
        lines.insert(rng.randrange(len(lines)), lines[line])
    else:
        odd = (b"1e400", b"-1", b"9" * 5000, b"[" * 3000, b"{a=" * 400, b"nan", b"'''", b"\x00")
        lines[line] += rng.choice(odd)
    return b"\n".join(lines)


def mutated(texts: list[bytes], rng: random.Random) -> bytes:
    """Return one of some files, altered one to three times."""
    text = rng.choice(texts)
    if rng.random() < 0.25:
        return damaged(text, rng)
    try:
        document = tomllib.loads(text.decode())
    except ValueError:
        return damaged(text, rng)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        if document:
            alter(document, rng)
    return "\n".join(f"{json.dumps(k)} = {toml(v)}" for k, v in document.items()).encode()


# ------------------------------------------------------------------- what is done with a file


def finite(*values: Any) -> None:
    """Raise where an answer is not finite."""
    import numpy as np

    for value in values:
        if not np.all(np.isfinite(np.asarray(value, dtype=np.float64))):
            raise ArithmeticError(f"an answer is not finite: {value}")


def use_aircraft(path: Path, rng: random.Random) -> None:
    """As `identify`, `convert` and `simulate` do."""
    from host.aircraft import linear_aircraft
    from host.aircraft.mass_properties import airframe_data
    from host.aircraft.powerplant import powerplant
    from host.aircraft.trim import solve
    from host.instrument.deviations import sensor_error_model
    from host.sysid.conversion import FlightCondition, conversion_document, convert

    plane = None
    with contextlib.suppress(HostError):
        plane = linear_aircraft.load(path)
    if plane is not None:
        assert all(len(one) < 500 for one in plane.doubts)
        frame = plane.airframe()
        if rng.random() < 0.1:
            with contextlib.suppress(HostError):
                finite(solve(frame, plane.scalar("trim.airspeed_mps")).command)
    airframe_data(str(path))
    sensor_error_model(str(path))
    Path("prior.toml").write_text("[coefficients]\nCm_q = -10.0\nCL_alpha = 5.0\n")
    done = convert(Path("prior.toml"), str(path), FlightCondition())
    finite(done.found.values, *(done.half_width(n) for n in done.found.names[:2]))
    json.dumps(conversion_document(done))
    import numpy as np

    one = np.ones(3)
    engine = powerplant(str(path))
    finite(engine.run(0.5 * one, 10.0 * one, 1.2 * one, 0.01)[0])


def use_calibration(path: Path, rng: random.Random) -> None:
    """As `decode` does."""
    import numpy as np
    from host.instrument.instrument_errors import instrument_errors
    from host.log import read_log
    from host.physical.calibration import load_calibration

    del rng
    for error in instrument_errors(calibration=load_calibration(path)):
        finite(error.sigmas)
    columns = read_log(Path("flight.bin"), calibration=path).columns()
    assert not any(np.isinf(np.asarray(v, dtype=np.float64)).any() for v in columns.values())


def use_map(path: Path, rng: random.Random) -> None:
    """As `maneuvers` does."""
    from host.sysid.flight import read_columns

    del rng
    columns, _ = read_columns(Path("foreign.csv"), path)
    finite(*columns.values())


def use_model(path: Path, rng: random.Random) -> None:
    """As `identify --model` and `simulate --aircraft` do."""
    from host.planning.identified_aircraft import is_model
    from host.sysid.coefficients import CoefficientModel
    from host.sysid.conversion import FlightCondition, convert
    from host.sysid.models import read_model
    from host.sysid.models.model_file import read_trim

    del rng
    is_model(path)
    model = read_model(path, of_coefficients=True)
    if isinstance(model, CoefficientModel):
        list(model.named())
        return
    for matrix in model.matrices(model.start):
        finite(matrix)
    with contextlib.suppress(HostError):
        finite(convert(path, "ultrastick25e", FlightCondition()).found.values)
    trim = read_trim(path)
    finite(trim.airspeed_mps, trim.alpha_rad, trim.theta_rad)


def use_prior(path: Path, rng: random.Random) -> None:
    """As `identify --prior` and `convert` do."""
    from host.aircraft.prior.prior_file import read_prior
    from host.sysid.conversion import FlightCondition, conversion_document, convert

    del rng
    with contextlib.suppress(HostError):
        finite(*read_prior(path, 17.0).at(0.05).values())
    done = convert(path, "ultrastick25e", FlightCondition())
    finite(done.found.values)
    json.dumps(conversion_document(done))


def use_card(path: Path, rng: random.Random) -> None:
    """As `plan` and `simulate` do before they fly."""
    from host.twin.faults import recorder_actions
    from host.twin.testcard import cards

    del rng
    card = cards.load(path)
    finite(cards.duration_s(card))
    assert cards.duration_s(card) <= 5 * 3600.0
    recorder_actions(card.faults)


KINDS: dict[str, tuple[str, Callable[[Path, random.Random], None]]] = {
    "aircraft": (".toml", use_aircraft),
    "calibration": (".toml", use_calibration),
    "map": (".toml", use_map),
    "model": (".toml", use_model),
    "prior": (".toml", use_prior),
    "card": (".toml", use_card),
}

MAP = b"""[columns]
t_s = { from = "TimeUS", unit = "us" }
alpha_rad = { from = "AOA", unit = "deg", sign = -1 }
az_mps2 = { from = "Nz", unit = "g", scale = 1.02, offset = 0.1 }
q_radps = "q"
elevator_rad = { from = "de", unit = "deg" }
"""
MODEL = b"""name = "short-period"
states = ["alpha_rad", "q_radps"]
inputs = ["elevator_rad"]
outputs = ["alpha_rad", "q_radps", "az_mps2"]
hold = "foh"
state_biases = ["alpha_rad", "q_radps"]
output_biases = ["az_mps2"]
initial_states = ["alpha_rad", "q_radps"]
A = [["Z_alpha", 1.0], ["M_alpha", "M_q"]]
B = [["Z_de"], ["M_de"]]
C = [[1, 0], [0, 1], ["17.0*Z_alpha", 0]]
D = [[0], [0], ["17.0*Z_de"]]
[parameters]
Z_alpha = { start = -5.0, lower = -50.0, upper = 0.0 }
M_q = { start = -5.0, prior_sd = 2.0 }
[[delays]]
name = "delay_vanes_s"
outputs = ["alpha_rad"]
limit_s = 0.1
[[levers]]
output = "az_mps2"
state = "q_radps"
parameter = "imu_x_m"
gain = -1.0
[trim]
airspeed_mps = 17.0
alpha_rad = 0.05
theta_rad = 0.05
"""
ERROR = b"""
[error.thrust_share]
sigma = 0.05
drawn = "flight"
source = "static thrust on a scale"
"""
PRIOR = b"""alpha_deg = [-2.0, 2.0, 6.0]
[coefficients]
CL_alpha = [4.6, 4.7, 4.5]
Cm_q = -10.0
Cl_p = -0.4
Cn_r = [-0.09, -0.1, -0.12]
"""
DERIVATIVES = b"[derivatives]\nM_q = [-5.0, 0.3]\nZ_alpha = -6.0\nL_p = [-12.0, 1.0]\n"


def sources(kind: str) -> list[bytes]:
    """Return good files of a kind, and write what goes with them into the working folder."""
    package = ROOT / "host/src/host"
    if kind == "aircraft":
        found = [p.read_bytes() for p in sorted((package / "aircraft/airframes").glob("*.toml"))]
        measured = tomllib.loads(found[0].decode())
        measured["kind"] = "measured"
        for name in ("aerodynamics", "servo", "surfaces"):
            del measured[name]
        return [*found, "\n".join(f"{k} = {toml(v)}" for k, v in measured.items()).encode()]
    if kind == "calibration":
        Path("flight.bin").write_bytes(written(*flight(0.5)))
        default = (ROOT / "hw/calibration/default.toml").read_bytes()
        own = default.replace(b"default = true", b"default = false") + ERROR
        return [default, own]
    if kind == "map":
        rows = "".join(f"{20000 * k},{k % 7},-1.0{k % 3},0.{k % 9},1\n" for k in range(60))
        Path("foreign.csv").write_text(f"TimeUS,AOA,Nz,q,de\n{rows}")
        return [MAP]
    if kind == "model":
        return [MODEL, (package / "sysid/models/standard_coefficients.toml").read_bytes()]
    if kind == "prior":
        return [PRIOR, DERIVATIVES]
    return [p.read_bytes() for p in sorted((package / "twin/testcard/cards").glob("*.toml"))]


def judged(kind: str, count: int, seed: int) -> tuple[Counter[str], dict[str, tuple[str, bytes]]]:
    """Alter files of a kind and use them.

    Returns
    -------
    Counter, dict
        How many were used, how many refused, how many ended in each other error; of each other
        error its text and an example.
    """
    rng = random.Random(f"{kind} {seed}")
    ending, use = KINDS[kind]
    ends: Counter[str] = Counter()
    examples: dict[str, tuple[str, bytes]] = {}
    good = sources(kind)
    for _ in range(count):
        text = mutated(good, rng)
        path = Path(f"altered{ending}")
        path.write_bytes(text)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                use(path, rng)
            ends["used"] += 1
        except HostError as error:
            ends["refused"] += 1
            assert str(error)
        except Exception as error:
            where = error.__traceback__
            while where is not None and where.tb_next is not None:
                where = where.tb_next
            name = Path(where.tb_frame.f_code.co_filename).name if where else ""
            label = f"{type(error).__name__} in {name}:{where.tb_lineno if where else 0}"
            ends[label] += 1
            examples.setdefault(label, (str(error)[:300], text))
    return ends, examples


def main() -> int:
    """Judge one kind and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=[*KINDS, "all"])
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    bad = 0
    kinds = KINDS if options.kind == "all" else [options.kind]
    folder = tempfile.mkdtemp()
    os.chdir(folder)
    try:
        for kind in kinds:
            ends, examples = judged(kind, options.count, options.seed)
            print(f"{kind}: {', '.join(f'{n} {what}' for what, n in ends.most_common())}")
            for label, (words, text) in examples.items():
                bad += 1
                saved = ROOT / "build" / f"altered-{kind}-{bad}.toml"
                saved.parent.mkdir(exist_ok=True)
                saved.write_bytes(text)
                print(f"  {label}: {words}\n    {saved}")
            sys.stdout.flush()
    finally:
        os.chdir(ROOT)
        shutil.rmtree(folder)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
