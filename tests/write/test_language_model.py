"""Language models as foreign programs: bounded in time and size, and without secrets in texts."""

import os
import sys
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler

import pytest

from gen_data.core.errors import ConfigError
from gen_data.lab.write.language_model import REPLY_BYTES_MAX, Message, ModelCommand, ModelServer
from tests.write.scripted import Answer, body_of, send, serve

TALK = (Message("system", "rules"), Message("user", "mugs"))
SCHEMA = {"type": "object"}
KEY = "sk-very-secret-1234"


def failure(answer: Answer, key: str = "", timeout_s: float = 20.0) -> str:
    """The error of a server's only answer, without its URL."""
    with serve([answer]) as script:
        with pytest.raises(ConfigError) as error:
            ModelServer(script.url, key=key, timeout_s=timeout_s).reply(TALK, SCHEMA)
        assert error.value.__cause__ is None
        assert error.value.exit_code == 2
        return str(error.value).removeprefix(f"{script.url}: ")


def test_a_server_is_asked_as_openais_is() -> None:
    with serve(["template: tabletop"]) as script:
        model = ModelServer(script.url, "small", KEY)
        assert model.reply(TALK, SCHEMA) == "template: tabletop"

    assert script.requests == [
        {
            "messages": [
                {"role": "system", "content": "rules"},
                {"role": "user", "content": "mugs"},
            ],
            "model": "small",
            "response_format": {
                "type": "json_schema",
                "json_schema": {"name": "configuration", "schema": SCHEMA, "strict": False},
            },
        }
    ]
    assert script.heads[0]["path"] == "/v1/chat/completions"
    assert script.heads[0]["Authorization"] == f"Bearer {KEY}"


def test_a_server_without_schemas_is_asked_without_one_from_then_on() -> None:
    refusal = lambda handler: send(handler, b"response_format is unknown", 400)  # noqa: E731
    with serve([refusal, "a: 1", "b: 2"]) as script:
        model = ModelServer(f"{script.url}/chat/completions/")
        assert [model.reply(TALK, SCHEMA) for _ in range(2)] == ["a: 1", "b: 2"]

    assert ["response_format" in request for request in script.requests] == [True, False, False]
    assert {head["path"] for head in script.heads} == {"/v1/chat/completions"}
    assert all("Authorization" not in head for head in script.heads)


def status(number: int, body: bytes = b"") -> Callable[[BaseHTTPRequestHandler], None]:
    return lambda handler: send(handler, body, number)


@pytest.mark.parametrize(
    ("answer", "fact"),
    [
        (status(500, b"out of\nmemory"), "answered 500; expected 200: out of memory"),
        (status(401), "answered 401; expected 200: "),
        (status(404), "answered 404; expected 200: "),
        (b"", "expected a reply as OpenAI's chat completions have it, got: "),
        (b"<html><h1>Hello</h1>", "expected a reply as OpenAI's chat completions have it, got: <h"),
        (b"[]", "expected a reply as OpenAI's chat completions have it, got: []"),
        (b'{"choices": []}', "expected a reply as OpenAI's chat completions have it"),
        (body_of(None), "expected a reply as OpenAI's chat completions have it"),
        (body_of([{"text": "a"}]), "expected a reply as OpenAI's chat completions have it"),
        (b"\xff\xfe\x00", "expected a reply as OpenAI's chat completions have it"),
        (b'{"a":' * 100_000, "expected a reply as OpenAI's chat completions have it"),
        (body_of("x" * REPLY_BYTES_MAX), f"sent more than {REPLY_BYTES_MAX} bytes"),
    ],
)
def test_an_answer_that_is_none_is_one_short_error(answer: Answer, fact: str) -> None:
    found = failure(answer)

    assert found.startswith(fact)
    assert len(found) < 450
    assert "\n" not in found


def test_a_redirection_is_not_followed() -> None:
    with serve(["from elsewhere"]) as other:
        away = lambda handler: send(handler, b"", 307, Location=other.url)  # noqa: E731
        assert failure(away, KEY).startswith("answered 307; expected 200")

    assert other.requests == []


def endless(handler: BaseHTTPRequestHandler) -> None:
    """A body without end."""
    handler.send_response(200)
    handler.end_headers()
    while True:
        handler.wfile.write(b"x" * 65536)


def endless_head(handler: BaseHTTPRequestHandler) -> None:
    handler.wfile.write(b"HTTP/1.1 200 OK\r\n")
    while True:
        handler.wfile.write(b"A: b\r\n")


def claims_much(handler: BaseHTTPRequestHandler) -> None:
    handler.send_response(200)
    handler.send_header("Content-Length", str(10**15))
    handler.end_headers()
    handler.wfile.write(b"{}")


@pytest.mark.parametrize(
    ("answer", "fact"),
    [
        (endless, f"sent more than {REPLY_BYTES_MAX} bytes"),
        (endless_head, "has no readable answer"),
        (claims_much, "expected a reply as OpenAI's chat completions have it"),
    ],
)
def test_a_stream_without_end_ends(answer: Answer, fact: str) -> None:
    assert failure(answer).startswith(fact)


@pytest.mark.parametrize("begins", [False, True])
def test_a_server_that_is_slow_is_left(begins: bool) -> None:
    """It sends nothing at all, or one byte now and then, each within the limit of a socket."""
    with serve([]) as waiting:

        def drip(handler: BaseHTTPRequestHandler) -> None:
            if begins:
                handler.send_response(200)
                handler.end_headers()
            while not waiting.finished.wait(0.02):
                if begins:
                    handler.wfile.write(b" ")

        assert failure(drip, timeout_s=0.2) == (
            "gave no whole reply within 0.2 s; --timeout raises that"
        )


def test_the_key_is_in_no_text_that_comes_back() -> None:
    """A server may send it back."""
    echo = status(401, f"wrong key {KEY}, {KEY}".encode())

    assert failure(echo, KEY) == "answered 401; expected 200: wrong key [key], [key]"
    with serve([f"# {KEY}\ntemplate: tabletop"]) as script:
        model = ModelServer(script.url, key=KEY)
        assert model.reply(TALK, SCHEMA) == "# [key]\ntemplate: tabletop"


@pytest.mark.parametrize("key", ["sk secret", "sk-secret\r\nHost: evil", "sk-secr\u00e9t"])
def test_a_key_that_no_header_can_hold_is_refused_without_being_shown(key: str) -> None:
    with pytest.raises(ConfigError, match="the key holds a space, a line break") as error:
        ModelServer("http://127.0.0.1:1/v1", key=key)
    assert "secr" not in str(error.value)


@pytest.mark.parametrize(
    "url",
    ["", "localhost:8080", "file:///etc/passwd", "ftp://host/v1", "http://", "http://h:x/v1",
     "http://user:secret@host/v1", "http://host/v1?key=secret", "http://ho st/v1"],
)  # fmt: skip
def test_a_url_that_cannot_be_used_is_refused(url: str) -> None:
    with pytest.raises(ConfigError, match="--url: ") as error:
        ModelServer(url)
    assert "secret" not in str(error.value)


def test_an_absent_server_is_an_error() -> None:
    with serve(["gone"]) as script:
        pass
    with pytest.raises(ConfigError, match="Connection refused"):
        ModelServer(script.url).reply(TALK, SCHEMA)


def command(script: str, timeout_s: float = 20.0) -> ModelCommand:
    return ModelCommand([sys.executable, "-S", "-c", script], timeout_s)


def test_a_command_reads_the_conversation_and_prints_the_reply() -> None:
    echo = command("import sys; print(sys.stdin.read(), end='')")

    assert echo.reply(TALK, SCHEMA) == "[system]\nrules\n\n[user]\nmugs"


@pytest.mark.parametrize(
    ("script", "timeout_s", "fact"),
    [
        ("while True: print('x' * 9999)", 20, f"printed more than {REPLY_BYTES_MAX} bytes"),
        ("raise SystemExit(3)", 20, "ended with exit code 3"),
        ("import time; time.sleep(600)", 0.2, "gave no reply within 0.2 s"),
        ("import os, time; os.fork(); time.sleep(600)", 0.2, "gave no reply within 0.2 s"),
    ],
)
def test_a_command_that_gives_no_reply_ends(script: str, timeout_s: float, fact: str) -> None:
    if "fork" in script and not hasattr(os, "fork"):
        pytest.skip("this system has no fork")
    with pytest.raises(ConfigError, match=fact):
        command(script, timeout_s).reply(TALK, SCHEMA)


@pytest.mark.parametrize("words", [[], ["no-such-program"], ["a\0b"]])
def test_a_command_that_cannot_be_run_is_an_error(words: list[str]) -> None:
    with pytest.raises(ConfigError, match="--command: "):
        ModelCommand(words).reply(TALK, SCHEMA)
