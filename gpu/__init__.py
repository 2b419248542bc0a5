"""The GPU: a headless OpenGL device and what is done on it. Nothing in ``curvify`` imports it unless asked to."""
