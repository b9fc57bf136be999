"""Language models behind one small interface: a server with OpenAI's interface, or a command."""

import http.client
import json
import os
import re
import signal
import socket
import ssl
import subprocess
import threading
import urllib.parse
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from gen_data.core.errors import ConfigError

REPLY_BYTES_MAX = 1 << 20
"""A configuration has a few kilobytes; models that think aloud write more."""
_ERROR_CHARS = 300
_WITHOUT_SCHEMA = (400, 404, 415, 422, 501)
"""Answers of servers that cannot constrain replies to a schema; asked again without one."""


@dataclass(frozen=True)
class Message:
    """A part of a conversation, in OpenAI's terms."""

    role: Literal["system", "user", "assistant"]
    content: str


class LanguageModel(Protocol):
    """Anything that answers a conversation."""

    def reply(self, messages: Sequence[Message], schema: Mapping[str, Any]) -> str:
        """The next message of the assistant.

        Args:
            messages: The conversation so far.
            schema: JSON Schema of the reply; a model that cannot obey it ignores it.

        Raises:
            ConfigError: there is no reply.
        """
        ...


@dataclass
class ModelServer:
    """A server with the interface of OpenAI's chat completions, such as llama.cpp's and vLLM's.

    Redirections are not followed, and proxies not used: nothing but this URL is asked.

    Attributes:
        url: Such as ``http://localhost:8080/v1``.
        model: Its name there; empty = the server's only one.
        key: Sent to the URL as bearer token, and removed from all texts that come back.
        timeout_s: For a whole reply.
    """

    url: str
    model: str = ""
    key: str = ""
    timeout_s: float = 300.0

    def __post_init__(self) -> None:
        """Refuse URLs and keys that cannot be used. Raises ConfigError if one of them cannot."""
        place = urllib.parse.urlsplit(self.url)
        try:
            is_url = place.scheme in ("http", "https") and bool(place.hostname) and place.port != 0
        except ValueError:
            is_url = False
        if not is_url or not self.url.isascii() or re.search(r"\s", self.url):
            raise ConfigError(f"--url: '{_shown(place)}' is none; expected http:// or https://")
        if place.username is not None or place.query or place.fragment:
            raise ConfigError("--url: expected no user, query or fragment in it")
        if not re.fullmatch(r"[\x21-\x7e]*", self.key):
            raise ConfigError("the key holds a space, a line break or another sign; expected ASCII")
        self._takes_schema = True

    def reply(self, messages: Sequence[Message], schema: Mapping[str, Any]) -> str:
        """See ``LanguageModel``."""
        status, data = self._ask(messages, schema if self._takes_schema else None)
        if status in _WITHOUT_SCHEMA and self._takes_schema:
            self._takes_schema = False
            status, data = self._ask(messages, None)
        text = self._without_key(data.decode("utf-8", "replace"))
        if status != http.client.OK:
            fact = " ".join(text.split())[:_ERROR_CHARS]
            raise self._error(f"answered {status}; expected 200: {fact}")
        try:
            content = json.loads(data)["choices"][0]["message"]["content"]
        except (ValueError, LookupError, TypeError, RecursionError):
            content = None
        if not isinstance(content, str):
            fact = " ".join(text.split())[:_ERROR_CHARS]
            raise self._error(f"expected a reply as OpenAI's chat completions have it, got: {fact}")
        return self._without_key(content)

    def _ask(
        self, messages: Sequence[Message], schema: Mapping[str, Any] | None
    ) -> tuple[int, bytes]:
        """Status and body of the answer."""
        body: dict[str, Any] = {"messages": [vars(message) for message in messages]}
        if self.model:
            body["model"] = self.model
        if schema is not None:
            described = {"name": "configuration", "schema": schema, "strict": False}
            body["response_format"] = {"type": "json_schema", "json_schema": described}
        headers = {"Content-Type": "application/json", "Accept-Encoding": "identity"}
        if self.key:
            headers["Authorization"] = f"Bearer {self.key}"
        path = urllib.parse.urlsplit(self.url).path.rstrip("/")
        path += "" if path.endswith("/chat/completions") else "/chat/completions"
        connection = self._connection()

        # The connection forgets its socket when an answer has it.
        opened: list[socket.socket] = []

        def stop() -> None:
            for one in opened:
                with suppress(OSError):
                    one.shutdown(socket.SHUT_RDWR)

        late = f"gave no whole reply within {self.timeout_s:g} s; --timeout raises that"
        with _limited(self.timeout_s, stop) as is_late:
            try:
                connection.connect()
                opened.append(connection.sock)
                connection.request("POST", path, json.dumps(body), headers)
                with connection.getresponse() as response:
                    status, data = response.status, _read_at_most(response.read1)
            except (OSError, http.client.HTTPException, ValueError) as error:
                if is_late() or isinstance(error, TimeoutError):
                    raise self._error(late) from None
                # Exceptions may hold the headers: their texts are not shown.
                fact = error.strerror if isinstance(error, OSError) else ""
                fact = fact or f"has no readable answer ({type(error).__name__})"
                raise self._error(fact) from None
            finally:
                connection.close()
            if is_late():
                raise self._error(late)
        if data is None:
            raise self._error(f"sent more than {REPLY_BYTES_MAX} bytes; expected a configuration")
        return status, data

    def _connection(self) -> http.client.HTTPConnection:
        place = urllib.parse.urlsplit(self.url)
        host, port, limit_s = str(place.hostname), place.port, self.timeout_s
        if place.scheme == "http":
            return http.client.HTTPConnection(host, port, timeout=limit_s)
        context = ssl.create_default_context()
        return http.client.HTTPSConnection(host, port, timeout=limit_s, context=context)

    def _without_key(self, text: str) -> str:
        return text.replace(self.key, "[key]") if self.key else text

    def _error(self, fact: str) -> ConfigError:
        return ConfigError(f"{self.url}: {fact}")


@dataclass(frozen=True)
class ModelCommand:
    """A command that reads the conversation from its standard input, and prints the reply.

    Attributes:
        command: Program and arguments.
        timeout_s: For a whole reply.
    """

    command: Sequence[str]
    timeout_s: float = 300.0

    def reply(self, messages: Sequence[Message], schema: Mapping[str, Any]) -> str:
        """See ``LanguageModel``."""
        del schema
        text = "\n\n".join(f"[{message.role}]\n{message.content}" for message in messages)
        name = self.command[0] if self.command else ""
        try:
            process = subprocess.Popen(
                self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
            )
        except (OSError, ValueError, IndexError) as error:
            fact = getattr(error, "strerror", None) or "is not a command"
            raise ConfigError(f"--command: '{name}': {fact}") from None
        assert process.stdin is not None
        assert process.stdout is not None

        def stop() -> None:
            # With the programs that it started, which may hold the pipe.
            with suppress(OSError):
                os.killpg(process.pid, signal.SIGKILL) if hasattr(os, "killpg") else process.kill()

        writer = threading.Thread(target=_write, args=(process.stdin, text.encode()), daemon=True)
        writer.start()
        try:
            with _limited(self.timeout_s, stop) as is_late:
                data = _read_at_most(process.stdout.read1)  # type: ignore[attr-defined]
                if data is not None:
                    process.wait()
        finally:
            if process.poll() is None:
                stop()
            process.wait()
            writer.join()
            process.stdout.close()
        if is_late():
            raise ConfigError(f"--command: '{name}': gave no reply within {self.timeout_s:g} s")
        if data is None:
            raise ConfigError(f"--command: '{name}': printed more than {REPLY_BYTES_MAX} bytes")
        if process.returncode:
            raise ConfigError(f"--command: '{name}': ended with exit code {process.returncode}")
        return data.decode("utf-8", "replace")


def _write(pipe: Any, data: bytes) -> None:
    with suppress(OSError):
        pipe.write(data)
    with suppress(OSError):
        pipe.close()


def _read_at_most(read: Callable[[int], bytes]) -> bytes | None:
    """All bytes of a stream; None if there are more than ``REPLY_BYTES_MAX``."""
    found = bytearray()
    while chunk := read(1 << 16):
        found += chunk
        if len(found) > REPLY_BYTES_MAX:
            return None
    return bytes(found)


@contextmanager
def _limited(timeout_s: float, stop: Callable[[], None]) -> Iterator[Callable[[], bool]]:
    """Call ``stop`` if the block takes longer; yields whether it did.

    The time of a socket counts for each piece, and a slow stream has many.
    """
    late = threading.Event()

    def end() -> None:
        late.set()
        stop()

    timer = threading.Timer(timeout_s, end)
    timer.daemon = True
    timer.start()
    try:
        yield late.is_set
    finally:
        timer.cancel()


def _shown(place: urllib.parse.SplitResult) -> str:
    """A URL without possible secrets."""
    return f"{place.scheme}://{place.netloc.rpartition('@')[2]}{place.path}"[:_ERROR_CHARS]
