"""The solver object: order once, then distances and betweenness from any number of sources."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from .._arrays import FloatArray, IntArray, frozen, vertex_indices
from .._parallel import ordered_map
from ..cluster import Scheduler
from ..errors import FileFormatError, InputError, NumericalError
from ..mesh import Mesh, load_arrays, save_arrays
from .cuda import Device, cuda_distances, on_cuda
from .customise import (
    UNREACHED,
    Arcs,
    CountedArcs,
    counted_arcs,
    edge_flow_of,
    fixed_point_lengths,
    metric_arcs,
)
from .elimination import Int32Array, eliminate
from .engines import Engine, engine
from .flow import passing_flow
from .graph import EdgeGraph, GraphKind, as_graph, as_weights, component_labels
from .plain import plain_edge_flow
from .sweeps import LANES, DistanceSweep, batches, checked_limit

FORMAT = "pliant-geodesic-hierarchy-1"
SMALLEST_SWEPT = 128  # smaller graphs are solved plainly: compiling the sweeps would take longer
# Bits of damping tried in turn, over the longest path, when numbers of shortest paths leave float64.
DAMPING_BITS = (0.0, 600.0, 1200.0, 1700.0)
TOO_MANY_PATHS = (
    "more shortest paths between two vertices than float64 can count, even damped; perturb the vertices slightly "
    "so that fewer paths tie"
)


class GeodesicHierarchy:
    """Shortest paths on a graph, ordered once and then solved from any number of sources.

    The vertices are ordered by nested dissection and joined into a chordal supergraph whose arcs carry exact
    shortest-path lengths (customizable contraction hierarchies; Dibbelt, Strasser and Wagner 2016). Sweeps over it
    serve 64 sources at once (PHAST; Delling et al. 2011).

    Parameters
    ----------
    graph : Mesh, EdgeGraph or sparse matrix
        What to find paths on. A mesh stands for its edge graph.
    kind : {"edges", "refined"}
        The graph of a mesh, see :func:`pliant.edge_graph`; ignored for a graph or a matrix.

    Attributes
    ----------
    graph : EdgeGraph
        The graph itself.

    Notes
    -----
    Building costs about 10 microseconds a vertex for a triangle mesh; memory is about 1 kB a vertex, and while
    sweeping another 1.3 kB a vertex and thread.

    Examples
    --------
    >>> from pliant import shapes
    >>> hierarchy = GeodesicHierarchy(shapes.icosphere(2))
    >>> hierarchy.distances([0, 5]).shape
    (2, 162)
    """

    # Made when first asked for: distances do not need path counts, and fields do not need float lengths.
    _kept_metric: Arcs | None = None
    _kept_counted: CountedArcs | None = None

    def __init__(self, graph: Mesh | EdgeGraph | sp.sparray, kind: GraphKind = "edges") -> None:
        self.graph = as_graph(graph, kind)
        self._skeleton = eliminate(self.graph)

    def __repr__(self) -> str:
        return f"GeodesicHierarchy({self.n_vertices} vertices, {len(self._skeleton.heads)} arcs)"

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        return self.graph.n_vertices

    @property
    def order(self) -> IntArray:
        """(n,) vertices in the order of elimination; neighbours on the surface are mostly near in it."""
        return self._skeleton.order.astype(np.int64)

    @cached_property
    def components(self) -> IntArray:
        """(n,) number of the connected component of each vertex."""
        return frozen(component_labels(self.graph)[1])

    def _metric(self, n_jobs: int | None = None) -> Arcs:
        if self._kept_metric is None:
            self._kept_metric = metric_arcs(self._skeleton, self.graph, n_jobs)
        return self._kept_metric

    def _counted(self, n_jobs: int | None = None) -> CountedArcs:
        if self._kept_counted is None:
            self._kept_counted = counted_arcs(self._skeleton, self.graph, self._fixed_lengths, n_jobs=n_jobs)
        return self._kept_counted

    @cached_property
    def _fixed_lengths(self) -> Int32Array:
        return fixed_point_lengths(self.graph, self.components)

    def distances(
        self,
        sources: ArrayLike,
        *,
        max_distance: float | None = None,
        n_jobs: int | None = None,
        progress: bool = False,
        device: Device = "cpu",
    ) -> FloatArray:
        """Shortest-path distances from each source to every vertex.

        Parameters
        ----------
        sources : int or (s,) array_like of int
            Vertex numbers.
        max_distance : float, optional
            Distances above this are returned as inf.
        n_jobs : int, optional
            Threads; all processors by default.
        progress : bool
            Show a bar on a terminal.
        device : {"cpu", "cuda"}
            Where to sweep; the result is the same to the last bit. See docs/scaling.md.

        Returns
        -------
        (s, n) array of float64
            In the graph's unit, exact to rounding; inf where there is no path.

        Raises
        ------
        InputError
            If a source is not a vertex, or ``max_distance`` is negative or NaN.
        UnavailableError
            If there is no such device.
        MemoryError
            If the result does not fit in memory; see :meth:`blocks`.

        Notes
        -----
        About 0.3 ms a source at 40,000 vertices on one core.
        """
        wanted = vertex_indices(sources, self.n_vertices, "sources")
        limit = checked_limit(max_distance)
        cuda = on_cuda(device)
        result = np.empty((len(wanted), self.n_vertices))
        ranks = self._skeleton.rank[wanted]
        by_rank = np.argsort(ranks, kind="stable")
        if self.n_vertices < SMALLEST_SWEPT:
            found = np.atleast_2d(sp.csgraph.dijkstra(self.graph.matrix(), directed=False, indices=wanted))
            return np.where(found > limit, np.inf, found).reshape(len(wanted), self.n_vertices)
        if cuda:
            ranks = ranks[by_rank]
            cuda_distances(
                self._skeleton, self._metric(n_jobs), ranks, by_rank, result, limit, progress=progress
            )
            return result
        sweep = DistanceSweep(self._skeleton, self._metric(n_jobs))

        def solve(places: IntArray) -> None:
            sweep.into(result, places, ranks[places], limit)

        for _ in ordered_map(solve, batches(by_rank), n_jobs, description="distances", progress=progress):
            pass
        return result

    def blocks(
        self, sources: ArrayLike | None = None, *, size: int = LANES, n_jobs: int | None = None
    ) -> Iterator[tuple[IntArray, FloatArray]]:
        """Yield (sources, distances) a block at a time, in bounded memory, computed ahead of the caller.

        Parameters
        ----------
        sources : (s,) array_like of int, optional
            Vertex numbers; every vertex by default. They come in another order than given: neighbours together.
        size : int
            Sources a block; multiples of 64 are fastest.
        n_jobs
            As in :meth:`distances`.

        Yields
        ------
        (b,) array of int, (b, n) array of float64
        """
        everyone = np.arange(self.n_vertices)
        wanted = everyone if sources is None else vertex_indices(sources, self.n_vertices, "sources")
        if size < 1:
            message = f"size must be at least 1, got {size}"
            raise InputError(message)
        wanted = wanted[np.argsort(self._skeleton.rank[wanted], kind="stable")]
        parts = [wanted[start : start + size] for start in range(0, len(wanted), size)]
        sweep = DistanceSweep(self._skeleton, self._metric(n_jobs))

        def solve(part: IntArray) -> FloatArray:
            out = np.empty((len(part), self.n_vertices))
            for places in batches(np.arange(len(part))):
                sweep.into(out, places, self._skeleton.rank[part[places]], np.inf)
            return out

        yield from zip(parts, ordered_map(solve, parts, n_jobs), strict=True)

    def betweenness(
        self,
        source_weights: ArrayLike | None = None,
        target_weights: ArrayLike | None = None,
        *,
        sources: ArrayLike | None = None,
        n_jobs: int | None = None,
        progress: bool = False,
        device: Device = "cpu",
        scheduler: Scheduler | None = None,
    ) -> FloatArray:
        """Weighted betweenness centrality: how much shortest-path traffic passes each vertex.

        With g(s, t, x) the share of the shortest paths from s to t that pass x, and x neither s nor t, this is half
        the sum of a(s) b(t) g(s, t, x) over all ordered pairs: with weights 1, the usual betweenness of an
        undirected graph, each pair once.

        Parameters
        ----------
        source_weights, target_weights : (n,) array_like of float, optional
            The a and b above, finite and not negative; 1 by default.
        sources : (s,) array_like of int, optional
            Let s run over these vertices only, each as often as it is listed.
        n_jobs : int, optional
            Threads; all processors by default. The result does not depend on it, to the last bit.
        progress : bool
            Show a bar on a terminal.
        device : {"cpu", "cuda"}
            Where to sweep. CUDA sums in another order: the same to rounding, and the same bytes on every run.
        scheduler : str or distributed.Client, optional
            Of a Dask cluster whose workers sweep instead of threads; the same bytes. See docs/scaling.md.

        Returns
        -------
        (n,) array of float64

        Raises
        ------
        MeshError
            If an edge has zero length: path counts are then not defined.
        NumericalError
            If there are more shortest paths between two vertices than can be represented.
        UnavailableError
            If there is no such device or cluster.

        Notes
        -----
        Lengths are rounded to about 1e-9 of the diameter, which makes ties exact and reproducible; paths whose
        lengths differ by less count as equal. Cost grows a little faster than n**2; docs/field.md has times.

        References
        ----------
        Brandes, A faster algorithm for betweenness centrality, 2001.
        """
        forth = as_weights(source_weights, self.n_vertices, "source_weights")
        back = as_weights(target_weights, self.n_vertices, "target_weights")
        chosen = None if sources is None else vertex_indices(sources, self.n_vertices, "sources")
        carrier = engine(device, scheduler, n_jobs, progress=progress)
        edge_flow = self._flow(chosen, forth, back, carrier, n_jobs)
        if chosen is not None:
            forth = forth * np.bincount(chosen, minlength=self.n_vertices)
        return passing_flow(self.graph.edges, edge_flow, forth, back, self.components)

    def edge_flow(
        self,
        source_weights: ArrayLike | None = None,
        target_weights: ArrayLike | None = None,
        *,
        sources: ArrayLike | None = None,
        n_jobs: int | None = None,
        progress: bool = False,
        device: Device = "cpu",
        scheduler: Scheduler | None = None,
    ) -> FloatArray:
        """Weighted betweenness of the edges of :attr:`graph`, (e,); arguments as in :meth:`betweenness`.

        Unlike vertices, edges count the paths that end at them.
        """
        forth = as_weights(source_weights, self.n_vertices, "source_weights")
        back = as_weights(target_weights, self.n_vertices, "target_weights")
        chosen = None if sources is None else vertex_indices(sources, self.n_vertices, "sources")
        carrier = engine(device, scheduler, n_jobs, progress=progress)
        return self._flow(chosen, forth, back, carrier, n_jobs)

    def sampled_betweenness(
        self,
        groups: Sequence[ArrayLike],
        weights: ArrayLike | None = None,
        stands_for: ArrayLike | None = None,
        *,
        n_jobs: int | None = None,
        progress: bool = False,
        device: Device = "cpu",
        scheduler: Scheduler | None = None,
    ) -> FloatArray:
        """Estimate betweenness from groups of sources, one estimate a group, each with little variance.

        A path from s to t counts for x in proportion to ``2 d(s, x) / d(s, t)``: over all sources that is betweenness
        exactly, over a sample it avoids rare, huge contributions of sources right behind x (Geisberger et al. 2008).

        Parameters
        ----------
        groups : sequence of (s,) array_like of int
            The sources of each group.
        weights, stands_for : (n,) array_like of float, optional
            Of a vertex as source and as target, and how many a source stands for; 1 by default.
        n_jobs, progress, device, scheduler
            As in :meth:`betweenness`.

        Returns
        -------
        (len(groups), n) array of float64
        """
        mass = as_weights(weights, self.n_vertices, "weights")[self.order]
        share = as_weights(stands_for, self.n_vertices, "stands_for")[self.order]
        carrier = engine(device, scheduler, n_jobs, progress=progress)
        ranks = [np.sort(self._skeleton.rank[vertex_indices(g, self.n_vertices, "sources")]) for g in groups]
        for arcs in self._arcs_by_damping(n_jobs):
            found = carrier.sampled(self._skeleton, arcs, mass, share, ranks)
            if all(part is not None for part in found):
                return np.stack([part for part in found if part is not None])[:, self._skeleton.rank]
        raise NumericalError(TOO_MANY_PATHS)

    def _flow(
        self,
        sources: IntArray | None,
        forth: FloatArray,
        back: FloatArray,
        carrier: Engine,
        n_jobs: int | None,
    ) -> FloatArray:
        """Edge flow from some sources; None stands for every vertex."""
        if self.n_vertices < SMALLEST_SWEPT:
            chosen = np.arange(self.n_vertices) if sources is None else sources
            return plain_edge_flow(self.graph, self._fixed_lengths, forth, back, chosen)
        order = self._skeleton.order
        ranks = np.arange(self.n_vertices) if sources is None else np.sort(self._skeleton.rank[sources])
        for arcs in self._arcs_by_damping(n_jobs):
            by_rank = (forth[order], back[order], ranks)
            flow = carrier.arc_flow(self._skeleton, arcs, *by_rank, both_ways=sources is None)
            if flow is not None:
                return edge_flow_of(arcs, flow, self.graph.n_edges)
        raise NumericalError(TOO_MANY_PATHS)

    def _arcs_by_damping(self, n_jobs: int | None) -> Iterator[CountedArcs]:
        """Yield arcs with path counts, each time damped more; those already overflowing are left out."""
        for bits in DAMPING_BITS:
            arcs = self._counted(n_jobs) if bits == 0 else self._damped(bits)
            if np.isfinite(arcs.counts).all():
                yield arcs

    def _damped(self, bits: float) -> CountedArcs:
        return counted_arcs(self._skeleton, self.graph, self._fixed_lengths, bits / float(UNREACHED))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write graph and order to an .npz file, atomically; the rest is built again in a moment."""
        stored = {"format": np.array(FORMAT), "order": self._skeleton.order}
        stored |= {"edges": self.graph.edges, "lengths": self.graph.lengths}
        save_arrays(path, stored)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> GeodesicHierarchy:
        """Read what :meth:`save` wrote.

        Raises
        ------
        FileFormatError
            If the file is not such a file, or does not hang together.
        """
        stored = load_arrays(path)
        try:
            if str(stored["format"]) != FORMAT:
                message = f"written by another version, {stored['format']}"
                raise InputError(message)
            self = cls.__new__(cls)
            self.graph = EdgeGraph(len(stored["order"]), stored["edges"], stored["lengths"])
            self._skeleton = eliminate(self.graph, order=stored["order"])
        except (InputError, KeyError, TypeError) as error:
            message = f"{os.fspath(path)}: not a geodesic hierarchy ({FORMAT}): {error}"
            raise FileFormatError(message) from error
        return self
