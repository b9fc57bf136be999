"""State shared by the tabs of one server."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gen_data.lab.edit.files import Folders
from gen_data.lab.edit.workers import Activity, Job, Ticket, Workers

PICTURES_BYTES = 96 << 20
"""Number of encoded pictures kept for browsers."""


@dataclass
class Pictures:
    """Encoded pictures by unguessable name; the oldest go first."""

    limit_bytes: int = PICTURES_BYTES
    held: dict[str, bytes] = field(default_factory=dict)
    size_bytes: int = 0

    def put(self, data: bytes) -> str:
        """Keep a picture; its path on the server."""
        name = secrets.token_urlsafe(12)
        self.held[name] = data
        self.size_bytes += len(data)
        while self.size_bytes > self.limit_bytes and len(self.held) > 1:
            self.size_bytes -= len(self.held.pop(next(iter(self.held))))
        return f"/edit/picture/{name}"


@dataclass
class Desk:
    """State shared by all tabs.

    Attributes:
        source: File or data set to open; None = the start page.
        real: Folder of real pictures; None without one.
        gallery: Pictures of shipped configurations by file name.
        listeners: Receivers of results by client of the workers.
        schema: Loads all plug-ins, which takes seconds and must not hold up the page.
        reports: Names of reports of fits in addresses, by path.
        scratch: Folder for dropped files and temporary ones, which ends with the server.
        hearers: Receivers of the activities for a client.
    """

    folders: Folders
    source: Path | None
    real: Path | None
    token: str
    pictures: Pictures = field(default_factory=Pictures)
    gallery: dict[str, bytes] = field(default_factory=dict)
    reports: dict[str, str] = field(default_factory=dict)
    listeners: dict[str, Callable[[Ticket, Any], None]] = field(default_factory=dict)
    hearers: dict[str, Callable[[Activity], None]] = field(default_factory=dict)
    schema: asyncio.Task[Any] | None = None
    loop: asyncio.AbstractEventLoop | None = None
    workers: Workers | None = None
    scratch: Path | None = None

    def deliver(self, ticket: Ticket, result: Any) -> None:
        """Hand a result to its tab, in the loop of the server."""
        listener = self.listeners.get(ticket.client)
        if listener is not None and self.loop is not None and not self.loop.is_closed():
            self.loop.call_soon_threadsafe(listener, ticket, result)

    def hear(self, ticket: Ticket, activity: Activity) -> None:
        """Hand an activity to the tab that waits for it, in the loop of the server."""
        hearer = self.hearers.get(ticket.client)
        if hearer is not None and self.loop is not None and not self.loop.is_closed():
            self.loop.call_soon_threadsafe(hearer, activity)

    def order(
        self,
        client: str,
        jobs: Sequence[Job],
        receive: Callable[[Ticket, Any], None],
        *,
        later: bool = False,
    ) -> None:
        """Replace the jobs of a client; their results go to ``receive``, ``later`` than others."""
        self.listeners[client] = receive
        assert self.workers is not None
        self.workers.submit(client, jobs, later=later)

    def forget(self, key: str) -> None:
        """Drop the jobs of all clients of a tab."""
        assert self.workers is not None
        self.hearers.pop(key, None)
        for client in [name for name in self.listeners if name.startswith(key)]:
            del self.listeners[client]
            self.workers.submit(client, ())
