"""Dense triangle meshes to few convex polygons that refine back to them.

>>> from curvify.simplify import Options, simplify
>>> coarse = simplify(curvify.read("scan.ply"), Options(faces=1000)).mesh

Their vertices lie on the dense mesh. With ``simplify_and_fit(mesh, options, Fit())`` vertices and normals are fitted,
so that the refinement comes as close to the dense mesh as it can.

Source: Leung, Wang, Zhang, section 2.4; Cohen-Steiner, Alliez & Desbrun 2004 (docs/simplify.md).
"""

from curvify.simplify.attempts import Options
from curvify.simplify.chain import Simplified, simplify
from curvify.simplify.fit import Fit, Fitted, fit_mesh
from curvify.simplify.pipeline import simplify_and_fit

__all__ = ["Fit", "Fitted", "Options", "Simplified", "fit_mesh", "simplify", "simplify_and_fit"]
