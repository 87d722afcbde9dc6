"""Run the example notebooks and write each, with what its cells give, as a page of the site.

Called by site.py with the Python that has MkDocs and nbconvert:

    notebooks.py NOTEBOOKS PAGES HOST_PYTHON

The kernel is HOST_PYTHON, where `host` is installed; it borrows ipykernel from the caller. A cell
that fails, or takes more than ten minutes, ends the run with exit code 1.
"""

from __future__ import annotations

import json
import os
import sys
import sysconfig
import tempfile
from pathlib import Path

CELL_S = 600
KERNEL = "host"
START = "import sys; sys.path.append({site!r}); from ipykernel.kernelapp import launch_new_instance"


def write_kernel(folder: Path, python: str) -> None:
    """Describe a kernel of another Python, which finds ipykernel behind its own packages."""
    start = f"{START.format(site=sysconfig.get_path('purelib'))}; launch_new_instance()"
    spec = {
        "argv": [python, "-c", start, "-f", "{connection_file}"],
        "display_name": KERNEL,
        "language": "python",
    }
    place = folder / "kernels" / KERNEL
    place.mkdir(parents=True)
    (place / "kernel.json").write_text(json.dumps(spec), encoding="utf-8")


def run(notebook: Path, pages: Path) -> None:
    """Run one notebook in a folder of its own and write its page.

    Raises
    ------
    nbclient.exceptions.CellExecutionError
        If a cell fails.
    """
    import nbformat
    from nbclient import NotebookClient
    from nbconvert import MarkdownExporter

    document = nbformat.read(notebook, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        resources = {"metadata": {"path": folder}}
        NotebookClient(document, timeout=CELL_S, kernel_name=KERNEL, resources=resources).execute()
    text, kept = MarkdownExporter().from_notebook_node(
        document, resources={"output_files_dir": f"{notebook.stem}_files"}
    )
    pages.mkdir(parents=True, exist_ok=True)
    (pages / f"{notebook.stem}.md").write_text(text, encoding="utf-8")
    for name, data in (kept.get("outputs") or {}).items():
        target = pages / name
        target.parent.mkdir(exist_ok=True)
        target.write_bytes(data)


def main(arguments: list[str]) -> int:
    """Run every notebook of a folder; return the exit code."""
    notebooks, pages, python = arguments
    with tempfile.TemporaryDirectory() as folder:
        write_kernel(Path(folder), python)
        os.environ["JUPYTER_PATH"] = folder
        os.environ["OPENBLAS_NUM_THREADS"] = "1"
        for notebook in sorted(Path(notebooks).glob("*.ipynb")):
            print(f"running {notebook.name}", flush=True)
            try:
                run(notebook, Path(pages))
            except Exception as error:
                print(f"{notebook}: {error}", file=sys.stderr)
                return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
