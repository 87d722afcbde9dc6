"""Every link of a page leads to a file of this tree; every study's page has the same headings."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
IMAGE = re.compile(r'<img src="([^"]+)"')  # with a height, where a picture is taller than a screen
CODE = re.compile(r"```.*?```", re.DOTALL)
SOURCE = re.compile(r"`([\w/]+\.(?:py|cpp))`")
HEADING = re.compile(r"^## (.+)$", re.MULTILINE)
STUDY_HEADINGS = ["Question", "Method", "Result", "What does not hold", "Command"]


def tracked(root: Path, *patterns: str) -> list[Path]:
    """Files of such names that git knows or would take."""
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard", *patterns],
        cwd=root,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    return [root / name for name in sorted(set(listed.split("\n"))) if (root / name).is_file()]


def dead_links(page: Path) -> Iterator[str]:
    """Links of a page that lead nowhere."""
    text = CODE.sub("", page.read_text(encoding="utf-8"))
    for target in [*LINK.findall(text), *IMAGE.findall(text)]:
        if re.match(r"[a-z]+:", target):
            continue
        place = target.split("#")[0]
        if place and not (page.parent / place).exists():
            yield f"{page.name}: {target}"


def test_links_lead_somewhere() -> None:
    found = tracked(ROOT, "*.md")
    assert len(found) > 40
    assert [dead for page in found for dead in dead_links(page)] == []


def test_dead_link_is_seen(tmp_path: Path) -> None:
    page = tmp_path / "README.md"
    page.write_text(
        "[a](there.md) ![b](gone.svg) [c](https://host/x) `[d](code)`\n```\n[e](f)\n```\n"
        '<img src="far.png" height="3">'
    )
    (tmp_path / "there.md").touch()
    assert list(dead_links(page)) == [
        "README.md: gone.svg",
        "README.md: code",
        "README.md: far.png",
    ]


def test_a_source_that_a_page_names_is_there() -> None:
    """A page of the package's rooms names its own files bare, those of others with their room."""
    known = [f"/{path.relative_to(ROOT)}" for path in tracked(ROOT, "*.py", "*.cpp")]
    lost, count = [], 0
    for page in tracked(ROOT, "*.md"):
        room = f"/{page.parent.relative_to(ROOT)}/"
        inside = [path for path in known if path.startswith(room)]
        for name in SOURCE.findall(page.read_text(encoding="utf-8")):
            near = inside if "/src/host/" in room and "/" not in name else known
            count += 1
            lost += [] if any(p.endswith(f"/{name}") for p in near) else [(page.name, room, name)]
    assert count > 200
    assert lost == []


def test_studies_pages_have_the_same_headings_and_are_listed() -> None:
    folder = ROOT / "host" / "studies"
    listed = set(LINK.findall((folder / "README.md").read_text(encoding="utf-8")))
    studies = [page for page in sorted(folder.glob("*.md")) if page.name != "README.md"]
    assert len(studies) > 20
    assert {page.name for page in studies} - listed == set()
    headings = {p.name: HEADING.findall(p.read_text(encoding="utf-8")) for p in studies}
    assert {name: h for name, h in headings.items() if h != STUDY_HEADINGS} == {}


def test_a_verbs_page_is_two_clicks_from_the_readme() -> None:
    seen = ROOT / "README.md"
    first = [ROOT / t for t in LINK.findall(seen.read_text(encoding="utf-8")) if t.endswith(".md")]
    near = {page.resolve() for page in first}
    for page in first:
        targets = LINK.findall(page.read_text(encoding="utf-8"))
        near |= {(page.parent / t.split("#")[0]).resolve() for t in targets if ".md" in t}
    text = {page: page.read_text(encoding="utf-8") for page in near if page.is_file()}
    verbs = (ROOT / "host" / "src" / "host" / "verbs").glob("[!_]*.py")
    lost = [v.stem for v in verbs if not any(f"host {v.stem}" in t for t in text.values())]
    assert lost == []
