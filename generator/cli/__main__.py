"""``python -m generator.cli`` is ``gen-data``."""

from generator.cli.main import main

if __name__ == "__main__":
    main()
