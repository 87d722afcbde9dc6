"""A short seeded run of every target, and proof that a fault in one is found."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz import targets


@pytest.mark.parametrize("name", sorted(targets.TARGETS))
def test_seeded_run_breaks_no_rule(name: str, tmp_path: Path) -> None:
    program = targets.build(name)
    known = targets.unpack(name, tmp_path)
    assert known >= 5
    code, said = targets.fuzz(program, name, tmp_path, runs=known + 1000, seed=1)
    assert code == 0, said


@pytest.mark.parametrize(
    ("flags", "told"), [((), "not so: !found"), (("-DPLANTED_READ",), "heap-buffer-overflow")]
)
def test_a_planted_fault_is_found_from_a_corpus_that_lacks_it(
    flags: tuple[str, ...], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(targets, "SOURCES", Path(__file__).resolve().parent)
    monkeypatch.setattr(targets, "OUT", tmp_path)
    monkeypatch.setitem(targets.TARGETS, "planted", targets.Target((), 8))
    program = targets.build("planted", extra_flags=flags)
    corpus = tmp_path / "corpus"
    corpus.mkdir()
    (corpus / "one").write_bytes(b"ba")
    code, said = targets.fuzz(program, "planted", corpus, runs=200_000, seed=1)
    assert code == targets.BROKEN
    assert list((tmp_path / "failures").glob("planted-crash-*"))
    assert told in said


def test_committed_inputs_survive_packing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in targets.TARGETS:
        committed = (targets.CORPORA / f"{name}.txt").read_text(encoding="ascii")
        assert len(committed) < 200_000, f"{name}: merge its corpus"
        folder = tmp_path / name
        count = targets.unpack(name, folder)
        with monkeypatch.context() as patch:
            patch.setattr(targets, "CORPORA", tmp_path / "packed")
            assert targets.pack(name, folder) == count
        assert (tmp_path / "packed" / f"{name}.txt").read_text(encoding="ascii") == committed
