"""Measurements, run by name: ``python -m tests.benchmarks.speed`` and so on. The test command leaves them out."""
