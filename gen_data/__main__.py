"""``python -m gen_data`` is ``gen-data``."""

from gen_data.cli.__main__ import main

main()
