"""One attempt at the polygons: regions cut, merged, slid and drawn, cuts at folds included."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from curvify.errors import OptionError
from curvify.mesh import Bools, Ints
from curvify.simplify.borders import SHARE, Tolerance
from curvify.simplify.coarse import Drawn, draw
from curvify.simplify.decompose import Partition, polygonize
from curvify.simplify.features import find_creases, sharp_half_edges
from curvify.simplify.flats import flat_rims, planes_of
from curvify.simplify.folds import unfold
from curvify.simplify.merge import FREE, PRESSED, Limits, drop_vertices, merge
from curvify.simplify.polygons import Polygons
from curvify.simplify.slide import slide_vertices
from curvify.simplify.triangles import Triangles
from curvify.simplify.vsa import Metric

#: How far borders may leave their chords, as shares of the size of a polygon: on creases and boundaries, and elsewhere.
SHARP_TOLERANCE, SMOOTH_TOLERANCE = 0.12, 0.4
#: How far dropping a vertex of a crease or a boundary may move that, as a share of the same.
DROP_TOLERANCE = 0.012
#: The share of cuts at folds that may come on top of the number wanted; how often merging is tried to make up for more.
FOLD_SHARE, FOLD_ROUNDS = 0.04, 4
#: Flat polygons of this many times the mean area are not merged with others, however many polygons there are.
LARGE = 2.0


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
        if any(number is not None and number < 1 for number in (self.faces, self.proxies)):
            raise OptionError("at least 1 face or proxy must be asked for")
        if not self.compactness >= 0:
            raise OptionError(f"the compactness must be 0 or more, not {self.compactness}")
        if not 0 < self.sharp_angle <= 180:
            raise OptionError(f"the sharp angle must be between 0 and 180 degrees, not {self.sharp_angle}")


@dataclass(eq=False)
class Attempt:
    """Polygons from regions ``labels``; ``unmerged`` those before merging, ``drop`` how far dropping vertices may move
    creases, ``loose`` the factor on tolerances. ``drawn`` is the mesh that they make, with the cuts at folds.
    """

    polygons: Polygons
    creases: Bools
    labels: Ints
    unmerged: Polygons
    sharp: Bools
    tolerance: Tolerance
    drop: float
    loose: float
    drawn: Drawn

    @property
    def count(self) -> int:
        """Polygons of the mesh."""
        return self.drawn.polygons.count

    @property
    def extra(self) -> int:
        """How many of them the cuts at folds have made."""
        return self.count - self.polygons.count

    def against(self, wanted: int) -> int:
        """Polygons to hold against the number wanted, which a few cuts at folds may exceed."""
        return self.polygons.count + max(self.extra - int(FOLD_SHARE * wanted), 0)

    def merged(self, dense: Triangles, polygons: Polygons, creases: Bools) -> Attempt:
        """The same with other polygons on its regions."""
        return replace(self, polygons=polygons, creases=creases, drawn=unfolded(dense, self.labels, polygons, creases))


def unfolded(dense: Triangles, labels: Ints, polygons: Polygons, creases: Bools) -> Drawn:
    """The mesh of the polygons, cut where patches would fold."""
    drawn = draw(dense, labels, polygons, creases)
    done = unfold(drawn.mesh)
    return drawn.changed(done.mesh, done.corners, done.diagonals, done.vertices)


def as_they_are(dense: Triangles, metric: Metric, options: Options) -> Attempt:
    """Every triangle a polygon."""
    labels = np.arange(dense.face_count)
    sharp, tolerance = sharp_half_edges(dense, options.sharp_angle), Tolerance(0.0, 0.0)
    polygons = polygonize(Partition(dense, metric, sharp, tolerance, options.split_rule, labels))
    creases = find_creases(dense, metric, labels, polygons)
    drawn = draw(dense, labels, polygons, creases)
    return Attempt(polygons, creases, labels, polygons, sharp, tolerance, 0.0, 0.0, drawn)


def polygons_of(
    dense: Triangles, metric: Metric, labels: Ints, options: Options, wanted: int, loose: float = 1.0
) -> Attempt:
    """Polygons from regions: made discs, cut, mended, merged where that costs nothing.

    ``wanted`` polygons set the tolerance for borders, ``loose`` is a factor on that.
    """
    size = float(np.sqrt(dense.areas.sum() / wanted))
    tolerance = Tolerance(loose * SHARP_TOLERANCE * size, loose * SMOOTH_TOLERANCE * size, min(SHARE * loose, 0.7))
    sharp = sharp_half_edges(dense, options.sharp_angle)
    partition = Partition(dense, metric, sharp, tolerance, options.split_rule, labels)
    whole = polygonize(partition)
    creases = find_creases(dense, metric, partition.labels, whole)
    polygons, creases = merge_stages(dense, partition.labels, whole, creases, (FREE,), 1, 0.0)
    drop = loose * DROP_TOLERANCE * size
    polygons, creases = drop_vertices(dense.positions, polygons, creases, drop)
    polygons = slide_vertices(dense.positions, polygons, creases)
    drawn = unfolded(dense, partition.labels, polygons, creases)
    return Attempt(polygons, creases, partition.labels, whole, sharp, tolerance, drop, loose, drawn)


def reduced(dense: Triangles, attempt: Attempt, wanted: int) -> Attempt:
    """Merge down to the number wanted, cuts at folds included."""
    for _ in range(FOLD_ROUNDS):
        had = attempt.polygons.count
        surplus = attempt.against(wanted) - wanted
        if surplus > 0:
            attempt = _pressed(dense, attempt, had - surplus)
        if attempt.polygons.count == had:
            break
    return attempt


def merge_stages(
    dense: Triangles,
    labels: Ints,
    polygons: Polygons,
    creases: Bools,
    stages: tuple[Limits, ...],
    target: int,
    least: float,
) -> tuple[Polygons, Bools]:
    """Merge in stages, but not over ``creases (C,)`` or the rims of flat polygons of at least the area ``least``."""
    for limits in stages:
        rims = flat_rims(planes_of(dense, labels, polygons), polygons.topology(dense.positions), least)
        polygons, was = merge(dense.positions, polygons, creases | rims, limits, target)
        creases = creases[was]
    return polygons, creases


def _pressed(dense: Triangles, attempt: Attempt, target: int) -> Attempt:
    """Merge down to a number of polygons before cuts, as gently as can be."""
    target = max(target, 1)
    large = LARGE * float(dense.areas.sum()) / target
    polygons, creases = attempt.polygons, attempt.creases
    polygons, creases = merge_stages(dense, attempt.labels, polygons, creases, PRESSED, target, large)
    polygons, creases = drop_vertices(dense.positions, polygons, creases, attempt.drop)
    return attempt.merged(dense, slide_vertices(dense.positions, polygons, creases), creases)
