"""The printed boards: where each one's sheets and copper lie, and what is made of them."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent


class BoardError(Exception):
    """KiCad found a violation, or is not there."""


@dataclass(frozen=True, slots=True)
class Board:
    """One board of KiCad.

    Attributes
    ----------
    name
        Stem of its project, root sheet and copper.
    folder, generated
        Where they lie, and where goes what is made of them.
    sheets
        Pattern of its sheets in that folder.
    quantity
        For one logger.
    """

    name: str
    folder: Path
    generated: Path
    sheets: str
    quantity: int

    @property
    def root_sheet(self) -> str:
        """Name of the first sheet."""
        return f"{self.name}.kicad_sch"

    @property
    def copper(self) -> str:
        """Name of the routed board."""
        return f"{self.name}.kicad_pcb"

    def sheets_hash(self) -> str:
        """Return the hash of all sheets, the same with any line ending."""
        digest = hashlib.sha256()
        for path in sorted(self.folder.glob(self.sheets)):
            digest.update(path.name.encode() + b"\0" + path.read_bytes().replace(b"\r\n", b"\n"))
        return digest.hexdigest()

    def kicad(self, *arguments: str) -> None:
        """Run kicad-cli in the board's folder.

        Raises
        ------
        BoardError
            No kicad-cli, or it failed; with what it said.
        """
        command = ["kicad-cli", *arguments]
        try:
            with tempfile.TemporaryDirectory() as empty:
                # The reader's own library tables must not decide what is found.
                settings = {**os.environ, "KICAD_CONFIG_HOME": empty}
                done = subprocess.run(
                    command,
                    cwd=self.folder,
                    env=settings,
                    capture_output=True,
                    text=True,
                    check=False,
                )
        except FileNotFoundError:
            raise BoardError("no kicad-cli found: run .ci/setup.sh hw") from None
        if done.returncode:
            raise BoardError(f"kicad-cli {' '.join(arguments[:2])}: {done.stdout}{done.stderr}")

    def check_rules(self, kind: str, report: Path) -> None:
        """Run KiCad's rules; any violation, warnings too, is an error.

        Parameters
        ----------
        kind
            "sch" for electrical rules; "pcb" for design rules, unrouted connections and
            agreement with the schematic.
        report
            File to write.

        Raises
        ------
        BoardError
            Names every violation.
        """
        rules = {"sch": ("erc",), "pcb": ("drc", "--schematic-parity")}[kind]
        source = self.root_sheet if kind == "sch" else self.copper
        self.kicad(kind, *rules, "--severity-all", "--format", "json", "-o", str(report), source)
        read = json.loads(report.read_text(encoding="utf-8"))
        groups = [sheet["violations"] for sheet in read.get("sheets", ())]
        groups += [
            read.get(name, ()) for name in ("violations", "unconnected_items", "schematic_parity")
        ]
        found = [
            f"{one['type']}: {one['description']}: "
            + "; ".join(item["description"] for item in one["items"])
            for group in groups
            for one in group
        ]
        if found:
            what = "electrical" if kind == "sch" else "design"
            raise BoardError(f"{self.name}, {what} rules:\n  " + "\n  ".join(found))


_SENSORS = HERE / "sensors"
BOARDS = (
    Board("logger", HERE, HERE / "generated", "*.kicad_sch", 1),
    Board("vane", _SENSORS, _SENSORS / "generated" / "vane", "vane.kicad_sch", 4),
    Board("pitot", _SENSORS, _SENSORS / "generated" / "pitot", "pitot.kicad_sch", 1),
)


def named(name: str) -> Board:
    """Return a board by its name."""
    return next(board for board in BOARDS if board.name == name)
