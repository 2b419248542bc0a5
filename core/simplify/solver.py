"""Levenberg and Marquardt's method for the fit, with a damping of its own for every unknown.

One patch that folds must not hold up all others: where the residuals of a patch grow, only the unknowns at its corners
are damped more. A step must not make `refine` cut polygons that are whole: where one would, those weigh more against
folding and the step is sought again.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curvify.mesh import Bools, Floats
from curvify.records import record
from curvify.simplify.linear import Linear, linearized
from curvify.simplify.model import Model, Openings, Samples, State
from curvify.simplify.residuals import Residuals, Target, Weights, residuals
from curvify.simplify.slots import Unknowns

#: Gain of the residual below which another step is not worth it.
LEAST_GAIN = 0.01
#: Damping at first, as a share of the median diagonal; its factors after a success and a failure; the least, and the
#: most that single patches can ask for.
DAMPING, EASED, RAISED, LEAST_DAMPING, MOST_DAMPING = 0.1, 0.5, 8.0, 0.01, 10.0
#: A step that gains this share of what was predicted eases damping further, and has no least.
AS_PREDICTED, FAR_EASED = 0.9, 0.1
#: Tries of one step, and the factor on its parts that would break patches.
TRIES, SHRUNK = 4, 0.3
#: Where a step would break patches it is sought again, at most so often in all, with these factors on what the weights
#: of their openings and the damping of their unknowns were.
HELD, STIFFENED, HELD_DAMPING = 4, 3.0, 2.0
#: A step after which one patch has grown by more than this share of all residuals is tried again.
SPOILED = 0.02
#: Largest tilt of a step in radians; largest move as a share of the mean edge and of the shortest edge at the vertex.
LARGEST_TILT, LARGEST_MOVE = 0.35, 0.25

#: Told the residual after every step, as a share of the diagonal.
Report = Callable[[float], None]


@record
class Solution:
    """The ``state`` found, and the root mean square residual ``history`` of all states on the way, as shares of the
    diagonal.
    """

    state: State
    history: list[float]


@record
class Problem:
    """What residuals are measured against, and what may change."""

    target: Target
    weights: Weights
    unknowns: Unknowns


@record
class Here:
    """A state with its samples and residuals."""

    model: Model
    state: State
    samples: Samples
    found: Residuals

    @classmethod
    def at(cls, model: Model, problem: Problem, state: State) -> Here:
        """Residuals of a state."""
        there = model.at(state)
        samples = there.samples(state)
        return cls(there, state, samples, residuals(there, problem.target, problem.weights, samples))


def solve(model: Model, target: Target, unknowns: Unknowns, steps: int, report: Report | None = None) -> Solution:
    """Lower the residuals in a number of steps at most, each of which lowers them."""
    problem = Problem(target, Weights.of(model, target), unknowns)
    damping = np.full(unknowns.count, DAMPING)
    here = Here.at(model, problem, model.start)
    totals = [here.found.total]
    for _ in range(steps if unknowns.count else 0):
        there = _improved(here, problem, damping)
        if there is None:
            break
        here = there
        totals.append(here.found.total)
        if report is not None:
            report(float(np.sqrt(totals[-1])))
        if totals[-1] > (1 - LEAST_GAIN) * totals[-2]:
            break
    return Solution(here.state, [float(np.sqrt(total)) for total in totals])


def _improved(here: Here, problem: Problem, damping: Floats) -> Here | None:
    """A state with smaller residuals, if a few tries find one. ``damping (n,)`` is changed in place."""
    linear = linearized(here.model, here.state, here.found, problem.unknowns)
    scale, share = _scale(linear, problem.unknowns), np.ones(problem.unknowns.count)
    before, best = here.found.by_face(here.model), here
    for _ in range(TRIES):
        step, held = _whole_step(here, linear, problem, damping, scale)
        step *= share
        there = Here.at(here.model, problem, _moved(here, step, problem.unknowns))
        worse = there.found.by_face(here.model) - before
        bad = _touched(here.model, problem.unknowns, worse > before.mean())
        _damp(damping, bad, RAISED)
        share[bad] *= SHRUNK
        if there.found.total < best.found.total:
            best = there
            if worse.max() <= SPOILED * here.found.total:
                predicted = not held and here.found.total - there.found.total > AS_PREDICTED * linear.gain(step)
                eased = FAR_EASED * damping if predicted else np.maximum(EASED * damping, LEAST_DAMPING)
                damping[~bad] = eased[~bad]
                break
        elif best is not here:
            break
        if not bad.any():
            damping *= RAISED
    return None if best is here else best


def _whole_step(
    here: Here, linear: Linear, problem: Problem, damping: Floats, scale: Floats
) -> tuple[Floats, bool]:
    """A step ``(n,)`` that breaks no patch, and whether one had to be held back for that.

    Patches that it would break are made stiffer and their unknowns are damped, for a few times; what still breaks then
    goes less far.
    """
    stiffness = np.ones_like(problem.weights.least)
    step = linear.step(damping * scale, stiffness)
    broken = first = _would_break(here, step, problem)
    for _ in range(HELD - 1):
        if not broken.any():
            break
        stiffness[broken] *= STIFFENED
        _damp(damping, _at_corners(here.model, problem.unknowns, broken), HELD_DAMPING)
        step = linear.step(damping * scale, stiffness)
        broken = _would_break(here, step, problem)
    for _ in range(TRIES):
        if not broken.any():
            break
        step[_at_corners(here.model, problem.unknowns, broken)] *= SHRUNK
        broken = _would_break(here, step, problem)
    return step, bool(first.any())


def _damp(damping: Floats, unknowns: Bools, factor: float) -> None:
    """Damp some unknowns more, in place, but not beyond the most that single patches can ask for."""
    more = np.minimum(factor * damping[unknowns], MOST_DAMPING)
    damping[unknowns] = np.maximum(more, damping[unknowns])


def _would_break(here: Here, step: Floats, problem: Problem) -> Bools:
    """Openings ``(C,3)`` that a step would break: patches that fold, or cannot keep a normal at a corner."""
    state = _moved(here, step, problem.unknowns)
    openings = here.model.at(state).openings(state)
    return _broken(openings, problem.weights) & ~_broken(here.samples.openings, problem.weights)


def _broken(openings: Openings, weights: Weights) -> Bools:
    """Openings ``(C,3)`` that are too small, all three where a corner cannot keep its normal."""
    return openings.adjusted[:, None] | (openings.sines <= weights.limit)


def _scale(linear: Linear, unknowns: Unknowns) -> Floats:
    """What damping is measured in ``(n,)``: the median diagonal of moves and of tilts."""
    diagonal = linear.hessian.diagonal()
    scale = np.empty(unknowns.count)
    for part in (slice(0, unknowns.moves), slice(unknowns.moves, unknowns.count)):
        positive = diagonal[part][diagonal[part] > 0]
        scale[part] = np.median(positive) if len(positive) else 1.0
    return scale


def _reach(here: Here, unknowns: Unknowns) -> Floats:
    """How far each free vertex may move ``(v,)``."""
    lengths, edges = here.model.edge_lengths(here.state), here.model.topology.edges
    shortest = np.full(len(here.state.positions), here.model.edge_length)
    for end in edges.T:
        np.minimum.at(shortest, end, lengths)
    return LARGEST_MOVE * shortest[unknowns.vertices >= 0]


def _moved(here: Here, step: Floats, unknowns: Unknowns) -> State:
    """The state after a step, its parts cut to what is allowed."""
    state = here.state
    moves, tilts = np.zeros_like(state.positions), np.zeros((len(state.normals), 2))
    moves[unknowns.vertices >= 0] = limited(step[: unknowns.moves].reshape(-1, 3), _reach(here, unknowns))
    most = np.full((unknowns.count - unknowns.moves) // 2, LARGEST_TILT)
    tilts[unknowns.sectors >= 0] = limited(step[unknowns.moves :].reshape(-1, 2), most)
    return state.moved(moves, tilts)


def limited(vectors: Floats, most: Floats) -> Floats:
    """Vectors ``(n,d)`` no longer than ``most (n,)``."""
    length = np.linalg.norm(vectors, axis=1)
    return vectors * np.minimum(1.0, most / np.maximum(length, 1e-300))[:, None]


def _at_corners(model: Model, unknowns: Unknowns, openings: Bools) -> Bools:
    """Unknowns ``(n,)`` of the pieces with some of the openings ``(C,3)``."""
    return _touched(model, unknowns, model.faces_with(np.asarray(openings.any(axis=1))))


def _touched(model: Model, unknowns: Unknowns, faces: Bools) -> Bools:
    """Unknowns ``(n,)`` at corners of some of the pieces ``(F,)``."""
    vertices = np.zeros(len(unknowns.vertices), dtype=bool)
    sectors = np.zeros(len(unknowns.sectors), dtype=bool)
    corners = faces[model.topology.faces]
    vertices[model.topology.vertices[corners]] = True
    sectors[model.sectors[corners]] = True
    of_vertices, of_sectors = vertices[unknowns.vertices >= 0], sectors[unknowns.sectors >= 0]
    return np.concatenate([np.repeat(of_vertices, 3), np.repeat(of_sectors, 2)])
