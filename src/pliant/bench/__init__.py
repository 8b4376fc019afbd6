"""Benchmarks against other packages, each measured in a process of its own on the same input."""
