"""What every test may ask for."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile(
    "pliant", deadline=None, max_examples=40, suppress_health_check=[HealthCheck.too_slow], derandomize=True
)
settings.load_profile("pliant")


def _data_folder() -> Path | None:
    named = os.environ.get("PLIANT_DATA")
    folder = Path(named) if named else Path(__file__).resolve().parents[2] / "shared" / "data"
    return folder if folder.is_dir() else None


@pytest.fixture(scope="session")
def data() -> Path:
    """Folder of the evaluation data; a test that asks for it skips where there is none."""
    folder = _data_folder()
    if folder is None:
        pytest.skip("no evaluation data: set PLIANT_DATA to its folder")
    return folder
