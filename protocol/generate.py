"""Write protocol/generated/ from frames.toml and cases.toml; --check proves that it is current.

Exit codes: 0 ok, 1 a generated file is not current, 2 an input cannot be used.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from protocol.generator import cases, cpp, markdown, model, packets, schema_text

PROTOCOL = Path(__file__).resolve().parent


def generate(schema: model.Schema, cases_path: Path) -> dict[str, str]:
    """Return the content of every generated file by its name.

    Raises
    ------
    protocol.generator.model.SchemaError
        If the schema text does not fit its blocks, or a case cannot be used.
    """
    size = len(schema_text.text(schema))
    if size > schema_text.TEXT_LIMIT_BYTES:
        raise model.SchemaError(
            f"schema text has {size} bytes, at most {schema_text.TEXT_LIMIT_BYTES} fit"
        )
    return {
        "frames.h": cpp.frames_header(schema),
        "schema_blob.h": cpp.blob_header(schema),
        "FRAMES.md": markdown.frames_page(schema),
        "schema.json": schema_text.json_file(schema),
        "packets.json": packets.json_file(schema),
        "cases.h": cases.cases_header(cases_path),
    }


def first_difference(files: dict[str, str], folder: Path) -> str | None:
    """Return what is wrong with the first file that is not as generated, None if all are."""
    for name, content in files.items():
        path = folder / name
        if not path.is_file():
            return f"{name} is missing"
        found = path.read_bytes()
        expected = content.encode("utf-8")
        if found != expected:
            same = next(
                (i for i, (a, b) in enumerate(zip(found, expected, strict=False)) if a != b),
                min(len(found), len(expected)),
            )
            return f"{name} differs in line {expected[:same].count(10) + 1}"
    extra = sorted(path.name for path in folder.iterdir() if path.name not in files)
    return f"{extra[0]} is not made by this generator" if extra else None


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="protocol/generate.py", description=__doc__)
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    parser.add_argument("--frames", type=Path, default=PROTOCOL / "frames.toml")
    parser.add_argument("--cases", type=Path, default=PROTOCOL / "cases.toml")
    parser.add_argument("--out", type=Path, default=PROTOCOL / "generated")
    options = parser.parse_args(arguments)
    frames: Path = options.frames
    out: Path = options.out
    try:
        files = generate(model.load(frames), options.cases)
    except model.SchemaError as error:
        print(error, file=sys.stderr)
        return 2
    if options.check:
        difference = first_difference(files, out) if out.is_dir() else "generated/ is missing"
        if difference is None:
            return 0
        print(f"{difference}; run: python protocol/generate.py", file=sys.stderr)
        return 1
    out.mkdir(exist_ok=True)
    for name, content in files.items():
        (out / name).write_bytes(content.encode("utf-8"))
    print(f"wrote {', '.join(files)} to {out.name}/")
    return 0


if __name__ == "__main__":
    sys.exit(main())
