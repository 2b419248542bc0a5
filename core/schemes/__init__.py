"""The surface schemes."""
