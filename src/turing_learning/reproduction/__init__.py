"""The experiments of the paper, repeated, and held against what it prints.

`reproduce`
    Conduct an experiment, or all, at full size or in a fast form; resumable.
`standings`, `Standing`, `default_folder`
    How the experiments stand.
`Stopped`
    An experiment was stopped, and can be resumed.
`write_page`, `refuse_page_path`
    The page of all claims, and where it may be written.
`load_claims`, `Claim`
    What the paper prints, claim by claim.
`LeastSquares`, `squared_errors`
    The metric-based baseline of section 4.5.
`least_squares_optimum`, `expected_squared_error`, `check_statements`
    What its error leads to: theorem 1 and its corollaries.

Names are listed in ``__init__.pyi`` and imported on first use.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
