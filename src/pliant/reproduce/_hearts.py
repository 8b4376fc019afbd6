"""Cohorts of phantom hearts with known stenosis, and what is measured on their true surfaces."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from .._arrays import FloatArray
from ..heart import (
    PhantomCohort,
    SegmentFeatures,
    aha_segments,
    endocardial_features,
    phantom_cohort,
    ventricle_frame,
)
from .bench import Bench

DATA = (
    "{count} phantom hearts with known stenosis and {change} changes of the trabeculae (no public data "
    "carry stenosis by segment), from their exact surfaces. Ours is balanced accuracy, so that guessing "
    "has .5; intervals over subjects."
)
_STEP = {True: 1.5, False: 1.0}
_LOCAL, _FINE = 3, 20


def hearts(
    bench: Bench, change: str = "mixed", *, bins: int = 10, waves: int = 10
) -> tuple[list[SegmentFeatures], FloatArray, str]:
    """Return features and per cent of stenosis (LAD, LCX, RCA) of each subject, and what to say of them."""
    count = 24 if bench.quick else 64
    setting = (count, change, bench.seed + 1000, _STEP[bench.quick])
    features = [_merged(one, bins) for one in _measured(*setting, waves)]
    return features, _cohort(*setting).stenosis, DATA.format(count=count, change=change)


def _merged(found: SegmentFeatures, bins: int) -> SegmentFeatures:
    """Add up neighbouring bins of the context: ten bins are twenty in pairs."""
    values = found.values
    context = values[:, _LOCAL : _LOCAL + _FINE].reshape(len(values), bins, -1).sum(axis=2)
    values = np.hstack([values[:, :_LOCAL], context, values[:, _LOCAL + _FINE :]])
    return replace(found, values=values, settings={**found.settings, "bins": bins})


@cache
def _cohort(count: int, change: str, seed: int, step: float) -> PhantomCohort:
    # The volumes are not used: the coarsest that can be made will do.
    return phantom_cohort(count, change=change, rng=seed, mesh_step=step, spacing=8.0)  # type: ignore[arg-type]


@cache
def _measured(count: int, change: str, seed: int, step: float, waves: int) -> list[SegmentFeatures]:
    wavelengths = np.geomspace(30.0, 6.0, waves).tolist()
    found = []
    for i, phantom in enumerate(_cohort(count, change, seed, step)):
        frame = ventricle_frame(phantom.mesh, **phantom.landmarks)
        labels = aha_segments(phantom.mesh, frame)
        found.append(
            endocardial_features(
                phantom.mesh, labels, frame, points=200, bins=_FINE, wavelengths=wavelengths, rng=i
            )
        )
    return found
