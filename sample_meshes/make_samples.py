#!/usr/bin/env python3
"""Write the sample meshes: small coarse shapes to refine, each built from a few lines of geometry, and marks for them.

Run ``python make_samples.py [DIRECTORY]``; without a directory the files are written beside this script.
The output is the same on every run.

All meshes are z up and about one to two units large. Faces are counter-clockwise seen from outside and
n-gons are kept whole. No vertex normals are written, so a reader is free to compute its own.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

import make_marks

Array = npt.NDArray[np.float64]
Face = tuple[int, ...]

DECIMALS = 6
"""Decimals kept of a coordinate."""

GOLDEN = (1.0 + 5.0**0.5) / 2.0
"""The golden ratio, of which the icosahedral coordinates are made."""


@dataclass(frozen=True)
class Sample:
    """A mesh with its name and a line that says what it is."""

    name: str
    comment: str
    vertices: Array
    faces: list[Face]


# ---------------------------------------------------------------------------------------------------------
# The OBJ writer


def decimal(value: float) -> str:
    """Return the shortest decimal that reads back as ``value`` rounded, never a negative zero."""
    return np.format_float_positional(round(float(value), DECIMALS) + 0.0, trim="-")


def obj_text(sample: Sample) -> str:
    """Return the sample as the text of an OBJ file."""
    lines = [f"# {sample.comment}; written by make_samples.py", f"o {sample.name}"]
    lines += ["v " + " ".join(decimal(c) for c in vertex) for vertex in sample.vertices]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in sample.faces]
    return "\n".join(lines) + "\n"


# ---------------------------------------------------------------------------------------------------------
# Shared construction


def circle(radius: float, height: float, sides: int, phase: float = 0.0) -> Array:
    """Return ``sides`` points of a horizontal circle, counter-clockwise from above.

    ``phase`` turns the points by that part of one side.
    """
    angles = 2.0 * np.pi * (np.arange(sides) + phase) / sides
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(sides, height)])


def band(lower: int, upper: int, sides: int) -> list[Face]:
    """Return the quads between two rings of ``sides`` vertices, given the first index of each."""
    turn = [(k, (k + 1) % sides) for k in range(sides)]
    return [(lower + k, lower + n, upper + n, upper + k) for k, n in turn]


def revolve(
    profile: Sequence[tuple[float, float]], sides: int, *, bottom: bool = True, top: bool = True
) -> tuple[Array, list[Face]]:
    """Turn a profile of (radius, height) pairs, listed from the bottom up, round the z axis.

    The first and last rings are closed by one n-gon each, unless ``bottom`` or ``top`` leaves them open.
    """
    vertices = np.concatenate([circle(radius, height, sides) for radius, height in profile])
    faces: list[Face] = []
    if bottom:
        faces.append(tuple(reversed(range(sides))))
    for level in range(len(profile) - 1):
        faces += band(level * sides, (level + 1) * sides, sides)
    if top:
        last = (len(profile) - 1) * sides
        faces.append(tuple(range(last, last + sides)))
    return vertices, faces


def cyclic(points: Sequence[tuple[float, float, float]]) -> Array:
    """Return the points with each of their three cyclic permutations of coordinates."""
    return np.array([np.roll(point, shift) for shift in range(3) for point in points])


def icosahedron_directions() -> Array:
    """Return the twelve vertices of an icosahedron of edge 2, the dual of the dodecahedron below."""
    return cyclic([(0.0, y, z) for z in (1.0, -1.0) for y in (GOLDEN, -GOLDEN)])


def dodecahedron_directions() -> Array:
    """Return the twenty vertices of a dodecahedron, all at the distance of the cube corner (1, 1, 1)."""
    cube = [(x, y, z) for z in (1.0, -1.0) for y in (1.0, -1.0) for x in (1.0, -1.0)]
    rest = cyclic([(0.0, y, z) for z in (GOLDEN, -GOLDEN) for y in (1.0 / GOLDEN, -1.0 / GOLDEN)])
    return np.concatenate([np.array(cube), rest])


def to_unit_sphere(points: Array) -> Array:
    """Return the points pushed along their rays to distance one from the origin."""
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True), dtype=np.float64)


def supporting_face(vertices: Array, direction: Array) -> Face:
    """Return the face of a convex solid that faces along ``direction``, starting at its lowest index.

    Its corners are the vertices farthest that way, sorted by their angle round the direction.
    """
    reach = vertices @ direction
    members = np.flatnonzero(reach > reach.max() - 1e-9)
    offsets = vertices[members] - vertices[members].mean(axis=0)
    across = np.cross(direction / np.linalg.norm(direction), offsets[0])
    order = members[np.argsort(np.arctan2(offsets @ across, offsets @ offsets[0]))]
    return tuple(int(i) for i in np.roll(order, -int(np.argmin(order))))


# ---------------------------------------------------------------------------------------------------------
# The meshes


def torus() -> Sample:
    """Return a ring of nine segments with a tube of four sides."""
    around, tube = 9, 4
    big, small = 1.0, 0.45
    # From the outermost ring over the top: by symmetry that ring and the innermost one have level normals.
    angles = 2.0 * np.pi * np.arange(tube) / tube
    vertices = np.concatenate([circle(big + small * np.cos(a), small * np.sin(a), around) for a in angles])
    faces: list[Face] = []
    for level in range(tube):
        faces += band(level * around, (level + 1) % tube * around, around)
    return Sample("torus", "torus: 36 quads, 9 around and 4 round the tube", vertices, faces)


def ring() -> Sample:
    """Return a ring of eight segments with a tube of six sides, level above and below."""
    around, tube = 8, 6
    angles = 2.0 * np.pi * np.arange(tube) / tube
    vertices = np.concatenate([circle(1.0 + 0.4 * np.cos(a), 0.4 * np.sin(a), around) for a in angles])
    faces: list[Face] = []
    for level in range(tube):
        faces += band(level * around, (level + 1) % tube * around, around)
    return Sample("ring", "ring: 48 quads, 8 around and 6 round the tube", vertices, faces)


def ball() -> Sample:
    """Return a ball of six sides with a hexagon at either end, few enough faces for creases to show."""
    polar = np.radians([150.0, 110.0, 70.0, 30.0])
    vertices, faces = revolve([(float(np.sin(a)), float(np.cos(a))) for a in polar], 6)
    return Sample("ball", "ball: 18 quads and two hexagons on the unit sphere", vertices, faces)


def knob() -> Sample:
    """Return a knob of eight sides as it comes from a lathe: five bands between two octagons."""
    profile = [(0.5, 0.0), (0.5, 0.15), (0.22, 0.3), (0.22, 0.6), (0.4, 0.75), (0.3, 1.0)]
    vertices, faces = revolve(profile, 8)
    return Sample("knob", "knob: a turned part, 40 quads and 2 octagons", vertices, faces)


def mushroom() -> Sample:
    """Return a stem and a cap of six sides: three rows of quads between two hexagons."""
    profile = [(0.34, 0.0), (0.25, 0.52), (0.9, 0.76), (0.58, 1.14)]
    vertices, faces = revolve(profile, 6)
    return Sample("mushroom", "mushroom: a stem and a cap, 18 quads and 2 hexagons", vertices, faces)


def pawn() -> Sample:
    """Return a chess pawn of eight sides: eleven rows of quads between two octagons."""
    profile = [
        (0.44, 0.0),  # the foot
        (0.52, 0.1),
        (0.47, 0.22),
        (0.31, 0.34),  # the body
        (0.21, 0.58),
        (0.16, 0.86),
        (0.31, 0.97),  # the collar
        (0.29, 1.05),
        (0.18, 1.13),  # the head
        (0.29, 1.27),
        (0.29, 1.46),
        (0.17, 1.6),
    ]
    vertices, faces = revolve(profile, 8)
    return Sample("pawn", "pawn: a chess pawn, 88 quads and 2 octagons", vertices, faces)


def vase() -> Sample:
    """Return the outside of a vase of ten sides, closed below and open at its rim."""
    profile = [(0.3, 0.0), (0.48, 0.24), (0.57, 0.54), (0.48, 0.86), (0.3, 1.14), (0.25, 1.38), (0.38, 1.6)]
    vertices, faces = revolve(profile, 10, top=False)
    return Sample("vase", "vase: an open surface, 60 quads and a decagon, its rim a boundary", vertices, faces)


def cylinder() -> Sample:
    """Return a capped cylinder of twelve sides."""
    vertices, faces = revolve([(0.5, 0.0), (0.5, 1.0)], 12)
    return Sample("cylinder", "cylinder: 12 quads and two caps of 12 sides", vertices, faces)


def dodecahedron() -> Sample:
    """Return the regular dodecahedron in the unit sphere; each face lies toward an icosahedron vertex."""
    vertices = to_unit_sphere(dodecahedron_directions())
    faces = [supporting_face(vertices, direction) for direction in icosahedron_directions()]
    return Sample("dodecahedron", "dodecahedron: 12 regular pentagons on the unit sphere", vertices, faces)


def truncated_icosahedron() -> Sample:
    """Return the truncated icosahedron in the unit sphere: each edge of an icosahedron cut at its thirds."""
    corners = icosahedron_directions()
    distance = np.linalg.norm(corners[:, None] - corners[None, :], axis=2)
    near, far = np.nonzero(np.abs(distance - 2.0) < 1e-9)
    vertices = to_unit_sphere(2.0 * corners[near] + corners[far])
    faces = [supporting_face(vertices, d) for d in (*corners, *dodecahedron_directions())]
    comment = "truncated icosahedron: 12 pentagons and 20 hexagons on the unit sphere"
    return Sample("truncated_icosahedron", comment, vertices, faces)


def mixed() -> Sample:
    """Return a rounded body of triangles, quads, pentagons and a hexagon, with valences from 3 to 6.

    The rings lie on the unit sphere such that every face is planar; a bend and a taper then make an
    uneven body of it, whose faces are planar only nearly.
    """
    sides = 6
    polar = np.radians([42.0, 74.0, 142.0])
    (r_a, r_b, r_d), (z_a, z_b, z_d) = np.sin(polar), np.cos(polar)
    # The row of pentagons has two corners on ring a, two on ring b and one on ring c, halfway between
    # them: where the plane of the other four meets the sphere again.
    half = np.cos(np.pi / sides)
    start = np.array([r_a * half, z_a])
    step = np.array([r_b * half, z_b]) - start
    along, across = float(step @ step), float(start @ step)
    t = (-across + np.sqrt(across**2 - along * float(start @ start - 1.0))) / along
    r_c, z_c = start + t * step

    vertices = np.concatenate(
        [
            np.array([[0.0, 0.0, 1.0]]),
            circle(r_a, z_a, sides),
            circle(r_b, z_b, sides),
            circle(r_c, z_c, sides, phase=0.5),
            circle(r_d, z_d, sides, phase=0.5),
        ]
    )
    a, b, c, d = (1 + sides * ring for ring in range(4))
    faces: list[Face] = []
    for k in range(sides):
        n = (k + 1) % sides
        faces.append((0, a + k, a + n))
        faces.append((a + n, a + k, b + k, c + k, b + n))
        faces.append((b + n, c + k, c + n))
    faces += band(d, c, sides)
    faces.append(tuple(reversed(range(d, d + sides))))

    x, y, z = vertices.T
    taper = 1.0 + 0.12 * z
    bent = np.column_stack([0.9 * taper * x + 0.18 * z**2, 0.75 * taper * y, 1.1 * z])
    return Sample(
        "mixed",
        "mixed: a rounded body of 12 triangles, 6 quads, 6 pentagons and a hexagon",
        bent,
        faces,
    )


def l_part() -> Sample:
    """Return an L-shaped solid: three cubes long, two of its eight faces concave hexagons."""
    outline = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.5, 0.5), (0.5, 1.0), (0.0, 1.0)]
    sides = len(outline)
    # The outline is drawn in x and z; seen from -y, where the first copy lies, it runs counter-clockwise.
    vertices = np.array([(x - 0.5, y, z) for y in (-0.25, 0.25) for x, z in outline])
    faces: list[Face] = [tuple(range(sides)), tuple(reversed(range(sides, 2 * sides)))]
    faces += band(sides, 0, sides)
    return Sample("l_part", "l_part: an L-shaped solid, 6 quads and 2 concave hexagons", vertices, faces)


BUILDERS: tuple[Callable[[], Sample], ...] = (
    torus,
    mushroom,
    pawn,
    vase,
    dodecahedron,
    truncated_icosahedron,
    mixed,
    l_part,
    cylinder,
    ring,
    ball,
    knob,
)
"""One function for each mesh, in the order in which they are written."""


def write_disc(path: Path, size: int = 256, radius: float = 0.3) -> None:
    """Write a trimming image: white, with a black disc of ``radius`` (of the width) whose rim is a few pixels soft."""
    from PIL import Image

    across = (np.arange(size) + 0.5) / size - 0.5
    distance = np.hypot(across[:, None], across)
    brightness = np.clip((distance - radius) * size / 4 + 0.5, 0.0, 1.0)
    Image.fromarray(np.rint(255 * brightness).astype(np.uint8)).save(path, optimize=True)


def main(arguments: Sequence[str] | None = None) -> None:
    """Write every sample into the directory named on the command line."""
    parser = argparse.ArgumentParser(description="Write the sample meshes as OBJ files and their marks as JSON.")
    parser.add_argument(
        "directory",
        nargs="?",
        type=Path,
        default=Path(__file__).resolve().parent,
        help="where to write them (default: beside this script)",
    )
    directory: Path = parser.parse_args(arguments).directory
    directory.mkdir(parents=True, exist_ok=True)
    for build in BUILDERS:
        sample = build()
        path = directory / f"{sample.name}.obj"
        path.write_text(obj_text(sample), encoding="utf-8", newline="\n")
        corners = sum(len(face) for face in sample.faces)
        print(f"{path.name}: {len(sample.vertices)} vertices, {len(sample.faces)} faces, {corners} corners")
    for make in make_marks.BUILDERS:
        marked = make()
        path = directory / f"{marked.name}.json"
        path.write_text(make_marks.json_text(marked), encoding="utf-8", newline="\n")
        print(f"{path.name}: for {marked.mesh}.obj, {marked.comment}")
    write_disc(directory / "disc.png")
    print("disc.png: an image to trim by")


if __name__ == "__main__":
    main()
