"""The one polygon splitter: faces that no patch can fill are cut into convex pieces by diagonals.

Faces are cut where they are concave (paper 2.4 and equation (12)), visit a vertex twice (keyholes) or have
too many sides, and, in a step of their own, where they would fold at a corner.

A piece is a loop of the source mesh's corners, so what corners carry is copied through, and a side of a
piece is a diagonal exactly where it does not lead to the source face's next corner. Every face is worked on
from the lexicographically smallest of its positions, so that the corner listed first does not matter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from curvify.arrays import distinct, values_of
from curvify.errors import OptionError
from curvify.mesh import Bools, Floats, Ints
from curvify.polygons import (
    all_distinct,
    cross_rows,
    dot_rows,
    edge_keys,
    is_in,
    judge,
    lay_flat,
    link_darts,
    next_corners,
    surely_convex,
)
from curvify.records import record

if TYPE_CHECKING:
    from curvify.dissect import Cut, Group

RULES = ("best", "closest")
CONCAVE, KEYHOLE, MANY_SIDED, FOLDING, UNSPLIT, FOLDED, DOUBLED = 1, 2, 4, 8, 16, 32, 64
REASONS = {
    "concave": CONCAVE,
    "keyhole": KEYHOLE,
    "many_sided": MANY_SIDED,
    "folding": FOLDING,
    "unsplit": UNSPLIT | FOLDED,
    "doubled": DOUBLED,
}
ROUNDS = 4  # how often faces whose diagonals meet are cut anew
TOGETHER = 30_000  # corners judged at once


@record
class Split:
    """Convex pieces of the faces of a mesh; a face that needs nothing is one piece.

    ``face_offsets (P+1,)``, ``face_vertices (C',)``: the pieces, by source face, then by their smallest
    source corner, at which each starts. ``source_faces (P,)``; ``source_corners (C',)`` index the source
    mesh's ``face_vertices``. ``diagonals (C',)`` is -1 where the side from a piece's corner to its next is
    a side of the source face, else a diagonal 0..D-1, which two sides share in opposite directions;
    ``diagonal_faces (D,)`` is the source face of each, not decreasing. ``source_offsets (F+1,)`` are the
    source's faces, ``reasons (F,)`` uint8 flags what happened to each (see `REASONS`).
    """

    face_offsets: Ints
    face_vertices: Ints
    source_faces: Ints
    source_corners: Ints
    diagonals: Ints
    diagonal_faces: Ints
    source_offsets: Ints
    reasons: Ints

    @property
    def counts(self) -> dict[str, int]:
        """How many source faces each reason holds for.

        ``concave``, ``keyhole``, ``many_sided`` and ``folding`` faces were split; ``unsplit`` ones were left as
        they are because no diagonal helps; ``doubled`` ones got a diagonal along an existing edge, for want
        of any other.
        """
        return {name: int(np.count_nonzero(self.reasons & flag)) for name, flag in REASONS.items()}

    @property
    def first(self) -> dict[str, int]:
        """The first source face of each reason that occurs."""
        hits = {name: np.flatnonzero(self.reasons & flag) for name, flag in REASONS.items()}
        return {name: int(faces[0]) for name, faces in hits.items() if len(faces)}


def whole_faces(face_offsets: Ints, face_vertices: Ints) -> Split:
    """Every face as one piece."""
    reasons = np.zeros(len(face_offsets) - 1, dtype=np.uint8)
    return cut_along(face_offsets, face_vertices, np.zeros((0, 2), dtype=np.int64), reasons)


def split_polygons(
    positions: Floats, face_offsets: Ints, face_vertices: Ints, *, rule: str = "best", max_sides: int = 64
) -> Split:
    """Cut the faces that are not convex, not simple or have more than ``max_sides`` sides.

    ``positions (V,3)``, faces in compressed rows. ``rule``: ``best`` for few well-shaped pieces, or
    ``closest``, the paper's. Faces without area are left alone. No diagonal runs along an edge of the mesh
    or another face's diagonal where that can be avoided. Raises OptionError for an unknown rule or fewer
    than 3 sides.
    """
    if rule not in RULES:
        raise OptionError(f"no rule {rule!r} for splitting faces; choose from {', '.join(RULES)}")
    if max_sides < 3:
        raise OptionError(f"pieces need at least 3 sides, not {max_sides}")
    offsets, vertices = np.asarray(face_offsets, dtype=np.int64), np.asarray(face_vertices, dtype=np.int64)
    groups = _faces_to_split(np.asarray(positions, dtype=np.float64), offsets, vertices, max_sides)
    reasons = np.zeros(len(offsets) - 1, dtype=np.uint8)
    pairs: Ints = np.zeros((0, 2), dtype=np.int64)
    if groups:
        for group in groups:
            shape = np.where(group.convex, MANY_SIDED, CONCAVE)
            reasons[group.faces] = np.where(group.simple, shape, KEYHOLE)
        edges = _edges_between(offsets, vertices, np.concatenate([group.ids.ravel() for group in groups]))
        pairs = _cut_groups(groups, edges, reasons, rule, max_sides)
    return cut_along(offsets, vertices, pairs, reasons)


def _faces_to_split(positions: Floats, offsets: Ints, vertices: Ints, max_sides: int) -> list[Group]:
    sizes = np.diff(offsets)
    rows = np.ascontiguousarray(positions.T)
    groups = []
    for size in values_of(sizes[sizes > 3]):
        of_size = np.flatnonzero(sizes == size)
        for faces in np.array_split(of_size, -(-len(of_size) * size // TOGETHER)):
            corners = offsets[faces] + np.arange(size)[:, None]
            ids = vertices[corners]
            points = np.take(rows, ids, axis=1)
            acceptable = surely_convex(points) if size == 4 else np.zeros(len(faces), dtype=bool)
            unsure = np.flatnonzero(~acceptable)
            if len(unsure):
                acceptable[unsure] = judge(points[:, :, unsure]).acceptable
            simple = all_distinct(ids)
            bad = ~acceptable | ~simple | (size > max_sides)
            if not bad.any():
                continue
            sides = points - np.roll(points, 1, axis=1)
            area = cross_rows(points - points[:, :1], np.roll(points, -1, axis=1) - points).sum(axis=1)
            area_size = np.sqrt(dot_rows(area, area))
            bad &= area_size > 1e-10 * dot_rows(sides, sides).sum(axis=0)
            if bad.any():
                groups.append(_gather(faces[bad], corners[:, bad], ids[:, bad], rows, acceptable[bad]))
    return groups


def _gather(faces: Ints, corners: Ints, ids: Ints, rows: Floats, convex: Bools) -> Group:
    from curvify.dissect import Group  # most meshes have no face to cut

    size = len(ids)
    turned = (_first_corners(rows[:, ids]) + np.arange(size)[:, None]) % size
    corners, ids = np.take_along_axis(corners, turned, axis=0), np.take_along_axis(ids, turned, axis=0)
    points = rows[:, ids]
    area = cross_rows(points - points[:, :1], np.roll(points, -1, axis=1) - points).sum(axis=1)
    return Group(faces, corners, ids, lay_flat(points), dot_rows(area, area), convex, all_distinct(ids))


def _first_corners(points: Floats) -> Ints:
    """The corner with the lexicographically smallest position ``(B,)``; equal ones look ahead."""
    left = np.ones(points.shape[1:], dtype=bool)
    for ahead in range(3):
        for row in np.roll(points, -ahead, axis=1):
            row = np.where(left, row, np.inf)
            left &= row == row.min(axis=0)
    return np.asarray(np.argmax(left, axis=0))


def _edges_between(offsets: Ints, vertices: Ints, wanted: Ints) -> Ints:
    """Sorted keys of the edges whose two ends are among the ``wanted`` vertices."""
    is_wanted = np.zeros(int(vertices.max(initial=0)) + 1, dtype=bool)
    is_wanted[wanted] = True
    heads = vertices[next_corners(offsets)]
    near = is_wanted[vertices] & is_wanted[heads]
    return np.sort(edge_keys(vertices[near], heads[near]))


def _cut_groups(groups: list[Group], edges: Ints, reasons: Ints, rule: str, max_sides: int) -> Ints:
    """Diagonals ``(D,2)`` as pairs of source corners; faces that cannot be cut are flagged in ``reasons``.

    Each face is first cut as if it were alone. Where a diagonal meets an edge or another face's diagonal,
    the face (of two, the smaller) is cut again, now avoiding all diagonals that stay.
    """
    from curvify.dissect import cut_group

    done = []
    avoid, known = None, edges
    for attempt in range(ROUNDS):
        cuts = [cut_group(group, avoid, rule, max_sides) for group in groups]
        for group, (face, _, _) in zip(groups, cuts, strict=True):
            whole = np.bincount(face, minlength=len(group.faces)) == 0
            reasons[group.faces[whole]] = UNSPLIT
        pairs, face, key, area = _flatten(groups, cuts)
        doubled = is_in(key, known)
        again = _repeats(key, area, face)
        if attempt == 0:
            again |= doubled
        else:  # these were avoided where that is possible
            reasons[face[doubled]] |= DOUBLED
        if attempt == ROUNDS - 1:
            reasons[face[again]] |= DOUBLED
            again[:] = False
        losers = np.isin(face, face[again])
        done.append(pairs[~losers])
        if not losers.any():
            break
        avoid = known = distinct(np.concatenate([known, key[~losers]]))[0]
        lost = [np.flatnonzero(np.isin(group.faces, face[losers])) for group in groups]
        groups = [group.take(hit) for group, hit in zip(groups, lost, strict=True) if len(hit)]
    return np.concatenate(done)


def _flatten(groups: list[Group], cuts: list[Cut]) -> tuple[Ints, Ints, Ints, Floats]:
    """The cuts of all groups as source corners ``(D,2)``, with their faces, vertex keys and face areas."""
    every = list(zip(groups, cuts, strict=True))
    pairs = [np.stack([group.corners[a, at], group.corners[b, at]], axis=1) for group, (at, a, b) in every]
    keys = [edge_keys(group.ids[a, at], group.ids[b, at]) for group, (at, a, b) in every]
    faces = [group.faces[at] for group, (at, _, _) in every]
    areas = [group.area[at] for group, (at, _, _) in every]
    return np.concatenate(pairs), np.concatenate(faces), np.concatenate(keys), np.concatenate(areas)


def _repeats(key: Ints, area: Floats, face: Ints) -> Bools:
    """Which diagonals repeat a vertex pair that a larger face (or a lower one as large) already has."""
    order = np.lexsort((face, -area, key))
    repeats = np.zeros(len(key), dtype=bool)
    repeats[order[1:]] = key[order[1:]] == key[order[:-1]]
    return repeats


def split_at_corners(
    positions: Floats, split: Split, bad_corners: Bools, corner_normals: Floats, least: float = -np.inf
) -> Split:
    """Cut each piece with a bad corner by one diagonal from that corner (the folding rule).

    ``bad_corners (C',)`` and ``corner_normals (C',3)`` are by corner of the pieces of ``split``. The diagonal
    goes to the corner that makes the smallest sine of the two pieces' corners, seen along their normals,
    largest; never along an edge. A piece stays where no diagonal makes all sines positive or the smallest
    larger, or where those at its ends would be less than ``least``, and its face then counts as ``unsplit``.
    Repeat with the pieces' own bad corners as needed.
    """
    offsets, vertices = split.face_offsets, split.face_vertices
    bad = np.asarray(bad_corners, dtype=bool)
    owner = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    pieces = distinct(owner[bad])[0]
    reasons = split.reasons & ~np.uint8(FOLDED)
    avoid = _edges_between(offsets, vertices, vertices[np.isin(owner, pieces)])
    found = [_old_pairs(split)]
    rows, normals = np.ascontiguousarray(positions.T), np.ascontiguousarray(np.asarray(corner_normals).T)
    for _ in range(ROUNDS):
        start, end, worth = _folding_diagonals(rows, split, pieces, bad, normals, avoid)
        wide = worth >= least
        start, end, worth = start[wide], end[wide], worth[wide]
        reasons[split.source_faces[pieces[~np.isin(pieces, owner[start])]]] |= FOLDED
        keys = edge_keys(vertices[start], vertices[end])
        again = _repeats(keys, worth, owner[start])
        reasons[split.source_faces[owner[start[~again]]]] |= FOLDING
        found.append(split.source_corners[np.stack([start[~again], end[~again]], axis=1)])
        avoid, pieces = distinct(np.concatenate([avoid, keys]))[0], owner[start[again]]
        if not len(pieces):
            break
    reasons[split.source_faces[pieces]] |= FOLDED
    source_vertices = np.zeros(int(split.source_offsets[-1]), dtype=np.int64)
    source_vertices[split.source_corners] = vertices
    return cut_along(split.source_offsets, source_vertices, np.concatenate(found), reasons)


def _old_pairs(split: Split) -> Ints:
    """The diagonals of a split as pairs of source corners, each once."""
    start = split.source_corners
    end = start[next_corners(split.face_offsets)]
    once = (split.diagonals >= 0) & (start < end)
    return np.stack([start[once], end[once]], axis=1)


def _folding_diagonals(
    rows: Floats, split: Split, pieces: Ints, bad: Bools, normals: Floats, avoid: Ints
) -> tuple[Ints, Ints, Floats]:
    """The diagonals for those of ``pieces`` that one helps: their two corners, and the smallest new sine."""
    sizes = np.diff(split.face_offsets)[pieces]
    nothing: Ints = np.zeros(0, dtype=np.int64)
    found: list[tuple[Ints, Ints, Floats]] = [(nothing, nothing, np.zeros(0))]
    for size in values_of(sizes[sizes > 3]):
        corners = split.face_offsets[pieces[sizes == size]] + np.arange(size)[:, None]
        turned = _first_corners(rows[:, split.face_vertices[corners]]) + np.arange(size)[:, None]
        corners = np.take_along_axis(corners, turned % size, axis=0)
        ids = split.face_vertices[corners]
        start, end, worth = _unfold(rows[:, ids], normals[:, corners], bad[corners], ids, avoid)
        at = np.flatnonzero(end >= 0)
        found.append((corners[start[at], at], corners[end[at], at], worth[at]))
    start, end, worth = (np.concatenate(part) for part in zip(*found, strict=True))
    return start, end, worth


def _unfold(points: Floats, normals: Floats, bad: Bools, ids: Ints, avoid: Ints) -> tuple[Ints, Ints, Floats]:
    """For loops ``(3,m,B)`` the worst bad corner, the best one to join it to (or -1), the smallest sine."""
    size, every = len(ids), np.arange(ids.shape[1])
    leave = np.roll(points, -1, axis=1) - points
    back = np.roll(points, 1, axis=1) - points
    sines = _sines(leave, back, normals)
    start = np.argmin(np.where(bad, sines, np.inf), axis=0)
    end = (start + np.arange(2, size - 1)[:, None]) % size
    line = points[:, end, every] - points[:, start, every][:, None]
    here, there = normals[:, start, every][:, None], normals[:, end, every]
    fresh = _sines(leave[:, start, every][:, None], line, here)
    fresh = np.minimum(fresh, _sines(line, back[:, start, every][:, None], here))
    fresh = np.minimum(fresh, _sines(leave[:, end, every], -line, there))
    fresh = np.minimum(fresh, _sines(-line, back[:, end, every], there))
    ids_here, ids_there = ids[start, every], ids[end, every]
    fresh[is_in(edge_keys(ids_here, ids_there), avoid) | (ids_here == ids_there)] = -np.inf
    # The smallest sine of the corners that stay as they are: the lowest, or the next if that is the end.
    others = sines.copy()
    others[start, every] = np.inf
    lowest = np.argmin(others, axis=0)
    rest = np.broadcast_to(others[lowest, every], end.shape).copy()
    others[lowest, every] = np.inf
    rest[end == lowest] = np.broadcast_to(others.min(axis=0), end.shape)[end == lowest]
    total = np.minimum(fresh, rest)
    pick = np.argmax(np.where(total == total.max(axis=0), fresh, -np.inf), axis=0)
    total, fresh, end = total[pick, every], fresh[pick, every], end[pick, every]
    now = sines.min(axis=0)
    helps = (total > np.minimum(now, 0)) | ((total == now) & (fresh > sines[start, every]))
    return start, np.where(helps & np.isfinite(fresh), end, -1), fresh


def _sines(leave: Floats, back: Floats, normal: Floats) -> Floats:
    lengths = np.sqrt(dot_rows(leave, leave) * dot_rows(back, back))
    return dot_rows(cross_rows(leave, back), normal) / np.maximum(lengths, 1e-300)


def cut_along(offsets: Ints, vertices: Ints, pairs: Ints, reasons: Ints) -> Split:
    """The pieces that the diagonals ``pairs (D,2)``, of source corners, make of the faces; they must not cross."""
    corner_count, sizes = len(vertices), np.diff(offsets)
    if not len(pairs):
        none = np.zeros(0, dtype=np.int64)
        faces, corners = np.arange(len(sizes)), np.arange(corner_count)
        return Split(offsets, vertices, faces, corners, np.full(corner_count, -1), none, offsets, reasons)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    cut = np.zeros(len(sizes), dtype=bool)
    cut[owner[pairs[:, 0]]] = True
    pairs = np.sort(pairs, axis=1)
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    side, number = np.flatnonzero(cut[owner]), np.arange(len(pairs))
    tail = np.concatenate([side, pairs[:, 0], pairs[:, 1]])
    head = np.concatenate([next_corners(offsets)[side], pairs[:, 1], pairs[:, 0]])
    diagonals = np.concatenate([np.full(len(side), -1), number, number])
    order = np.lexsort((head, tail))
    tail, head, diagonals = tail[order], head[order], diagonals[order]
    size = sizes[owner[tail]]
    count, loop = _cycles(link_darts(tail, head, (head - tail) % size, size))
    first = tail[loop[np.cumsum(count) - count]]
    # Faces that stay whole come first here: put all pieces in the order of the faces.
    piece_faces = np.concatenate([np.flatnonzero(~cut), owner[first]])
    piece_sizes = np.concatenate([sizes[~cut], count])
    corners = np.concatenate([np.flatnonzero(~cut[owner]), tail[loop]])
    names = np.concatenate([np.full(corner_count - len(side), -1), diagonals[loop]])
    order = np.argsort(piece_faces, kind="stable")
    piece_offsets = np.concatenate([[0], np.cumsum(piece_sizes[order])])
    shift = (np.cumsum(piece_sizes) - piece_sizes)[order] - piece_offsets[:-1]
    move = np.repeat(shift, piece_sizes[order]) + np.arange(len(corners))
    return Split(
        face_offsets=piece_offsets,
        face_vertices=vertices[corners[move]],
        source_faces=piece_faces[order],
        source_corners=corners[move],
        diagonals=names[move],
        diagonal_faces=owner[pairs[:, 0]],
        source_offsets=offsets,
        reasons=reasons,
    )


def _cycles(after: Ints) -> tuple[Ints, Ints]:
    """Lengths of the cycles of ``after (N,)``, and their items cycle by cycle, each from its smallest."""
    lowest, jump = np.arange(len(after)), after
    while not np.array_equal(lower := np.minimum(lowest, lowest[jump]), lowest):
        lowest, jump = lower, jump[jump]
    count = np.bincount(lowest, minlength=len(after))
    item = np.flatnonzero(count)
    count = count[item]
    loop = np.empty_like(after)
    place, active = np.cumsum(count) - count, np.arange(len(item))
    for step in range(int(count.max(initial=0))):
        active = active[count[active] > step]
        loop[place[active] + step] = item[active]
        item[active] = after[item[active]]
    return count, loop
