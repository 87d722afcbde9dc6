"""Loops of these tests run as machine code."""

from collections.abc import Iterator

import pytest

from host import compiled


@pytest.fixture(autouse=True, scope="module")
def machine_code() -> Iterator[None]:
    """Run loops as the studies do, for many fits: four fifths of the time.

    tests/answers runs them as a user's one flight does, and `sysid/test_kernels_ready.py` compares.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compiled, "_preferred", True)
        yield


@pytest.fixture
def loops_as_a_user_has_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run few loops as Python and numpy: no program asked for machine code."""
    monkeypatch.setattr(compiled, "_preferred", False)
