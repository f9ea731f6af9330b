"""A reader for each tracker's files, and what several of them share."""
