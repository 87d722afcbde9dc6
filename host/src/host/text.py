"""Text of strangers (a log, a file's name, a serial line) -> text that may be shown."""

from __future__ import annotations


def shown(text: str | bytes) -> str:
    """Return text on one line, without anything that a terminal would act on.

    Parameters
    ----------
    text : str or bytes
        Bytes are taken for ASCII.

    Returns
    -------
    str
        Each character that is not to be seen is written as its code, such as ``\\x1b``.
    """
    if isinstance(text, bytes):
        text = text.decode("ascii", "backslashreplace")
    # Neither control codes, nor what turns the direction of writing, nor halves of characters.
    return "".join(one if one.isprintable() else _code(one) for one in text)


def _code(character: str) -> str:
    number = ord(character)
    if 0xDC80 <= number <= 0xDCFF:  # a byte of a file's name that is no text
        number -= 0xDC00
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}"
