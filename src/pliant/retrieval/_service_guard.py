"""What every request passes before it reaches the application: who asks, how much is sent, what headers answer."""

from __future__ import annotations

import asyncio
import hmac
import json
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any, TypeAlias

Message: TypeAlias = MutableMapping[str, Any]
Receive: TypeAlias = Callable[[], Awaitable[Message]]
Send: TypeAlias = Callable[[Message], Awaitable[None]]
App: TypeAlias = Callable[[Message, Receive, Send], Awaitable[None]]
#: Status, what is wrong, and headers beyond the usual ones.
Refusal: TypeAlias = tuple[int, str, dict[str, str]]

_LOOPBACK_NAMES = frozenset((b"localhost", b"127.0.0.1", b"[::1]"))
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
        "form-action 'none'; base-uri 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
}
_USUAL = {"Cache-Control": "no-store"}


class Guard:
    """An ASGI layer that refuses early and cheaply.

    Parameters
    ----------
    app : callable
        The application.
    token : str or None
        Needed for everything below ``/api``.
    loopback : bool
        Answer only requests addressed to a loopback name: another site's page whose name was made to resolve to this
        machine still sends its own name.
    upload_bytes : int
    patience : float
        Seconds for a request to arrive.
    """

    def __init__(
        self, app: App, token: str | None, loopback: bool, upload_bytes: int, patience: float
    ) -> None:
        self._app, self._loopback, self._most, self._patience = app, loopback, upload_bytes, patience
        self._credentials = None if token is None else f"Bearer {token}".encode("ascii")

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer a request, or pass it on with its body measured and its answer's headers completed."""
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        elif scope["type"] != "http":
            await self._app(scope, receive, send)
        elif refusal := self._refusal(scope):
            await _answer(send, refusal)
        else:
            exchange = _Exchange(receive, send, self._most, self._patience)
            try:
                await self._app(scope, exchange.receive, exchange.send)
            except Exception:
                if exchange.refusal is None:
                    raise
            await exchange.finish()

    def _refusal(self, scope: Message) -> Refusal | None:
        headers = dict(scope["headers"])
        host = headers.get(b"host", b"")
        if self._loopback and _without_port(host) not in _LOOPBACK_NAMES:
            return 403, "this service answers only on this machine's own names, as 127.0.0.1", {}
        origin = headers.get(b"origin")
        if origin is not None and origin.partition(b"://")[2] != host:
            return 403, "pages of other sites may not use this service", {}
        if self._credentials is not None and scope["path"].startswith("/api"):
            given = headers.get(b"authorization", b"")
            if not hmac.compare_digest(given, self._credentials):
                return 401, "the token is missing or wrong", {"WWW-Authenticate": "Bearer"}
        length = headers.get(b"content-length", b"0")
        if not length.isdigit():
            return 400, "the length of the request is not a number", {}
        return too_large(self._most) if int(length) > self._most else None


def too_large(most: int) -> Refusal:
    """Say that a request is too large."""
    return (
        413,
        f"the request is larger than {most / 1e6:g} MB; send a smaller picture",
        {"Connection": "close"},
    )


class _Exchange:
    """One request and its answer; a refusal in the middle takes the place of whatever the application answers."""

    def __init__(self, receive: Receive, send: Send, most: int, patience: float) -> None:
        self._receive, self._send, self._most = receive, send, most
        self._patience = patience
        self._until = asyncio.get_running_loop().time() + patience
        self._size, self._whole, self._started = 0, False, False
        self.refusal: Refusal | None = None

    async def receive(self) -> Message:
        """Pass on a part of the request, as long as it is neither too large nor too slow."""
        if self.refusal is not None:
            return {"type": "http.disconnect"}
        if self._whole:
            return await self._receive()
        try:
            async with asyncio.timeout_at(self._until):
                message = await self._receive()
        except TimeoutError:
            why = f"the request did not arrive within {self._patience:g} s"
            return self._refuse((408, why, {"Connection": "close"}))
        self._size += len(message.get("body", b""))
        self._whole = not message.get("more_body", False)
        return self._refuse(too_large(self._most)) if self._size > self._most else message

    async def send(self, message: Message) -> None:
        """Pass on a part of the answer, with the headers that every answer has."""
        if self.refusal is not None:
            return
        if message["type"] == "http.response.start":
            self._started = True
            given = {name.lower() for name, _ in message["headers"]}
            extra = [(n.lower().encode(), v.encode()) for n, v in (HEADERS | _USUAL).items()]
            message["headers"] = [*message["headers"], *(pair for pair in extra if pair[0] not in given)]
        await self._send(message)

    async def finish(self) -> None:
        """Send the refusal, if there is one."""
        if self.refusal is not None and not self._started:
            await _answer(self._send, self.refusal)

    def _refuse(self, refusal: Refusal) -> Message:
        self.refusal = refusal
        return {"type": "http.disconnect"}


async def _answer(send: Send, refusal: Refusal) -> None:
    status, why, extra = refusal
    body = json.dumps({"error": why}).encode()
    headers = {
        **HEADERS,
        **_USUAL,
        "Content-Type": "application/json",
        "Content-Length": str(len(body)),
        **extra,
    }
    await send(
        {
            "type": "http.response.start",
            "status": status,
            "headers": [(name.lower().encode(), value.encode()) for name, value in headers.items()],
        }
    )
    await send({"type": "http.response.body", "body": body})


def _without_port(host: bytes) -> bytes:
    """Return the name of a Host header: ``[::1]:80`` has colons of its own."""
    name, separator, port = host.rpartition(b":")
    return name if separator and port.isdigit() else host
