"""Components, boundaries, fans, against networks built face by face."""

from __future__ import annotations

from collections import Counter, defaultdict
from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pliant.mesh import Mesh, boundary_edges, boundary_loops, edge_faces, shapes, vertex_components
from pliant.mesh.topology import face_fans, first_members, grouped


@st.composite
def soups(draw: st.DrawFn) -> Mesh:
    n = draw(st.integers(3, 9))
    faces = draw(hnp.arrays(np.int64, (draw(st.integers(1, 14)), 3), elements=st.integers(0, n - 1)))
    return Mesh(np.random.default_rng(n).normal(size=(n, 3)), faces)


def plain_edges(mesh: Mesh) -> Counter[tuple[int, int]]:
    sides = ((int(f[k]), int(f[(k + 1) % 3])) for f in mesh.faces for k in range(3))
    return Counter((min(a, b), max(a, b)) for a, b in sides if a != b)


@given(mesh=soups())
def test_edge_counts_match_a_plain_count(mesh: Mesh) -> None:
    found = edge_faces(mesh)
    counted = {
        tuple(edge): count for edge, count in zip(found.edges.tolist(), found.counts.tolist(), strict=True)
    }
    assert counted == dict(plain_edges(mesh))
    for first, second in found.pairs.tolist():
        assert found.edge_of_side[first] == found.edge_of_side[second]


@given(mesh=soups())
def test_components_match_a_plain_flood(mesh: Mesh) -> None:
    around = defaultdict(set)
    for a, b in plain_edges(mesh):
        around[a].add(b)
        around[b].add(a)
    expected = np.full(mesh.n_vertices, -1)
    count = 0
    for start in range(mesh.n_vertices):
        if expected[start] >= 0:
            continue
        stack = [start]
        while stack:
            vertex = stack.pop()
            if expected[vertex] < 0:
                expected[vertex] = count
                stack += around[vertex]
        count += 1
    found, labels = vertex_components(mesh)
    assert found == count
    np.testing.assert_array_equal(labels, expected)


@given(mesh=soups())
def test_boundary_edges_match_a_plain_count(mesh: Mesh) -> None:
    once = {edge for edge, count in plain_edges(mesh).items() if count == 1}
    found = boundary_edges(mesh)
    assert {(min(a, b), max(a, b)) for a, b in found.tolist()} == once
    assert len(found) == len(once)


@given(mesh=soups())
def test_boundary_chains_walk_each_boundary_edge_once(mesh: Mesh) -> None:
    once = Counter(edge for edge, count in plain_edges(mesh).items() if count == 1)
    walked: Counter[tuple[int, int]] = Counter()
    for loop in boundary_loops(mesh):
        steps = list(zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True))
        walked.update((min(a, b), max(a, b)) for a, b in steps[:-1])
        # A chain that ends at an edge of three faces does not come back; a loop does, by its last step.
        last = (min(steps[-1]), max(steps[-1]))
        walked.update([last] if walked[last] < once[last] else [])
    assert walked == once


def test_loops_run_along_their_faces() -> None:
    mesh = shapes.grid(4, 3)
    (loop,) = boundary_loops(mesh)
    directed = set(map(tuple, boundary_edges(mesh).tolist()))
    assert set(zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)) == directed


def test_an_annulus_has_two_loops() -> None:
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(12)])
    k = np.arange(12)
    after = (k + 1) % 12
    faces = np.vstack([np.column_stack([k, after, after + 12]), np.column_stack([k, after + 12, k + 12])])
    loops = boundary_loops(Mesh(np.vstack([ring * 2, ring]), faces[:, ::-1]))
    assert [sorted(loop.tolist()) for loop in loops] == [list(range(12)), list(range(12, 24))]


def test_holes_that_touch_in_a_vertex_stay_apart() -> None:
    # Two triangles that share one vertex: two boundaries, not one figure of eight.
    bow = Mesh([[0, 0, 0], [1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]], [[0, 2, 1], [0, 3, 4]])
    assert [loop.tolist() for loop in boundary_loops(bow)] == [[0, 2, 1], [0, 3, 4]]


def test_a_moebius_strip_has_one_loop() -> None:
    k = np.arange(9)
    faces = np.vstack([np.column_stack([k, k + 1, k + 2]) % 9])
    angle = 2 * np.pi * k / 9
    mesh = Mesh(np.column_stack([np.cos(2 * angle), np.sin(2 * angle), np.cos(angle)]), faces)
    assert [len(loop) for loop in boundary_loops(mesh)] == [9]


def test_closed_and_empty_meshes_have_no_loop() -> None:
    assert boundary_loops(shapes.icosphere(1)) == ()
    assert boundary_loops(Mesh([[0, 0, 0]], np.empty((0, 3), dtype=int))) == ()
    assert boundary_edges(Mesh([[0, 0, 0]], np.empty((0, 3), dtype=int))).shape == (0, 2)


@given(mesh=soups())
def test_fans_match_a_plain_union(mesh: Mesh) -> None:
    sides = edge_faces(mesh)
    holders = defaultdict(list)
    for f, face in enumerate(mesh.faces.tolist()):
        for k in range(3):
            a, b = face[k], face[(k + 1) % 3]
            if a != b:
                holders[min(a, b), max(a, b)].append((f, k))
    parent = list(range(3 * mesh.n_faces))

    def root(x: int) -> int:
        while parent[x] != x:
            x = parent[x]
        return x

    for holding in holders.values():
        for (f, k), (g, j) in pairwise(holding):
            ends_f, ends_g = (3 * f + k, 3 * f + (k + 1) % 3), (3 * g + j, 3 * g + (j + 1) % 3)
            for x in ends_f:
                for y in ends_g:
                    if mesh.faces.ravel()[x] == mesh.faces.ravel()[y]:
                        parent[root(x)] = root(y)
    count, labels = face_fans(mesh, sides, through_crowded=True)
    roots = [root(x) for x in range(3 * mesh.n_faces)]
    assert count == len(set(roots))
    assert len(set(zip(roots, labels.tolist(), strict=True))) == count


@given(pairs=hnp.arrays(np.int64, st.tuples(st.integers(0, 12), st.just(2)), elements=st.integers(0, 9)))
def test_groups_are_numbered_by_first_member(pairs: np.ndarray) -> None:
    count, labels = grouped(10, pairs)
    assert labels[0] == 0
    np.testing.assert_array_equal(np.unique(labels), np.arange(count))
    firsts = first_members(count, labels)
    np.testing.assert_array_equal(firsts, [labels.tolist().index(k) for k in range(count)])
    assert (np.diff(firsts) > 0).all()
    assert (labels[pairs[:, 0]] == labels[pairs[:, 1]]).all()
