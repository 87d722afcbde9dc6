"""What an answer leaves behind: whole files where asked, one line where that cannot be."""

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.cli import main
from host.errors import IdentificationError, UsageError
from host.export.atomic_files import atomic_write
from host.export.mat_writer import mat_name
from host.sysid.answer import OutputPaths, check_outputs
from host.sysid.answer.mat_file import labels, write_answers
from host.sysid.answer.simulator_forms import write_form
from host.sysid.flight import read_columns
from host.sysid.linear import Answer
from scipy import io

from tests.host.short_period_table import short_period_table
from tests.host.sysid.at_hand import identify


@pytest.fixture(scope="module")
def flight(simulated: Callable[[str, int], Path]) -> Path:
    return simulated("calm", 4) / "flight.csv"


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A table of four columns, for what is asked of any flight."""
    return short_period_table(tmp_path_factory.mktemp("small"))


@pytest.fixture(scope="module")
def answers(flight: Path) -> list[Answer]:
    columns, _ = read_columns(flight)
    return identify(columns, names=("short-period",), method="equation-error")


def test_python_control_has_the_models(answers: list[Answer], tmp_path: Path) -> None:
    """The file runs; its transfer functions at 50 frequencies are those of the estimates."""
    path = tmp_path / "mine.control.py"
    assert write_form(path, [], answers, None, None) == [path]
    text = path.read_text(encoding="utf-8")
    assert "#   M_q " in text
    assert "trailing edge down" in text
    space: dict[str, object] = {}
    exec(compile(text, str(path), "exec"), space)
    system = space["short_period"]
    model, estimate = answers[0].model, answers[0].result.estimate
    A, B, C, D = model.matrices(estimate)
    assert list(system.state_labels) == list(model.states)  # type: ignore[attr-defined]
    for s in 1j * np.logspace(-1, 2, 50):
        ours = C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D
        theirs = np.asarray(system(s, squeeze=False))  # type: ignore[operator]
        assert np.max(np.abs(theirs - ours)) < 1e-8 * np.max(np.abs(ours))
    with pytest.raises(IdentificationError, match="python-control takes linear models"):
        write_form(path, [], [], None, None)


Line = Callable[[], str]


@pytest.fixture
def line(capsys: pytest.CaptureFixture[str]) -> Line:
    """Give the single line of stderr."""

    def read() -> str:
        said = capsys.readouterr().err.strip()
        assert said.count("\n") == 0
        return said

    return read


QUICK = ("--model", "short-period", "--method", "equation-error")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--plots", "FILE"], "--plots FILE: a file; name a folder"),
        (["--plots", "FILE/in"], "no folder can be in it"),
        (["--mat", "FOLDER.mat"], "a folder; name a file in it"),
        (["--mat", "FILE"], "expected .mat"),
        (["--save-model", "x.txt"], "expected .toml or .mat or .xml"),
        (["--save-model", "x.xml"], "give --aircraft"),
        (["--save-aircraft", "x.toml"], "give --aircraft"),
        (
            ["--save-aircraft", "x.mat", "--aircraft", "ultrastick25e"],
            "--save-aircraft x.mat: ends in '.mat', expected .toml or .xml",
        ),
        (["--mat", "x.mat", "--save-model", "x.mat"], "--mat and --save-model both name x.mat"),
    ],
)
def test_a_place_that_is_none_is_refused_before_the_flight_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: Line, options: list[str], words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("FILE").write_text("x")
    Path("FOLDER.mat").mkdir()
    Path("none.csv").write_text("no table")  # the place is looked at first
    assert main(["identify", "none.csv", *options]) == 2
    assert words in line()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["FILE", "FOLDER.mat", "none.csv"]


def test_an_output_does_not_replace_what_it_is_made_from(
    tmp_path: Path, flight: Path, line: Line
) -> None:
    own = tmp_path / "own.mat"
    own.write_bytes(flight.read_bytes())
    assert main(["identify", str(own), "--mat", str(own)]) == 2
    assert "is what the answer is made from" in line()
    assert own.read_bytes() == flight.read_bytes()
    model = tmp_path / "mine.toml"
    model.write_text("# mine\n")
    with pytest.raises(IdentificationError, match=r"argument save_model .* made from"):
        same = tmp_path / "../" / tmp_path.name / "mine.toml"
        check_outputs(OutputPaths(save_model=same, given=(flight, model)))


def test_models_named_after_the_first_replace_no_source(
    tmp_path: Path, small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "plane_short-period_recursive.toml"
    source.write_text("[coefficients]\nCm_alpha = -1.6\n")
    model = tmp_path / "plane.toml"
    prior = ("--aircraft", "ultrastick25e", "--prior", str(source))
    both = ("--method", "recursive", *prior, "--save-model", str(model))
    assert main(["identify", str(small), *QUICK, *both]) == 2
    assert f"would replace {source}" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [source]
    assert source.read_text().startswith("[coefficients]")


def test_a_file_in_a_folder_that_takes_none_is_refused_before_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "model.toml"
    path.write_text("before")
    monkeypatch.setattr(os, "access", lambda place, _: Path(place) != tmp_path)
    with pytest.raises(UsageError, match=f"no permission to write to {tmp_path}$"):
        check_outputs(OutputPaths(save_model=path))


def test_without_room_the_answer_is_said_and_nothing_is_left(
    tmp_path: Path,
    small: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    target = tmp_path / "new" / "model.toml"

    def full(_self: Path, text: str, **_: object) -> int:
        with _self.open("w") as file:
            file.write(text[:40])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    assert main(["identify", str(small), *QUICK, "--save-model", str(target)]) == 2
    said = capsys.readouterr()
    assert said.err == (
        f"host: {target}: cannot be written: No space left on device; make room or name another"
        " place\n"
    )
    assert "M_alpha" in said.out
    assert list(target.parent.iterdir()) == []


def test_several_methods_of_one_model_are_several_files(
    tmp_path: Path, small: Path, line: Line
) -> None:
    methods = ["--method", "equation-error", "--method", "output-error"]
    model, mat = tmp_path / "m.toml", tmp_path / "m.mat"
    places = ["--save-model", str(model), "--mat", str(mat)]
    assert main(["identify", str(small), "--model", "short-period", *methods, *places]) == 0
    second = tmp_path / "m_short-period_output-error.toml"
    assert line() == f"wrote {mat}, {model}, {second}"
    assert 'method = "equation' in model.read_text()
    assert 'method = "output' in second.read_text()
    names = [n for n in io.loadmat(mat) if not n.startswith("__")]
    assert names == ["short_period_equation_error", "short_period_output_error"]


def test_a_mat_file_holds_what_is_printed_and_the_histories(
    tmp_path: Path, answers: list[Answer]
) -> None:
    path = tmp_path / "a.mat"
    write_answers(path, answers, None)
    loaded = io.loadmat(path, simplify_cells=True)["short_period"]
    answer = answers[0]
    result = answer.result
    np.testing.assert_array_equal(loaded["A"], result.matrices()[0])
    units = dict(zip(loaded["names"], loaded["units"], strict=True))
    assert (units["Z_alpha"], units["M_alpha"], units["M_q"]) == ("1/s", "1/s2", "1/s")
    poles = np.linalg.eigvals(loaded["A"])
    wanted = loaded["modes"]["frequency_radps"]
    np.testing.assert_allclose(np.unique(np.abs(poles).round(9)), np.unique(np.round(wanted, 9)))
    first = loaded["maneuvers"] if isinstance(loaded["maneuvers"], dict) else loaded["maneuvers"][0]
    np.testing.assert_allclose(first["measured"], answer.maneuvers[0].outputs)
    np.testing.assert_allclose(first["t_s"], answer.maneuvers[0].time_s)
    np.testing.assert_allclose(first["simulated"], answer.simulated[0])


def test_names_are_those_of_variables(answers: list[Answer]) -> None:
    assert mat_name("short-period with tail lag", ()) == "short_period_with_tail_lag"
    assert mat_name("2-state Nick-Modell ä", ()) == "model_2_state_Nick_Modell__"
    long = mat_name("x" * 80, ("x" * 31,))
    assert len(long) == 31
    assert long.endswith("_2")
    twice = [answers[0], replace(answers[0]), replace(answers[0], template="other")]
    assert labels(twice) == [
        "short-period_equation-error",
        "short-period_equation-error_2",
        "other",
    ]


def test_interrupted_writing_leaves_the_file_that_was_there(tmp_path: Path) -> None:
    path = tmp_path / "a.svg"
    path.write_text("before")
    with pytest.raises(KeyboardInterrupt), atomic_write(path) as part:
        part.write_text("half")
        raise KeyboardInterrupt
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_called_part_is_left_alone(tmp_path: Path) -> None:
    own = tmp_path / "model.part.toml"
    own.write_text("mine")
    with atomic_write(tmp_path / "model.toml") as part:
        part.write_text("x")
    assert own.read_text() == "mine"


def test_a_device_is_written_to_as_it_is(answers: list[Answer]) -> None:
    with atomic_write(Path(os.devnull)) as part:
        assert part == Path(os.devnull)
    with (
        pytest.raises(UsageError, match="No space left"),
        atomic_write(Path("/dev/full")) as part,
    ):
        part.write_text("x")
    assert Path("/dev/full").exists()


def test_json_has_one_document_and_no_nan(
    flight: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(token: str) -> None:
        raise AssertionError(token)

    prior = tmp_path / "prior.toml"
    prior.write_text("[coefficients]\nCm_alpha = -1.6\n")
    beside = ["--aircraft", "ultrastick25e", "--truth", str(flight.with_name("flight.truth.toml"))]
    assert main(["identify", str(flight), *QUICK, *beside, "--prior", str(prior), "--json"]) == 0
    document = json.loads(capsys.readouterr().out, parse_constant=refuse)
    assert document["answers"][0]["parameters"]["M_alpha"]["unit"] == "1/s2"
    (truth,) = document["truth"].values()
    assert truth["Cm_alpha"].keys() >= {
        "value",
        "half_width",
        "truth",
        "relative_error",
        "inside",
    }
    (expected,) = document["prior"].values()
    assert expected["Cm_alpha"]["prior"] == -1.6


def test_methods_are_listed_without_a_flight(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["identify", "--method", "list"]) == 0
    assert "output-error-white" in capsys.readouterr().out
    assert main(["identify"]) == 4
    assert "no flight log in this folder" in capsys.readouterr().err
