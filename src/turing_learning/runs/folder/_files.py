"""Atomic files, as every store writes them."""

from turing_learning._files import remove_partial, write_atomically, write_json

__all__ = ["remove_partial", "write_atomically", "write_json"]
