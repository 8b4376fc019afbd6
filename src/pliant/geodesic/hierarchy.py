"""The solver object: order once, then distances and betweenness from any number of sources."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from .._arrays import FloatArray, IntArray, frozen, vertex_indices
from .._parallel import ordered_map
from ..errors import FileFormatError, InputError, NumericalError
from ..mesh import Mesh, load_arrays, save_arrays
from .customise import UNREACHED, Arcs, CountedArcs, counted_arcs, fixed_point_lengths, metric_arcs, unpack
from .elimination import Int32Array, eliminate
from .flow import FlowJob
from .graph import EdgeGraph, GraphKind, as_graph, as_weights, component_labels
from .plain import plain_edge_flow
from .sweeps import DistanceJob, batches

FORMAT = "pliant-geodesic-hierarchy-1"
# Smaller graphs are solved plainly: compiling the sweeps would take longer.
SMALLEST_SWEPT = 128
# Flows are summed in this many fixed parts, so that the result does not depend on the number of threads.
PARTS = 32
# Bits of damping tried in turn, over the longest path, when numbers of shortest paths leave float64.
DAMPING_BITS = (0.0, 600.0, 1200.0, 1700.0)


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

    @cached_property
    def _metric(self) -> Arcs:
        return metric_arcs(self._skeleton, self.graph)

    @cached_property
    def _counted(self) -> CountedArcs:
        return counted_arcs(self._skeleton, self.graph, self._fixed_lengths)

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

        Returns
        -------
        (s, n) array of float64
            In the graph's unit, exact to rounding; inf where there is no path.

        Raises
        ------
        InputError
            If a source is not a vertex, or ``max_distance`` is negative or NaN.
        MemoryError
            If the result does not fit in memory: ask for fewer sources at a time, see :meth:`blocks`.

        Notes
        -----
        About 0.1 ms a source at 40,000 vertices on one core.
        """
        wanted = vertex_indices(sources, self.n_vertices, "sources")
        limit = checked_limit(max_distance)
        result = np.empty((len(wanted), self.n_vertices))
        ranks = self._skeleton.rank[wanted]
        by_rank = np.argsort(ranks, kind="stable")
        if self.n_vertices < SMALLEST_SWEPT:
            found = np.atleast_2d(sp.csgraph.dijkstra(self.graph.matrix(), directed=False, indices=wanted))
            found[found > limit] = np.inf
            return found.reshape(len(wanted), self.n_vertices)
        job = DistanceJob(self._skeleton, self._metric, ranks, result, limit)
        for _ in ordered_map(job, batches(by_rank), n_jobs, description="distances", progress=progress):
            pass
        return result

    def blocks(
        self, sources: ArrayLike | None = None, *, size: int = 1024, n_jobs: int | None = None
    ) -> Iterator[tuple[IntArray, FloatArray]]:
        """Yield (sources, distances) for a block of sources at a time, so that memory stays bounded.

        Parameters
        ----------
        sources : (s,) array_like of int, optional
            Vertex numbers; every vertex by default.
        size : int
            Sources a block.
        n_jobs : int, optional
            Threads; all processors by default.

        Yields
        ------
        (b,) array of int, (b, n) array of float64
        """
        wanted = (
            np.arange(self.n_vertices)
            if sources is None
            else vertex_indices(sources, self.n_vertices, "sources")
        )
        if size < 1:
            message = f"size must be at least 1, got {size}"
            raise InputError(message)
        for start in range(0, len(wanted), size):
            part = wanted[start : start + size]
            yield part, self.distances(part, n_jobs=n_jobs)

    def betweenness(
        self,
        source_weights: ArrayLike | None = None,
        target_weights: ArrayLike | None = None,
        *,
        sources: ArrayLike | None = None,
        n_jobs: int | None = None,
        progress: bool = False,
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

        Returns
        -------
        (n,) array of float64

        Raises
        ------
        MeshError
            If an edge has zero length: the number of shortest paths is then not defined.
        NumericalError
            If there are more shortest paths between two vertices than can be represented.

        Notes
        -----
        Lengths are rounded to about 1e-9 of the diameter, which makes ties exact and reproducible; paths whose
        lengths differ by less are counted as equal. Cost grows a little faster than n**2: about 1 s at 10,000
        vertices on two cores, 10 s at 40,000.

        References
        ----------
        Brandes, A faster algorithm for betweenness centrality, 2001.
        """
        forth = as_weights(source_weights, self.n_vertices, "source_weights")
        back = as_weights(target_weights, self.n_vertices, "target_weights")
        chosen = None if sources is None else vertex_indices(sources, self.n_vertices, "sources")
        return self._vertex_flow(self._flows([chosen], forth, back, n_jobs, progress)[0], forth, back, chosen)

    def edge_flow(
        self,
        source_weights: ArrayLike | None = None,
        target_weights: ArrayLike | None = None,
        *,
        sources: ArrayLike | None = None,
        n_jobs: int | None = None,
        progress: bool = False,
    ) -> FloatArray:
        """Weighted betweenness of the edges of :attr:`graph`, (e,); arguments as in :meth:`betweenness`.

        Unlike vertices, edges count the paths that end at them.
        """
        forth = as_weights(source_weights, self.n_vertices, "source_weights")
        back = as_weights(target_weights, self.n_vertices, "target_weights")
        chosen = None if sources is None else vertex_indices(sources, self.n_vertices, "sources")
        return self._flows([chosen], forth, back, n_jobs, progress)[0]

    def betweenness_of_groups(
        self,
        groups: Sequence[ArrayLike],
        source_weights: ArrayLike | None = None,
        target_weights: ArrayLike | None = None,
        *,
        n_jobs: int | None = None,
        progress: bool = False,
    ) -> list[FloatArray]:
        """:meth:`betweenness` of several groups of sources, each by itself, as sampling needs it.

        Parameters
        ----------
        groups : sequence of (s,) array_like of int
            The sources of each group.
        source_weights, target_weights, n_jobs, progress
            As in :meth:`betweenness`.

        Returns
        -------
        list of (n,) array of float64
        """
        forth = as_weights(source_weights, self.n_vertices, "source_weights")
        back = as_weights(target_weights, self.n_vertices, "target_weights")
        chosen = [vertex_indices(group, self.n_vertices, "sources") for group in groups]
        flows = self._flows(chosen, forth, back, n_jobs, progress)
        return [self._vertex_flow(f, forth, back, group) for f, group in zip(flows, chosen, strict=True)]

    def _flows(
        self,
        groups: Sequence[IntArray | None],
        forth: FloatArray,
        back: FloatArray,
        n_jobs: int | None,
        progress: bool,
    ) -> list[FloatArray]:
        """Edge flow of each group of sources; None stands for every vertex."""
        lengths = self._fixed_lengths
        if self.n_vertices < SMALLEST_SWEPT:
            everyone = np.arange(self.n_vertices)
            chosen = [everyone if group is None else group for group in groups]
            return [plain_edge_flow(self.graph, lengths, forth, back, group) for group in chosen]
        for bits in DAMPING_BITS:
            arcs = self._counted if bits == 0 else self._damped(bits)
            found = [self._arc_flow(arcs, forth, back, group, n_jobs, progress) for group in groups]
            if all(flow is not None for flow in found):
                return [self._unpacked(arcs, flow) for flow in found if flow is not None]
        raise NumericalError(
            "more shortest paths between two vertices than float64 can count, even damped; perturb the vertices "
            "slightly so that fewer paths tie"
        )

    def _damped(self, bits: float) -> CountedArcs:
        longest = float(UNREACHED)
        return counted_arcs(self._skeleton, self.graph, self._fixed_lengths, bits / longest)

    def _arc_flow(
        self,
        arcs: CountedArcs,
        forth: FloatArray,
        back: FloatArray,
        sources: IntArray | None,
        n_jobs: int | None,
        progress: bool,
    ) -> FloatArray | None:
        """Flow on every arc, before unpacking; None where path counts overflowed."""
        if not np.isfinite(arcs.counts).all():
            return None
        order = self._skeleton.order
        job = FlowJob(self._skeleton, arcs, forth[order], back[order], both_ways=sources is None)
        ranks = np.arange(self.n_vertices) if sources is None else np.sort(self._skeleton.rank[sources])
        lanes = batches(ranks)
        # Runs of neighbouring sources, whose shortest paths are alike; the longest sweeps come first.
        cuts = np.linspace(0, len(lanes), min(PARTS, len(lanes)) + 1).astype(int)
        parts = [lanes[a:b] for a, b in itertools.pairwise(cuts)]
        total = np.zeros(len(arcs.heads))
        for part in ordered_map(job, parts, n_jobs, description="shortest paths", progress=progress):
            if part is None:
                return None
            total += part
        return total

    def _unpacked(self, arcs: CountedArcs, total: FloatArray) -> FloatArray:
        """Hand arc flow down to the graph's edges; halve it, as each pair has two directions."""
        unpack(total, arcs.counts, arcs.whole, arcs.first, arcs.second)
        direct = arcs.edge >= 0
        edge_flow = np.zeros(self.graph.n_edges)
        edge_flow[arcs.edge[direct]] = 0.5 * (total * arcs.edge_share)[direct]
        return edge_flow

    def _vertex_flow(
        self, edge_flow: FloatArray, forth: FloatArray, back: FloatArray, sources: IntArray | None
    ) -> FloatArray:
        """Flow through each vertex: half of what its edges carry, once what ends there is taken off."""
        n = self.n_vertices
        ends = self.graph.edges
        carried = np.bincount(ends[:, 0], edge_flow, n) + np.bincount(ends[:, 1], edge_flow, n)
        if sources is not None:
            forth = forth * np.bincount(sources, minlength=n)
        labels = self.components
        all_forth = np.bincount(labels, forth)[labels]
        all_back = np.bincount(labels, back)[labels]
        ending = 0.5 * (forth * (all_back - back) + back * (all_forth - forth))
        through = 0.5 * (carried - ending)
        # What is left of two large equal numbers is rounding, not traffic.
        through[through < 1e-12 * carried] = 0.0
        return through

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write graph and order to an .npz file, atomically; the rest is built again in a moment."""
        stored = {
            "format": np.array(FORMAT),
            "edges": self.graph.edges,
            "lengths": self.graph.lengths,
            "order": self._skeleton.order,
        }
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


def checked_limit(max_distance: float | None) -> float:
    """Take None to no limit, and refuse what is negative or NaN."""
    if max_distance is None:
        return np.inf
    if not max_distance >= 0:
        message = f"max_distance must be 0 or more, got {max_distance}"
        raise InputError(message)
    return float(max_distance)
