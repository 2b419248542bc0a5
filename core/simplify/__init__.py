"""Dense triangle meshes to few convex polygons that refine back to them.

>>> from curvify.simplify import Options, simplify
>>> coarse = simplify(curvify.read("scan.ply"), Options(faces=1000)).mesh

Source: Leung, Wang, Zhang, section 2.4; Cohen-Steiner, Alliez & Desbrun 2004 (docs/simplify.md).
"""

from curvify.simplify.attempts import Options
from curvify.simplify.chain import Simplified, simplify

__all__ = ["Options", "Simplified", "simplify"]
