"""From a dense mesh to few polygons: the steps in order, and the search for the number asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from curvify.errors import OptionError
from curvify.mesh import Bools, Floats, Ints, Marks, PolygonMesh
from curvify.simplify.borders import SHARE, Tolerance
from curvify.simplify.checks import check_polygons
from curvify.simplify.decompose import Partition, polygonize
from curvify.simplify.features import find_creases, flat_polygons, sector_normals, sharp_half_edges
from curvify.simplify.merge import FREE, PRESSED, drop_vertices, merge
from curvify.simplify.polygons import Polygons
from curvify.simplify.regions import bisect
from curvify.simplify.triangles import Triangles, face_components, prepare_triangles
from curvify.simplify.vsa import COMPACT_SWEEPS, SWEEPS, Metric, cluster, exchange
from curvify.words import count_of

#: Regions to begin with, as a share of the polygons wanted: convex pieces outnumber regions.
FIRST_SHARE = 0.5
#: Attempts at the number of regions, and the surplus of polygons that merging may take away well.
ATTEMPTS, SURPLUS = 8, 1.06
#: Polygons a region from which on chords are allowed more, by what factor and how often.
PIECES, LOOSER, LOOSEST = 1.75, 1.5, 4
#: The least factor on the tolerance, where the number cannot be reached otherwise.
CLOSEST = 0.05
#: Fewer regions must bring at least this much: below lies what topology and creases ask for.
FLOOR = 0.9
#: How far borders may leave their chords, as shares of the size of a polygon: on creases and boundaries, and elsewhere.
SHARP_TOLERANCE, SMOOTH_TOLERANCE = 0.12, 0.4
#: How far dropping a vertex of a crease or a boundary may move that, as a share of the same.
DROP_TOLERANCE = 0.012
#: The count asked for is met within this share.
CLOSE = 0.05

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Options:
    """What simplifying does.

    ``faces`` polygons wanted, or ``proxies`` regions with as many polygons as they take; ``compactness`` the weight of
    short regions against flat ones, 0 for pure variational shape approximation; ``sharp_angle`` in degrees from which
    edges of the dense mesh are sharp; ``split_rule`` and ``weld`` as for refining.
    """

    faces: int | None = None
    proxies: int | None = None
    compactness: float = 4.0
    sharp_angle: float = 30.0
    split_rule: str = "best"
    weld: str = "auto"

    def __post_init__(self) -> None:
        if (self.faces is None) == (self.proxies is None):
            raise OptionError("give either the number of faces or the number of proxies")
        if min(self.faces or 1, self.proxies or 1) < 1:
            raise OptionError("at least 1 face must be asked for")
        if not self.compactness >= 0:
            raise OptionError(f"the compactness must be 0 or more, not {self.compactness}")
        if not 0 < self.sharp_angle <= 180:
            raise OptionError(f"the sharp angle must be between 0 and 180 degrees, not {self.sharp_angle}")


@dataclass(eq=False)
class Simplified:
    """A coarse mesh and what it was made from.

    ``mesh`` with corner normals and marks; ``dense`` the triangles; ``polygons`` in vertices of these; ``labels
    (F,)`` the region of each triangle; ``creases (C,)``; ``counts``; ``warnings``.
    """

    mesh: PolygonMesh
    dense: Triangles
    polygons: Polygons
    labels: Ints
    creases: Bools
    counts: dict[str, int]
    warnings: list[str] = field(default_factory=list)


@dataclass(eq=False)
class _Attempt:
    """Polygons from regions ``labels``, before merging ``unmerged``; ``drop`` how far dropping vertices may move creases."""

    polygons: Polygons
    creases: Bools
    labels: Ints
    unmerged: Polygons
    sharp: Bools
    tolerance: Tolerance
    drop: float


def simplify(mesh: PolygonMesh, options: Options, progress: Progress | None = None) -> Simplified:
    """Few convex polygons for a dense mesh. Raises MeshError where there is nothing to simplify.

    ``progress(stage, share)`` is told what is being done and the share of all work that is behind.
    """
    tell = progress or (lambda stage, share: None)
    tell("cleaning", 0.0)
    dense, notes = prepare_triangles(mesh, options.weld)
    metric = Metric.of(dense)
    if options.faces is not None and options.faces >= dense.face_count:
        notes.append(f"the mesh has only {count_of(dense.face_count, 'triangle')}; they are kept as they are")
        attempt = _as_they_are(dense, metric, options)
    else:
        attempt = _search(dense, metric, options, notes, tell)
    tell("normals", 0.95)
    check_polygons(dense, attempt.polygons)
    result = _coarse_mesh(mesh, dense, attempt)
    result.warnings = [*mesh.warnings, *notes]
    return result


def _as_they_are(dense: Triangles, metric: Metric, options: Options) -> _Attempt:
    """Every triangle a polygon."""
    labels = np.arange(dense.face_count)
    sharp, tolerance = sharp_half_edges(dense, options.sharp_angle), Tolerance(0.0, 0.0)
    polygons = polygonize(Partition(dense, metric, sharp, tolerance, options.split_rule, labels))
    creases = find_creases(dense, metric, labels, polygons)
    return _Attempt(polygons, creases, labels, polygons, sharp, tolerance, 0.0)


def _search(
    dense: Triangles, metric: Metric, options: Options, notes: list[str], tell: Progress
) -> _Attempt:
    """Find the number of regions that gives the polygons wanted, and merge those that are too many."""
    start = face_components(dense)
    if options.proxies is not None:
        labels = cluster(dense, metric, options.proxies, start)
        return _attempt(dense, metric, exchange(dense, metric, labels, SWEEPS), options, options.proxies)
    wanted = options.faces or 1
    labels, count, least = start, max(int(wanted * FIRST_SHARE), 1), int(start.max()) + 1
    loose, low, high, last = 1.0, 0, dense.face_count, dense.face_count
    best: _Attempt | None = None
    for attempts in range(ATTEMPTS):
        tell("regions", 0.9 * (1 - 0.5**attempts))
        labels = cluster(dense, metric, count, labels if count > int(labels.max()) else start)
        tell("polygons", 0.9 * (1 - 0.7 * 0.5**attempts))
        attempt = _attempt(dense, metric, labels, options, wanted, loose)
        found, made = attempt.polygons.count, int(labels.max()) + 1
        if best is None or _distance(found, wanted) < _distance(best.polygons.count, wanted):
            best = attempt
        if wanted <= found <= SURPLUS * wanted:
            break
        if made < count:  # no error is left that more regions could lower: closer borders may
            if loose <= CLOSEST or found >= wanted:
                break
            loose /= LOOSER**2
            continue
        if found < wanted:
            low = count
            count = min(int(np.ceil(count * wanted / found * 1.02)), (count + high + 1) // 2)
        elif found > PIECES * (int(attempt.labels.max()) + 1) and loose < LOOSER**LOOSEST:
            loose *= LOOSER
            high = dense.face_count
            continue
        else:
            if low == 0 and found > FLOOR * last:
                break
            high, last = count, found
            count = max(int(count * wanted / found), count // 3, (low + count) // 2 if low else 1)
        if not low < count < high or count < least:
            break
    assert best is not None
    if best.polygons.count < wanted:
        best = _fill(dense, metric, best, options, wanted)
    return _reduce(dense, best, wanted, notes)


def _fill(dense: Triangles, metric: Metric, attempt: _Attempt, options: Options, wanted: int) -> _Attempt:
    """More polygons where regions cannot tell more: free merging ends sooner, and the largest regions are halved."""
    labels, whole = attempt.labels, attempt.unmerged
    for _ in range(ATTEMPTS):
        missing = wanted - whole.count
        if missing <= 0:
            break
        sizes = np.bincount(labels, metric.weights) * (np.bincount(labels) > 1)
        largest = np.argsort(-sizes, kind="stable")[:missing]
        largest = largest[sizes[largest] > 0]
        if not len(largest):
            break
        labels = bisect(dense, labels, largest)
        partition = Partition(dense, metric, attempt.sharp, attempt.tolerance, options.split_rule, labels)
        whole, labels = polygonize(partition), partition.labels
    creases = find_creases(dense, metric, labels, whole)
    polygons, creases = merge(dense.positions, whole, creases, FREE, wanted)
    return replace(attempt, polygons=polygons, creases=creases, labels=labels)


def _distance(found: int, wanted: int) -> float:
    """How far a number is from that wanted; too many are better than too few, since they can be merged."""
    return (found - wanted) / wanted if found >= wanted else 3 * (wanted - found) / wanted


def _attempt(
    dense: Triangles, metric: Metric, labels: Ints, options: Options, wanted: int, loose: float = 1.0
) -> _Attempt:
    """Polygons from regions: compacted, made discs, cut, mended, merged where that costs nothing.

    ``wanted`` polygons set the tolerance for borders, ``loose`` is a factor on that.
    """
    if options.compactness > 0 and int(labels.max()) + 1 < dense.face_count:
        labels = exchange(dense, metric.compact(labels, options.compactness), labels, COMPACT_SWEEPS)
    size = float(np.sqrt(dense.areas.sum() / wanted))
    tolerance = Tolerance(loose * SHARP_TOLERANCE * size, loose * SMOOTH_TOLERANCE * size, min(SHARE * loose, 0.7))
    sharp = sharp_half_edges(dense, options.sharp_angle)
    partition = Partition(dense, metric, sharp, tolerance, options.split_rule, labels)
    whole = polygonize(partition)
    creases = find_creases(dense, metric, partition.labels, whole)
    polygons, creases = merge(dense.positions, whole, creases, FREE, 1)
    drop = loose * DROP_TOLERANCE * size
    polygons, creases = drop_vertices(dense.positions, polygons, creases, drop)
    return _Attempt(polygons, creases, partition.labels, whole, sharp, tolerance, drop)


def _reduce(dense: Triangles, attempt: _Attempt, wanted: int, notes: list[str]) -> _Attempt:
    """Merge down to the number wanted."""
    polygons, creases = attempt.polygons, attempt.creases
    for limits in PRESSED:
        polygons, creases = merge(dense.positions, polygons, creases, limits, wanted)
    polygons, creases = drop_vertices(dense.positions, polygons, creases, attempt.drop)
    if polygons.count > (1 + CLOSE) * wanted:
        notes.append(
            f"{count_of(wanted, 'face')} cannot hold this mesh's topology and creases; "
            f"{polygons.count:,} are the fewest found"
        )
    elif polygons.count < (1 - CLOSE) * wanted:
        notes.append(f"{count_of(polygons.count, 'face')} hold everything; more would add nothing")
    return replace(attempt, polygons=polygons, creases=creases)


def _coarse_mesh(mesh: PolygonMesh, dense: Triangles, attempt: _Attempt) -> Simplified:
    """The polygons as a mesh of their own, with normals and marks."""
    polygons, creases = attempt.polygons, attempt.creases
    normals = sector_normals(dense, attempt.labels, polygons, creases)
    used = np.zeros(len(dense.positions), dtype=bool)
    used[polygons.vertices] = True
    number = np.cumsum(used) - 1
    result = PolygonMesh(
        positions=dense.positions[used],
        face_offsets=polygons.offsets,
        face_vertices=number[polygons.vertices],
        corner_normals=normals,
        marks=_marks(dense, attempt, number),
        position_dtype=mesh.position_dtype,
    )
    counts = {
        "input_faces": mesh.face_count,
        "triangles": dense.face_count,
        "regions": int(attempt.labels.max()) + 1,
        "faces": polygons.count,
        "vertices": result.vertex_count,
        "crease_edges": len(result.marks.crease_edges),
        "flat_faces": len(result.marks.flat_faces),
    }
    return Simplified(result, dense, polygons, attempt.labels, creases, counts)


def _marks(dense: Triangles, attempt: _Attempt, number: Ints) -> Marks:
    """Crease edges, and flat faces that only creases or their like in one plane surround."""
    polygons, creases = attempt.polygons, attempt.creases
    topology = polygons.topology(dense.positions)
    once = np.flatnonzero(creases & (topology.twin > np.arange(len(creases))))
    edges = number[np.stack([polygons.vertices[once], polygons.vertices[topology.next[once]]], axis=1)]
    flat = flat_polygons(dense, attempt.labels, polygons)
    return Marks(
        crease_edges=edges,
        crease_sharpness=np.ones((len(edges), 2)),
        flat_faces=np.flatnonzero(flat & _set_apart(topology.faces, topology.twin, creases, flat)),
    )


def _set_apart(faces: Ints, twin: Ints, creases: Bools, flat: Bools) -> Bools:
    """Faces ``(P,)`` each side of which is a crease, a boundary or shared with a flat face."""
    beside = (twin >= 0) & flat[faces[np.maximum(twin, 0)]]
    open_ = np.bincount(faces, ~(creases | beside), len(flat))
    return open_ == 0
