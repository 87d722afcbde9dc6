"""Every warning of the list is said, by its key words in one sentence, item or row of its page."""

from __future__ import annotations

import csv
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LIST = Path(__file__).with_name("warnings.tsv")
EMPHASIS = str.maketrans("", "", "*`")
ITEM = re.compile(r"\s*(?:[-|#]|\d+\. )")


def blocks_of(text: str) -> list[str]:
    """Return paragraphs, items and rows of a page, in one line each, without emphasis."""
    blocks, open_block = [""], False
    for line in text.replace("\n>", "\n").split("\n"):
        if not line.strip() or ITEM.match(line) or not open_block:
            blocks.append("")
        blocks[-1] += " " + line
        open_block = bool(line.strip())
    return [re.sub(r"\s+", " ", block.translate(EMPHASIS)) for block in blocks]


def is_said(keys: str, text: str) -> bool:
    """Tell whether one block has all keys, whatever their order and case."""
    wanted = [key.strip().lower() for key in keys.split(" + ")]
    return any(all(key in block.lower() for key in wanted) for block in blocks_of(text))


def read_list() -> list[dict[str, str]]:
    """Read the rows: page, keys, warning."""
    with LIST.open(encoding="utf-8") as file:
        return list(csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE))


def test_every_warning_is_said_on_its_page() -> None:
    rows = read_list()
    assert len(rows) > 200
    texts = {row["page"]: (ROOT / row["page"]).read_text(encoding="utf-8") for row in rows}
    lost = [(r["page"], r["warning"]) for r in rows if not is_said(r["keys"], texts[r["page"]])]
    assert lost == []


def test_a_warning_that_is_gone_is_seen() -> None:
    page = "# Relay\n\n**Propeller off**\nuntil the end.\n\n| a | no level | holds it |\n- b\n- c"
    assert is_said("propeller off + until", page)
    assert is_said("no level + holds", page)
    assert not is_said("propeller off + holds", page)
    assert not is_said("b + c", page)
