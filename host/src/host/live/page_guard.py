"""Who may look and who may act: Host, Origin and token of every request, and what a page may load.

Loopback is no protection by itself: any page in the user's browser can reach it, under another
name too (DNS rebinding).
"""

from __future__ import annotations

import hmac
import ipaddress
import secrets
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field

from aiohttp import web

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]
ROLE = web.RequestKey("role", str)
PILOT, VIEWER = "pilot", "viewer"
_LONGEST_TOKEN = 100
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self';"
    " img-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none';"
    " frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


def new_token() -> str:
    """Return a token of 128 bits."""
    return secrets.token_urlsafe(16)


@dataclass(slots=True)
class PageGuard:
    """Checks every request.

    Parameters
    ----------
    port : int
        Where the page is served.
    addresses : tuple of str
        Addresses of this computer in its network, with `--lan`.
    pilot_token, viewer_token : str
        The first may mark, and only from this computer; the second may look.
    """

    port: int
    addresses: tuple[str, ...] = ()
    pilot_token: str = field(default_factory=new_token)
    viewer_token: str = field(default_factory=new_token)

    @property
    def cookie(self) -> str:
        """Its name: browsers share cookies between the ports of a host."""
        return f"host_live_{self.port}"

    def hosts(self) -> set[str]:
        """Return what a Host header may say."""
        names = ("127.0.0.1", "localhost", "[::1]", *self.addresses)
        return {f"{name}:{self.port}" for name in names}

    @web.middleware
    async def middleware(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Answer 403 to whoever may not look; add the headers to every answer."""
        try:
            role = self._role(request)
            if role is None:
                answer: web.StreamResponse = web.Response(status=403, text=REFUSED)
            else:
                request[ROLE] = role
                answer = await handler(request)
        except web.HTTPException as error:
            answer = web.Response(status=error.status, text=f"{error.status} {error.reason}\n")
        if not answer.prepared:
            answer.headers.update(_HEADERS)
        return answer

    def _role(self, request: web.Request) -> str | None:
        if request.headers.get("Host", "") not in self.hosts():
            return None
        origin = request.headers.get("Origin")
        if origin is not None and origin.removeprefix("http://") not in self.hosts():
            return None
        given = request.query.get("token") or request.cookies.get(self.cookie, "")
        if not 0 < len(given) <= _LONGEST_TOKEN:
            return None
        if _same(given, self.pilot_token):
            return PILOT if _is_loopback(request.remote) else VIEWER
        return VIEWER if _same(given, self.viewer_token) else None


REFUSED = (
    "403: open the address that `host live` printed, with its token; another site, another name"
    " of this computer, or an old token is refused\n"
)


def _same(given: str, token: str) -> bool:
    return hmac.compare_digest(given.encode("utf-8", "replace"), token.encode())


def _is_loopback(remote: str | None) -> bool:
    try:
        return ipaddress.ip_address(remote or "").is_loopback
    except ValueError:
        return False
