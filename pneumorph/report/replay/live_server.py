"""A page of this machine that is told what happens: a local HTTP server with server-sent events."""

from __future__ import annotations

import contextlib
import json
import threading
from collections.abc import Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

HOST = "127.0.0.1"
_HEARTBEAT_S = 5.0
"""A silent stream gets a comment this often, so that a page that has gone is noticed."""


class LivePage:
    """Serves one page on 127.0.0.1 and sends it events; later pages get the earlier events too.

    The page reads them with ``new EventSource("/events")``. Used as a context manager it ends with
    the block.

    Args:
        page: The HTML.
        port: Where to listen; 0 takes a free one.

    Raises:
        OSError: The port is taken.
    """

    def __init__(self, page: str, port: int = 0) -> None:
        self._changed = threading.Condition()
        self._events: list[tuple[int, str, str]] = []
        self._sequence = 0
        self._delivered = 0
        self._closed = False
        live = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                live._answer(self, page.encode())

            def log_message(self, format: str, *args: Any) -> None:
                """Say nothing: standard error is the progress display's."""

        self._server = ThreadingHTTPServer((HOST, port), Handler)
        self._server.daemon_threads = True
        # Streams are long; closing does not wait for pages that stay open.
        self._server.block_on_close = False
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        """Where a browser finds the page."""
        return f"http://{HOST}:{self._server.server_port}/"

    def send(self, name: str, value: Mapping[str, Any], *, replace: bool = False) -> None:
        """Send an event to all pages, open or to be opened.

        Args:
            name: Name of the event.
            value: JSON values.
            replace: Forget earlier events of this name: a new page needs the last one alone.
        """
        text = json.dumps(value, allow_nan=False, separators=(",", ":"))
        with self._changed:
            if replace:
                self._events = [each for each in self._events if each[1] != name]
            self._sequence += 1
            self._events.append((self._sequence, name, text))
            self._changed.notify_all()

    def wait_until_read(self, timeout_s: float) -> bool:
        """Wait until some page has got every event; return whether one has."""
        with self._changed:
            return self._changed.wait_for(
                lambda: self._delivered >= self._sequence > 0, max(timeout_s, 0.0)
            )

    def close(self) -> None:
        """End all streams and the server."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def __enter__(self) -> LivePage:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _answer(self, request: BaseHTTPRequestHandler, page: bytes) -> None:
        # A page of another site could point its own name at this machine and read along.
        host = request.headers.get("Host", "").rsplit(":", 1)[0]
        if host not in (HOST, "localhost"):
            request.send_error(403)
        elif request.path == "/":
            request.send_response(200)
            request.send_header("Content-Type", "text/html; charset=utf-8")
            request.send_header("Content-Length", str(len(page)))
            request.end_headers()
            request.wfile.write(page)
        elif request.path == "/events":
            request.send_response(200)
            request.send_header("Content-Type", "text/event-stream")
            request.send_header("Cache-Control", "no-store")
            request.end_headers()
            # A page that is closed breaks its stream.
            with contextlib.suppress(BrokenPipeError, ConnectionResetError):
                self._stream(request)
        else:
            request.send_error(404)

    def _stream(self, request: BaseHTTPRequestHandler) -> None:
        # A page whose connection broke goes on after the last event that it got.
        last = int(request.headers.get("Last-Event-ID") or 0)
        closed = False
        while not closed:
            due, closed = self._after(last)
            for sequence, name, text in due:
                request.wfile.write(f"id: {sequence}\nevent: {name}\ndata: {text}\n\n".encode())
                last = sequence
            if not due:
                request.wfile.write(b": alive\n\n")
            request.wfile.flush()
            with self._changed:
                self._delivered = max(self._delivered, last)
                self._changed.notify_all()

    def _after(self, last: int) -> tuple[list[tuple[int, str, str]], bool]:
        """Wait for events after one; return them, and whether the server closes."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._sequence > last, _HEARTBEAT_S)
            return [each for each in self._events if each[0] > last], self._closed
