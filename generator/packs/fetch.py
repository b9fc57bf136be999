"""Download of pack archives with the ordinary client of each registry."""

import importlib.util
import shutil
import subprocess
import sys
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from gen_data.config.data_files import load_data
from gen_data.core.errors import AssetError
from gen_data.core.processes import tie
from gen_data.packs.pack_table import ClientName, Pack

_TIMEOUT_S = 1800


@dataclass(frozen=True, slots=True)
class Client:
    """A package client.

    Attributes:
        program: Name on PATH.
        arguments: Arguments to fetch one package into the working folder, with placeholders
            ``{package}`` and ``{version}``.
        remedy: Advice if the program is missing.
    """

    program: str
    arguments: list[str]
    remedy: str


_TABLE = load_data(__package__, "clients")
CLIENTS: dict[ClientName, Client] = {k: Client(**row) for k, row in _TABLE["clients"].items()}


def fetch(pack: Pack, folder: Path) -> Path:
    """Fetch the archive of a pack into an empty folder; return its path.

    Raises:
        AssetError: if the client is missing, has no network, or fails otherwise.
    """
    command = _command(pack)
    temporary = folder / "tmp"
    temporary.mkdir()
    # A client that is killed leaves its temporary files, which go with the folder.
    variables = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(temporary))
    # Messages are matched, so they must be in English.
    variables["LC_ALL"] = "C"
    try:
        done = subprocess.run(
            tie(command, variables), cwd=folder, capture_output=True, text=True, errors="replace",
            timeout=_TIMEOUT_S, stdin=subprocess.DEVNULL, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise _client_error(pack, command, f"took longer than {_TIMEOUT_S} s") from None
    files = sorted(path for path in folder.iterdir() if path.is_file())
    if done.returncode != 0 or len(files) != 1:
        said = (done.stderr + done.stdout).strip()
        if any(words in said.lower() for words in _TABLE["no_network"]):
            raise _client_error(pack, command, "found no network")
        raise _client_error(pack, command, f"failed: {said[-600:] or 'it fetched no file'}")
    return files[0]


def check_archive(pack: Pack, archive: Path) -> None:
    """Raise AssetError unless a file has the pinned hash of a pack's archive."""
    if archive.exists() and not archive.is_file():
        # A device such as /dev/zero never ends, and a pipe waits for a writer.
        raise AssetError(f"{archive}: is not a regular file; expected the archive of {pack.source}")
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
    """Hexadecimal sha256 of a file."""
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
    arguments = [argument.format(**names) for argument in client.arguments]
    return [*start, *arguments, *pack.options]


def _client_error(pack: Pack, command: list[str], what: str) -> AssetError:
    return AssetError(
        f"pack '{pack.name}': '{' '.join([Path(command[0]).name, *command[1:]])}' {what}\n"
        f"  Nothing was installed. Fetch {pack.source} elsewhere and give it with: "
        f"gen-data assets install {pack.name} --from FILE"
    )
