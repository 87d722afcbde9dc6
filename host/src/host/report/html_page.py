"""One self-contained page: its parts, and the policy that lets nothing else run.

The Content-Security-Policy names the hash of the one script and the one style sheet. Whatever text
of a log found its way into markup, no other script runs, and nothing is asked of any host.
"""

from __future__ import annotations

import base64
import hashlib
from dataclasses import dataclass, field

from host.report.html_text import escaped


@dataclass(frozen=True, slots=True)
class HtmlPage:
    """The parts of a page.

    Attributes
    ----------
    title : str
        Any text.
    body : str
        Markup.
    style, script : str
        Our own texts, never a stranger's.
    data : mapping of str to str
        Blocks of data by id: base64, or JSON of `script_data`.
    """

    title: str
    body: str
    style: str
    script: str = ""
    data: dict[str, str] = field(default_factory=dict)

    def text(self) -> str:
        """Return the page."""
        blocks = "\n".join(
            f'<script type="application/octet-stream" id="{escaped(name)}">{one}</script>'
            for name, one in self.data.items()
        )
        program = f"<script>{self.script}</script>\n" if self.script else ""
        return (
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            f'<meta http-equiv="Content-Security-Policy" content="{self._policy()}">\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            '<meta name="referrer" content="no-referrer">\n'
            f"<title>{escaped(self.title)}</title>\n<style>{self.style}</style>\n</head>\n"
            f"<body>\n{self.body}\n{blocks}\n{program}</body>\n</html>\n"
        )

    def _policy(self) -> str:
        script = f"'{_hash(self.script)}'" if self.script else "'none'"
        return (
            f"default-src 'none'; script-src {script}; style-src '{_hash(self.style)}';"
            " img-src data:; base-uri 'none'; form-action 'none'"
        )


def _hash(text: str) -> str:
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return "sha256-" + base64.b64encode(digest).decode("ascii")
