"""``gen-data``, also as ``python -m gen_data.generator.cli``; Ctrl-C is handled from here on."""

from __future__ import annotations

import os
import signal


def _leave(number: int, frame: object) -> None:
    """End the process; nothing has begun while modules are imported."""
    del number, frame
    os.write(2, b"gen-data: interrupted\n")
    os._exit(130)


signal.signal(signal.SIGINT, _leave)
signal.signal(signal.SIGTERM, _leave)


def main() -> None:
    """Run the command line and exit with its code."""
    from gen_data.generator.cli.main import main as run

    run()


if __name__ == "__main__":
    main()
