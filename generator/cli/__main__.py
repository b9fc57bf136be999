"""``python -m gen_data.generator.cli`` is ``gen-data``."""

from gen_data.generator.cli.main import main

if __name__ == "__main__":
    main()
