"""A fake data set made by a separate process.

``python -m tests.runner.fake_run OUT WORKERS DELAY_S [BALLAST_BYTES]``

Tests kill it. Exit codes and messages equal the command line's.
"""

import os
import sys

from gen_data.core.errors import GenDataError
from tests.runner.doubles import Trouble, make

N, SHARD_SIZE = 24, 2
DELAY_S = 0.04


def main() -> int:
    out, workers, delay_s = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
    # Random bytes do not compress: the job is at least as large as they are.
    ballast = os.urandom(int(sys.argv[4])) if len(sys.argv) > 4 else b""
    trouble = Trouble(delay_s=delay_s, ballast=ballast)
    try:
        make(out, N, SHARD_SIZE, workers=workers, trouble=trouble)
    except GenDataError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
