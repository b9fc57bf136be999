"""Counted fault injection: ``python -m benchmarks.faults [--quick | --full] [--only NAME]``.

Each campaign is a function of a ``Scale`` and an empty folder that returns a ``Result``. Campaigns
that need a privilege or a tool report skipped attempts with the reason, and do not count them as
held.
"""
