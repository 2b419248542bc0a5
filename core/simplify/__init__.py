"""Dense triangle meshes to few convex polygons that refine back to them."""
