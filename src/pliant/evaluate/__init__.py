"""Protocols: arrays in, frozen results out."""

from .maps import MapError, map_error

__all__ = ["MapError", "map_error"]
