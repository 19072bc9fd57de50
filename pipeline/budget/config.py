"""Settings of the uncertainty budget."""

from dataclasses import dataclass

from pipeline.ranges import Count


@dataclass(frozen=True)
class BudgetConfig:
    """The uncertainty budget."""

    members: Count = 0
    """Insertions whose inputs are drawn from what they may be. 200 of them take as long as segmenting and tracing ten
    frames of 256³. 0: no budget."""
    members_alone: Count = 32
    """The same for each input by itself, with the same draws, for the table by source. 0: no table."""
    seed: Count = 0
    """Seed of the draws."""
