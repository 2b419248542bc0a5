"""curvify: coarse polygon meshes in, dense meshes of smooth curved surfaces out."""
