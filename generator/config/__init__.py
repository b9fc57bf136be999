"""YAML to typed, frozen configuration; every error names file, line, column and field."""
