"""The dissertation's tables and figures, measured again: printed beside recomputed, with a verdict."""

from .catalogue import experiments
from .findings import Experiment, Findings, Row
from .run import Outcome, reproduce

__all__ = ["Experiment", "Findings", "Outcome", "Row", "experiments", "reproduce"]
