"""One way of running loops."""

from collections.abc import Iterator

import pytest

from host import compiled


@pytest.fixture(autouse=True)
def loops_as_a_user_has_them() -> Iterator[None]:
    """Forget behind each test that a program asked for machine code, as the studies do."""
    yield
    compiled._preferred = False


@pytest.fixture
def machine_code() -> None:
    """Run loops as the studies do, for tests of many fits: a third to a half of the time."""
    compiled.prefer_machine_code()
