"""The server of the page: one user, one secret, no request to anywhere else."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import socket
from collections.abc import Awaitable, Callable, MutableMapping
from contextlib import suppress
from http.cookies import SimpleCookie
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs

from gen_data.core.errors import ConfigError
from gen_data.core.temporary_folders import temporary_folder
from gen_data.lab.edit.completion import root_schema
from gen_data.lab.edit.workers import Workers

if TYPE_CHECKING:
    from gen_data.lab.edit.desk import Desk

LOOPBACK = "127.0.0.1"
COOKIE = "gen_data_edit"
POLICY = (
    "default-src 'self'; img-src 'self' data: blob:; font-src 'self' data:; "
    "script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "connect-src 'self'; frame-ancestors 'none'; form-action 'self'; base-uri 'self'"
)
"""Browsers refuse requests to other hosts."""

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]


class Guard:
    """Accepts requests that have the token and name a host of this server.

    The first request has the token in its query; a cookie has it from then on. Names of other hosts
    are refused, because another site may resolve its name to this machine.
    """

    def __init__(self, app: Any, token: str, hosts: frozenset[str], port: int) -> None:
        self.app, self.token, self.hosts = app, token, hosts
        # Cookies hold for all ports of a host: each server has a name for its own.
        self.cookie = f"{COOKIE}_{port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = {
            key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]
        }
        given = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token", [""])[0]
        origin = headers.get("origin", "")
        is_ours = not self.hosts or headers.get("host", "") in self.hosts
        is_same = not origin or origin.partition("://")[2] == headers.get("host", "")
        if is_ours and is_same and self._fits(given) and scope["type"] == "http":
            await self._enter(scope, send)
        elif is_ours and is_same and self._fits(_cookie(headers.get("cookie", ""), self.cookie)):
            await self.app(scope, receive, _with_policy(send) if scope["type"] == "http" else send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            text = b"gen-data edit: open the address that the command has printed, with its token\n"
            await _reply(send, 403, [(b"content-type", b"text/plain")], text)

    def _fits(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.token.encode())

    async def _enter(self, scope: Scope, send: Send) -> None:
        cookie = f"{self.cookie}={self.token}; HttpOnly; SameSite=Strict; Path=/"
        headers = [(b"location", scope["path"].encode()), (b"set-cookie", cookie.encode())]
        await _reply(send, 303, headers, b"")


def _cookie(header: str, name: str) -> str:
    found = SimpleCookie(header).get(name)
    return found.value if found else ""


def _with_policy(send: Send) -> Send:
    async def answer(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            added = [
                (b"content-security-policy", POLICY.encode()),
                (b"referrer-policy", b"no-referrer"),
                (b"x-content-type-options", b"nosniff"),
            ]
            message["headers"] = [*message.get("headers", ()), *added]
        await send(message)

    return answer


async def _reply(send: Send, status: int, headers: list[tuple[bytes, bytes]], body: bytes) -> None:
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


def usual_port(source: Path | None) -> int:
    """A port of the dynamic range (RFC 6335) that stays the same for a file.

    Browsers store drafts by address and port: a restarted server finds its drafts.
    """
    digest = hashlib.sha256(str(source and source.resolve()).encode()).digest()
    return 49152 + int.from_bytes(digest[:4], "big") % 16384


def free_port(host: str, port: int, wish: int = 0) -> int:
    """The port; for 0 the preferred one if it is free, otherwise any.

    Raises:
        ConfigError: it is in use, or the address does not belong to this machine.
    """
    if not port and wish:
        with suppress(ConfigError):
            return free_port(host, wish)
    try:
        with socket.socket(socket.AF_INET) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
            return int(probe.getsockname()[1])
    except OSError as error:
        raise ConfigError(
            f"--host {host} --port {port}: {error.strerror}; expected an address of this machine "
            "and a free port"
        ) from error


async def _wait_for(host: str, port: int) -> None:
    """Wait until the server accepts connections."""
    while True:
        with suppress(OSError):
            _, writer = await asyncio.open_connection(host, port)
            writer.close()
            return
        await asyncio.sleep(0.02)


def serve(desk: Desk, host: str, port: int, workers: int, announce: Callable[[str], None]) -> None:
    """Serve the page until it is interrupted."""
    from nicegui import app, ui

    from gen_data.lab.edit import page

    port = free_port(host, port, usual_port(desk.source))
    names = (LOOPBACK, "localhost") if host == LOOPBACK else ()
    hosts = frozenset(f"{name}:{port}" for name in names)
    app.add_middleware(Guard, token=desk.token, hosts=hosts, port=port)
    page.add_routes(app, desk)

    async def tell() -> None:
        await _wait_for(host, port)
        announce(f"http://{host}:{port}/?token={desk.token}")

    def start() -> None:
        desk.loop = asyncio.get_running_loop()
        desk.schema = desk.loop.create_task(asyncio.to_thread(root_schema))
        # The server listens only after its start: a browser would be refused until then.
        waiting.append(desk.loop.create_task(tell()))

    waiting: list[asyncio.Task[None]] = []
    app.on_startup(start)
    with (
        temporary_folder("edit") as desk.scratch,
        Workers(workers, desk.deliver, desk.hear, desk.scratch) as desk.workers,
    ):
        ui.run(
            lambda: page.build(desk),
            host=host,
            port=port,
            title="gen-data edit",
            show=False,
            reload=False,
            tailwind=False,
            show_welcome_message=False,
            reconnect_timeout=60.0,
            dark=None,
        )
