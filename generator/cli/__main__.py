"""``gen-data``, also as ``python -m gen_data.cli``; Ctrl-C is handled from here on."""

import gc
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
    # Modules, configuration and tables of assets stay: searching them for garbage at Python's
    # pace of every 700 objects takes a tenth of the start.
    gc.set_threshold(50_000, 20, 100)
    from gen_data.cli.main import main as run

    try:
        run()
    finally:
        # The process ends: frozen objects are not searched again by the interpreter's last steps.
        gc.freeze()


if __name__ == "__main__":
    main()
