"""The tolerance of the comparison."""

import pytest

from tests.answers.comparison import DEFAULT


def pytest_addoption(parser: pytest.Parser) -> None:
    """Take a share of the 95 % half-width: 1e-9 on the machine that froze the answers."""
    parser.addoption("--tolerance", type=float, default=DEFAULT, help="share of the half-width")
