"""The command line: arguments, exit codes, progress. Nothing else in the project prints."""
