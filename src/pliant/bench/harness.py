"""Run one measurement in a fresh process; report medians, ratios and the machine they were taken on."""

from __future__ import annotations

import json
import os
import platform
import statistics
import subprocess
import sys
from collections.abc import Mapping, Sequence
from importlib import metadata
from typing import Any

from ..errors import PliantError

Row = dict[str, Any]


class BenchmarkError(PliantError):
    """A measurement that did not come back with a result."""


def measured(
    module: str, task: str, settings: Mapping[str, Any], *, repeats: int, limit: float = 3600
) -> Row:
    """Run ``python -m module task settings`` several times and merge what it prints.

    Parameters
    ----------
    module : str
        A module that, run as a program, prints one JSON object with at least ``seconds``.
    task : str
        What it should measure.
    settings : mapping
        Its settings, JSON-ready.
    repeats : int
        Processes to run, one after another.
    limit : float
        Seconds after which a process is stopped.

    Returns
    -------
    dict
        The last run's object, with ``seconds`` the median over the runs, ``fastest``, ``slowest`` and ``runs``; with
        only ``skipped``, a reason, where a package is missing.

    Raises
    ------
    BenchmarkError
        If a run fails.
    """
    command = [sys.executable, "-m", module, task, json.dumps(dict(settings))]
    runs: list[Row] = []
    for _ in range(repeats):
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit, check=False)
        if done.returncode:
            message = f"{task} failed: {done.stderr.strip().splitlines()[-1] if done.stderr.strip() else '?'}"
            raise BenchmarkError(message)
        runs.append(json.loads(done.stdout.strip().splitlines()[-1]))
        if "skipped" in runs[-1]:
            return runs[-1]
    seconds = [run["seconds"] for run in runs]
    spread = {"seconds": statistics.median(seconds), "fastest": min(seconds), "slowest": max(seconds)}
    return {**runs[-1], **spread, "runs": len(runs)}


def peak_megabytes() -> float:
    """Return the largest resident size of this process so far, in MB (0 where the system does not tell)."""
    try:
        import resource
    except ImportError:
        return 0.0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1e6 if sys.platform == "darwin" else 1e3)


def machine(packages: Sequence[str] = ("numpy", "scipy", "numba")) -> Row:
    """Describe the machine and the versions a table was measured with."""
    versions: dict[str, str] = {}
    for package in packages:
        try:
            versions[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            versions[package] = "not installed"
    affinity = getattr(os, "sched_getaffinity", None)
    return {
        "processor": _processor(),
        "cores": len(affinity(0)) if affinity else os.cpu_count(),
        "system": platform.system(),
        "python": platform.python_version(),
        "versions": versions,
    }


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            for line in lines:
                if line.startswith("model name"):
                    return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
