"""What the logger learns by itself, as `host live` tells it: a committed log of the recorder."""

import json
from pathlib import Path

import numpy as np
import pytest
from host.cli import main
from host.live.flight_state import FlightState
from host.live.live_stream import LiveStream
from host.live.logger_learning import LoggerLearning
from host.log import read_log
from host.physical.calibration import load_calibration

from tests.host.live.radio import joined, sent
from tests.protocol.log_writer import envelope, number, rows

DATA = Path(__file__).resolve().parents[2] / "data"
LEARNED = DATA / "format-1-learned.bin"
SECOND_US = 1_000_000


def learned(t_us: int, name: str, **values: int) -> bytes:
    """Return a derivative as the radio carries it."""
    fields = {"t_us": np.array([t_us], np.uint32), "derivative": number("derivative", name)}
    return envelope(rows("learned", 1, **fields, **values).tobytes())


def event(name: str, t_us: int, arg: int) -> bytes:
    at = np.array([t_us], np.uint32)
    return envelope(rows("event", 1, t_us=at, code=number("event", name), arg=arg).tobytes())


def watched() -> tuple[LiveStream, LoggerLearning, list[str]]:
    told: list[str] = []
    stream = LiveStream(load_calibration())
    stream.feed(joined(sent(4.0)), 0.0)
    return stream, LoggerLearning(stream, told.append, lambda: 0.0), told


def test_a_recorders_own_stream_on_the_terminal_and_as_json_lines(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["live", f"{LEARNED}@max", "--no-page", "--json"]) == 0
    out, err = capsys.readouterr()
    said = [json.loads(line) for line in out.splitlines()]
    lines = [one for one in said if one["type"] == "learned"]
    logged = read_log(LEARNED).frames["learned"]
    assert [one["name"] for one in lines] == ["Cm_alpha", "Cm_q", "Cm_de"]
    for one, frame in zip(lines, logged, strict=True):
        assert one["value"] == pytest.approx(1e-6 * float(frame["estimate"]))
        assert one["half_width"] == pytest.approx(1e-6 * float(frame["half_width"]))
        assert (one["axis"], one["row"], one["after_s"]) == ("pitch", 1, 2.0)
        assert one["ground"] is None
    assert said[-1]["logger"]["card"]
    line = next(one for one in err.splitlines() if "the logger" in one)
    assert line.endswith(
        "row 1, 2.0 s: Cm_alpha -0.2002 +- 0.26, Cm_q -1.227 +- 4.2, Cm_de 0.1082 +- 0.12"
    )


def test_a_logger_without_a_card_tells_nothing() -> None:
    _, watch, told = watched()
    assert watch.as_json() == {"card": False, "age_s": None, "rows": []}
    watch.close()
    assert told == []


def test_one_line_a_solve_with_the_grounds_figure_beside() -> None:
    stream, watch, told = watched()
    watch.ground = {"Cn_beta": (0.06, 0.01)}.get
    shown: list[dict[str, object]] = []
    watch.show = shown.append
    for at_us, half in ((5 * SECOND_US, 0), (6 * SECOND_US, 4000)):
        samples = at_us // 20_000
        given = {"samples": samples, "row": 2, "estimate": 58_000, "half_width": half}
        stream.feed(learned(at_us, "cn_beta", enough=half > 0, **given), 0.0)
        stream.feed(learned(at_us, "cn_r", **(given | {"estimate": -70_000})), 0.0)
    assert told == ["the logger, row 3, 5.0 s: Cn_beta not estimated, Cn_r not estimated"]
    watch.close()
    assert told[1] == (
        "the logger, row 3, 6.0 s: Cn_beta 0.058 +- 0.004 (here 0.06 +- 0.01) enough,"
        " Cn_r -0.07 +- 0.004"
    )
    assert [one["name"] for one in shown] == ["Cn_beta", "Cn_r"] * 2
    said = watch.as_json()
    assert said["age_s"] == 0.0
    beta, r = said["rows"]
    assert (beta["axis"], beta["percent"], beta["enough"]) == ("yaw", 6.9, True)
    assert beta["ground"] == {"value": 0.06, "half_width": 0.01}
    assert r["ground"] is None


def test_what_the_logger_moves_is_no_jump_of_a_servo() -> None:
    """A row's fastest sine leaves and is back within 0.15 s; the same behind its end is a jump."""

    def jumps(end_row: int) -> tuple[dict[str, int], list[str]]:
        stream = LiveStream(load_calibration())
        state = FlightState(stream)
        parts = sent(4.0)
        stream.feed(joined(parts), 0.0)
        last_us = parts[-1].t_us
        at = np.arange(40)
        ident = rows("ident", 40, t_us=(last_us + 50_000 * (at + 1)).astype(np.uint32))
        ident["valid"] = 0xFFFF
        ident["rc_elevator"] = ident["servo_elevator"] = 3000
        ident["servo_elevator"][20] += 100
        for row, one in enumerate(ident):
            if row == 0:
                stream.feed(event("input_start", last_us, 1), 0.0)
            if row == end_row:
                arg = 1 + 256 * number("input_end", "stick")
                stream.feed(event("input_end", int(one["t_us"]), arg), 0.0)
            stream.feed(envelope(one.tobytes()), 0.0)
        return state.servos.jumps, [event["text"] for event in state.events]

    flown, events = jumps(30)
    assert flown["elevator"] == 0
    assert events[-2:] == ["row 2 begins", "row 2 ends: stick"]
    assert jumps(10)[0]["elevator"] == 1
