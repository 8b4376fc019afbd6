"""Progress where nobody looks at a terminal: plain lines, few of them, none for short work."""

from __future__ import annotations

import io
import itertools
import re
import sys
import time

import pytest

from pliant import _progress
from pliant._parallel import ordered_map
from pliant._progress import progress_bar


@pytest.fixture
def hurried(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in {"FIRST": 0.02, "BETWEEN": 0.05}.items():
        monkeypatch.setattr(_progress, name, value)


def test_short_work_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("steps", 3, show=True) as advance:
        advance()
    assert capsys.readouterr() == ("", "")


@pytest.mark.usefixtures("hurried")
def test_long_work_says_how_far_it_is_and_that_it_ended(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("subjects", 8, show=True) as advance:
        advance()
        advance(2)
        time.sleep(0.3)  # a long step of its own is no silence
    captured = capsys.readouterr()
    assert captured.out == ""
    lines = captured.err.splitlines()
    assert 3 <= len(lines) <= 9
    assert all(re.fullmatch(r"pliant: subjects: 3 of 8 after \d+ s", line) for line in lines[:-1])
    assert re.fullmatch(r"pliant: subjects: done in \d+ s", lines[-1])


@pytest.mark.usefixtures("hurried")
def test_nobody_asked(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("subjects", 8, show=False) as advance:
        advance()
        time.sleep(0.1)
    assert capsys.readouterr().err == ""


@pytest.mark.usefixtures("hurried")
def test_work_that_fails_is_not_done(capsys: pytest.CaptureFixture[str]) -> None:
    def fail() -> None:
        with progress_bar("subjects", 8, show=True):
            time.sleep(0.1)
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    said = capsys.readouterr().err
    assert "after" in said
    assert "done" not in said


@pytest.mark.usefixtures("hurried")
@pytest.mark.parametrize("n_jobs", [1, 2])
@pytest.mark.parametrize("taken", [2, 4])
def test_who_takes_all_results_and_no_more_is_told_of_the_end(
    taken: int, n_jobs: int, capsys: pytest.CaptureFixture[str]
) -> None:
    results = ordered_map(lambda i: time.sleep(0.05), range(4), n_jobs, description="parts", progress=True)
    for _ in itertools.islice(results, taken):
        pass
    results.close()  # type: ignore[attr-defined]
    said = capsys.readouterr().err
    assert "after" in said
    assert ("pliant: parts: done in" in said) == (taken == 4)


@pytest.mark.usefixtures("hurried")
def test_a_stream_that_is_closed_does_no_harm(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    with progress_bar("subjects", 8, show=True):
        stream.close = lambda: None  # type: ignore[method-assign]
        io.StringIO.close(stream)
        # Its thread would end with an error, which the test run takes for a failure.
        time.sleep(0.1)


def test_lines_grow_rare_over_a_night(monkeypatch: pytest.MonkeyPatch) -> None:
    now, waits = [0.0], []

    class Ended:
        def wait(self, seconds: float) -> bool:
            waits.append(seconds)
            now[0] += seconds
            return now[0] > 8 * 3600

    monkeypatch.setattr(_progress.time, "monotonic", lambda: now[0])
    lines = _progress._Lines("subjects", 8)
    lines.ended = Ended()  # type: ignore[assignment]
    lines._tell()
    assert waits[:3] == [2.0, 10.0, 10.0]
    assert len(waits) < 80
