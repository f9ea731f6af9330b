"""The experiments of the paper, repeated, and held against what it prints.

`reproduce` conducts experiments, `standings` says how they stand, and `write_page` writes the page of all `load_claims`.
`LeastSquares` is the metric-based baseline of section 4.5; `check_statements` checks theorem 1 and its corollaries.

Names are listed in ``__init__.pyi`` and imported on first use.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
