"""The six levels of a cylinder that a spin transformation bends, shared by Tables 2.1 and 2.2."""

from __future__ import annotations

from collections.abc import Iterator

from ..cortex import ConformalCylinder, conformal_cylinder
from .bench import Bench

LEVELS = (1, 2, 3, 4, 5, 6)
DATA = (
    "{count} irregular cylinders of {least} to {most} vertices around, six levels of a bump grown by spin "
    "transformation; the dissertation does not print how strong its deformations are. Intervals over cylinders."
)


def cylinders(bench: Bench) -> Iterator[list[ConformalCylinder]]:
    """Yield the levels of each cylinder: other triangles, other resolution."""
    for i, sides in enumerate(_sides(bench)):
        yield [conformal_cylinder(level, sides=sides, rng=bench.seed + i) for level in LEVELS]


def described(bench: Bench) -> str:
    """Say what the cylinders are."""
    sides = _sides(bench)
    return DATA.format(count=len(sides), least=sides[0], most=sides[-1])


def _sides(bench: Bench) -> tuple[int, ...]:
    return (24, 28, 32) if bench.quick else (24, 28, 32, 40, 48)
