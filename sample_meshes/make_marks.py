"""The marks files that go with the sample meshes: sharp features and shape controls (docs/sharp-features.md).

``make_samples.py`` writes them beside the meshes. Meshes of revolution count their vertices ring by ring from the
bottom up, so that vertex k of ring r is ``sides * r + k``, and their bands of faces after the bottom.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

Edge = tuple[int, int]


@dataclass
class Marked:
    """A marks file: its name, the mesh it is for, what it shows, and the marks."""

    name: str
    mesh: str
    comment: str
    edges: dict[Edge, dict[str, Any]] = field(default_factory=dict)
    faces: dict[int, dict[str, Any]] = field(default_factory=dict)

    def mark_edges(self, edges: Iterable[Edge], **marks: Any) -> None:
        """Add marks to some edges."""
        for a, b in edges:
            self.edges.setdefault((min(a, b), max(a, b)), {}).update(marks)

    def mark_faces(self, faces: Iterable[int], **marks: Any) -> None:
        """Add marks to some faces."""
        for face in faces:
            self.faces.setdefault(face, {}).update(marks)


def json_text(marked: Marked) -> str:
    """Return the marks as the text of a JSON file, one entry a line."""
    parts = ['"marks": 1']
    lists = (
        ("edges", [{"vertices": list(edge), **marks} for edge, marks in sorted(marked.edges.items())]),
        ("faces", [{"face": face, **marks} for face, marks in sorted(marked.faces.items())]),
    )
    for name, entries in lists:
        if entries:
            parts.append(f'"{name}": [\n  ' + ",\n  ".join(json.dumps(entry) for entry in entries) + "\n ]")
    return "{" + ",\n ".join(parts) + "}\n"


def loop(ring: int, sides: int) -> list[Edge]:
    """Return the edges round a ring."""
    return [(sides * ring + k, sides * ring + (k + 1) % sides) for k in range(sides)]


def rungs(lower: int, upper: int, sides: int) -> list[Edge]:
    """Return the edges between two rings."""
    return [(sides * lower + k, sides * upper + k) for k in range(sides)]


# ---------------------------------------------------------------------------------------------------------
# Figure 15 of the paper: one ring, six shapes. Its tube has six sides; ring 0 is the outermost, 1 and 2 bound
# the top, 3 is the innermost, 4 and 5 bound the bottom.

SIDES, TUBE = 8, 6
TOP, BOTTOM, OUTERMOST = 1, 4, 0


def band(level: int) -> range:
    """Return the faces between a ring of the torus and the next."""
    return range(SIDES * level, SIDES * (level + 1))


def ring_plain() -> Marked:
    """Return no marks: the basic scheme."""
    return Marked("ring-a-plain", "ring", "no marks: smooth everywhere")


def ring_flat() -> Marked:
    """Return a flat top and a flat bottom."""
    marked = Marked("ring-b-flat", "ring", "top and bottom flat")
    marked.mark_faces([*band(TOP), *band(BOTTOM)], flat=True)
    return marked


def ring_level() -> Marked:
    """Return edge normals that turn the edges round the axis into level planes."""
    marked = Marked("ring-c-level", "ring", "edge normals lay the edges round the axis into level planes")
    for ring in range(TUBE):
        radius = 1.0 + np.cos(2.0 * np.pi * ring / TUBE)
        outward = 1.0 if radius >= 1.0 else -1.0  # away from the tube: the inner rings bend towards the axis
        for k, edge in enumerate(loop(ring, SIDES)):
            angle = 2.0 * np.pi * (k + 0.5) / SIDES
            normal = [round(float(outward * value), 6) for value in (np.cos(angle), np.sin(angle), 0.0)]
            marked.mark_edges([edge], normal=normal)
    return marked


def ring_cones() -> Marked:
    """Return a ring of six cones: creases round the axis, straight edges between them."""
    marked = Marked("ring-d-cones", "ring", "cones: creases round the axis, straight edges between them")
    for ring in range(TUBE):
        marked.mark_edges(loop(ring, SIDES), crease=1)
        marked.mark_edges(rungs(ring, (ring + 1) % TUBE, SIDES), straight=True)
    return marked


def ring_flat_creased() -> Marked:
    """Return a flat top and bottom, and a crease round the outside."""
    marked = ring_flat()
    marked.name, marked.comment = "ring-e-flat-creased", "top and bottom flat, a crease round the outside"
    marked.mark_edges(loop(OUTERMOST, SIDES), crease=1)
    return marked


def ring_creased() -> Marked:
    """Return a crease round the outside and nothing else."""
    marked = Marked("ring-f-creased", "ring", "a crease round the outside")
    marked.mark_edges(loop(OUTERMOST, SIDES), crease=1)
    return marked


# ---------------------------------------------------------------------------------------------------------
# Other shapes


def creased_rings(name: str, mesh: str, comment: str, sides: int, rings: Sequence[int]) -> Marked:
    """Return creases round some rings of a solid of revolution, and a flat bottom."""
    marked = Marked(name, mesh, comment)
    for ring in rings:
        marked.mark_edges(loop(ring, sides), crease=1)
    marked.mark_faces([0], flat=True)
    return marked


def mushroom_sharp() -> Marked:
    """Return the mushroom with a hard stem end, a hard rim, and gills that meet the stem at an angle."""
    return creased_rings("mushroom-sharp", "mushroom", "creases at the stem's ends and the rim", 6, (0, 1, 2))


def pawn_sharp() -> Marked:
    """Return the pawn with the hard edges of a turned piece: foot, body and collar."""
    comment = "creases round the foot, the body and the collar"
    return creased_rings("pawn-sharp", "pawn", comment, 8, (0, 2, 3, 5, 6, 7, 8))


def knob_hard() -> Marked:
    """Return the knob as it comes from the lathe: hard edges, round walls, flat ends."""
    marked = creased_rings("knob-hard", "knob", "hard edges between round walls, straight along them", 8, range(6))
    marked.mark_faces([1 + 8 * 5], flat=True)
    for ring in range(5):
        marked.mark_edges(rungs(ring, ring + 1, 8), straight=True)
    return marked


def ball_darts() -> Marked:
    """Return three creases down the sides of the ball, which fade where they end."""
    marked = Marked("ball-darts", "ball", "three creases that fade where they end")
    for k in (1, 3, 5):
        marked.mark_edges(pairwise(6 * ring + k for ring in range(4)), crease=1)
    return marked


def cylinder_soft() -> Marked:
    """Return the cylinder with a hard rim below and one above whose sharpness runs from 0 to 1 and back."""
    marked = Marked("cylinder-soft", "cylinder", "a hard rim below, above one from soft to hard and back")
    marked.mark_edges(loop(0, 12), crease=1)
    for k, edge in enumerate(loop(1, 12)):
        ends = [round(1.0 - abs(6 - j % 12) / 6.0, 6) for j in (k, k + 1)]
        marked.mark_edges([edge], crease=ends if edge[0] < edge[1] else ends[::-1])
    return marked


BUILDERS = (
    ring_plain,
    ring_flat,
    ring_level,
    ring_cones,
    ring_flat_creased,
    ring_creased,
    mushroom_sharp,
    pawn_sharp,
    knob_hard,
    ball_darts,
    cylinder_soft,
)
"""One function for each file, in the order in which they are written."""
