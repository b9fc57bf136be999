"""Questions to the driver of the GPU."""

import subprocess


def ask_driver(query: str) -> str:
    """One field of ``nvidia-smi``; empty without it."""
    command = ["nvidia-smi", f"--query-gpu={query}", "--format=csv,noheader,nounits"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10)
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip().splitlines()[0]
