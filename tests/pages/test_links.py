"""Every link of a page leads to a file of this tree, every folder that a page names is there."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
CODE = re.compile(r"```.*?```", re.DOTALL)


def pages(root: Path) -> list[Path]:
    """Pages that git knows or would take."""
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard", "*.md"],
        cwd=root,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    return [root / name for name in sorted(set(listed.split("\n"))) if (root / name).is_file()]


def dead_links(page: Path) -> Iterator[str]:
    """Links of a page that lead nowhere."""
    for target in LINK.findall(CODE.sub("", page.read_text(encoding="utf-8"))):
        if re.match(r"[a-z]+:", target):
            continue
        place = target.split("#")[0]
        if place and not (page.parent / place).exists():
            yield f"{page.name}: {target}"


def test_links_lead_somewhere() -> None:
    found = pages(ROOT)
    assert len(found) > 40
    assert [dead for page in found for dead in dead_links(page)] == []


def test_dead_link_is_seen(tmp_path: Path) -> None:
    page = tmp_path / "README.md"
    page.write_text(
        "[a](there.md) ![b](gone.svg) [c](https://host/x) `[d](code)`\n```\n[e](f)\n```"
    )
    (tmp_path / "there.md").touch()
    assert list(dead_links(page)) == ["README.md: gone.svg", "README.md: code"]
