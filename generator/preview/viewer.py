"""The Rerun viewer as a process: a desktop window, or a server for browsers.

Rerun's Python functions for both listen on all network interfaces and cannot be told otherwise;
its command line can.
"""

import errno
import socket
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from gen_data.core import errors, processes

LOOPBACK = "127.0.0.1"
GRPC_PORT = 9876
WEB_PORT = 9090
PORTS_TRIED = 100
START_TIMEOUT_S = 60.0


@dataclass(frozen=True)
class Viewer:
    """A running viewer.

    Attributes:
        process: Its process.
        stream_url: Where recordings are sent.
        web_url: Page for a browser; empty for a desktop window.
    """

    process: subprocess.Popen[bytes]
    stream_url: str
    web_url: str = ""


def open_window() -> Viewer:
    """Open a desktop window that outlives this process; only this machine can send to it.

    Raises:
        ConfigError: The viewer does not start, for example without a display.
    """
    port = _find_free_port(LOOPBACK, GRPC_PORT)
    arguments = ("--bind", LOOPBACK, "--port", str(port), "--expect-data-soon")
    process = subprocess.Popen(
        [str(_executable()), *arguments], stdout=subprocess.DEVNULL, start_new_session=True
    )
    _wait_until_listening(process, LOOPBACK, port)
    return Viewer(process, _stream_url(LOOPBACK, port))


def serve_web(host: str) -> Viewer:
    """Serve a viewer to browsers; it ends with this process.

    Args:
        host: The IP address to listen on; ``0.0.0.0`` shows the scene to the whole network.

    Raises:
        ConfigError: This machine does not have the address, or the server does not start.
    """
    port, web_port = _find_free_port(host, GRPC_PORT), _find_free_port(host, WEB_PORT)
    listening = ("--bind", host, "--port", str(port), "--web-viewer-port", str(web_port))
    command = (str(_executable()), "--serve-web", *listening)
    process = subprocess.Popen(processes.tie(command), stdout=subprocess.DEVNULL)
    _wait_until_listening(process, host, port)
    _wait_until_listening(process, host, web_port)
    # A wildcard is not an address to connect to.
    reachable = LOOPBACK if host == "0.0.0.0" else host
    stream_url = _stream_url(reachable, port)
    page = f"http://{reachable}:{web_port}/?url={quote(stream_url, safe='')}"
    return Viewer(process, stream_url, page)


def _stream_url(host: str, port: int) -> str:
    return f"rerun+http://{host}:{port}/proxy"


def _executable() -> Path:
    import rerun_cli

    return Path(rerun_cli.__file__).with_name("rerun")


def _find_free_port(host: str, first: int) -> int:
    """Find the first free port from ``first`` on; ConfigError if this machine has none there."""
    for port in range(first, first + PORTS_TRIED):
        with socket.socket(socket.AF_INET) as probe:
            try:
                probe.bind((host, port))
            except OSError as error:
                if error.errno == errno.EADDRINUSE:
                    continue
                raise errors.ConfigError(
                    f"--host {host}: {error.strerror}; expected an IPv4 address of this machine"
                ) from error
            return port
    raise errors.ConfigError(f"--host {host}: ports {first} to {port} are all in use")


def _wait_until_listening(process: subprocess.Popen[bytes], host: str, port: int) -> None:
    """Wait until the viewer accepts connections; ConfigError if it ends or takes too long."""
    deadline_s = time.monotonic() + START_TIMEOUT_S
    while process.poll() is None and time.monotonic() < deadline_s:
        try:
            socket.create_connection((host, port), timeout=1.0).close()
        except OSError:
            time.sleep(0.05)
        else:
            return
    process.kill()
    raise errors.ConfigError(
        f"the Rerun viewer did not start (exit code {process.wait()}; see above); a desktop window "
        "takes a display: without one use --web, or --save and open the file elsewhere"
    )
