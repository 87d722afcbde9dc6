"""Models that come with the package, by name: those of the thesis, as fitted and as published."""

from __future__ import annotations

from pathlib import Path

FOLDER = Path(__file__).with_name("thesis")


def shipped_models() -> tuple[str, ...]:
    """Return their names."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def model_path(given: str | Path) -> Path:
    """Return the file of a model: that of its name, unless a file of the user's is called so."""
    path = Path(given)
    return (
        FOLDER / f"{given}.toml" if str(given) in shipped_models() and not path.exists() else path
    )


def shipped_lines() -> list[str]:
    """Return each name with the first line of its file."""
    said = []
    for name in shipped_models():
        text = (FOLDER / f"{name}.toml").read_text(encoding="utf-8")
        comment = [line[2:] for line in text.splitlines() if line.startswith("# ")]
        said += [f"{name:26s} {comment[0]}", *(f"{'':26s} {line}" for line in comment[1:])]
    return said
