"""Benchmarks: ``python -m benchmarks.bench_tabletop`` and its neighbours."""
