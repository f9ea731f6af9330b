"""The program of the PC: a laboratory's file, its states P1 to P5, and a look at everything before."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
