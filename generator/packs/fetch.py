"""Archives of packs, brought by the ordinary client of each registry."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from gen_data.generator.core.errors import AssetError
from gen_data.generator.packs.pack_table import ClientName, Pack

_TIMEOUT_S = 1800
_NO_NETWORK = (
    "could not resolve", "name resolution", "name or service", "newconnectionerror", "enotfound",
    "eai_again", "econnrefused", "connection refused", "network is unreachable", "enetunreach",
    "timed out", "etimedout", "connection failed", "could not connect", "max retries",
)  # fmt: skip
"""What the clients say, in lower case, when there is no way to their registry."""


@dataclass(frozen=True, slots=True)
class Client:
    """A package client.

    Attributes:
        program: Looked up on PATH.
        arguments: Fetch one package into the working folder; ``{package}``, ``{version}``.
        remedy: What to do when the program is missing.
    """

    program: str
    arguments: tuple[str, ...]
    remedy: str


CLIENTS: dict[ClientName, Client] = {
    "pip": Client(
        "pip",
        ("download", "--no-deps", "--only-binary=:all:", "--disable-pip-version-check",
         "--no-input", "{package}=={version}"),
        "install pip",
    ),
    "apt": Client(
        "apt-get",
        ("download", "{package}={version}"),
        "it comes with Debian and Ubuntu only",
    ),
    "npm": Client("npm", ("pack", "--silent", "{package}@{version}"), "install Node.js"),
}  # fmt: skip


def fetch(pack: Pack, folder: Path) -> Path:
    """The archive of a pack, fetched into an empty folder.

    Raises:
        AssetError: the client is missing, there is no network, or it fails otherwise.
    """
    command = _command(pack)
    try:
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True,
            errors="replace", timeout=_TIMEOUT_S, stdin=subprocess.DEVNULL, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise _failed(pack, command, f"took longer than {_TIMEOUT_S} s") from None
    files = sorted(path for path in folder.iterdir() if path.is_file())
    if done.returncode != 0 or len(files) != 1:
        said = (done.stderr + done.stdout).strip()
        if any(words in said.lower() for words in _NO_NETWORK):
            raise _failed(pack, command, "found no network")
        raise _failed(pack, command, f"failed: {said[-600:] or 'it brought no file'}")
    return files[0]


def check_archive(pack: Pack, archive: Path) -> None:
    """Raise AssetError unless a file is the archive that the table means, bit by bit."""
    try:
        digest = file_digest(archive)
    except OSError as error:
        raise AssetError(f"{archive}: {error.strerror}; check the path and its rights") from None
    if digest != pack.sha256:
        raise AssetError(
            f"{archive}: sha256 is {digest}, expected {pack.sha256} for {pack.source}; it is "
            "another version, damaged or tampered with: fetch it again, nothing was installed"
        )


def file_digest(path: Path) -> str:
    """sha256 of a file, in hexadecimal."""
    digest = sha256()
    with path.open("rb") as file:
        while chunk := file.read(1 << 20):
            digest.update(chunk)
    return digest.hexdigest()


def _command(pack: Pack) -> list[str]:
    client = CLIENTS[pack.client]
    program = shutil.which(client.program)
    start = [program] if program else []
    if not start and pack.client == "pip" and importlib.util.find_spec("pip"):
        start = [sys.executable, "-m", "pip"]
    if not start:
        raise AssetError(
            f"pack '{pack.name}': '{client.program}' is not on PATH; {client.remedy}, or fetch "
            f"{pack.source} elsewhere and give it with --from FILE"
        )
    names = {"package": pack.package, "version": pack.version}
    # What they say is matched, so that it has to be in English.
    english = ["/usr/bin/env", "LC_ALL=C"]
    return english + start + [argument.format(**names) for argument in client.arguments]


def _failed(pack: Pack, command: list[str], what: str) -> AssetError:
    return AssetError(
        f"pack '{pack.name}': '{' '.join([Path(command[2]).name, *command[3:]])}' {what}\n"
        f"  Fetch {pack.source} elsewhere and give it with --from FILE; nothing was installed"
    )
