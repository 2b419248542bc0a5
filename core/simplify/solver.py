"""Levenberg and Marquardt's method for the fit, with a damping of its own for every unknown.

One patch that folds must not hold up all others: where the residuals of a patch grow, only the unknowns at its corners
are damped more.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curvify.mesh import Bools, Floats
from curvify.records import record
from curvify.simplify.folds import LEAST_SINE
from curvify.simplify.linear import Linear, linearized
from curvify.simplify.model import Model, Samples, State
from curvify.simplify.residuals import OPEN, Residuals, Target, Weights, residuals
from curvify.simplify.slots import Unknowns

#: Gain of the residual below which another step is not worth it.
LEAST_GAIN = 0.01
#: Damping at first, as a share of the median diagonal; its factors after a success and a failure; the least.
DAMPING, EASED, RAISED, LEAST_DAMPING = 0.1, 0.5, 8.0, 0.01
#: A step that gains this share of what was predicted eases damping further, and has no least.
AS_PREDICTED, FAR_EASED = 0.9, 0.1
#: Tries of one step, and the factor on its parts that would break patches.
TRIES, SHRUNK = 4, 0.3
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
class Here:
    """A state with its samples and residuals."""

    model: Model
    state: State
    samples: Samples
    found: Residuals

    @classmethod
    def at(cls, model: Model, target: Target, weights: Weights, state: State) -> Here:
        """Residuals of a state."""
        there = model.at(state)
        samples = there.samples(state)
        return cls(there, state, samples, residuals(there, target, weights, samples))


def solve(model: Model, target: Target, unknowns: Unknowns, steps: int, report: Report | None = None) -> Solution:
    """Lower the residuals in a number of steps at most, each of which lowers them."""
    weights = Weights.of(model, target)
    damping = np.full(unknowns.count, DAMPING)
    here = Here.at(model, target, weights, model.start)
    totals = [here.found.total]
    for _ in range(steps if unknowns.count else 0):
        there = _improved(here, target, weights, unknowns, damping)
        if there is None:
            break
        here = there
        totals.append(here.found.total)
        if report is not None:
            report(float(np.sqrt(totals[-1])))
        if totals[-1] > (1 - LEAST_GAIN) * totals[-2]:
            break
    return Solution(here.state, [float(np.sqrt(total)) for total in totals])


def _improved(here: Here, target: Target, weights: Weights, unknowns: Unknowns, damping: Floats) -> Here | None:
    """A state with smaller residuals, if a few tries find one. ``damping (n,)`` is changed in place."""
    linear = linearized(here.model, here.state, here.found, unknowns)
    scale = _scale(linear, unknowns)
    before = here.found.by_face(here.model)
    reach = _reach(here, unknowns)
    for _ in range(TRIES):
        step = _kept_whole(here, linear.step(damping * scale), weights, unknowns, reach)
        there = Here.at(here.model, target, weights, _moved(here.state, step, unknowns, reach))
        worse = there.found.by_face(here.model) > before + before.mean()
        bad = _touched(here.model, unknowns, worse)
        damping[bad] *= RAISED
        if there.found.total < here.found.total:
            gain = here.found.total - there.found.total
            if gain > AS_PREDICTED * linear.gain(step):
                damping[~bad] *= FAR_EASED
            else:
                damping[~bad] = np.maximum(EASED * damping[~bad], LEAST_DAMPING)
            return there
        if not bad.any():
            damping *= RAISED
    return None


def _kept_whole(here: Here, step: Floats, weights: Weights, unknowns: Unknowns, reach: Floats) -> Floats:
    """The step without the unknowns at patches that it would break: fold at a corner, or take a normal from one."""
    step = step.copy()
    for _ in range(TRIES):
        state = _moved(here.state, step, unknowns, reach)
        samples = here.model.at(state).samples(state)
        broken = _broken(samples, weights) & ~_broken(here.samples, weights)
        if not broken.any():
            break
        step[_touched(here.model, unknowns, here.model.faces_with(broken))] *= SHRUNK
    return step


def _broken(samples: Samples, weights: Weights) -> Bools:
    """Corners ``(C,)`` that fold, or cannot keep their normals."""
    return samples.adjusted | (samples.sines < weights.least - OPEN - LEAST_SINE)


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


def _moved(state: State, step: Floats, unknowns: Unknowns, reach: Floats) -> State:
    """The state after a step, its parts cut to what is allowed."""
    moves, tilts = np.zeros_like(state.positions), np.zeros((len(state.normals), 2))
    moves[unknowns.vertices >= 0] = limited(step[: unknowns.moves].reshape(-1, 3), reach)
    most = np.full((unknowns.count - unknowns.moves) // 2, LARGEST_TILT)
    tilts[unknowns.sectors >= 0] = limited(step[unknowns.moves :].reshape(-1, 2), most)
    return state.moved(moves, tilts)


def limited(vectors: Floats, most: Floats) -> Floats:
    """Vectors ``(n,d)`` no longer than ``most (n,)``."""
    length = np.linalg.norm(vectors, axis=1)
    return vectors * np.minimum(1.0, most / np.maximum(length, 1e-300))[:, None]


def _touched(model: Model, unknowns: Unknowns, faces: Bools) -> Bools:
    """Unknowns ``(n,)`` at corners of some of the pieces ``(F,)``."""
    vertices = np.zeros(len(unknowns.vertices), dtype=bool)
    sectors = np.zeros(len(unknowns.sectors), dtype=bool)
    corners = faces[model.topology.faces]
    vertices[model.topology.vertices[corners]] = True
    sectors[model.sectors[corners]] = True
    of_vertices, of_sectors = vertices[unknowns.vertices >= 0], sectors[unknowns.sectors >= 0]
    return np.concatenate([np.repeat(of_vertices, 3), np.repeat(of_sectors, 2)])
