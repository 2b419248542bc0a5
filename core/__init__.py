"""curvify: coarse polygon meshes in, dense meshes of smooth curved surfaces out.

>>> import curvify
>>> mesh = curvify.read("coarse.obj")
>>> dense = curvify.refine(mesh, scheme="gregory", level=5)
>>> curvify.write(dense, "dense.ply")

``curvify.surface(mesh)`` gives an object that evaluates position and normal anywhere, ``curvify.refinable(mesh,
scheme)`` one of any scheme that writes straight to files.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from curvify.checks import check_mesh
    from curvify.compare import compare_meshes, compare_surfaces
    from curvify.deviation import deviations
    from curvify.errors import CurvifyError, DeviceError, FormatError, LimitError, MeshError, OptionError
    from curvify.inspection import describe
    from curvify.mask import read_mask
    from curvify.mesh import DenseMesh, Marks, PolygonMesh
    from curvify.pieces import split_mesh
    from curvify.refinement import Refinable, Surface, refinable, refine, surface
    from curvify.repair import repair_mesh

_WHERE = {
    "CurvifyError": "errors",
    "DeviceError": "errors",
    "FormatError": "errors",
    "LimitError": "errors",
    "MeshError": "errors",
    "OptionError": "errors",
    "DenseMesh": "mesh",
    "Marks": "mesh",
    "PolygonMesh": "mesh",
    "Refinable": "refinement",
    "Surface": "refinement",
    "check_mesh": "checks",
    "compare_meshes": "compare",
    "compare_surfaces": "compare",
    "describe": "inspection",
    "deviations": "deviation",
    "read_mask": "mask",
    "refinable": "refinement",
    "refine": "refinement",
    "repair_mesh": "repair",
    "split_mesh": "pieces",
    "surface": "refinement",
}

__all__ = [
    "CurvifyError",
    "DenseMesh",
    "DeviceError",
    "FormatError",
    "LimitError",
    "Marks",
    "MeshError",
    "OptionError",
    "PolygonMesh",
    "Refinable",
    "Surface",
    "__version__",
    "check_mesh",
    "compare_meshes",
    "compare_surfaces",
    "describe",
    "deviations",
    "read",
    "read_mask",
    "refinable",
    "refine",
    "repair_mesh",
    "split_mesh",
    "surface",
    "write",
]


def __getattr__(name: str) -> Any:
    """Load a part of the library when it is first used: importing curvify alone stays cheap."""
    if name not in _WHERE:
        raise AttributeError(f"module 'curvify' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"curvify.{_WHERE[name]}"), name)


def read(path: str | os.PathLike[str], format: str | None = None) -> PolygonMesh:
    """Read a mesh file; the suffix tells the format unless ``format`` does. Raises FormatError."""
    from curvify.formats import read_mesh

    return read_mesh(path, format)


def write(
    mesh: PolygonMesh | DenseMesh, path: str | os.PathLike[str], format: str | None = None, **options: Any
) -> None:
    """Write a polygon mesh or a dense mesh to a file, completely or not at all.

    ``options``: ``ascii`` for PLY as text, ``dtype`` float32 or float64. Raises FormatError.
    """
    from curvify.formats import write_mesh
    from curvify.formats.dense import to_polygon_mesh
    from curvify.mesh import DenseMesh as Dense

    write_mesh(to_polygon_mesh(mesh) if isinstance(mesh, Dense) else mesh, path, format, **options)
