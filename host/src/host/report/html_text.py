"""Escape text from foreign files for a page, so that it cannot act as markup or script.

Control codes, characters that turn the direction of writing and lone surrogates are shown as their
code (`host.text.shown`), since XML cannot hold most of them.
"""

from __future__ import annotations

import html
import json
from typing import Any

from host.text import shown


def escaped(text: object) -> str:
    """Return text for HTML or XML, in an element or in an attribute's quotes."""
    return html.escape(shown(str(text)), quote=True)


def script_data(value: Any) -> str:
    """Return JSON that may stand within a ``<script>``: no ``<``, so that none ends it."""
    text = json.dumps(_shown(value), separators=(",", ":"), allow_nan=False)
    for letter in "<>&\u2028\u2029":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return text


def _shown(value: Any) -> Any:
    if isinstance(value, str):
        return shown(value)
    if isinstance(value, dict):
        return {shown(str(key)): _shown(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_shown(one) for one in value]
    return value
