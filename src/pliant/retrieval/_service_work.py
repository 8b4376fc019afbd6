"""Work that takes a processor, kept off the event loop: a few at a time, a bounded queue, the rest sent away."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")
# Seconds between looks at whether the client is still there.
_LOOK_AFTER_CLIENT = 0.25


class TooBusyError(Exception):
    """More requests wait than may."""


class ClientGoneError(Exception):
    """Nobody waits for the answer any more."""


class Workers:
    """Threads for the pictures of many clients.

    Parameters
    ----------
    count : int
        Pictures worked on at once.
    waiting : int
        Requests that may wait for one.
    """

    def __init__(self, count: int, waiting: int) -> None:
        self._pool = ThreadPoolExecutor(count, "pliant-search")
        self._room = count + waiting

    async def run(
        self, gone: Callable[[], Awaitable[bool]], work: Callable[P, R], *args: P.args, **kwargs: P.kwargs
    ) -> R:
        """Do one piece of work in its turn; drop it if the client is gone before that.

        Raises
        ------
        TooBusyError
            At once, where too many wait.
        ClientGoneError
        """
        if not self._room:
            raise TooBusyError
        self._room -= 1
        try:
            future = self._pool.submit(work, *args, **kwargs)
        except BaseException:
            self._room += 1
            raise
        # The room is free when the work is done, not when a client that left stops waiting for it.
        loop = asyncio.get_running_loop()
        future.add_done_callback(lambda _: _soon(loop, self._leave))
        answer = asyncio.wrap_future(future)
        while not (await asyncio.wait([answer], timeout=_LOOK_AFTER_CLIENT))[0]:
            if not future.running() and await gone() and future.cancel():
                raise ClientGoneError
        return answer.result()

    def close(self) -> None:
        """Finish what runs, and drop what waits."""
        self._pool.shutdown(wait=True, cancel_futures=True)

    def _leave(self) -> None:
        self._room += 1


def _soon(loop: asyncio.AbstractEventLoop, call: Callable[[], None]) -> None:
    # A loop that closed meanwhile has nobody left who waits.
    with suppress(RuntimeError):
        loop.call_soon_threadsafe(call)
