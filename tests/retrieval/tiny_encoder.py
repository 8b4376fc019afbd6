"""The smallest encoder that does something sensible (a hash of eight by eight places), and pictures for it."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from pliant.errors import InputError
from pliant.images import as_picture

cv2 = pytest.importorskip("cv2")
Image = pytest.importorskip("PIL.Image")


class TinyEncoder:
    bits = 64

    def encode(self, pictures):
        return np.array([self._one(as_picture(picture)) for picture in pictures]).reshape(-1, 8)

    def save(self, folder):
        Path(folder).mkdir(parents=True)
        (Path(folder) / "tiny").write_text("")

    def _one(self, picture):
        if np.ptp(picture.grey) < 1e-6:
            raise InputError("the picture is of one colour: it has no edges to describe")
        small = cv2.resize(picture.grey, (8, 8), interpolation=cv2.INTER_AREA)
        return np.packbits(small.ravel() > np.median(small), bitorder="little")


def scene(seed: int, width: int = 96, height: int = 72) -> np.ndarray:
    field = gaussian_filter(np.random.default_rng(seed).random((height, width)), 7)
    return np.rint(20 + 210 * (field - field.min()) / np.ptp(field)).astype(np.uint8)


def encoded(pixels: np.ndarray, kind: str = "PNG", **options) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, kind, **options)
    return buffer.getvalue()


def write_classes(folder: Path, classes: dict[str, int]) -> Path:
    """Write so many pictures a class; their seeds count on."""
    seed = 0
    for name, count in classes.items():
        (folder / name).mkdir(parents=True)
        for _ in range(count):
            (folder / name / f"{seed}.jpg").write_bytes(encoded(scene(seed), "JPEG", quality=92))
            seed += 1
    return folder
