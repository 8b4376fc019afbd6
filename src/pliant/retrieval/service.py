"""Searching an index from a browser or over HTTP: on this machine by default, with a token beyond it."""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError, require
from .index import ShapeIndex

if TYPE_CHECKING:
    from fastapi import FastAPI

__all__ = ["ServiceLimits", "create_app", "serve"]

_SHORTEST_TOKEN = 16
_BACKLOG = 512


@dataclass(frozen=True)
class ServiceLimits:
    """How much of the machine the service lets its clients use.

    Attributes
    ----------
    upload_bytes : int
        Largest request.
    pixels : int
        Largest picture.
    matches : int
        Most matches in a reply.
    workers : int or None
        Pictures worked on at once; None for one a processor.
    waiting : int
        Requests that may wait for a worker; those beyond are told to come again (429).
    patience : float
        Seconds that a client may take to send its request.
    """

    upload_bytes: int = 20_000_000
    pixels: int = 50_000_000
    matches: int = 96
    workers: int | None = None
    waiting: int = 128
    patience: float = 30.0

    def __post_init__(self) -> None:
        for name in ("upload_bytes", "pixels", "matches", "waiting", "patience"):
            if not getattr(self, name) > 0:
                message = f"{name} must be greater than 0, got {getattr(self, name)}"
                raise InputError(message)


def create_app(
    index: ShapeIndex,
    *,
    token: str | None = None,
    host: str = "127.0.0.1",
    limits: ServiceLimits | None = None,
) -> FastAPI:
    """Make the web application that searches an index: a page at ``/``, the interface below ``/api``.

    Parameters
    ----------
    index : ShapeIndex
        With a model.
    token : str, optional
        What a client must send (``Authorization: Bearer ...``) with every call below ``/api``.
    host : str
        Address that it will be bound to. On a loopback address only requests to a loopback name are answered, which
        keeps pages of other sites out whatever name they have resolved to this machine.
    limits : ServiceLimits, optional

    Returns
    -------
    fastapi.FastAPI
        Described at ``/openapi.json`` and, for reading, ``/docs``.

    Raises
    ------
    InputError
        If the index has no model, or the host is not a loopback address and the token is missing or shorter than 16
        characters.
    MissingExtraError
        Without FastAPI: ``pip install 'pliant[retrieval]'``.

    Notes
    -----
    No file that a client names is ever opened: pictures come in the request, previews out of the index. Everything
    the page needs is served from here, and its content security policy allows nothing else.

    Examples
    --------
    >>> create_app(ShapeIndex(8))
    Traceback (most recent call last):
    pliant.errors.InputError: the index has no model: it takes codes, not pictures
    """
    require("fastapi", "retrieval")
    require("python_multipart", "retrieval")
    from ._service_routes import application

    _ = index.model
    _check_token(host, token)
    return application(index, token, is_loopback(host), limits or ServiceLimits())


def serve(
    folder: str | Path,
    *,
    host: str = "127.0.0.1",
    port: int = 8000,
    token: str | None = None,
    limits: ServiceLimits | None = None,
    ready: Callable[[str], None] | None = None,
) -> None:
    """Serve the search page of an index until interrupted.

    Parameters
    ----------
    folder : str or Path
        The index; what other processes add to it meanwhile is found.
    host : str
        Address to bind to: by default one that only this machine can reach.
    port : int
        0 for any that is free.
    token : str, optional
        Required beyond loopback; see :func:`create_app`.
    limits : ServiceLimits, optional
    ready : callable, optional
        Called with the page's address before the first request is taken.

    Raises
    ------
    InputError
        If the index cannot be opened, the token is missing, or the address cannot be bound.

    Examples
    --------
    >>> serve("no-such-folder", host="0.0.0.0")
    Traceback (most recent call last):
    pliant.errors.InputError: 0.0.0.0 can be reached from other machines: give a token of 16 or more characters...
    """
    uvicorn = require("uvicorn", "retrieval")
    _check_token(host, token)
    with ShapeIndex.load(folder) as index:
        app = create_app(index, token=token, host=host, limits=limits)
        _use_one_thread_a_picture()
        listener = _bound(host, port)
        with listener:
            if ready is not None:
                ready(_address(host, listener.getsockname()[1]))
            config = uvicorn.Config(
                app, log_level="warning", server_header=False, limit_concurrency=1024, timeout_keep_alive=10
            )
            uvicorn.Server(config).run(sockets=[listener])


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach what is bound to a host."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def _check_token(host: str, token: str | None) -> None:
    if token is not None and not (token.isascii() and token.isprintable() and " " not in token):
        raise InputError("the token must be of printable ASCII characters without spaces")
    if not is_loopback(host) and len(token or "") < _SHORTEST_TOKEN:
        message = (
            f"{host} can be reached from other machines: give a token of {_SHORTEST_TOKEN} or more characters "
            '(python -c "import secrets; print(secrets.token_urlsafe())" makes one), or bind to 127.0.0.1'
        )
        raise InputError(message)


def _bound(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host.strip("[]"), port))
        # Who is told the address can connect at once, and waits where it must.
        listener.listen(_BACKLOG)
    except (OSError, OverflowError) as error:
        listener.close()
        message = f"{host}:{port} cannot be bound: {getattr(error, 'strerror', None) or error}"
        raise InputError(message) from error
    return listener


def _address(host: str, port: int) -> str:
    shown = {"0.0.0.0": "127.0.0.1", "::": "[::1]"}.get(host, host)
    return f"http://{f'[{shown}]' if ':' in shown and '[' not in shown else shown}:{port}/"


def _use_one_thread_a_picture() -> None:
    """Let the workers share the processors, not the threads inside each picture's work."""
    from threadpoolctl import threadpool_limits

    threadpool_limits(1)
    require("cv2", "images").setNumThreads(1)
