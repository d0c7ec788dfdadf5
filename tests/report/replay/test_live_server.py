"""The local server gives every page every event, and ends when it is told."""

from __future__ import annotations

import http.client
import json
import threading
from urllib.parse import urlsplit

import pytest

from pneumorph.report.replay.live_replay import LiveSettings
from pneumorph.report.replay.live_server import LivePage


def _connect(live: LivePage) -> http.client.HTTPConnection:
    parts = urlsplit(live.address)
    assert parts.hostname == "127.0.0.1"
    return http.client.HTTPConnection(parts.hostname, parts.port, timeout=60)


def _read(response: http.client.HTTPResponse, count: int) -> list[tuple[str, object]]:
    """Name and value of the next events."""
    events: list[tuple[str, object]] = []
    name = ""
    while len(events) < count:
        line = response.readline().decode().rstrip("\n")
        if line.startswith("event: "):
            name = line.removeprefix("event: ")
        elif line.startswith("data: "):
            events.append((name, json.loads(line.removeprefix("data: "))))
    return events


def test_pages_get_earlier_and_later_events_in_order() -> None:
    with LivePage("<p>page</p>") as live:
        first = _connect(live)
        first.request("GET", "/")
        assert first.getresponse().read() == b"<p>page</p>"
        live.send("frame", {"number": 1})
        early = _connect(live)
        early.request("GET", "/events")
        stream = early.getresponse()
        assert _read(stream, 1) == [("frame", {"number": 1})]
        live.send("frame", {"number": 2})
        assert _read(stream, 1) == [("frame", {"number": 2})]
        late = _connect(live)
        late.request("GET", "/events")
        assert _read(late.getresponse(), 2) == [("frame", {"number": n}) for n in (1, 2)]
        # A page whose connection broke goes on where it was.
        again = _connect(live)
        again.request("GET", "/events", headers={"Last-Event-ID": "1"})
        assert _read(again.getresponse(), 1) == [("frame", {"number": 2})]


def test_a_replaced_event_is_sent_once() -> None:
    with LivePage("") as live:
        live.send("snapshot", {"number": 1}, replace=True)
        live.send("other", {})
        live.send("snapshot", {"number": 2}, replace=True)
        page = _connect(live)
        page.request("GET", "/events")
        assert _read(page.getresponse(), 2) == [("other", {}), ("snapshot", {"number": 2})]


def test_it_waits_until_a_page_has_read_everything() -> None:
    with LivePage("") as live:
        live.send("frame", {})
        assert not live.wait_until_read(0.05)
        page = _connect(live)
        page.request("GET", "/events")
        response = page.getresponse()
        assert live.wait_until_read(60)
        assert _read(response, 1) == [("frame", {})]
        live.send("frame", {})
        assert live.wait_until_read(60)


def test_closing_ends_streams_and_frees_the_port() -> None:
    with LivePage("") as live:
        port = urlsplit(live.address).port
        page = _connect(live)
        page.request("GET", "/events")
        response = page.getresponse()
    response.read()  # to the end, which has come
    LivePage("", port or 0).close()
    assert not [each for each in threading.enumerate() if "serve_forever" in each.name]


def test_other_names_other_paths_and_a_taken_port_are_refused() -> None:
    with LivePage("") as live:
        page = _connect(live)
        page.request("GET", "/", headers={"Host": "evil.example"})
        assert page.getresponse().status == 403
        other = _connect(live)
        other.request("GET", "/etc/passwd")
        assert other.getresponse().status == 404
        with pytest.raises(OSError, match="in use"):
            LivePage("", urlsplit(live.address).port or 0)
    with pytest.raises(ValueError, match="port must be at least 0 and at most 65535, got 70000"):
        LiveSettings(port=70000)
    with pytest.raises(ValueError, match="linger_s must be at least 0, got -1"):
        LiveSettings(linger_s=-1)
