"""Pliant: the geometry of shapes that bend.

Everything a user needs is here by name; nothing is imported until it is asked for.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
