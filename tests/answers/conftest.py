"""The tolerance of the comparison, and one thread of linear algebra before numpy is loaded."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest

from tests.answers.comparison import DEFAULT


def pytest_addoption(parser: pytest.Parser) -> None:
    """Take a share of the 95 % half-width: 1e-9 on the machine that froze the answers."""
    parser.addoption("--tolerance", type=float, default=DEFAULT, help="share of the half-width")
