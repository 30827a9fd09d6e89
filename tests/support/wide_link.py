"""A wide-area link: a TCP proxy that delays what passes, holds it up now and then as a lost packet does, or is cut.

There is no packet loss inside TCP for those who use it: a lost packet is a pause until it has been sent again, so that
is what is made here.
"""

import asyncio
import contextlib
import random
import threading
from collections.abc import Iterator


class WideLink:
    """Forwards connections to a port of this machine, from another port of it."""

    def __init__(self, to_port: int, delay_s: float, loss: float, retransmission_s: float) -> None:
        self.port = 0
        self._to_port, self._delay_s = to_port, delay_s
        self._loss, self._retransmission_s = loss, retransmission_s
        self._chance = random.Random(1)
        self._is_cut = False
        self._open: set[asyncio.StreamWriter] = set()
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> "WideLink":
        self._thread.start()
        assert self._ready.wait(5.0)
        return self

    def __exit__(self, *_: object) -> None:
        self.cut()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(5.0)

    def cut(self) -> None:
        """Close all connections, and accept none."""
        self._is_cut = True
        self._loop.call_soon_threadsafe(self._close_all)

    def mend(self) -> None:
        """Accept connections again."""
        self._is_cut = False

    def _close_all(self) -> None:
        for writer in self._open:
            writer.close()
        self._open.clear()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        server = self._loop.run_until_complete(asyncio.start_server(self._accept, "127.0.0.1", 0))
        self.port = server.sockets[0].getsockname()[1]
        self._ready.set()
        self._loop.run_forever()
        server.close()
        for task in asyncio.all_tasks(self._loop):
            task.cancel()
        self._loop.run_until_complete(asyncio.sleep(0.05))
        self._loop.close()

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._is_cut:
            writer.close()
            return
        with contextlib.suppress(OSError):
            far_reader, far_writer = await asyncio.open_connection("127.0.0.1", self._to_port)
            self._open |= {writer, far_writer}
            await asyncio.gather(
                self._forward(reader, far_writer), self._forward(far_reader, writer)
            )

    async def _forward(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Forward data in order, each piece after its delay."""
        waiting: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()

        async def send() -> None:
            while True:
                due_s, data = await waiting.get()
                await asyncio.sleep(max(0.0, due_s - self._loop.time()))
                writer.write(data)
                if not data:
                    writer.close()
                    return

        sending = asyncio.create_task(send())
        due_s = 0.0
        with contextlib.suppress(OSError):
            while data := await reader.read(65_536):
                pause_s = self._retransmission_s if self._chance.random() < self._loss else 0.0
                due_s = max(due_s, self._loop.time() + self._delay_s + pause_s)
                waiting.put_nowait((due_s, data))
        waiting.put_nowait((due_s, b""))
        with contextlib.suppress(OSError, asyncio.CancelledError):
            await sending


@contextlib.contextmanager
def wide_link(
    to_port: int, delay_s: float = 0.04, loss: float = 0.02, retransmission_s: float = 0.2
) -> Iterator[WideLink]:
    """A link inside the context: 40 ms each way, and every fiftieth piece is late by 0.2 s."""
    with WideLink(to_port, delay_s, loss, retransmission_s) as link:
        yield link
