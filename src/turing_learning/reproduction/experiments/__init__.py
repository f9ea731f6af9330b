"""The experiments of the paper, each a module or a package with an `EXPERIMENT`, and what several of them share."""
