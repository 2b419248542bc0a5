"""The search for as many polygons as are wanted: how many regions, and how closely polygons follow them.

Convex pieces outnumber regions by an amount that only trying tells, and so do the cuts that keep patches from folding.
Too few polygons ask for more regions; many more polygons than regions ask for chords that may leave their borders
further.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from curvify.errors import OptionError
from curvify.mesh import Bools, Ints
from curvify.simplify.borders import SHARE, Tolerance
from curvify.simplify.coarse import Drawn, draw
from curvify.simplify.decompose import Partition, polygonize
from curvify.simplify.features import find_creases, sharp_half_edges
from curvify.simplify.folds import unfold
from curvify.simplify.merge import FREE, PRESSED, drop_vertices, merge
from curvify.simplify.polygons import Polygons
from curvify.simplify.regions import bisect
from curvify.simplify.slide import slide_vertices
from curvify.simplify.triangles import Triangles, face_components
from curvify.simplify.vsa import COMPACT_SWEEPS, SWEEPS, Metric, cluster, exchange
from curvify.words import count_of

#: Regions to begin with, as a share of the polygons wanted: convex pieces outnumber regions.
FIRST_SHARE = 0.6
#: Attempts at the number of regions, and the surplus of polygons that merging may take away well.
ATTEMPTS, SURPLUS = 8, 1.06
#: Polygons a region from which on chords are allowed more, by what factor and how often.
PIECES, LOOSER, LOOSEST = 1.75, 1.5, 4
#: Larger tolerances must lower the number to this share, or they are not worth it.
STIFF = 0.98
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
#: The share of cuts at folds that may come on top of the number wanted; how often merging is tried to make up for more.
FOLD_SHARE, FOLD_ROUNDS = 0.04, 4

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
        if any(number is not None and number < 1 for number in (self.faces, self.proxies)):
            raise OptionError("at least 1 face or proxy must be asked for")
        if not self.compactness >= 0:
            raise OptionError(f"the compactness must be 0 or more, not {self.compactness}")
        if not 0 < self.sharp_angle <= 180:
            raise OptionError(f"the sharp angle must be between 0 and 180 degrees, not {self.sharp_angle}")


@dataclass(eq=False)
class Attempt:
    """Polygons from regions ``labels``; ``unmerged`` those before merging, ``drop`` how far dropping vertices may move
    creases. ``drawn`` is the mesh that they make, with the cuts at folds.
    """

    polygons: Polygons
    creases: Bools
    labels: Ints
    unmerged: Polygons
    sharp: Bools
    tolerance: Tolerance
    drop: float
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
    return Attempt(polygons, creases, labels, polygons, sharp, tolerance, 0.0, drawn)


@dataclass(eq=False)
class Search:
    """Where the search stands: ``labels`` of ``count`` regions, ``compact`` the same made compact.

    ``loose`` is the factor on tolerances, ``eased`` the polygons before it was last raised, ``stiff`` says that this
    helps no more. Numbers of regions known to be too ``low`` and too ``high``, ``last`` the polygons that the latter
    gave; ``spent`` once no error is left that more regions could lower.
    """

    dense: Triangles
    metric: Metric
    options: Options
    wanted: int
    tell: Progress
    count: int = field(init=False)
    labels: Ints = field(init=False)
    compact: Ints = field(init=False)
    loose: float = 1.0
    low: int = 0
    spent: bool = False
    stiff: bool = False
    eased: float = np.inf

    def __post_init__(self) -> None:
        self.labels = self.compact = self.start = face_components(self.dense)
        self.count = max(int(self.wanted * FIRST_SHARE), 1)
        self.high = self.last = self.dense.face_count

    def run(self) -> Attempt:
        """The best of some attempts."""
        attempts = [self._attempt(0)]
        while len(attempts) < ATTEMPTS:
            found = attempts[-1].against(self.wanted)
            if self.wanted <= found <= SURPLUS * self.wanted:
                break
            if not self._adjust(found, int(attempts[-1].labels.max()) + 1):
                break
            attempts.append(self._attempt(len(attempts)))
        return min(attempts, key=lambda one: _misses(one.against(self.wanted), self.wanted))

    def _attempt(self, number: int) -> Attempt:
        self.tell("regions", 0.9 * (1 - 0.5**number))
        made = int(self.labels.max()) + 1
        if self.count != made:
            start = self.labels if self.count > made else self.start
            self.labels = cluster(self.dense, self.metric, self.count, start)
            self.compact = compacted(self.dense, self.metric, self.labels, self.options)
            made = int(self.labels.max()) + 1
            self.spent |= made < self.count
            self.count = made
        self.tell("polygons", 0.9 * (1 - 0.7 * 0.5**number))
        return polygons_of(self.dense, self.metric, self.compact, self.options, self.wanted, self.loose)

    def _adjust(self, found: int, regions: int) -> bool:
        """Choose what to try after ``found`` polygons on so many ``regions``; whether anything is left to try."""
        if found < self.wanted and self.spent:
            worth = self.loose > CLOSEST and found != self.last
            self.loose, self.last = self.loose / LOOSER**2, found
            return worth
        if found < self.wanted:
            self.low = self.count
            grown = int(np.ceil(self.count * self.wanted / found * 1.02))
            self.count = min(grown, (self.count + self.high + 1) // 2)
            return self.low < self.count < self.high
        if found > PIECES * regions and not self.stiff and self.loose < LOOSER**LOOSEST:
            self.stiff = found > STIFF * self.eased
            self.loose, self.eased = self.loose / LOOSER if self.stiff else self.loose * LOOSER, found
            if not self.stiff:
                self.high = self.dense.face_count
                return True
        if self.low == 0 and found > FLOOR * self.last:
            return False
        self.high, self.last = self.count, found
        least = (self.low + self.count) // 2 if self.low else self.count // 3
        self.count = max(int(self.count * self.wanted / found), least, int(self.start.max()) + 1)
        return self.low < self.count < self.high


def _misses(found: int, wanted: int) -> float:
    """How far a number is from that wanted; too many are better than too few, since they can be merged."""
    return (found - wanted) / wanted if found >= wanted else 3 * (wanted - found) / wanted


def find_polygons(
    dense: Triangles, metric: Metric, options: Options, notes: list[str], tell: Progress
) -> Attempt:
    """Polygons as the options ask for; where their number cannot be had, that is said in ``notes``."""
    if options.faces is None:
        labels = cluster(dense, metric, options.proxies or 1, face_components(dense))
        labels = compacted(dense, metric, labels, options)
        return polygons_of(dense, metric, labels, options, int(labels.max()) + 1)
    best = Search(dense, metric, options, options.faces, tell).run()
    if best.against(options.faces) < options.faces:
        best = _fill(dense, metric, best, options, options.faces)
    return _reduce(dense, best, options.faces, notes)


def _fill(dense: Triangles, metric: Metric, attempt: Attempt, options: Options, wanted: int) -> Attempt:
    """More polygons where regions cannot tell more: free merging ends sooner, and the largest regions are halved."""
    labels, whole = attempt.labels, attempt.unmerged
    wanted -= attempt.against(wanted) - attempt.polygons.count
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
    return replace(attempt, labels=labels).merged(dense, polygons, creases)


def compacted(dense: Triangles, metric: Metric, labels: Ints, options: Options) -> Ints:
    """The regions made compact, or improved once more where that is not wanted."""
    if options.compactness > 0:
        return exchange(dense, metric.compact(labels, options.compactness), labels, COMPACT_SWEEPS)
    return exchange(dense, metric, labels, SWEEPS)


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
    polygons, creases = merge(dense.positions, whole, creases, FREE, 1)
    drop = loose * DROP_TOLERANCE * size
    polygons, creases = drop_vertices(dense.positions, polygons, creases, drop)
    polygons = slide_vertices(dense.positions, polygons, creases)
    drawn = unfolded(dense, partition.labels, polygons, creases)
    return Attempt(polygons, creases, partition.labels, whole, sharp, tolerance, drop, drawn)


def _reduce(dense: Triangles, attempt: Attempt, wanted: int, notes: list[str]) -> Attempt:
    """Merge down to the number wanted, cuts at folds included."""
    for _ in range(FOLD_ROUNDS):
        had = attempt.polygons.count
        surplus = attempt.against(wanted) - wanted
        if surplus > 0:
            attempt = _pressed(dense, attempt, had - surplus)
        if attempt.polygons.count == had:
            break
    if attempt.count > (1 + CLOSE) * wanted:
        notes.append(
            f"{count_of(wanted, 'face')} cannot hold this mesh's topology and creases; "
            f"{attempt.count:,} are the fewest found"
        )
    elif attempt.count < (1 - CLOSE) * wanted:
        notes.append(f"{count_of(attempt.count, 'face')} hold everything; more would add nothing")
    return attempt


def _pressed(dense: Triangles, attempt: Attempt, target: int) -> Attempt:
    """Merge down to a number of polygons before cuts, as gently as can be."""
    polygons, creases = attempt.polygons, attempt.creases
    for limits in PRESSED:
        polygons, creases = merge(dense.positions, polygons, creases, limits, max(target, 1))
    polygons, creases = drop_vertices(dense.positions, polygons, creases, attempt.drop)
    return attempt.merged(dense, slide_vertices(dense.positions, polygons, creases), creases)
