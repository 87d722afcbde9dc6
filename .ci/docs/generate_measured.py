"""Write the page that says when figures of studies and benches were measured, from git's history.

.venv/bin/python .ci/docs/generate_measured.py           write tests/generated/MEASURED.md
.venv/bin/python .ci/docs/generate_measured.py --check   compare its figures with those of the pages

Measured means: in this commit a number came into the result that the page had not had. The check
needs no history: each line keeps the CRC-32 of its numbers, and only lines of other numbers are
dated anew. Numbers that are not committed yet get today and the commit that they stand on.
"""

from __future__ import annotations

import re
import subprocess
import sys
import zlib
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "tests" / "generated" / "MEASURED.md"
RESULT = "Result"  # heading of the figures of a study
BENCHES = (
    "tests/FIGURES.md", "tests/attitude/README.md", "tests/bench/README.md",
    "tests/bench/fleet.md", "tests/cards/README.md", "tests/chip/flight/README.md",
    "tests/chip/imu/README.md", "tests/fuzz/README.md", "tests/learning/README.md",
    "tests/mutants/README.md",
)  # fmt: skip
HEAD = """\
<!-- made by .ci/docs/generate_measured.py from the pages and git's history -->
# When figures were measured

The newest number of a section came with this commit. CRC: of all its numbers.

| page | section | date | commit | CRC |
| --- | --- | --- | --- | --- |
"""
NUMBER = re.compile(r"(?<![\w.])\d[\d.]*")
LINE = re.compile(r"\| \[(.+)\]\(.*\) \| (.*) \| (\S+) \| (\S+) \| (\w{8}) \|")
STALE = 6


def sections(page: str, text: str) -> dict[str, list[str]]:
    """Return the numbers of each section of a page that holds figures, in their order."""
    study = page.startswith("host/studies/")
    found: dict[str, list[str]] = {}
    for part in re.split(r"^#{1,3} ", text, flags=re.MULTILINE)[1:]:
        heading, _, body = part.partition("\n")
        heading = re.sub(r" \(\[.*", "", heading)  # pages that it leads to
        lines = body.split("\n")
        # A study's result is all figures; elsewhere they stand in tables.
        rows = lines if study else [line for line in lines if line.startswith("|")]
        numbers = [n for row in rows for n in NUMBER.findall(row)]
        if numbers and (heading == RESULT or not study):
            found[heading] = numbers
    return found


def crc_of(numbers: list[str]) -> str:
    """Return what tells one set of figures from another."""
    return f"{zlib.crc32(' '.join(numbers).encode()):08x}"


def pages() -> list[str]:
    """Name the pages whose figures no cheap check makes anew."""
    studies = sorted(p.as_posix() for p in (ROOT / "host" / "studies").glob("*.md"))
    return [Path(p).relative_to(ROOT).as_posix() for p in studies] + list(BENCHES)


def figures() -> dict[tuple[str, str], list[str]]:
    """Return the numbers of every section of every page."""
    return {
        (page, name): numbers
        for page in pages()
        for name, numbers in sections(page, (ROOT / page).read_text(encoding="utf-8")).items()
    }


def kept() -> dict[tuple[str, str, str], tuple[str, str]]:
    """Return date and commit by page, section and CRC, as the page has them."""
    text = PAGE.read_text(encoding="utf-8") if PAGE.is_file() else ""
    return {(page, name, crc): (day, at) for page, name, day, at, crc in LINE.findall(text)}


def _git(*words: str) -> str:
    return subprocess.run(
        ["git", *words], cwd=ROOT, capture_output=True, text=True, encoding="utf-8", check=True
    ).stdout


def measured(page: str, numbers: list[str]) -> tuple[str, str]:
    """Return date and commit in which the newest of these numbers came into the page."""
    now = datetime.now(UTC).date().isoformat()
    newer = now, _git("rev-parse", "--short=8", "HEAD").strip()
    log = _git("log", "--follow", "--name-only", "--format=@%h %cs", "--abbrev=8", "--", page)
    for entry in log.split("@")[1:]:
        stamp, _, name = entry.partition("\n")
        commit, day = stamp.split()
        had = Counter(NUMBER.findall(_git("show", f"{commit}:{name.strip()}")))
        if Counter(numbers) - had:  # some of them came later
            return newer
        newer = day, commit
    return newer


def text(*, history: bool) -> str:
    """Return the page; without history a section of other figures has no date."""
    known, rows = kept(), []
    for (page, name), numbers in figures().items():
        crc = crc_of(numbers)
        day, commit = known.get((page, name, crc)) or (
            measured(page, numbers) if history else ("-", "-")
        )
        where = f"../../{page}" if page.startswith("host") else page.replace("tests/", "../")
        rows.append(f"| [{page}]({where}) | {name} | {day} | {commit} | {crc} |\n")
    return HEAD + "".join(rows)


def main(arguments: list[str] | None = None) -> int:
    """Write or compare; 0 ok, 6 the page is not current."""
    if "--check" in (sys.argv[1:] if arguments is None else arguments):
        if PAGE.read_text(encoding="utf-8") == text(history=False):
            return 0
        print(f"{PAGE.relative_to(ROOT)} is not current: run .ci/docs/generate_measured.py",
              file=sys.stderr)  # fmt: skip
        return STALE
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(text(history=True), encoding="utf-8")
    print(f"wrote {PAGE.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
