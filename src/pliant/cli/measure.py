"""A geodesic field with what made it: what ``pliant field`` and ``pliant demo`` share."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .output import show_facts, show_table

if TYPE_CHECKING:
    from .._arrays import FloatArray
    from ..mesh import Mesh

# The neighbourhood and the number of bins that the dissertation settles on (Table 2.1).
NEIGHBOURS, BINS = 50, 10
_QUANTILES = {"least": 0.0, "5 %": 0.05, "median": 0.5, "95 %": 0.95, "greatest": 1.0}
_MOST = 5


@dataclass(frozen=True, eq=False)
class Measurement:
    """The geodesic field of one mesh.

    Attributes
    ----------
    mesh : Mesh
    name : str
    values : (n,) array
    half_widths : (n,) array or None
        Of the confidence intervals, where the field was sampled.
    settings : dict
        What made the values.
    seconds : float
        The field alone took.
    length_unit : str
        Of the mesh; empty where it is not known.
    """

    mesh: Mesh
    name: str
    values: FloatArray
    half_widths: FloatArray | None
    settings: dict[str, Any]
    seconds: float
    length_unit: str

    @property
    def label(self) -> str:
        """Name and unit of the values."""
        if self.settings["weights"] == "uniform":
            return "GFE (share of pairs)"
        return f"GFE (per {self.length_unit}²)" if self.length_unit else "GFE (per unit area)"

    @property
    def meaning(self) -> str:
        """One sentence on what the values are."""
        drawn = "points drawn by area" if self.settings["weights"] == "area" else "vertices"
        unit = ", per unit area" if self.settings["weights"] == "area" else ""
        return f"Probability that the shortest path between two random {drawn} passes each place{unit}."

    @property
    def most(self) -> list[int]:
        """The vertices of the greatest values, greatest first."""
        order = np.argsort(-self.values, kind="stable")
        return [int(vertex) for vertex in order[:_MOST]]

    @cached_property
    def quantiles(self) -> dict[str, float]:
        """Least, 5 %, median, 95 % and greatest value."""
        found = np.quantile(self.values, list(_QUANTILES.values()))
        return dict(zip(_QUANTILES, (float(value) for value in found), strict=True))

    def arrays(self) -> dict[str, FloatArray]:
        """Return the values by the names they are stored under."""
        arrays = {"gfe": self.values}
        return arrays if self.half_widths is None else {**arrays, "half_width": self.half_widths}

    def context(self) -> dict[str, Any]:
        """Return the geodesic context histograms and their edges, as :func:`pliant.report.surface_page` takes them."""
        count = min(NEIGHBOURS, self.mesh.n_vertices)
        from .. import gch_edges

        edges = gch_edges(self.values, bins=BINS)
        caption = f"GCH: share of the {count} nearest vertices"
        return {"histograms": {caption: contexts(self, edges)}, "edges": edges}

    def summary(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        summary: dict[str, Any] = {
            **self.settings,
            "vertices": self.mesh.n_vertices,
            "edges": len(self.mesh.edges),
            "faces": self.mesh.n_faces,
            "area": self.mesh.area,
            "seconds": round(self.seconds, 3),
            "gfe": self.quantiles,
            "most_travelled": [{"vertex": v, "gfe": float(self.values[v])} for v in self.most],
        }
        if self.half_widths is not None:
            summary["median_half_width"] = float(np.median(self.half_widths))
        return summary

    def show(self, more: Mapping[str, str] | None = None) -> None:
        """Write the facts and more of them, the distribution and the most travelled vertices as tables."""
        how = "exact, all pairs"
        if self.half_widths is not None:
            share = f"{100 * self.settings['confidence']:g} %"
            half = f"median half-width {np.median(self.half_widths):.3g} at {share}"
            how = f"estimated from {self.settings['samples']} sources, {half}"
        facts = {
            "vertices, edges, faces": f"{self.mesh.n_vertices}, {len(self.mesh.edges)}, {self.mesh.n_faces}",
            "area": f"{self.mesh.area:.6g} {self.length_unit}²"
            if self.length_unit
            else f"{self.mesh.area:.6g}",
            "weights, graph": f"{self.settings['weights']}, {self.settings['graph']}",
            "method": how,
            "time": f"{self.seconds:.2f} s",
            **(more or {}),
        }
        show_facts(f"Geodesic field of {self.name}", facts)
        show_table(self.label, list(_QUANTILES), [[f"{v:.4g}" for v in self.quantiles.values()]])
        rows = [[str(v), f"{self.values[v]:.4g}", *self._place(v)] for v in self.most]
        show_table("Most travelled vertices", ("vertex", "GFE", "x", "y", "z"), rows)

    def _place(self, vertex: int) -> list[str]:
        return [f"{coordinate:.5g}" for coordinate in self.mesh.vertices[vertex]]


def contexts(result: Measurement, edges: FloatArray) -> FloatArray:
    """Return the (n, bins) geodesic context histograms of a field."""
    from .. import gch, nearest

    count = min(NEIGHBOURS, result.mesh.n_vertices)
    near = nearest(result.mesh, count=count, graph=result.settings["graph"], progress=True)
    return gch(result.values, near, edges=edges)


def measure(
    mesh: Mesh,
    name: str,
    *,
    weights: Literal["area", "uniform"] = "area",
    graph: Literal["edges", "refined"] = "edges",
    samples: int | None = None,
    seed: int = 0,
    jobs: int | None = None,
    length_unit: str = "",
    device: Literal["cpu", "cuda"] = "cpu",
    scheduler: Any = None,
    progress: bool = True,
) -> Measurement:
    """Compute a field, exactly or from samples, telling how far it is."""
    from .. import __version__, estimate_gfe, gfe

    settings: dict[str, Any] = {"mesh": name, "quantity": "gfe", "weights": weights, "graph": graph}
    where: dict[str, Any] = {"n_jobs": jobs, "progress": progress, "device": device, "scheduler": scheduler}
    half_widths = None
    start = time.perf_counter()
    if samples is None:
        values = gfe(mesh, weights=weights, graph=graph, **where)
    else:
        estimate = estimate_gfe(mesh, samples, weights=weights, graph=graph, rng=seed, **where)
        values, half_widths = estimate.values, estimate.half_widths
        settings |= {"samples": samples, "seed": seed, "confidence": estimate.confidence}
    seconds = time.perf_counter() - start
    if device != "cpu":
        settings["device"] = device
    settings["pliant"] = __version__
    return Measurement(mesh, name, values, half_widths, settings, seconds, length_unit)
