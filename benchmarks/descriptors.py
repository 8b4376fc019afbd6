"""Print the hit rates of signatures, group by group.

    python benchmarks/descriptors.py SHAPES [--cache FOLDER] [--json FILE] [--groups poses,remeshed,noise] [--names ...]

SHAPES is the folder with ``tosca/`` and ``tosca_remeshed_5k/``. See ``pliant.bench.descriptors`` for what is measured.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pliant.bench.descriptors import FRACTIONS, groups, run


def show(rows: Sequence[dict[str, Any]]) -> None:
    columns = [f"at {100 * f:g} %" for f in FRACTIONS]
    for row in rows:
        numbers = "".join(f"{row[c]:8.3f}" for c in columns)
        print(
            f"{row['group']:12} {row['points']:9} {row['signature']:36}{numbers}   {row['interval at 0.1 %']}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("shapes", type=Path)
    parser.add_argument("--cache", type=Path, default=Path("descriptor-cache"))
    parser.add_argument("--json", type=Path)
    parser.add_argument("--groups", default="poses,remeshed,perturbations")
    parser.add_argument("--names", help="rows to compute, separated by semicolons; all by default")
    given = parser.parse_args()
    names = given.names.split(";") if given.names else None
    rows = []
    for group, pairs in groups(given.shapes, given.groups.split(",")).items():
        found = run(pairs, group=group, cache=given.cache, names=names)
        show(found)
        rows += found
    if given.json:
        given.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
