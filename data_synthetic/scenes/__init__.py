"""All scenes, grouped by what they try."""

from __future__ import annotations

from data_synthetic.scenes.hard import HARD
from data_synthetic.scenes.plain import PLAIN
from data_synthetic.scenes.willis import WILLIS

SCENES = (*PLAIN, *HARD, *WILLIS)
