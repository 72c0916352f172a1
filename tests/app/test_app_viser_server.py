"""Messages reach a tab whatever moment they are sent at."""

from __future__ import annotations

import asyncio
import threading
from typing import Any

from explorer.app.browser.viser_server import start_viser, stop_viser


def test_message_sent_as_a_tab_begins_to_wait_wakes_it() -> None:
    server = start_viser("127.0.0.1", 0)
    try:
        internals: Any = server
        buffer = internals._websock_server.get_message_buffer()
        loop: asyncio.AbstractEventLoop = buffer.event_loop
        plain = loop.create_future

        def create_future() -> asyncio.Future[Any]:
            # Who waits has seen that nothing is there, and cannot be woken yet.
            del loop.create_future
            sender = threading.Thread(target=lambda: server.scene.add_frame("/sent"))
            sender.start()
            sender.join()
            return plain()

        async def wait() -> bool:
            # What woke the loop before this has been done by now.
            buffer.message_event.clear()
            loop.create_future = create_future  # type: ignore[method-assign]
            return await buffer.message_event.wait()

        assert asyncio.run_coroutine_threadsafe(wait(), loop).result(60.0)
    finally:
        stop_viser(server)
