"""The search for as many polygons as are wanted: how many regions, and how closely polygons follow them.

Convex pieces outnumber regions by an amount that only trying tells, and so do the cuts that keep patches from folding.
Too few polygons ask for more regions; many more polygons than regions ask for chords that may leave their borders
further.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from curvify.arrays import distinct
from curvify.mesh import Ints
from curvify.simplify.attempts import Attempt, Options, merge_stages, polygons_of, reduced
from curvify.simplify.crossings import crosses_itself, crossing_polygons
from curvify.simplify.decompose import Partition, polygonize
from curvify.simplify.features import find_creases
from curvify.simplify.merge import FREE
from curvify.simplify.regions import bisect
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
#: Fewer regions must bring at least this much: below lies what topology and creases ask for. So must merging where that
#: does not reach the number wanted: polygons suffer from it.
FLOOR = 0.9
#: The least share that the loss of polygons must have in the loss of regions for these to be worth it.
WORTH = 0.2
#: The count asked for is met within this share.
CLOSE = 0.05
#: How often regions of polygons that cross are halved.
UNTANGLING = 3

Progress = Callable[[str, float], None]


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
            regions = self.count
            if not self._adjust(found, int(attempts[-1].labels.max()) + 1):
                break
            attempt = self._attempt(len(attempts))
            if self._hardly_fewer(found, regions, attempt.against(self.wanted)):
                break
            attempts.append(attempt)
        return min(attempts, key=lambda one: _misses(one.against(self.wanted), self.wanted))

    def _hardly_fewer(self, before: int, regions: int, after: int) -> bool:
        """Whether there are hardly fewer polygons ``after`` than ``before``, when there were so many ``regions``, and
        there never were too few: though regions are fewer, which makes polygons worse.
        """
        lost = 1 - self.count / regions
        return self.low == 0 and after > self.wanted and lost > 0 and 1 - after / before < WORTH * lost

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
    attempt, least = _found(dense, metric, options, tell)
    tell("crossings", 0.92)
    attempt = _untangled(dense, metric, attempt, options)
    wanted = options.faces
    if wanted is not None:
        notes += count_notes(wanted, attempt.count, least)
    return attempt


def count_notes(wanted: int, found: int, least: bool) -> list[str]:
    """What there is to say of a number of faces that was not met; ``least`` where fewer were never found."""
    if found > (1 + CLOSE) * wanted:
        why = "cannot hold this mesh's topology and creases" if least else "were not met"
        most = "are the fewest found" if least else "come nearest"
        return [f"{count_of(wanted, 'face')} {why}; {found:,} {most}"]
    if found < (1 - CLOSE) * wanted:
        return [f"{count_of(found, 'face')} hold everything; more would add nothing"]
    return []


def _found(dense: Triangles, metric: Metric, options: Options, tell: Progress) -> tuple[Attempt, bool]:
    """Polygons as the options ask for, whether they cross or not; and whether no attempt had too few of them."""
    if options.faces is None:
        labels = cluster(dense, metric, options.proxies or 1, face_components(dense))
        labels = compacted(dense, metric, labels, options)
        return polygons_of(dense, metric, labels, options, int(labels.max()) + 1), True
    search = Search(dense, metric, options, options.faces, tell)
    best = search.run()
    if best.against(options.faces) < options.faces:
        best = _fill(dense, metric, best, options, options.faces)
    fewer = reduced(dense, best, options.faces)
    least = search.low == 0
    worth = not least or fewer.count <= max((1 + CLOSE) * options.faces, FLOOR * best.count)
    return fewer if worth else best, least


def _untangled(dense: Triangles, metric: Metric, attempt: Attempt, options: Options) -> Attempt:
    """The attempt with fewer crossings, if halving the regions of polygons that cross others gives that.

    Not for more polygons than are wanted, and not where the dense mesh crosses itself: then its polygons must.
    """
    crossing = crossing_polygons(attempt.drawn.mesh)
    if not len(crossing) or crosses_itself(dense):
        return attempt
    for _ in range(UNTANGLING):
        polygons = attempt.drawn.polygons
        touched = np.isin(np.repeat(np.arange(polygons.count), polygons.sides), crossing)
        labels = bisect(dense, attempt.labels, distinct(polygons.regions[touched])[0])
        wanted = options.faces or int(attempt.labels.max()) + 1
        other = polygons_of(dense, metric, labels, options, wanted, attempt.loose)
        if options.faces is not None:
            other = reduced(dense, other, options.faces)
        left = crossing_polygons(other.drawn.mesh)
        too_many = options.faces is not None and other.count > max((1 + CLOSE) * options.faces, attempt.count)
        if len(left) >= len(crossing) or too_many:
            break
        attempt, crossing = other, left
        if not len(crossing):
            break
    return attempt


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
    polygons, creases = merge_stages(dense, labels, whole, creases, (FREE,), wanted, 0.0)
    return replace(attempt, labels=labels).merged(dense, polygons, creases)


def compacted(dense: Triangles, metric: Metric, labels: Ints, options: Options) -> Ints:
    """The regions made compact, or improved once more where that is not wanted."""
    if options.compactness > 0:
        return exchange(dense, metric.compact(labels, options.compactness), labels, COMPACT_SWEEPS)
    return exchange(dense, metric, labels, SWEEPS)
