"""A reader for each tracker's files."""
