"""Work over processes: results in order, deaths as results where that is asked, an end when it is stopped."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest

from pliant._processes import process_map
from pliant.cli import main

DIES = "__import__('os')._exit(3)"
SLEEPS = """
import signal, sys, time
from pliant.cli import main
from pliant._processes import process_map
# A shell that runs the tests in the background has told its children to ignore interrupts.
signal.signal(signal.SIGINT, signal.default_int_handler)
def sleep(arguments):
    def work():
        for _ in process_map(time.sleep, [0, 0, 30, 30, 30], 2):
            sys.stdout.write("done\\n")
            sys.stdout.flush()
    work()
import pliant.cli
pliant.cli._run = sleep
if __name__ == "__main__":
    sys.exit(main([]))
"""


@pytest.mark.parametrize("n_jobs", [1, 2])
def test_results_come_in_order(n_jobs: int) -> None:
    assert list(process_map(abs, range(-9, 3), n_jobs)) == [*range(9, 0, -1), 0, 1, 2]


def test_what_a_worker_raises_is_raised_here() -> None:
    with pytest.raises(ZeroDivisionError):
        list(process_map(eval, ["1 + 1", "1 / 0", "2"], 2))
    with pytest.raises(BrokenProcessPool):
        list(process_map(eval, ["1 + 1", DIES, *["2"] * 20], 2))


def test_failures_become_results_where_that_is_asked() -> None:
    found = list(process_map(eval, ["1 + 1", "1 / 0", "3"], 2, failed=lambda error: type(error)))
    assert found == [2, ZeroDivisionError, 3]
    # More than a pool takes ahead: those that come after a death fail too, and none is lost.
    found = list(process_map(eval, [DIES, *["2"] * 20], 2, failed=lambda error: type(error)))
    assert len(found) == 21
    assert found[0] is BrokenProcessPool
    assert set(found) <= {2, BrokenProcessPool}


def test_a_reader_that_stops_early_does_not_wait_for_the_rest() -> None:
    start = time.monotonic()
    results = process_map(time.sleep, [0, 25, 25], 2)
    next(results)
    results.close()  # type: ignore[attr-defined]
    assert time.monotonic() - start < 20


def test_an_interrupt_at_the_terminal_ends_workers_at_once_and_quietly(tmp_path: Path) -> None:
    script = tmp_path / "sleeps.py"
    script.write_text(SLEEPS)
    with subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()  # workers are at it
        process.stdout.readline()
        os.killpg(process.pid, signal.SIGINT)
        _, said = process.communicate(timeout=20)
    assert process.returncode == 130
    assert said == "pliant: interrupted: stopped before the end\n"
    until = time.monotonic() + 10
    while _group_lives(process.pid) and time.monotonic() < until:
        time.sleep(0.1)
    assert not _group_lives(process.pid)


def test_an_interrupted_command_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("pliant.load_mesh", interrupted, raising=False)
    assert main(["inspect", "mesh.ply"]) == 130
    assert capsys.readouterr().err == "pliant: interrupted: stopped before the end\n"


def _group_lives(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True
