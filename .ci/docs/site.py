"""`make docs`: the pages of this clone as a searchable site, with API and notebooks that were run.

Pages keep their places, so that their links work; what they link to and is no page (a picture, a
settings file) is copied with them. The site needs no network: build/docs/site/index.html.
"""

from __future__ import annotations

import ast
import json
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "build" / "docs"
PAGES, SITE, VENV = OUT / "pages", OUT / "site", OUT / "venv"
# Where `make setup` left `host`: the notebooks run in it.
HOST_PYTHON = ROOT / ".venv" / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
REQUIREMENTS = ROOT / ".ci" / "requirements-docs.txt"
# The theme breaks no line of a table, cuts what is wider than 700 pixels, lets text run over.
CSS = """.wy-table-responsive table td{white-space:normal}
.wy-nav-content{max-width:1000px}
.rst-content table.docutils td,.rst-content table.docutils th{padding:4px 6px}
.rst-content pre{overflow-x:auto}
.rst-content div>pre{font-size:80%}
@media(min-width:768px){.rst-content pre,.rst-content pre code{white-space:pre-wrap}}
"""
LARGEST = 2_000_000  # bytes of a file that a page links to
COPIED = (".md", ".svg", ".png", ".jpg", ".toml", ".csv", ".h", ".json", ".html", ".cff", ".txt")
USERS = (
    "README.md", "START.md", "host/README.md", "host/IDENTIFY.md", "host/LOGS.md", "host/LIVE.md",
    "host/PREFLIGHT.md", "host/CARD.md", "host/CALIBRATE.md", "host/PLOT.md", "host/TUNE.md",
    "host/FLEET.md", "host/FIELD.md", "host/HELP.md", "host/generated/OPTIONS.md",
)  # fmt: skip


def main() -> int:
    """Gather, run, build; return the exit code."""
    python = _environment()
    shutil.rmtree(PAGES, ignore_errors=True)
    tracked = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    for name in tracked:
        source = ROOT / name
        if source.suffix.lower() in COPIED and source.stat().st_size <= LARGEST:
            target = PAGES / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
    notebooks = Path(__file__).with_name("notebooks.py")
    examples = "host/examples"
    run = [python, str(notebooks), str(ROOT / examples), str(PAGES / examples), str(HOST_PYTHON)]
    if code := subprocess.run(run, check=False).returncode:
        return code
    (PAGES / "site.css").write_text(CSS, encoding="utf-8")
    (PAGES / "API.md").write_text(api_page(), encoding="utf-8")
    (OUT / "mkdocs.yml").write_text(json.dumps(_settings(), indent=1), encoding="utf-8")
    command = [python, "-m", "mkdocs", "build", "--quiet", "--clean", "-f", str(OUT / "mkdocs.yml")]
    code = subprocess.run(command, cwd=ROOT, check=False).returncode
    if code == 0:
        print(f"open {(SITE / 'index.html').relative_to(ROOT)}")
    return code


def _environment() -> str:
    """Return the Python that has MkDocs; it shares nothing with that of the tests."""
    python = VENV / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    stamp, wanted = VENV / "requirements.txt", REQUIREMENTS.read_text(encoding="utf-8")
    if not stamp.is_file() or stamp.read_text(encoding="utf-8") != wanted:
        subprocess.run([sys.executable, "-m", "venv", str(VENV)], check=True)
        pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*pip, "-r", str(REQUIREMENTS)], check=True)
        stamp.write_text(wanted, encoding="utf-8")
    return str(python)


def api_page() -> str:
    """Return a page of what `import host` offers: the names of its ``__all__``."""
    package = ROOT / "host" / "src" / "host" / "__init__.py"
    tree = ast.parse(package.read_text(encoding="utf-8"))
    homes = {
        name.asname or name.name: node.module
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("host.")
        for name in node.names
    }
    homes.pop("lazily", None)
    parts = ["# Python API", "", "`import host`; `host.NAME` is loaded when it is first used.", ""]
    for name, module in sorted(homes.items(), key=lambda one: (one[0][0].isupper(), one[0])):
        parts += [f"::: {_defined(name, module)}", ""]
    return "\n".join(parts)


def _defined(name: str, module: str) -> str:
    """Return the place where a name is defined, behind the faces that hand it on."""
    path = ROOT / "host" / "src" / Path(*module.split("."))
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.ImportFrom) or not node.module:
            continue
        if any((one.asname or one.name) == name for one in node.names):
            return _defined(name, node.module)
    return f"{module}.{name}"


def _settings() -> dict[str, object]:
    """Return MkDocs' settings; JSON is YAML."""
    python = {
        "paths": [str(ROOT / "host" / "src")],
        "options": {
            "docstring_style": "numpy", "show_root_heading": True, "show_source": False,
            "show_root_full_path": False, "heading_level": 2,
        },
    }  # fmt: skip
    return {
        "site_name": "Flight-test instrument",
        "docs_dir": str(PAGES),
        "site_dir": str(SITE),
        "use_directory_urls": False,  # opened from the disk
        "theme": {"name": "readthedocs", "highlightjs": False},
        "extra_css": ["site.css"],
        "plugins": ["search", {"mkdocstrings": {"handlers": {"python": python}}}],
        "nav": [
            *(page for page in USERS if (PAGES / page).is_file()),
            "API.md",
            {"Notebooks": _below("host/examples")},
            {"Hardware": _below("hw")},
            {"Protocol": _below("protocol")},
            {"Studies": _below("host/studies")},
            {"Rooms": [*_below("host/src"), *_below("firmware")]},
            {"Tests": _below("tests")},
        ],
        "validation": {"links": {"not_found": "info", "unrecognized_links": "info"}},
    }


def _below(folder: str) -> list[str]:
    return sorted(str(path.relative_to(PAGES)) for path in (PAGES / folder).rglob("*.md"))


if __name__ == "__main__":
    sys.exit(main())
