"""A short, seeded run of the fuzz target; longer ones by hand."""

from tests.protocol import fuzz_decode


def test_forty_seeds() -> None:
    assert fuzz_decode.main(["--seed", "1000", "--count", "40"]) == 0
