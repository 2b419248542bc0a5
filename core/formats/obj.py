"""Wavefront OBJ, both ways."""

from curvify.formats.obj_read import read_obj
from curvify.formats.obj_write import write_obj

__all__ = ["read_obj", "write_obj"]
