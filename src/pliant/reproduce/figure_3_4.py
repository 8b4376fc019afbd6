"""Figure 3.4: the density estimate of a hand on the whole body and on the arm alone."""

from __future__ import annotations

import numpy as np

from .._arrays import FloatArray
from ..descriptors import bde, rms_biharmonic_distance
from ..evaluate import part_of
from ..mesh import boundary_edges, shapes
from ..spectral import biharmonic_distances, eigenbasis
from ._plots import lines
from .bench import Bench
from .findings import Experiment, Findings, row_of

RADII = np.geomspace(0.02, 2.0, 24)
AGREES, PARTS = 0.1, 0.3


def _run(bench: Bench) -> Findings:
    poses = ("rest", "wave") if bench.quick else ("rest", "walk", "run", "wave", "reach")
    curves, cuts = [], []
    for pose in poses:
        errors, cut = _errors(pose, 3000 if bench.quick else 8000)
        curves.append(errors)
        cuts.append(cut)
    errors, cut = np.stack(curves), float(np.mean(cuts))
    inside, beyond = errors[:, cut / 2 > RADII].mean(axis=1), errors[:, 1.5 * cut < RADII].mean(axis=1)
    figure = lines(
        RADII,
        {f"{pose}": row for pose, row in zip(poses, errors, strict=True)},
        x_label="radius, RMS biharmonic distances of the whole (the cut is at the dotted place)",
        y_label="relative change at the hand's tip",
        log_x=True,
    )
    figure.axes[0].axvline(cut, color="#9aa3ad", ls=":", lw=1)
    bench.figure(figure, "Change of the density at a hand's tip when all but the arm is cut off, by radius")
    near, far = float(inside.mean()), float(beyond.mean())
    return Findings(
        "holds" if near < AGREES and far > PARTS else "holds partly" if far > 2 * near else "does not hold",
        f"Below half the distance to the cut the two signatures differ by {near:.2f} of their value, beyond "
        f"one and a half times it by {far:.2f}. The biharmonic distance itself is global: cutting the body "
        "off changes every distance a little, so agreement is never exact.",
        f"A synthetic human of {3000 if bench.quick else 8000} vertices in {len(poses)} poses, mean kernel "
        "of simple balls with radii in the whole's unit. Intervals over poses.",
        (
            row_of("relative change at radii below half the distance to the cut", None, inside),
            row_of("relative change at radii beyond 1.5 times that distance", None, beyond),
        ),
        {"eigenpairs": 120, "poses": poses},
    )


def _errors(pose: str, n: int) -> tuple[FloatArray, float]:
    body = shapes.human(n).posed(pose)
    named = [body.part_names.index(part) for part in ("left arm", "left hand")]
    arm, source = part_of(body.mesh, np.isin(body.parts, named))
    hand = np.flatnonzero(body.parts[source] == named[1])
    whole_spectrum, part_spectrum = eigenbasis(body.mesh, 120), eigenbasis(arm, 120)
    edge = np.unique(boundary_edges(arm))
    to_edge = biharmonic_distances(whole_spectrum, source[edge]).min(axis=0)
    tip = int(hand[to_edge[source[hand]].argmax()])
    unit = rms_biharmonic_distance(whole_spectrum)
    whole = bde(whole_spectrum, RADII * unit, average="simple", statistic="mean", form="raw", relative=False)
    part = bde(part_spectrum, RADII * unit, average="simple", statistic="mean", form="raw", relative=False)
    change: FloatArray = np.abs(part[tip] / whole[source[tip]] - 1)
    return change, float(to_edge[source[tip]] / unit)


EXPERIMENT = Experiment(
    "figure-3.4",
    "Occlusion: a hand on the body and on the arm alone",
    "The signatures of whole and part agree until the ball reaches the cut.",
    "They differ by less than a tenth at radii below half the distance to the cut and by more than three "
    "tenths beyond it.",
    _run,
)
