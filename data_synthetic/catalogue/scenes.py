"""All scenes, grouped by what they try."""

from __future__ import annotations

from data_synthetic.catalogue.hard import HARD
from data_synthetic.catalogue.plain import PLAIN
from data_synthetic.catalogue.willis import WILLIS

SCENES = (*PLAIN, *HARD, *WILLIS)
