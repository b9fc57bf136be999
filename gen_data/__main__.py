"""``python -m gen_data`` is ``gen-data``."""

from generator.cli.main import main

main()
