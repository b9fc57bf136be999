"""``python -m gen_data`` is ``gen-data``."""

from gen_data.generator.cli.main import main

main()
