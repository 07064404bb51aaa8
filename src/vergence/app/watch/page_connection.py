"""One page's connection: it gets what is new, and sends requests."""

import asyncio
from collections import deque
from collections.abc import Callable

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from vergence.app.watch.commands import More, parse
from vergence.app.watch.protocol import Request, packed, refusal
from vergence.app.watch.rate_limit import RateLimit
from vergence.app.watch.view_state import Reader, ViewState
from vergence.errors import InputError

LONGEST_FRAME = 1 << 16  # bytes: a longer one closes the connection
_LONGEST_MESSAGE = 1 << 12  # bytes: a longer one is refused
_RATE_HZ, _BURST = 250.0, 250  # messages of one page: a mouse and two screens make do with it
_MOST_ANSWERS = 64  # kept for a page that does not read
_PERIOD_S = 1 / 40  # between two looks at the view state


class PageConnection:
    """Serves one page until its connection is closed.

    The page gets the next state when it reports that it has shown the last one: a slow one misses
    images, but never lags behind. What it asks for is checked here, and slowed down if it is too
    much.

    Args:
        connection: to the page.
        view_state: what to show.
        ask: is given what the page asks for.
    """

    def __init__(
        self,
        connection: ServerConnection,
        view_state: ViewState,
        ask: Callable[[Request], None],
    ) -> None:
        self._connection, self._view_state, self._ask = connection, view_state, ask
        self._answers: deque[str] = deque(maxlen=_MOST_ANSWERS)  # filled by other threads, too
        self._ready = True

    async def serve(self) -> None:
        """Send news to the page, and pass on its requests."""
        listening = asyncio.create_task(self._listen())
        reader = Reader()
        try:
            while not listening.done():
                await self._answer()
                news = self._view_state.news(reader) if self._ready else None
                if news is not None:
                    self._ready = False
                    await self._connection.send(packed(news))
                await asyncio.sleep(_PERIOD_S)
        except ConnectionClosed:
            pass
        finally:
            listening.cancel()

    async def _answer(self) -> None:
        while self._answers:
            await self._connection.send(refusal(self._answers.popleft()))

    async def _listen(self) -> None:
        limit = RateLimit(_RATE_HZ, _BURST)
        async for message in self._connection:
            self._hear(message)
            if (wait := limit.take()) > 0.0:
                await asyncio.sleep(wait)  # meanwhile the rest waits at the sender

    def _hear(self, message: str | bytes) -> None:
        try:
            if len(message) > _LONGEST_MESSAGE:
                allowed = f"at most {_LONGEST_MESSAGE} bytes"
                raise InputError("message", "", f"{len(message)} bytes", allowed)
            command = parse(message)
        except InputError as error:
            self._answers.append(str(error))
            return
        if isinstance(command, More):
            self._ready = True
        else:
            self._ask(Request(command, self._answers.append))
