"""Who may ask the HTTP ports of a local cluster: pages of this computer under its own name.

Dask loads this module into the scheduler and every worker (`preload`). Loopback is no protection by
itself: a page in the user's browser reaches it under another name (DNS rebinding), and by a
WebSocket of another site.
"""

from __future__ import annotations

from typing import Any
from urllib.parse import urlsplit

_NAMES = ("127.0.0.1", "localhost", "::1")


def dask_setup(server: Any) -> None:
    """Answer 403 to every request that `is_ours` refuses, whatever it asks for.

    Parameters
    ----------
    server : distributed.Scheduler or distributed.Worker
    """
    from tornado.web import ErrorHandler

    application = server.http_application
    found = application.find_handler

    def guarded(request: Any, **more: Any) -> Any:
        headers = request.headers
        if is_ours(headers.get("Host", ""), headers.get("Origin")):
            return found(request, **more)
        return application.get_handler_delegate(request, ErrorHandler, {"status_code": 403})

    application.find_handler = guarded


def is_ours(host: str, origin: str | None) -> bool:
    """Return whether a request names this computer and comes from a page of the same address.

    Parameters
    ----------
    host : str
        Its Host header.
    origin : str or None
        Its Origin header.
    """
    if origin is not None and origin != f"http://{host}":
        return False
    try:
        return urlsplit(f"//{host}").hostname in _NAMES
    except ValueError:
        return False
