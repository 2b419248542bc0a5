"""Stanford PLY, both ways."""

from curvify.formats.ply_read import read_ply
from curvify.formats.ply_write import write_ply

__all__ = ["read_ply", "write_ply"]
