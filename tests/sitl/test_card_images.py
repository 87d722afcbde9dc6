"""A selection of `make card-images`, and that its judge can say no."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from host.twin.recorder.sitl_library import Sitl

from tests.cards.drawn import ALTERATIONS, DrawnCard, draw, good_card
from tests.cards.judge import Stage, judge, unreadable, untrue
from tests.cards.sparse import END, SparseCard
from tests.cards.tally import LEAST_FOUND, LEAST_MOUNTED, Tally
from tests.cards.truth import look_at
from tests.sitl.card_flight import fly
from tests.sitl.card_images import Kept, build_sanitized, fly_all

CARDS = 50
NONE = np.zeros(0, np.int64)


@pytest.mark.costs(60, "compiles the recorder under sanitizers, once for all below")
def test_cards_drawn_at_random(capsys: pytest.CaptureFixture[str]) -> None:
    """Under sanitizers; other seeds than those of the campaign."""
    tally = Tally()
    for result in fly_all(1_000_001, CARDS, build_sanitized()):
        tally.show(result)
    assert [(result.seed, result.judgement.wrong) for result in tally.wrong] == []
    assert tally.stages.total() == CARDS
    assert tally.reached(Stage.MOUNTED) >= LEAST_MOUNTED
    assert tally.reached(Stage.FOUND) >= LEAST_FOUND


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(379, id="the table calls the root folder's cluster free"),
        pytest.param(2463, id="the same behind noise"),
        pytest.param(1210, id="a damaged FAT32 with the numbers of a FAT16"),
        pytest.param(1_000_135, id="full, and searched again every two seconds"),
    ],
)
def test_a_card_that_was_wrong_once(seed: int) -> None:
    card = draw(seed).card
    assert fly(Sitl(), card).wrong == []
    card.close()


def test_a_campaign_that_was_stopped_goes_on(tmp_path: Path) -> None:
    library, path = build_sanitized(), tmp_path / "cards"
    first = list(Kept(path, library).fly_all(1_000_001, 3, library))
    assert len(path.read_text().splitlines()) == 3
    assert list(Kept(path, library).fly_all(1_000_001, 5, library))[:3] == first
    assert len(path.read_text().splitlines()) == 5
    other = tmp_path / "libsitl.so"
    other.write_bytes(library.read_bytes() + b"\0")
    assert len(list(Kept(path, other).fly_all(1_000_001, 2, library))) == 2
    assert len(path.read_text().splitlines()) == 7  # another image: nothing of these counts


def test_a_good_card_of_every_kind_records() -> None:
    for seed in range(20):
        drawn = good_card(np.random.default_rng(seed))
        judgement = fly(Sitl(), drawn.card)
        assert (judgement.wrong, judgement.stage) == ([], Stage.RECORDING), seed
        drawn.card.close()


def test_every_alteration_is_drawn_and_the_same_seed_gives_the_same_card() -> None:
    found = set()
    for seed in range(250):
        drawn = draw(seed)
        found |= {text.partition(":")[0] for text in drawn.altered}
        if seed % 50 == 0:
            assert draw(seed).card.content() == drawn.card.content()
        drawn.card.close()
    wanted = {alter.__name__.replace("_", " ") for group in ALTERATIONS for alter in group}
    assert found == wanted


def test_a_folder_without_an_end_is_filled_once_more() -> None:
    """Two alterations that both fill it."""
    drawn = draw(6368)
    assert [text.partition(":")[0] for text in drawn.altered].count("noise in the folder") > 1
    drawn.card.close()


def test_a_message_that_is_not_true_is_noticed() -> None:
    card = SparseCard(8)
    empty = look_at(card)
    for message in ("not FAT32", "full", "fragmented", "unreadable", "missing", "damaged", ""):
        assert untrue(message, empty) != [], message
    card.set_fat(0, np.full(card.clusters + 2, END, np.uint32))
    assert untrue("full", look_at(card)) == []
    card.write(0, bytes(512))
    assert untrue("not FAT32", look_at(card)) == []
    assert untrue("full", look_at(card)) != []


def test_a_write_into_another_file_is_noticed() -> None:
    drawn = DrawnCard(SparseCard(8), np.random.default_rng(1))
    card = drawn.card
    card.add_entry("PHOTO.JPG", 100, 40_000)
    card.chain(100, 10)
    before = look_at(card)
    free, photo = card.lba(200), card.lba(105)
    for block, wrong in ((free, 0), (photo, 1), (card.fat_lba, 0), (card.first + 1, 0), (0, 1)):
        seen = judge("ready 1", before, card, np.array([block]), recording=False).wrong
        assert len([text for text in seen if text.startswith("wrote")]) == wrong, block


def test_a_flight_that_a_computer_cannot_read_is_noticed() -> None:
    card = SparseCard(8)
    assert unreadable(card) == ["records, and there is no flight in the root folder"]
    card.add_entry("FLT00001.BIN", 50, 10 * 4096)
    card.chain(50, 9)
    assert "not one run" in unreadable(card)[0]
    card.chain(50, 10)
    assert unreadable(card)[0].startswith("0 blocks of flight 1")
