"""A server with OpenAI's interface on the loopback, whose answers are written before."""

import json
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

Answer = str | bytes | Callable[[BaseHTTPRequestHandler], None]
"""A message of the assistant; a whole body; or a function that writes head and body."""


@dataclass
class Scripted:
    """Requests that came, and the URL."""

    url: str = ""
    requests: list[dict[str, Any]] = field(default_factory=list)
    heads: list[dict[str, str]] = field(default_factory=list)
    finished: threading.Event = field(default_factory=threading.Event)


@contextmanager
def serve(answers: Sequence[Answer]) -> Iterator[Scripted]:
    """Answer in turn; the last answer is repeated."""
    script = Scripted()

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            data = self.rfile.read(int(self.headers["Content-Length"]))
            answer = answers[min(len(script.requests), len(answers) - 1)]
            script.heads.append(dict(self.headers) | {"path": self.path})
            script.requests.append(json.loads(data))
            try:
                if callable(answer):
                    answer(self)
                else:
                    send(self, body_of(answer) if isinstance(answer, str) else answer)
            except OSError:
                pass  # The client has enough.

        def log_message(self, *args: object) -> None:
            del args

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    script.url = f"http://127.0.0.1:{server.server_port}/v1"
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield script
    finally:
        script.finished.set()
        server.shutdown()
        thread.join()
        server.server_close()


def body_of(content: object) -> bytes:
    return json.dumps({"choices": [{"message": {"content": content}}]}).encode()


def send(handler: BaseHTTPRequestHandler, body: bytes, status: int = 200, **head: str) -> None:
    handler.send_response(status)
    handler.send_header("Content-Length", str(len(body)))
    for name, value in head.items():
        handler.send_header(name, value)
    handler.end_headers()
    handler.wfile.write(body)
